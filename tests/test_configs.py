"""Every YAML that ships loads, is short, and names only what exists."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.config import SHIPPED_UNIVERSAL, PriorConfig, UniversalConfig, load_config
from mrhubo.robot import build_body_map, read_keypoints
from mrhubo.robot.parts import PARTS, OrientedPart

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = sorted(path for path in (ROOT / "conf").glob("*.yaml") if not path.stem.startswith(("prior", "universal")))
WHOLE = "-whole-body"


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots(path: Path) -> None:
    config = load_config(path)
    if "external" in config.robot.urdf.parts and not config.robot.urdf.exists():
        pytest.skip(f"{config.robot.urdf} is not there")
    body_map = build_body_map(config.robot)
    assert config.robot.name == path.stem.removesuffix(WHOLE) and len(path.read_text().splitlines()) < 45
    assert set(config.robot.key_links) <= set(body_map.robot.links)


@pytest.mark.parametrize("path", sorted((ROOT / "conf" / "paper").glob("*.yaml")), ids=lambda path: path.stem)
def test_the_papers_settings(path: Path) -> None:
    config, ours = load_config(path), load_config(ROOT / "conf" / path.name)
    assert build_body_map(config.robot).robot.joint_names == tuple(ours.robot.joints)
    for key in ("name", "urdf", "joints", "ranges", "keypoints", "key_links"):
        assert getattr(config.robot, key) == getattr(ours.robot, key), key
    assert config.robot.scale == "manual" and config.robot.manual is not None
    assert (config.pairs.solver, config.pairs.w_prior, config.pairs.reverse_share) == ("paper", 0.01, 0)
    assert (config.pairs.filter, config.pairs.filter_k) == ("linear", 1)
    assert (config.model.stages, config.model.hidden, config.model.layers) == (2, 512, 1)
    assert (config.trainer.loss, config.trainer.batch_size, config.trainer.lr) == ("mse", 2048, 1e-4)


@pytest.mark.parametrize("path", [path for path in ROBOTS if path.stem.endswith(WHOLE)], ids=lambda path: path.stem)
def test_a_whole_body_holds_the_upper_body_that_ships(path: Path) -> None:
    whole, arms = load_config(path).robot, path.with_name(f"{path.stem.removesuffix(WHOLE)}.yaml")
    feet = {part.name for part in PARTS if isinstance(part, OrientedPart) and part.stands}
    assert {part.name for part in read_keypoints(whole.keypoints).parts} >= feet or whole.name == "pepper"
    if arms.exists():
        upper = load_config(arms).robot
        assert set(upper.joints) <= set(whole.joints) and set(upper.key_links) <= set(whole.key_links)
        assert upper.keypoints.items() <= whole.keypoints.items() and upper.ranges == whole.ranges


def test_universal() -> None:
    config = load_config(ROOT / "conf" / "universal.yaml", schema=UniversalConfig)
    assert config.tracking_dir == ROOT / "mlruns" and config.output == SHIPPED_UNIVERSAL

    more = load_config(ROOT / "conf" / "universal-legs.yaml", schema=UniversalConfig)
    assert more.start == SHIPPED_UNIVERSAL and more.legs_share > 0 and more.output != SHIPPED_UNIVERSAL


def test_prior() -> None:
    config = load_config(ROOT / "conf" / "prior.yaml", schema=PriorConfig)
    assert config.data == ROOT / "data" / "external" / "cmu" / "training_poses.npz"
