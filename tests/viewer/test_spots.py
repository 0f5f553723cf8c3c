"""Spots lie under feet, where the robot's kinematics have them, while the answer says that they are planted."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from mrhubo.robot import Robot, link_poses
from mrhubo.viewer import Performance, arrange, perform
from mrhubo.viewer.page import save_page
from mrhubo.viewer.panels import WIDTH, contact_strips
from mrhubo.viewer.pictures import columns
from mrhubo.viewer.scene import Scene
from mrhubo.viewer.server import local_server
from mrhubo.viewer.spots import SPOT_COLOR, spots_of
from tests.viewer.conftest import FRAMES, random_motion, steps

FEET = ("left_foot", "right_foot")


@pytest.fixture(scope="module")
def walking(walker: Robot) -> Performance:
    return perform("walker", walker, steps(walker))


def test_a_robots_spots_are_under_its_ankles(walking: Performance) -> None:
    (standing,) = arrange(None, [walking]).standings
    spots = spots_of(walking, standing)
    assert spots is not None and spots.names == FEET
    np.testing.assert_array_equal(spots.planted_TP, walking.motion.contact)
    for frame in (0, 3, FRAMES - 1):
        poses = link_poses(walking.robot.description.parsed, walking.robot.configuration(walking.motion.q[frame]))
        for foot, link in enumerate(("l_ankle", "r_ankle")):
            ankle_3 = standing.pose_T44[frame, :3, :3] @ poses[link][:3, 3] * walking.scale
            ankle_3 += standing.pose_T44[frame, :3, 3]
            apart = np.linalg.norm((spots.place_TP3[frame, foot] - ankle_3)[:2])
            # NAO's sole, 11 cm long, lies 5 cm below its ankle; a foot in the air may be tilted.
            assert apart < 0.06 * walking.scale
    assert (spots.radius_P > 0.05 * walking.scale).all() and (spots.place_TP3[..., 2] < 0.005).all()


def test_scene_pages_and_pictures_have_them(walking: Performance, tmp_path: Path) -> None:
    stage = arrange(None, [walking])
    with local_server() as server:
        scene = Scene(server, stage)
        for frame in (0, 1, FRAMES - 1):
            scene.show(frame / stage.frame_rate)
            seen = [scene.nodes[f"/world/contacts_0/{foot}"].visible for foot in FEET]
            assert walking.motion.contact is not None and seen == walking.motion.contact[frame].tolist()
    page = save_page(stage, tmp_path / "a.html", "steps").read_text()
    assert "contacts (orange" in page and page.count(">left_foot</text>") == 1
    (drawn,) = columns(stage, [frame / stage.frame_rate for frame in range(FRAMES)])
    orange = [int((np.abs(solids.colors_S3 - SPOT_COLOR).max(axis=1) < 1e-9).sum()) for solids in drawn]
    without = orange[1]  # of parts of the robot that have this colour
    assert [count - without for count in orange] == walking.motion.contact.sum(axis=1).tolist()


def test_who_tells_nothing_has_none(nao: Robot, walker: Robot) -> None:
    for robot, motion in (
        (walker, random_motion(walker)),
        (nao, dataclasses.replace(random_motion(nao), contact=np.ones((FRAMES, 2)), contact_names=FEET)),
        (walker, dataclasses.replace(random_motion(walker), contact=np.ones((FRAMES, 1)), contact_names=("tail",))),
    ):
        stage = arrange(None, [perform("robot", robot, motion)])
        assert spots_of(stage.robots[0], stage.standings[0]) is None


def test_strips_are_as_long_as_contacts() -> None:
    told = np.array([[0, 1], [1, 1], [1, 1], [0, 1], [1, 1]], dtype=bool)
    svg = contact_strips(told, ("a<b", "right"), 0.5)
    bars = [
        (float(x), float(y), float(w)) for x, y, w in re.findall(r'x="([\d.]+)" y="(\d+)" width="([\d.]+)" .*?/>', svg)
    ]
    step = WIDTH / 5
    assert [bar for bar in bars if bar[1] == 0][1:] == [(step, 0, 2 * step), (4 * step, 0, step)]
    assert [bar[::2] for bar in bars if bar[1] > 0] == [(0, WIDTH), (0, WIDTH)]
    assert "a&lt;b" in svg and 'class="now" x1="150.0"' in svg
