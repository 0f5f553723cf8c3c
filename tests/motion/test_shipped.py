"""The motions that ship: there, as `make.py` makes them, smooth, and anatomically possible."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.motion import Motion, read_folder
from mrhubo.rotation import matrix_to_axis_angle, orthonormal

NAMES = [
    "bow_and_greet", "boxing", "conversation", "crossing_arms", "directing_traffic", "drinking", "pointing", "stretch", "wave",
]  # fmt: skip
STRAIGHT = ["arm_sweep", "hanging_noise", "side_circles"]
"""In a folder of their own: no folder of motions holds those of another."""
LIMB = 0.03
"""Half the thickness of a wrist or a palm [m]."""


@dataclass(frozen=True)
class Body:
    """A motion and where everything is in it."""

    motion: Motion
    local_TJ33: torch.Tensor
    points: dict[str, np.ndarray]
    rotations: dict[str, np.ndarray]

    def at(self, joint: str, offset: tuple[float, float, float]) -> np.ndarray:
        return self.points[joint] + self.rotations[joint] @ np.array(offset)


@pytest.fixture(scope="module")
def folder(root: Path) -> Path:
    return root / "data" / "motions"


@pytest.fixture(scope="module")
def bodies(folder: Path) -> dict[str, Body]:
    skeleton, found = Skeleton().double(), {}
    for motion in read_folder(folder):
        local_TJ33 = orthonormal(motion.local_TJ33.double())
        points, rotations = skeleton.keypoints_and_rotations(local_TJ33)
        found[motion.name] = Body(
            motion,
            local_TJ33,
            {name: points[:, i].numpy() for i, name in enumerate(KEYPOINT_NAMES)},
            {name: rotations[:, i].numpy() for i, name in enumerate(JOINT_NAMES)},
        )
    return found


def _distance(points_T3: np.ndarray, start_T3: np.ndarray, end_T3: np.ndarray) -> np.ndarray:
    """Distance (T,) [m] of points to segments."""
    along_T3 = end_T3 - start_T3
    share_T = np.einsum("ti,ti->t", points_T3 - start_T3, along_T3) / np.einsum("ti,ti->t", along_T3, along_T3)
    return np.linalg.norm(points_T3 - start_T3 - np.clip(share_T, 0, 1)[:, None] * along_T3, axis=-1)


def test_names_rates_and_sizes(folder: Path, bodies: dict[str, Body]) -> None:
    assert list(bodies) == NAMES
    for body in bodies.values():
        assert body.motion.frame_rate == 60.0
        assert 5.0 <= len(body.motion) / 60.0 <= 10.1
        assert torch.isfinite(body.motion.local_TJ33).all()
        assert len(body.motion.description) > 20
    assert all(file.stat().st_size < 300_000 for file in folder.glob("*.npz"))


def test_the_script_makes_them(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """The same numbers, to the last digit's rounding, on every machine."""
    spec = importlib.util.spec_from_file_location("make_motions", folder / "make.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    main: Callable[[Path], None] = module.main
    main(tmp_path)
    assert len(capsys.readouterr().out.splitlines()) == len(NAMES) + len(STRAIGHT)
    assert sorted(file.stem for file in tmp_path.glob("*.npz")) == NAMES
    assert sorted(file.stem for file in (tmp_path / "straight_arms").iterdir()) == STRAIGHT
    for name in [*NAMES, *(f"straight_arms/{name}" for name in STRAIGHT)]:
        with np.load(folder / f"{name}.npz") as shipped, np.load(tmp_path / f"{name}.npz") as made:
            assert set(shipped) == set(made)
            for key in shipped:
                if shipped[key].dtype.kind == "f":
                    np.testing.assert_allclose(made[key], shipped[key], atol=1.5e-5)
                else:
                    assert made[key] == shipped[key]


@pytest.mark.parametrize("name", NAMES)
def test_smooth(bodies: dict[str, Body], name: str) -> None:
    """Bounded angular velocity [rad/s], acceleration [rad/s^2] and jerk [rad/s^3] of every joint."""
    body = bodies[name]
    rate = body.motion.frame_rate
    turned = body.local_TJ33[:-1].transpose(-1, -2) @ body.local_TJ33[1:]
    velocity_TJ3 = matrix_to_axis_angle(turned).numpy() * rate
    acceleration_TJ3 = np.diff(velocity_TJ3, axis=0) * rate
    jerk_TJ3 = np.diff(acceleration_TJ3, axis=0) * rate
    limits = (12.0, 110.0, 2_500.0) if name == "boxing" else (7.0, 60.0, 1_500.0)
    for quantity, limit in zip((velocity_TJ3, acceleration_TJ3, jerk_TJ3), limits, strict=True):
        assert np.linalg.norm(quantity, axis=-1).max() < limit
    arms = [
        POSED_JOINT_NAMES.index(joint) for joint in ("left_shoulder", "right_shoulder", "left_elbow", "right_elbow")
    ]
    moving_T = np.linalg.norm(velocity_TJ3[:, arms], axis=-1).max(-1)
    assert np.median(moving_T) > 0.02, "frozen"
    assert moving_T.max() > 1.5, "nothing happens"


def test_straight_arms_are_straight(folder: Path) -> None:
    """To the last digit; or as nearly as two degrees of noise in every joint leave them, frame by frame anew."""
    points = {}
    for motion in read_folder(folder / "straight_arms"):
        points[motion.name] = Skeleton().double().keypoints(orthonormal(motion.local_TJ33.double())).numpy()
    for name, points_TK3 in points.items():
        for side in ("left", "right"):
            shoulder, elbow, wrist = (
                points_TK3[:, KEYPOINT_NAMES.index(f"{side}_{p}")] for p in ("shoulder", "elbow", "wrist")
            )
            upper, fore = elbow - shoulder, wrist - elbow
            lengths = np.linalg.norm(upper, axis=-1) * np.linalg.norm(fore, axis=-1)
            bend_deg_T = np.degrees(np.arccos(np.clip((upper * fore).sum(-1) / lengths, -1, 1)))
            assert 1.5 < bend_deg_T.mean() < 4.0 if name == "hanging_noise" else np.ptp(bend_deg_T) < 0.1
    assert 470 <= len(points["hanging_noise"]) <= 490


@pytest.mark.parametrize("name", NAMES)
def test_elbows_bend_as_elbows_do(bodies: dict[str, Body], name: str) -> None:
    body = bodies[name]
    rotvec_TJ3 = matrix_to_axis_angle(body.local_TJ33).numpy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        axis = np.array([0.0, -sign, 0.0])
        elbow_T3 = rotvec_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_elbow")]
        flexion_T = elbow_T3 @ axis
        assert np.abs(elbow_T3 - flexion_T[:, None] * axis).max() < 1e-3
        assert np.radians(1.9) < flexion_T.min() and flexion_T.max() < np.radians(150)
        wrist_T3 = rotvec_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_wrist")]
        assert np.linalg.norm(wrist_T3, axis=-1).max() < np.radians(135)


@pytest.mark.parametrize("name", NAMES)
def test_hands_stay_out_of_the_body(bodies: dict[str, Body], name: str) -> None:
    body = bodies[name]
    capsules = []
    for x in (-0.06, 0.06):
        hip, rib = body.at("pelvis", (x, -0.06, 0.0)), body.at("spine3", (x, 0.0, 0.012))
        capsules += [(hip, rib, 0.095), (rib, body.at("spine3", (1.2 * x, 0.06, 0.012)), 0.09)]
    capsules.append((body.at("head", (0, 0.1, 0)), body.at("head", (0, 0.03, 0.03)), 0.085))
    capsules.append((body.points["neck"], body.points["head"], 0.055))
    for side in ("left", "right"):
        elbow, wrist, knuckle = (body.points[f"{side}_{part}"] for part in ("elbow", "wrist", "middle"))
        for place in ((elbow + wrist) / 2, wrist, (wrist + knuckle) / 2, knuckle):
            for start, end, radius in capsules:
                assert _distance(place, start, end).min() > radius + LIMB - 0.01
        for other in ("left", "right"):
            thigh = body.points[f"{other}_hip"], body.points[f"{other}_knee"]
            assert _distance(knuckle, *thigh).min() > 0.085 + LIMB - 0.01


@pytest.mark.parametrize("name", NAMES)
def test_arms_stay_out_of_each_other(bodies: dict[str, Body], name: str) -> None:
    points = bodies[name].points
    for side, other in (("left", "right"), ("right", "left")):
        for bone in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "middle")):
            start, end = (points[f"{other}_{joint}"] for joint in bone)
            for low, high in (("elbow", "wrist"), ("wrist", "middle")):
                for share in np.linspace(0, 1, 7):
                    place = (1 - share) * points[f"{side}_{low}"] + share * points[f"{side}_{high}"]
                    assert _distance(place, start, end).min() > 0.05


def test_crossing_arms_really_cross(bodies: dict[str, Body]) -> None:
    """Each hand beyond the other and beyond the middle, in front of the chest, at a depth of its own."""
    body = bodies["crossing_arms"]
    chest = body.rotations["spine3"].swapaxes(-1, -2)
    left, right = (
        (chest @ (body.points[f"{side}_wrist"] - body.points["spine3"])[..., None])[..., 0]
        for side in ("left", "right")
    )
    crossed_T = (left[:, 0] < 0.0) & (right[:, 0] > 0.0)
    assert crossed_T.sum() > 2 * body.motion.frame_rate
    assert min(left[crossed_T, 2].min(), right[crossed_T, 2].min()) > 0.12
    apart_T3 = np.abs(left - right)[crossed_T]
    assert np.hypot(apart_T3[:, 1], apart_T3[:, 2]).min() > 0.03
    assert (left - right)[crossed_T, 2].max() > 0.04 and (right - left)[crossed_T, 2].max() > 0.04
