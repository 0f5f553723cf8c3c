"""Bodies carry their links where another library has them, and move with the joints above them alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.config import load_config
from mrhubo.robot import Robot, build_body_map
from mrhubo.robot.driven_bodies import DrivenBodies
from mrhubo.robot.urdf import link_poses


@pytest.fixture(scope="module", params=["nao", "nao-whole-body"])
def robot(root: Path, request: pytest.FixtureRequest) -> Robot:
    """Of the first, the legs are held."""
    return build_body_map(load_config(root / "conf" / f"{request.param}.yaml").robot).robot


def test_links_are_where_yourdfpy_has_them(robot: Robot) -> None:
    bodies, description = DrivenBodies(robot), robot.description
    assert bodies.links[0] == description.root and len(bodies.links) == 1 + len(robot.driven_joints)
    q_BN = robot.sample(3, torch.Generator().manual_seed(7))
    turn_BL33, place_BL3 = (found.double().numpy() for found in bodies.place(robot.forward(q_BN)))
    for q_N, turn_L33, place_L3 in zip(q_BN.numpy(), turn_BL33, place_BL3, strict=True):
        poses = link_poses(description.parsed, robot.configuration(q_N))
        for link in description.links:
            body, inside_44 = bodies.number(link), bodies.inside(link)
            assert bodies.links[body] == bodies.link_of(link)
            np.testing.assert_allclose(turn_L33[body] @ inside_44[:3, :3], poses[link][:3, :3], atol=1e-5)
            place_3 = place_L3[body] + turn_L33[body] @ inside_44[:3, 3]
            np.testing.assert_allclose(place_3, poses[link][:3, 3], atol=1e-5)


def test_a_body_moves_with_the_joints_above_it(robot: Robot) -> None:
    bodies, middle_N = DrivenBodies(robot), (robot.lower_N + robot.upper_N) / 2
    moved_DN = middle_N + 0.1 * torch.eye(len(middle_N))
    first_1L33, still_1L3 = bodies.place(robot.forward(middle_N[None]))
    turn_DL33, place_DL3 = bodies.place(robot.forward(moved_DN))
    moves_DL = ((place_DL3 - still_1L3).abs().amax(-1) > 1e-6) | ((turn_DL33 - first_1L33).abs().amax((-1, -2)) > 1e-4)
    above_NL = (robot.drive_DN != 0).float().T @ bodies.above_LA.T
    assert torch.equal(moves_DL, above_NL > 0)
