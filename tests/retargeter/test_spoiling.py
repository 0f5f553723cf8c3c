"""Poses spoilt in known ways."""

from __future__ import annotations

import pytest
import torch

from mrhubo.body.skeleton import POSED_JOINT_NAMES, Skeleton
from mrhubo.retargeter.spoiling import bent_backwards, dislocated, shaken
from mrhubo.robot.parts import PARTS
from mrhubo.rotation import axis_angle_to_matrix, geodesic_distance


@pytest.fixture
def generator() -> torch.Generator:
    return torch.Generator().manual_seed(0)


@pytest.fixture
def local_BJ33(generator: torch.Generator) -> torch.Tensor:
    return axis_angle_to_matrix(0.5 * torch.randn(400, 21, 3, generator=generator))


def test_noise_is_as_strong_as_said(local_BJ33: torch.Tensor, generator: torch.Generator) -> None:
    spread_B = torch.linspace(1, 20, len(local_BJ33))
    turned_BJ = torch.rad2deg(geodesic_distance(local_BJ33, shaken(local_BJ33, spread_B, generator)))
    ratio_B = turned_BJ.square().mean(dim=1).sqrt() / spread_B
    assert float(ratio_B.mean()) == pytest.approx(1.0, abs=0.03)
    assert torch.equal(shaken(local_BJ33, 0.0, generator), local_BJ33 @ torch.eye(3))


def test_elbows_are_bent_the_other_way(local_BJ33: torch.Tensor) -> None:
    """In the T-pose forearms then point back and not forward."""
    rest = torch.eye(3).expand(1, 21, 3, 3)
    points = Skeleton().keypoints(bent_backwards(rest, torch.tensor([60.0]), PARTS))[0]
    for side in ("left", "right"):
        elbow, wrist = (points[1 + POSED_JOINT_NAMES.index(f"{side}_{name}")] for name in ("elbow", "wrist"))
        assert float((wrist - elbow)[2]) < -0.2
    backwards = bent_backwards(local_BJ33, torch.full((400,), 60.0), PARTS)
    changed = (backwards - local_BJ33).abs().amax((0, 2, 3)) > 1e-6
    bent = {f"{side}_{name}" for side in ("left", "right") for name in ("elbow", "knee")}
    assert {n for n, c in zip(POSED_JOINT_NAMES, changed.tolist(), strict=True) if c} == bent


def test_joints_of_limbs_are_dislocated(local_BJ33: torch.Tensor, generator: torch.Generator) -> None:
    turned_BJ = torch.rad2deg(geodesic_distance(local_BJ33, dislocated(local_BJ33, PARTS, 0.5, 120.0, generator)))
    arms = [i for i, name in enumerate(POSED_JOINT_NAMES) if name.split("_")[-1] in ("shoulder", "elbow")]
    legless = [i for i, name in enumerate(POSED_JOINT_NAMES) if name.split("_")[0] in ("spine1", "neck", "head")]
    touched = turned_BJ[:, arms] > 1
    assert float(touched.float().mean()) == pytest.approx(0.5, abs=0.05)
    assert 29 < float(turned_BJ[:, arms][touched].min()) and float(turned_BJ[:, arms].max()) < 121
    assert float(turned_BJ[:, legless].max()) < 0.1
