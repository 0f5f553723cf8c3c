"""Which joints tell how well a scale factor fits."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.pairing import ScaleFactorObjective
from mrhubo.robot import build_body_map


@pytest.mark.parametrize(
    ("name", "joints"), [("nao", ["shoulder", "elbow"]), ("reachy", ["shoulder", "elbow", "wrist"])]
)
def test_arms_count_and_neither_collars_nor_the_head(root: Path, name: str, joints: list[str]) -> None:
    config = load_config(root / "conf" / f"{name}.yaml")
    body_map, prior = build_body_map(config.robot), BodyPrior.open()
    q_PN, local_PJ33 = body_map.robot.home()[None], prior.decode_matrices(torch.zeros(1, prior.latent))
    objective = ScaleFactorObjective(body_map, prior, config.pairs, q_PN, local_PJ33, "chest")
    found = [POSED_JOINT_NAMES[joint] for joint in objective.arm_joints]
    assert found == [f"{side}_{joint}" for joint in joints for side in ("left", "right")]
    assert float(objective.distances(local_PJ33[None]).max()) < 1e-3
