"""The robot on the page: as forward kinematics have it, and moving with the messages."""

from __future__ import annotations

import dataclasses
import http.client
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("websockets")

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast.rotations import quaternion_to_matrix
from mrhubo.live.endpoints import TOKEN_VARIABLE, Endpoint
from mrhubo.live.figure import figure_of
from mrhubo.live.server import PageSink, Server
from mrhubo.robot import Robot, link_poses, read_geometry
from mrhubo.view import robot_solids
from tests.browser import Browser, find_browser
from tests.live.robots import make_robot


@pytest.fixture(scope="module")
def nao(root: Path) -> Robot:
    return Robot.from_config(root / "conf" / "nao.yaml")


@pytest.fixture(scope="module")
def server(nao: Robot) -> Iterator[Server]:
    """A session's page of NAO."""
    found = Server(Endpoint("127.0.0.1", 0))
    robot = dataclasses.replace(make_robot(), figure=lambda: figure_of(nao, nao.joint_names))
    PageSink(found).open(robot, LiveConfig())
    yield found
    found.close()


def ask(server: Server, path: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.endpoint.port, timeout=120)
    connection.request("GET", path)
    answer = connection.getresponse()
    return answer.status, answer.read()


PARTS = {"left_leg_and_right_leg": 0.5}
"""A part with a long name."""


def message(angles: np.ndarray, names: tuple[str, ...]) -> str:
    told: dict[str, Any] = {"mrhubo": 1, "kind": "joints", "state": "following", "confidence": PARTS}
    return json.dumps({**told, "names": names, "angles": angles.tolist(), "velocities": [0.0] * len(names)})


def test_the_page_draws_what_forward_kinematics_say(
    server: Server, nao: Robot, tmp_path_factory: pytest.TempPathFactory
) -> None:
    find_browser()
    angles_N = np.random.default_rng(0).uniform(nao.lower_N.numpy(), nao.upper_N.numpy())
    figure = json.loads(ask(server, "/robot.json")[1])
    with Browser(tmp_path_factory.mktemp("browser") / "profile") as browser:
        browser.go(server.urls[0])
        pixels = "(() => { const c = document.getElementById('figure'); return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.filter((_, i) => i % 4 === 3 && i).reduce((sum, a, i) => (sum * 31 + a * (i % 997)) % 1e9, 0); })()"  # fmt: skip
        browser.until(f"!document.getElementById('robot').hidden && {pixels} > 0")
        before = browser.ask(pixels)
        script = f"import('/robot.js').then(m => fetch('/robot.json').then(a => a.json()).then(f => m.places(f.bodies, {angles_N.tolist()})))"
        places_B44 = np.array(browser.ask(script))
        turn_4, at_3 = np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7]), [0.3, -1.2, 0.4]
        base = json.dumps({"position": at_3, "quaternion_wxyz": turn_4.tolist()})
        moved_B44 = np.array(browser.ask(script.replace(f"{angles_N.tolist()})", f"{angles_N.tolist()}, {base})")))
        server.show(message(angles_N, tuple(nao.joint_names)))
        browser.until(f"{pixels} !== {before}")
        pen = browser.ask(pixels)
        told = json.loads(message(angles_N, tuple(nao.joint_names))) | {"base": json.loads(base)}
        server.show(json.dumps(told))
        browser.until(f"{pixels} !== {pen}")
        assert browser.ask("document.querySelector('#confidence span').textContent") == "left leg and right leg"
        assert browser.ask("(([a, b]) => a.right <= b.left)([...document.querySelector('#confidence div').children]"
                           ".map((one) => one.getBoundingClientRect()))")  # fmt: skip
        assert browser.complaints() == []
    base_44 = np.eye(4)
    base_44[:3, :3], base_44[:3, 3] = quaternion_to_matrix(turn_4[[1, 2, 3, 0]]), at_3
    np.testing.assert_allclose(moved_B44, base_44 @ places_B44, atol=1e-9)
    parsed = nao.description.parsed
    wanted = robot_solids(read_geometry(parsed), link_poses(parsed, nao.configuration(angles_N)))
    drawn = []
    for place_44, body in zip(places_B44, figure["bodies"], strict=True):
        for row in body["capsules"]:
            ends_23 = np.reshape(row[:6], (2, 3)) @ place_44[:3, :3].T + place_44[:3, 3]
            drawn.append([*ends_23.ravel(), *row[6:8]])
    told = np.column_stack([wanted.starts_S3, wanted.ends_S3, wanted.radii_S, wanted.end_radii_S])
    order, other = (np.lexsort(np.round(rows, 3).T) for rows in (np.array(drawn), told))
    assert len(drawn) == len(told)
    np.testing.assert_allclose(np.array(drawn)[order].mean(0), told[other].mean(0), atol=1e-4)
    nearest = [np.abs(told - row).max(axis=1).min() for row in drawn]
    assert max(nearest) < 1e-4


def test_who_has_no_token_does_not_see_it(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TOKEN_VARIABLE, "a-secret-of-some-length")
    other = Server(Endpoint("0.0.0.0", 0))
    other.figure = server.figure
    other.open()
    try:
        assert ask(other, "/robot.json")[0] == 403 and ask(other, "/")[0] == 200
        assert ask(other, "/robot.json?token=a-secret-of-some-length") == (200, server.figure)
    finally:
        other.close()


def test_a_robot_that_cannot_be_drawn_moves_all_the_same() -> None:
    def refuse() -> dict[str, Any]:
        raise UserError("no shape")

    for robot in (make_robot(), dataclasses.replace(make_robot(), figure=refuse)):
        server = Server(Endpoint("127.0.0.1", 0))
        PageSink(server).open(robot, LiveConfig())
        assert ask(server, "/robot.json") == (200, b"null")
        server.close()


def test_robots_without_shapes_and_with_many(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrhubo.live import figure as room

    nao = Robot.from_config(root / "conf" / "nao.yaml")
    monkeypatch.setattr(room, "_MOST", 10)
    assert sum(len(body["capsules"]) for body in figure_of(nao, nao.joint_names)["bodies"]) <= 10
    monkeypatch.undo()
    monkeypatch.setattr("mrhubo.robot.looks.read_geometry", lambda parsed: [])
    bodies = figure_of(nao, nao.joint_names)["bodies"]
    for number, body in enumerate(bodies):
        hanging = [other["origin"] for other in bodies if other["parent"] == number]
        ends = [row[3:6] for row in body["capsules"]]
        for origin_44 in hanging:
            assert any(np.allclose(np.array(origin_44)[:3, 3], end_3, atol=1e-5) for end_3 in ends), body


def test_a_mesh_that_collides_with_nothing_is_a_rod(root: Path, tmp_path: Path) -> None:
    """As a foot is, which stands on four points: the page has no meshes."""
    import trimesh

    path = tmp_path / "nao.urdf"
    told = (root / "data" / "robots" / "nao" / "nao.urdf").read_text()
    trimesh.creation.box((0.5, 0.1, 0.1)).export(tmp_path / "hat.stl")
    visual = '<visual><geometry><mesh filename="hat.stl"/></geometry></visual>'
    path.write_text(
        told.replace(
            "</robot>",
            f"""<link name="hat">{visual}</link>
<joint name="hat" type="fixed"><parent link="torso"/><child link="hat"/><origin xyz="0 0 1"/></joint></robot>""",
        )
    )
    config = tmp_path / "nao.yaml"
    shipped = (root / "conf" / "nao.yaml").read_text()
    config.write_text(shipped.replace("../data/robots/nao/nao.urdf", str(path)))
    robot = Robot.from_config(config)
    before = figure_of(Robot.from_config(root / "conf" / "nao.yaml"), robot.joint_names)["bodies"]
    after = figure_of(robot, robot.joint_names)["bodies"]
    (new,) = [
        row for one, two in zip(before, after, strict=True) for row in two["capsules"] if row not in one["capsules"]
    ]
    ends_23 = np.reshape(new[:6], (2, 3))
    assert np.ptp(ends_23[:, 2]) < 0.03 and ends_23[0, 2] > 1.0
    length = float(np.linalg.norm(ends_23[1] - ends_23[0]))
    assert 0.5 <= length + 2 * new[6] < 0.523 and 0.049 < new[6] < 0.08, "as long as the box, and its diagonal, to 3 mm"
