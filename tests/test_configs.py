"""Every YAML that ships loads, is short, and names only what exists."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.body.training import PriorConfig
from mrhubo.config import load_config
from mrhubo.robot import build_body_map

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = sorted(path for path in (ROOT / "conf").glob("*.yaml") if path.stem != "prior")


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots(path: Path) -> None:
    config = load_config(path)
    body_map = build_body_map(config.robot)
    assert config.robot.name == path.stem and len(path.read_text().splitlines()) < 45
    assert set(config.robot.key_links) <= set(body_map.robot.links)


def test_prior() -> None:
    config = load_config(ROOT / "conf" / "prior.yaml", schema=PriorConfig)
    assert config.data == ROOT / "data" / "external" / "cmu" / "training_poses.npz"
