from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.robot.discovery import discover
from mrhubo.robot.generator import humanoid
from mrhubo.robot.generator.score import asked, mistakes
from mrhubo.robot.urdf import describe

SEEDS = range(1000, 1012)


def test_a_seed_makes_one_robot() -> None:
    assert humanoid(7).urdf == humanoid(7).urdf != humanoid(8).urdf


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_truth_is_true_of_the_file(seed: int, tmp_path: Path) -> None:
    truth, path = humanoid(seed), tmp_path / "made.urdf"
    path.write_text(truth.urdf)
    description = describe(path)
    assert truth.joints <= set(description.joints) and {*truth.carriers.values(), truth.chest} <= set(description.links)
    assert truth.forward_3 @ truth.up_3 == pytest.approx(0, abs=1e-9)
    left_3 = truth.points["left_shoulder"] - truth.points["right_shoulder"]
    across_3 = np.cross(truth.up_3, truth.forward_3)
    assert left_3 @ across_3 == pytest.approx(np.linalg.norm(left_3), rel=1e-6), "left is left of right"


def test_detection_is_right_or_asks(tmp_path: Path) -> None:
    """A sample of what benchmarks/discovery.py counts over a thousand."""
    wrong = []
    for seed in SEEDS:
        truth, path = humanoid(seed), tmp_path / "made.urdf"
        path.write_text(truth.urdf)
        try:
            found = discover(path, whole_body=True)
        except UserError as refusal:
            wrong.append((seed, str(refusal)))
            continue
        if (faults := mistakes(found, truth, path)) and not asked(found, faults):
            wrong.append((seed, faults))
    assert len(wrong) <= 1, wrong
