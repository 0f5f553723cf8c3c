"""Motions whose rotations are shared out differently: nobody's limbs show it."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.config import load_config
from mrhubo.motion import Motion, read_motion, reshare
from mrhubo.robot import build_body_map
from mrhubo.rotation import geodesic_distance

KEPT = ["spine3", "head", *(f"{side}_{name}" for side in ("left", "right") for name in ("wrist", "ankle", "foot"))]
BONES = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in (
    ("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"),
)]  # fmt: skip
CHANGED = ["spine1", "spine2", "spine3", "neck", "head", *(
    f"{side}_{name}" for side in ("left", "right") for name in ("collar", "shoulder", "elbow", "wrist", "hip", "knee")
)]  # fmt: skip


@pytest.fixture(scope="module")
def motion(root: Path) -> Motion:
    """Bends, leans and turns the head."""
    return read_motion(root / "data" / "motions" / "bow_and_greet.npz")


@pytest.fixture(scope="module")
def reshared(motion: Motion) -> Motion:
    return reshare(motion, seed=3)


def test_limbs_and_ends_stay(motion: Motion, reshared: Motion) -> None:
    skeleton = Skeleton()
    (points, turns), (new_points, new_turns) = (
        skeleton.keypoints_and_rotations(m.local_TJ33) for m in (motion, reshared)
    )
    kept = [JOINT_NAMES.index(name) for name in KEPT]
    torch.testing.assert_close(new_turns[:, kept], turns[:, kept], atol=2e-6, rtol=0)
    for start, end in BONES:
        rows = [KEYPOINT_NAMES.index(end), KEYPOINT_NAMES.index(start)]
        bone, new_bone = points[:, rows].diff(dim=1), new_points[:, rows].diff(dim=1)
        torch.testing.assert_close(new_bone, bone, atol=2e-6, rtol=0)


def test_all_points_stay_where_only_twist_is_moved(motion: Motion) -> None:
    twisted = reshare(motion, seed=5, collar_deg=0.0, split=0.0)
    before, after = (Skeleton().keypoints(m.local_TJ33) for m in (motion, twisted))
    torch.testing.assert_close(after, before, atol=2e-6, rtol=0)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_robots_read_the_same(root: Path, name: str, motion: Motion, reshared: Motion) -> None:
    body_map = build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)
    limbs = [i for i, d in enumerate(body_map.directions) if d.part.region in ("arm", "hand", "head", "leg", "foot")]
    before, after = (body_map.human_directions(m.local_TJ33[::7])[:, limbs] for m in (motion, reshared))
    torch.testing.assert_close(after, before, atol=5e-6, rtol=0)


def test_rotations_differ_and_the_seed_decides_how(motion: Motion, reshared: Motion) -> None:
    differ_J = torch.rad2deg(geodesic_distance(motion.local_TJ33, reshared.local_TJ33)).mean(dim=0)
    by_joint = dict(zip(POSED_JOINT_NAMES, differ_J.tolist(), strict=True))
    assert min(by_joint[name] for name in CHANGED) > 1.0, by_joint
    assert min(by_joint[name] for name in by_joint if name.endswith(("collar", "shoulder"))) > 5.0
    assert torch.equal(reshare(motion, seed=3).local_TJ33, reshared.local_TJ33)
    assert not torch.allclose(reshare(motion, seed=4).local_TJ33, reshared.local_TJ33, atol=0.1)


def test_elbows_are_no_hinges_any_longer(motion: Motion, reshared: Motion) -> None:
    """The rest of an elbow's turn, off its own hinge."""
    elbow = POSED_JOINT_NAMES.index("left_elbow")

    def singular(local: torch.Tensor) -> torch.Tensor:
        skew = (local[:, elbow] - local[:, elbow].mT) / 2
        axis = torch.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), dim=1)
        return torch.linalg.svdvals(axis / len(axis) ** 0.5)

    assert float(singular(motion.local_TJ33)[1]) < 0.02 < 0.05 < float(singular(reshared.local_TJ33)[1])


def test_no_jump_comes_in(motion: Motion, reshared: Motion) -> None:
    """No joint turns much faster than it did: what is added turns slower than a person's joints do."""

    def speed(m: Motion) -> torch.Tensor:
        return geodesic_distance(m.local_TJ33[1:], m.local_TJ33[:-1]) * m.frame_rate

    assert float((speed(reshared) - speed(motion)).max()) < 1.5
    assert float((speed(reshared) - speed(motion)).mean().abs()) < 0.6
