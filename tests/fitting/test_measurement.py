"""A package is measured against the config's robot only if the two mean the same; some answers no training should end
with.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip
from mrhubo.fitting import measurement
from mrhubo.fitting.measurement import refuse_useless
from mrhubo.motion import Motion
from mrhubo.robot import Robot, build_body_map
from mrhubo.runtime.progress import SILENT


@pytest.fixture(scope="module")
def robot(root: Path) -> Robot:
    return build_body_map(load_config(root / "conf" / "nao.yaml").robot).robot


def clips(*references_TN: torch.Tensor) -> list[Clip]:
    return [Clip(Motion(f"{i}", torch.eye(3).expand(len(q), 21, 3, 3), 24.0), q) for i, q in enumerate(references_TN)]


def test_answers_that_move_are_taken(robot: Robot) -> None:
    q_TN = robot.sample(40, torch.Generator().manual_seed(0))
    refuse_useless(clips(q_TN[:30], q_TN[30:]), [q_TN[:30] + 0.1, q_TN[30:]], robot, "remedy")
    q_TN[:, :-1] = robot.upper_N[:-1]  # all joints but one at a limit
    refuse_useless(clips(robot.sample(40, torch.Generator().manual_seed(1))), [q_TN], robot, "remedy")


def test_useless_ones_are_refused(robot: Robot) -> None:
    reference_TN = robot.sample(40, torch.Generator().manual_seed(0))
    ends = torch.rand(40, 1, generator=torch.Generator().manual_seed(0)) < 0.5
    broken = reference_TN.clone()
    broken[7, 1] = torch.nan
    useless = {
        "are no numbers": broken,
        "stand at the joints' limits": torch.where(ends, robot.lower_N, robot.upper_N),
        "never move": reference_TN[:1].expand(40, -1),
    }
    for fault, q_TN in useless.items():
        with pytest.raises(UserError, match=f"has learned nothing: on the test clips its answers {fault}.*; lower it"):
            refuse_useless(clips(reference_TN[:10], reference_TN[10:]), [q_TN[:10], q_TN[10:]], robot, "lower it")


def test_a_still_human_is_answered_by_a_still_robot(robot: Robot) -> None:
    """At the limits too, where the reference stands there."""
    still_TN = robot.upper_N.expand(20, -1)
    refuse_useless(clips(still_TN), [still_TN], robot, "remedy")


def test_a_package_of_another_body_map_is_refused(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_config(root / "conf" / "nao.yaml")
    own = build_body_map(config.robot)
    config.robot.keypoints["left_wrist"] = {"link": "l_wrist", "offset": [0.02, 0, 0]}  # pyright: ignore
    prepared = SimpleNamespace(body_map=build_body_map(config.robot), config=config)
    monkeypatch.setattr(measurement.Retargeter, "load", lambda folder: SimpleNamespace(body_map=own))
    with pytest.raises(UserError, match=r"package: was made with other links or offsets for left_wrist than"):
        measurement.measure_package(prepared, SILENT, Path("package"))  # pyright: ignore[reportArgumentType]
