from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo.config.schema import RobotConfig
from mrhubo.reference import DirectionJacobian
from mrhubo.robot import BodyMap, build_body_map

# An arm on a waist. `waist` is above the chest, so it turns a direction only through `twist`, which mimics it; `bend` halves
# and reverses the elbow further down, `slide` moves the wrist sideways with the elbow. Axes are negative or oblique. No body
# part sits on a link right below a mimicking joint.
ODD_URDF = """<robot name="odd">
  <link name="base"/> <link name="chest"/> <link name="shoulder"/> <link name="upper"/> <link name="fore"/>
  <link name="turned"/> <link name="bent"/> <link name="slid"/> <link name="hand"/>
  <joint name="waist" type="revolute"><parent link="base"/><child link="chest"/><origin xyz="0 0 1" rpy="0 0 0.2"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
  <joint name="pitch" type="revolute"><parent link="chest"/><child link="shoulder"/><origin xyz="0 0.2 0.3"/>
    <axis xyz="0 -1 0"/><limit lower="-1.5" upper="1"/></joint>
  <joint name="roll" type="revolute"><parent link="shoulder"/><child link="upper"/><origin xyz="0 0.05 0" rpy="0.3 0 0"/>
    <axis xyz="-0.6 0 0.8"/><limit lower="-1" upper="2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.02 0 -0.3"/>
    <axis xyz="0 -1 0"/><limit lower="0.1" upper="2"/></joint>
  <joint name="twist" type="revolute"><parent link="fore"/><child link="turned"/><origin xyz="0 0.01 -0.05"/>
    <axis xyz="0 0 1"/><limit lower="-9" upper="9"/><mimic joint="waist" multiplier="2" offset="0.3"/></joint>
  <joint name="bend" type="revolute"><parent link="turned"/><child link="bent"/><origin xyz="0 0 -0.1"/>
    <axis xyz="1 0 0"/><limit lower="-9" upper="9"/><mimic joint="elbow" multiplier="-0.5" offset="0.1"/></joint>
  <joint name="slide" type="prismatic"><parent link="bent"/><child link="slid"/><origin xyz="0 0 -0.1"/>
    <axis xyz="0 1 0"/><limit lower="-9" upper="9"/><mimic joint="elbow" multiplier="0.1"/></joint>
  <joint name="palm" type="fixed"><parent link="slid"/><child link="hand"/><origin xyz="0 0 -0.08"/></joint>
</robot>"""


@pytest.fixture
def odd_robot(tmp_path: Path) -> BodyMap:
    path = tmp_path / "odd.urdf"
    path.write_text(ODD_URDF)
    keypoints = {
        "chest": "chest", "left_shoulder": "shoulder", "left_elbow": {"link": "fore", "offset": [0.01, 0, 0.02]},
        "left_wrist": "hand", "left_hand": {"link": "hand", "fingers": [0, 0, -1], "thumb": [1, 0, 0]},
    }  # fmt: skip
    return build_body_map(RobotConfig("odd", path, ["elbow", "waist", "pitch", "roll"], keypoints, ["hand"]))


def directions(body_map: BodyMap, q_BN: Tensor) -> Tensor:
    return body_map.robot_directions(body_map.robot.forward(q_BN))


def central_differences(body_map: BodyMap, q_BN: Tensor, step: float = 0.01) -> Tensor:
    columns = []
    for offset_N in step * torch.eye(q_BN.shape[1]):
        near = directions(body_map, q_BN + offset_N) - directions(body_map, q_BN - offset_N)
        far = directions(body_map, q_BN + 2 * offset_N) - directions(body_map, q_BN - 2 * offset_N)
        columns.append((8 * near - far) / (12 * step))  # fourth order, for the sake of float32
    return torch.stack(columns, dim=-1)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy", "odd"])
def test_equals_differences_and_autograd(
    name: str, body_maps: dict[str, BodyMap], request: pytest.FixtureRequest
) -> None:
    body_map = request.getfixturevalue("odd_robot") if name == "odd" else body_maps[name]
    q_BN = body_map.robot.sample(64, torch.Generator().manual_seed(1))
    found_BD3, jacobian_BD3N = DirectionJacobian(body_map).forward(q_BN)
    torch.testing.assert_close(found_BD3, directions(body_map, q_BN))
    assert jacobian_BD3N.shape == (*found_BD3.shape, len(body_map.robot.joint_names))
    torch.testing.assert_close(jacobian_BD3N, central_differences(body_map, q_BN), atol=2e-4, rtol=0)

    def summed(q: Tensor) -> Tensor:
        # rows of a batch are independent, so the sum's Jacobian holds each of them
        return directions(body_map, q).sum(0)

    automatic_BD3N = torch.autograd.functional.jacobian(summed, q_BN).permute(2, 0, 1, 3)  # pyright: ignore
    torch.testing.assert_close(jacobian_BD3N, automatic_BD3N, atol=1e-5, rtol=0)


def test_links_of_mimicking_joints_are_found(odd_robot: BodyMap) -> None:
    kinematics = DirectionJacobian(odd_robot)
    assert {"turned", "bent", "slid"} <= set(kinematics.robot.links)
    assert kinematics.robot.links[: len(odd_robot.robot.links)] == odd_robot.robot.links
    waist = odd_robot.robot.joint_names.index("waist")
    turned = {
        n for n, moved in zip(odd_robot.direction_names, kinematics.moved_DN[:, waist].tolist(), strict=True) if moved
    }
    assert turned == {"left_wrist", "left_hand_fingers", "left_hand_thumb"}


def test_arms_do_not_turn_each_other(body_maps: dict[str, BodyMap]) -> None:
    for body_map in body_maps.values():
        moved_DN = DirectionJacobian(body_map).moved_DN
        for direction, row in zip(body_map.direction_names, moved_DN.tolist(), strict=True):
            for joint, moved in zip(body_map.robot.joint_names, row, strict=True):
                sides = {"l": "left", "r": "right", "n": "head"}
                assert not moved or sides[joint[0].lower()] == direction.split("_")[0], (direction, joint)
