"""Batched chains: their Jacobian is the derivative, and they move as the robot's own model does."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from mrhubo.reference import DirectionProblem
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.keypoints import Limb
from mrhubo.universal.chains import Chains
from mrhubo.universal.learning.random_chains import random_chains
from mrhubo.universal.robots import RobotBranch
from mrhubo.universal.slots import SIGN_3

EACH = {"arms": 120, "heads": 40, "legs": 100, "waists": 40}


def double(chains: Chains) -> Chains:
    values = {f.name: getattr(chains, f.name) for f in dataclasses.fields(chains)}
    return Chains(**{name: x.double() if x.is_floating_point() else x for name, x in values.items()})


def test_the_jacobian_is_the_derivative() -> None:
    generator = torch.Generator().manual_seed(0)
    chains = double(random_chains(EACH, generator))
    unit_BN = torch.rand(chains.lower_BN.shape, generator=generator, dtype=torch.float64)
    q_BN = chains.lower_BN + unit_BN * (chains.upper_BN - chains.lower_BN)
    local = chains.local(q_BN)
    for n in range(q_BN.shape[1]):
        step_N = 1e-6 * torch.eye(q_BN.shape[1], dtype=torch.float64)[n]
        ahead, behind = (chains.local(q_BN + sign * step_N).direction_BS3 for sign in (1, -1))
        slope_BS3 = (ahead - behind) / 2e-6 * chains.filled_BS[..., None] * chains.present_BN[:, None, n, None]
        torch.testing.assert_close(local.jacobian_BS3N[..., n], slope_BS3, atol=1e-6, rtol=0)


def test_senses_are_canonical_and_change_no_motion() -> None:
    generator = torch.Generator().manual_seed(1)
    chains = random_chains(EACH, generator)
    canonical, sense_BN = chains.canonical(), chains.senses()
    assert bool((sense_BN < 0).any()) and bool((canonical.senses() > 0).all())
    unit_BN = torch.rand(chains.lower_BN.shape, generator=generator)
    q_BN = chains.lower_BN + unit_BN * (chains.upper_BN - chains.lower_BN)
    there_BS1 = chains.filled_BS[..., None]
    torch.testing.assert_close(
        canonical.local(q_BN * sense_BN).direction_BS3 * there_BS1,
        chains.local(q_BN).direction_BS3 * there_BS1, atol=1e-5, rtol=0,
    )  # fmt: skip
    along_BN = canonical.local(canonical.middle_BN).axis_BN3 @ torch.tensor(SIGN_3)
    assert bool((along_BN >= 0).all())


@pytest.mark.parametrize("block", [0, 1])
def test_a_robots_branch_moves_as_the_robot(block: int) -> None:
    robot = Robot.from_config("nao")
    body_map = BodyMap.of(robot)
    branch = RobotBranch(DirectionProblem(body_map), block)
    q_BX = robot.sample(20, torch.Generator().manual_seed(2))[:, branch.joints_X] * branch.sense_X
    chains = chain_of(body_map, branch, len(q_BX))
    mine, theirs = chains.local(q_BX), branch.local(q_BX)
    there_BS1 = chains.filled_BS[..., None]
    torch.testing.assert_close(theirs.direction_BS3, mine.direction_BS3 * there_BS1, atol=1e-5, rtol=0)
    torch.testing.assert_close(theirs.jacobian_BS3N, mine.jacobian_BS3N, atol=1e-5, rtol=0)
    torch.testing.assert_close(theirs.axis_BN3, mine.axis_BN3, atol=1e-5, rtol=0)


def chain_of(body_map: BodyMap, branch: RobotBranch, count: int) -> Chains:
    """The branch as a product of exponentials, written down from the robot's links at zero."""
    robot, joints = body_map.robot, [body_map.robot.joint_names[n] for n in branch.joints_X.tolist()]
    poses = robot.forward(torch.zeros(1, len(robot.joint_names)))
    view_33 = body_map.shared.view_robot(poses).views[0][0]
    flip_3, axial_3 = branch.mirror_3, branch.axial_3
    order = sorted(joints, key=lambda name: len(robot.description.joints_above(robot.description.joints[name].child)))
    assert order == joints, "the config lists them from the body outwards"

    def link(name: str) -> tuple[torch.Tensor, torch.Tensor]:
        row = robot.link_index(name)
        return poses.rotation_BL33[0, row], poses.position_BL3[0, row]

    def carried(name: str) -> int:
        return len({joint.name for joint in robot.description.joints_above(name)} & set(joints))

    axes, points = [], []
    for n, name in enumerate(joints):
        joint = robot.description.joints[name]
        rotation_33, position_3 = link(joint.child)
        axis_3 = rotation_33 @ torch.tensor(joint.axis_3.tolist(), dtype=torch.float32)
        axes.append((axis_3 @ view_33) * axial_3 * branch.sense_X[n])
        points.append((position_3 @ view_33) * flip_3)
    starts, ends, bodies = torch.zeros(5, 3), torch.zeros(5, 3), torch.zeros(2, 5, dtype=torch.long)
    for slot, place in branch.places.items():
        direction = body_map.directions[place]
        if isinstance(direction, Limb):
            for row, (point, where) in enumerate(((direction.start, starts), (direction.end, ends))):
                rotation_33, position_3 = link(point.link)
                offset_3 = torch.tensor(point.offset_3, dtype=torch.float32)
                where[slot] = ((rotation_33 @ offset_3 + position_3) @ view_33) * flip_3
                bodies[row, slot] = carried(point.link)
        else:
            ends[slot] = (link(direction.link)[0] @ direction.axis_3 @ view_33) * branch.flip_S3[slot]
            bodies[1, slot] = carried(direction.link)
    filled_S = torch.tensor([float(slot in branch.places) for slot in range(5)])
    ends[filled_S == 0] = torch.tensor([1.0, 0.0, 0.0])
    one_N = torch.ones(len(joints))
    rows = (torch.stack(axes), torch.stack(points), one_N, -one_N, one_N, starts, ends, *bodies, filled_S, filled_S)
    chains = Chains(*(row.expand(count, *row.shape) for row in rows))
    return dataclasses.replace(chains, end_BS3=chains.end_BS3.clone())
