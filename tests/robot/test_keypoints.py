"""A robot that knows its body parts, and the one reading of its URDF."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import Axis, BodyMap, Limb, Robot, build_body_map, read_keypoints, urdf
from mrhubo.robot.parts import UPPER_BODY
from mrhubo.view.pictures import Artist


def test_links_are_those_of_views_points_and_ends(root: Path) -> None:
    config = load_config(root / "conf" / "reachy.yaml").robot
    keypoints = read_keypoints(config.keypoints)
    assert keypoints.links[0] == "torso" and keypoints.links[-1] == "head"
    assert [type(d) for d in keypoints.directions[:4]] == [Limb] * 4
    assert [d.name for d in keypoints.directions if isinstance(d, Axis)][-2:] == ["head_forward", "head_up"]
    table = [name for part in UPPER_BODY if part.region != "bend" for name in part.direction_names]
    assert [d.name for d in keypoints.directions] == table, "in the table's order, whatever the file's"
    turned_round = read_keypoints(dict(reversed(config.keypoints.items())))
    assert [d.name for d in turned_round.directions] == table


def test_a_config_that_does_not_exist_is_named() -> None:
    with pytest.raises(UserError, match="reachi"):
        Robot.from_config("reachi")


def test_nothing_to_compare_is_refused() -> None:
    with pytest.raises(UserError, match="names no limb"):
        read_keypoints({"chest": "torso", "left_shoulder": "LShoulder"})
    with pytest.raises(UserError, match="'chest' is missing; name the link that carries 'left_shoulder'"):
        read_keypoints({"left_shoulder": "LShoulder", "left_elbow": "LElbow"})


@pytest.mark.parametrize("name", ["nao", "reachy"])
def test_robots_from_config_and_urdf_are_those_of_the_body_map(root: Path, name: str) -> None:
    path = root / "conf" / f"{name}.yaml"
    config = load_config(path).robot
    made = Robot.from_config(name)
    assert made.urdf == Robot.from_config(path).urdf == config.urdf
    again = Robot.from_urdf(
        str(config.urdf), config.joints, config.keypoints, config.key_links, config.ranges, config.hold
    )
    body_map = build_body_map(config)
    q_BN = body_map.robot.sample(20, torch.Generator().manual_seed(0))
    for robot in (made, again):
        assert robot.name == name and robot.key_links == tuple(config.key_links)
        assert robot.links == body_map.robot.links
        assert torch.equal(robot.forward(q_BN).position_BL3, body_map.robot.forward(q_BN).position_BL3)
        assert BodyMap.of(robot).direction_names == body_map.direction_names


def test_the_optimisation_takes_a_robot(root: Path) -> None:
    robot = Robot.from_config(root / "conf" / "nao.yaml")
    local_TJ33 = torch.eye(3).repeat(3, 21, 1, 1)
    from_robot = OptimizationRetargeter(robot).retarget(local_TJ33, 24.0)
    body_map = build_body_map(load_config(root / "conf" / "nao.yaml").robot)
    assert torch.equal(from_robot.q_TN, OptimizationRetargeter(body_map).retarget(local_TJ33, 24.0).q_TN)
    with pytest.raises(UserError, match=r"nao.urdf: nothing tells which link of 'nao'.*from_config"):
        OptimizationRetargeter(Robot(robot.urdf, robot.joint_names))


def test_a_joint_that_moves_no_part_is_refused_from_a_robot_too(root: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml").robot
    robot = Robot.from_urdf(config.urdf, [*config.joints, "HeadYaw"], config.keypoints)
    with pytest.raises(UserError, match="'HeadYaw' turns no limb, hand or head .* relative to the chest 'torso'"):
        BodyMap.of(robot)


def test_differences_are_named(root: Path) -> None:
    entries = load_config(root / "conf" / "reachy.yaml").robot.keypoints
    known = read_keypoints(entries)
    assert known.differences(read_keypoints({**entries, "chest": {"link": "torso", "forward": [2, 0, 0]}})) == []
    changed = {
        **entries,
        "left_wrist": {"link": "l_wrist2hand", "offset": [0, 0, 0.01]},
        "head": {"link": "head", "forward": [1, 0, 0], "up": [0, 0, 1]},
    }
    del changed["right_hand"]
    assert known.differences(read_keypoints(changed)) == ["left_wrist", "right_hand", "head"]
    assert set(read_keypoints(changed).differences(known)) == {"left_wrist", "right_hand", "head"}


def test_the_urdf_is_parsed_once(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    load = urdf.read_tree
    monkeypatch.setattr(urdf, "read_tree", lambda path, text: (read.append(path), load(path, text))[1])
    urdf._described.cache_clear()
    body_map = build_body_map(load_config(root / "conf" / "coman.yaml").robot)
    assert body_map.collision.pairs
    Artist(body_map.robot).robot_figure(body_map.robot.home())
    OptimizationRetargeter(body_map)
    build_body_map(load_config(root / "conf" / "coman.yaml").robot)
    assert read == [body_map.robot.urdf]
