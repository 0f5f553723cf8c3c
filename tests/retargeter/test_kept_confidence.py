"""A confidence is found once for a robot."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import pytest

from mrhubo.config import load_config
from mrhubo.retargeter import Retargeter, kept_confidence, optimised
from mrhubo.retargeter.calibration import calibrate
from mrhubo.retargeter.kept_confidence import calibrated
from mrhubo.robot import BodyMap, build_body_map
from tests.reference.walkers import walker


@pytest.fixture
def found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The `id` of those whose confidence was found anew, on few poses; the user's cache is an empty folder."""
    asked: list[int] = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    few = functools.partial(calibrate, poses=30)
    monkeypatch.setattr(kept_confidence, "calibrate", lambda made: (asked.append(id(made)), few(made))[1])
    return asked


@pytest.fixture(scope="module")
def make(root: Path) -> Callable[..., Retargeter]:
    @functools.cache
    def body_map(*settings: str) -> BodyMap:
        return build_body_map(load_config(root / "conf" / "nao.yaml", list(settings)).robot)

    return lambda *settings: optimised(body_map(*settings))


def test_a_robot_that_is_known_is_not_asked_again(found: list[int], make: Callable[..., Retargeter]) -> None:
    first, second = make(), make()
    assert found == [id(first)] and first.confidence == second.confidence


@pytest.mark.parametrize(
    "setting",
    ["robot.ranges.LElbowRoll=[-1.2, -0.2]", "robot.keypoints.left_wrist={link: l_wrist, offset: [0.02, 0, 0]}"],
)  # fmt: skip
def test_another_robot_is(found: list[int], make: Callable[..., Retargeter], setting: str) -> None:
    first, other = make(), make(setting)
    assert found == [id(first), id(other)]


def test_one_whose_root_follows_another_part_is(found: list[int], tmp_path: Path) -> None:
    made = [optimised(walker(tmp_path, follows=part)) for part in ("chest", "between", "chest")]
    assert found == [id(retargeter) for retargeter in made[:2]]


def test_other_weights_are(found: list[int], make: Callable[..., Retargeter]) -> None:
    made = make()
    next(iter(made.prior.parameters())).data[0] += 1e-3
    calibrated(made)
    assert found == [id(made)] * 2


@pytest.mark.parametrize("damage", ["", "{", '{"usual_phi": NaN}', "\xff" * 20])
def test_a_damaged_file_is_replaced(
    found: list[int], make: Callable[..., Retargeter], tmp_path: Path, damage: str
) -> None:
    made = make()
    (file,) = (tmp_path / "mrhubo").glob("confidence-*.json")
    file.write_bytes(damage.encode("latin-1"))
    assert calibrated(made) == made.confidence == calibrated(made)
    assert found == [id(made)] * 2


def test_a_cache_that_takes_no_file_is_none(found: list[int], make: Callable[..., Retargeter], tmp_path: Path) -> None:
    (tmp_path / "mrhubo").write_text("a file where the folder should be")
    assert make().confidence == make().confidence
    assert len(found) == 2


def test_a_user_without_a_home_is_no_fault(
    found: list[int], make: Callable[..., Retargeter], monkeypatch: pytest.MonkeyPatch
) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", homeless)
    assert make().confidence == make().confidence
    assert len(found) == 2
