"""Clicks in a real browser find what is drawn under the mouse."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.robot import Robot
from mrhubo.robot_motion import RobotMotion
from mrhubo.viewer import arrange, perform
from mrhubo.viewer.controls import Controls
from mrhubo.viewer.player import Player
from mrhubo.viewer.poses import from_wxyz
from mrhubo.viewer.scene import Scene
from mrhubo.viewer.server import HOST, local_server
from tests.browser import Browser, find_browser
from tests.viewer.test_scene import node_poses, world_pose


def seen_at(camera: Any, mesh: Any, link_44: np.ndarray) -> tuple[float, float]:
    """Where the page draws the point of a mesh that is nearest to its camera [pixels]: a pinhole, y down."""
    points_V3 = np.asarray(mesh.vertices) @ link_44[:3, :3].T + link_44[:3, 3] - np.array(camera.position)
    x, y, z = points_V3[np.linalg.norm(points_V3, axis=1).argmin()] @ from_wxyz(np.array(camera.wxyz))
    focal = camera.image_height / 2 / np.tan(camera.fov / 2)
    return float(camera.image_width / 2 + focal * x / z), float(camera.image_height / 2 + focal * y / z)


def test_a_click_on_a_hand_chooses_its_robot_and_joint(nao: Robot, tmp_path: Path) -> None:
    find_browser()
    still = RobotMotion(np.tile(nao.home().numpy(), (2, 1)), nao.joint_names, 30.0)
    stage = arrange(None, [perform("one", nao, still), perform("two", nao, still)])
    with local_server() as server, Browser(tmp_path / "profile") as browser:
        scene, player = Scene(server, stage), Player(stage.duration)
        controls = Controls(server, scene, player)
        scene.show(0.0)
        browser.go(f"http://{HOST}:{server.get_port()}")
        browser.until("document.querySelector('canvas') !== null && document.querySelectorAll('input').length > 2")
        (client,) = browser.wait(lambda: list(server.get_clients().values()), "the page does not connect")
        places, shown = node_poses(scene), "[...document.querySelectorAll('input')].map((one) => one.value)"
        assert controls.robot is not None and controls.robot.value == "one"
        for number, side in ((1, "L"), (0, "R")):  # the second robot first, as the first is chosen already
            joint = f"{side}ElbowRoll"
            meshes = [mesh for mesh, column in scene.clickable[number] if nao.joint_names[column] == joint]
            link_44 = world_pose(places, meshes[0].name.rsplit("/", 1)[0])
            end = time.monotonic() + 180
            while (controls.robot.value, controls.joints[number].value) != (("one", "two")[number], joint):
                assert time.monotonic() < end, f"{controls.robot.value}, {controls.joints[number].value}"
                browser.click(*seen_at(client.camera, meshes[0], link_44))  # the page has to tell of its camera first
                time.sleep(0.5)
            controls.show(0.0, 1.0 + number)
            browser.until(f"{shown}.includes('{joint}')", 60)
            assert ("one", "two")[number] in browser.ask(shown)
            assert controls.joints[1 - number].value == ("LElbowRoll" if number == 0 else nao.joint_names[0])
    assert browser.complaints() == []
