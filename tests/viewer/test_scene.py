"""Nodes of the browser's scene are where the robot's kinematics and the person's skeleton have them, at any moment;
the page is served; a saved page has all of it.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import threading
import urllib.request
from collections import defaultdict
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard

from mrhubo.body import JOINT_NAMES
from mrhubo.robot import Robot, link_poses
from mrhubo.viewer import Stage, arrange, perform
from mrhubo.viewer.controls import Controls
from mrhubo.viewer.live import serve
from mrhubo.viewer.page import save_page
from mrhubo.viewer.player import Player
from mrhubo.viewer.poses import from_wxyz, poses
from mrhubo.viewer.scene import Scene
from mrhubo.viewer.server import local_server
from tests.viewer.conftest import FRAMES, random_motion


def world_pose(poses_of: dict[str, np.ndarray], name: str) -> np.ndarray:
    """The pose (4, 4) of a node, of those of the nodes above it."""
    parts = name.split("/")[1:]
    pose_44 = np.eye(4)
    for count in range(len(parts)):
        pose_44 = pose_44 @ poses_of["/" + "/".join(parts[: count + 1])]
    return pose_44


def node_poses(scene: Scene) -> dict[str, np.ndarray]:
    return {name: poses(np.array(node.position), from_wxyz(np.array(node.wxyz))) for name, node in scene.nodes.items()}


def check_robot(stage: Stage, number: int, frame: int, places: dict[str, np.ndarray], names: list[str]) -> None:
    """Nodes of a robot against yourdfpy's kinematics."""
    robot, standing = stage.robots[number], stage.standings[number + (stage.person is not None)]
    wanted = link_poses(robot.robot.description.parsed, robot.robot.configuration(robot.motion.q[frame]))
    for body, name in zip(robot.bodies, names, strict=True):
        link_44 = wanted[body.name].copy()
        link_44[:3, 3] *= robot.scale
        np.testing.assert_allclose(world_pose(places, name), standing.pose_T44[frame] @ link_44, atol=1e-5)


def body_names(stage: Stage, number: int) -> list[str]:
    names: list[str] = []
    for count, body in enumerate(stage.robots[number].bodies):
        names.append(f"/world/robot_{number}" if body.parent is None else f"{names[body.parent]}/{count}")
    return names


def test_nodes_follow_the_timeline(stage: Stage) -> None:
    assert stage.person is not None
    with local_server() as server:
        scene = Scene(server, stage)
        scene.follows = False
        for frame in (0, 4, 2):
            scene.show(frame / stage.frame_rate)
            places = node_poses(scene)
            for number in range(2):
                check_robot(stage, number, frame, places, body_names(stage, number))
            np.testing.assert_allclose(
                world_pose(places, "/world/person"), stage.standings[0].pose_T44[frame], atol=1e-6
            )
            turn_J33 = stage.person.turn_TJ33[frame]
            assert len(scene.bones) >= len(JOINT_NAMES) - 4
            for bone, place_T3, _ in scene.bones:
                joint = int(np.abs(stage.person.place_TJ3[frame] - place_T3[frame]).sum(axis=1).argmin())
                np.testing.assert_allclose(bone.position, stage.person.place_TJ3[frame, joint], atol=1e-6)
                np.testing.assert_allclose(from_wxyz(np.array(bone.wxyz)), turn_J33[joint], atol=1e-5)
            shown = [scene.nodes[f"/world/contacts/{side}_heel"].visible for side in ("left", "right")]
            assert stage.person.planted_TP is not None and shown == stage.person.planted_TP[frame, :2].tolist()
        scene.follows = True
        scene.show(2 / stage.frame_rate)
        np.testing.assert_allclose(node_poses(scene)["/world"][:2, 3], -stage.followed_F2[2], atol=1e-6)
        # The camera looks at the middle from the front, and from farther away than anything reaches.
        low_3, high_3 = stage.box()
        assert (low_3 < server.initial_camera.look_at).all() and (server.initial_camera.look_at < high_3 + 1).all()
        assert server.initial_camera.position[0] > high_3[0] + 1


def test_controls_and_player_agree(stage: Stage) -> None:
    with local_server() as server:
        scene, player = Scene(server, stage), Player(stage.duration)
        controls = Controls(server, scene, player)
        player.seek(0.05)
        controls.show(player.time, 0.0)
        assert controls.timeline.value == pytest.approx(0.05) and controls.play.label == "Play"
        assert player.time == 0.05 and not player.playing  # the timeline's own step has moved nothing
        player.toggle()
        controls.show(player.advance(0.02), 1.0)
        assert controls.timeline.value == pytest.approx(0.07) and controls.play.label == "Pause"
        controls.speed.value, controls.loop.value = "0.5x", False


def test_a_click_on_a_robot_opens_its_panels_and_the_joint_that_moves_the_part(stage: Stage) -> None:
    with local_server() as server:
        twins = dataclasses.replace(stage.robots[0]), dataclasses.replace(stage.robots[1], label=stage.robots[0].label)
        scene, player = Scene(server, dataclasses.replace(stage, robots=twins)), Player(stage.duration)
        controls = Controls(server, scene, player)
        assert controls.robot is not None and len(set(controls.robot.options)) == 2  # also of one name
        for number in (1, 0):
            for handle, column in scene.clickable[number][-3:]:
                (entry,) = handle._impl.click_cb
                entry.callback(None)
                assert controls.robot.value == controls.robot.options[number]
                assert [folder.visible for folder in controls.folders] == [number == 0, number == 1]
                assert controls.joints[number].value == twins[number].motion.joint_names[column]


def test_the_page_is_served_until_it_is_enough(stage: Stage, capsys: pytest.CaptureFixture[str]) -> None:
    found: list[str] = []
    enough = threading.Event()

    def look(address: str) -> None:
        with urllib.request.urlopen(address, timeout=60) as page:
            found.extend([address, page.read(200_000).decode()])
        enough.set()

    serve(stage, 8180, look, enough.is_set)
    assert re.fullmatch(r"http://127\.0\.0\.1:81\d\d", found[0]) and "<title>" in found[1]
    with pytest.raises(OSError):
        urllib.request.urlopen(found[0], timeout=2)
    assert capsys.readouterr().out == ""


def test_ctrl_c_ends_it(stage: Stage) -> None:
    def pressed() -> bool:
        raise KeyboardInterrupt

    serve(stage, 8180, lambda address: None, pressed)


def read_recording(page: str) -> list[tuple[float, dict[str, Any]]]:
    """The messages of a page, with their times [s]."""
    found = re.search(r'__VISER_EMBED_DATA__="([^"]+)"', page)
    assert found
    content = zstandard.ZstdDecompressor().decompressobj().decompress(base64.b64decode(found[1])[8:])
    length = int.from_bytes(content[:8], "little")
    return msgspec.msgpack.decode(content[8 : 8 + length])["messages"]


def test_a_saved_page_has_every_frame(stage: Stage, tmp_path: Path) -> None:
    path = save_page(stage, tmp_path / "more" / "page.html", "two <b>robots</b>")
    page = path.read_text()
    assert [file.name for file in path.parent.iterdir()] == ["page.html"]
    assert "<title>two &lt;b&gt;robots" in page and not re.search(r'(src|href)="(?!data:)[^"#]', page)
    messages = read_recording(page)
    times = sorted({round(time * stage.frame_rate) for time, _ in messages})
    assert times == list(range(FRAMES))
    places, names = defaultdict[str, np.ndarray](lambda: np.eye(4)), body_names(stage, 0)
    now = 0
    for time, message in [*messages, (FRAMES / stage.frame_rate, {"type": "end"})]:
        frame = round(time * stage.frame_rate)
        if frame > now:
            kept = places["/world"]
            places["/world"] = np.eye(4)
            check_robot(stage, 0, now, places, names)
            places["/world"], now = kept, frame
        if message["type"] == "SetPositionMessage":
            places[message["name"]][:3, 3] = message["position"]
        elif message["type"] == "SetOrientationMessage":
            places[message["name"]][:3, :3] = from_wxyz(np.array(message["wxyz"]))
    facts = re.search(r'id="mrhubo-robots">(.*?)</script>', page)
    assert facts
    first, second = json.loads(facts[1])
    robot = stage.robots[0]
    shares_TN = (robot.motion.q - robot.lower_N) / (robot.upper_N - robot.lower_N)
    np.testing.assert_allclose(np.array(first["shares"]) / first["scale"], shares_TN, atol=1e-3)
    assert second["frames"] == FRAMES and page.count('class="curve"') == 2 * len(robot.motion.joint_names)
    assert page.count("confidence (red") == 1  # the walker has none


def test_names_of_strangers_stay_text(nao: Robot, tmp_path: Path) -> None:
    evil = '</script><script>alert("x")</script>'
    stage = arrange(None, [perform(evil, nao, random_motion(nao, 2))])
    page = save_page(stage, tmp_path / "page.html", evil).read_text()
    assert evil not in page and "&lt;/script&gt;" in page
