"""Where a value of a config was written, told long after it was loaded."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

from mrhubo.config import Config, RobotConfig, fingerprint, load_config, to_yaml, where, with_places
from mrhubo.config.places import places_named
from mrhubo.errors import UserError

TEXT = """robot:
  name: r
  urdf: r.urdf
  joints:
  - a
  - b
  keypoints:
    chest: torso
    left_elbow: {link: L,
      offset: [0, 0, 1]}
  key_links: [L, R]
  ranges: {a.b: [0, 1]}
pairs: {count: 1000}
"""


@pytest.fixture()
def file(tmp_path: Path) -> Path:
    (tmp_path / "r.yaml").write_text(TEXT)
    return tmp_path / "r.yaml"


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("robot", 1),
        ("robot.joints", 4),
        ("robot.joints[1]", 6),
        ("robot.keypoints.chest", 8),
        ("robot.keypoints.left_elbow", 9),
        ("robot.keypoints.left_elbow.offset", 10),
        ("robot.keypoints.left_elbow.offset[2]", 10),
        ("robot.key_links[1]", 11),
        ("robot.ranges.a.b", 12),
        ("pairs.count", 13),
    ],
)
def test_every_value_has_its_line(file: Path, key: str, line: int) -> None:
    config = load_config(file)
    assert where(config, key) == f"{file}, line {line}"
    copied = copy.deepcopy(pickle.loads(pickle.dumps(config)))
    assert where(copied, key) == where(copied.robot, key) == where(copy.copy(config.pairs), key) == where(config, key)


def test_what_was_not_loaded_has_none(file: Path) -> None:
    config = load_config(file, ["pairs.seed=3", "robot.joints=[c]"])
    assert where(config, "pairs.shard_size") is None and where(config, "robot.joints[1]") is None
    assert where(config, "pairs.seed") == where(config, "robot.joints[0]") == "command line"
    made = Config(RobotConfig("r", Path("/r.urdf"), ["a"], {"chest": "torso"}, ["L"]))
    assert where(made, "robot.name") is None and where(None, "robot.name") is None


def test_places_change_nothing_else(file: Path, tmp_path: Path) -> None:
    config = load_config(file)
    (tmp_path / "again.yaml").write_text("# another line\n" + to_yaml(config))
    again = load_config(tmp_path / "again.yaml")
    assert again == config and fingerprint(again) == fingerprint(config)
    assert where(again, "robot.name") != where(config, "robot.name")


@pytest.mark.parametrize(
    ("sentence", "place"),
    [
        ("robot.joints[1]: is wrong", "line 6: "),
        ("robot.keypoints.left_elbow.link: is wrong: very", "line 9: "),
        ("robot.manual: is missing", "line 1: "),  # the section around it
        ("robot.keypoints.left_wrist: is missing", "line 7: "),
        ("robot.joints[7]: is wrong", "line 4: "),
        ("trainer.accelerator: there is no GPU", ""),
        ("/r.urdf: is wrong", ""),
        ("robots do not exist: none", ""),
        ("is wrong", ""),
        ("", ""),
    ],
)
def test_sentences_get_the_place_of_their_key(file: Path, sentence: str, place: str) -> None:
    @with_places
    def check(robot: RobotConfig, other: int = 0) -> int:
        if sentence:
            raise UserError(sentence)
        return other

    @with_places
    def outer(config: Config) -> int:
        return check(config.robot, other=3)

    config = load_config(file)
    for call in (lambda: check(config.robot), lambda: check(robot=config.robot), lambda: outer(config)):
        if not sentence:
            assert call() in (0, 3)
            continue
        with pytest.raises(UserError) as caught:
            call()
        assert str(caught.value) == (f"{file}, {place}" if place else "") + sentence


def test_the_kind_of_error_stays(file: Path) -> None:
    class Special(UserError):
        pass

    with pytest.raises(Special, match="line 2: robot.name: odd"), places_named(load_config(file)):
        raise Special("robot.name: odd")
