"""The page in a real browser, whose camera is a film of a figure that we draw."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

pytest.importorskip("websockets")

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.config.live import LiveConfig
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.loop import Session
from mrhubo.live.robot import LiveRobot
from mrhubo.live.server import PageSink, PageSource, Server
from mrhubo.video.models import FOLDER_VARIABLE
from tests.browser import Browser, find_browser, write_y4m
from tests.live.figures import lifted_hand, pose_of
from tests.live.robots import NAMES, make_robot
from tests.video.films import needs_models


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    return lifted_hand((320, 240))


@pytest.fixture
def server() -> Iterator[Server]:
    found = Server(Endpoint("127.0.0.1", 0))
    yield found
    found.close()


@pytest.fixture
def browser(tmp_path_factory: pytest.TempPathFactory, image: np.ndarray, server: Server) -> Iterator[Browser]:
    """With the page open."""
    needs_models()
    find_browser()
    folder = tmp_path_factory.mktemp("browser")
    with Browser(folder / "profile", write_y4m(folder / "camera.y4m", [image, image])) as found:
        server.open()
        found.go(server.urls[0])
        yield found


def arms(local_J33: np.ndarray) -> np.ndarray:
    """Directions (4, 3) of upper arms and forearms, the pelvis upright."""
    points_K3 = Skeleton().keypoints(torch.as_tensor(local_J33, dtype=torch.float32)[None])[0].numpy()
    rows = []
    for side in ("left", "right"):
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist")):
            bone_3 = (
                points_K3[KEYPOINT_NAMES.index(f"{side}_{end}")] - points_K3[KEYPOINT_NAMES.index(f"{side}_{start}")]
            )
            rows.append(bone_3 / np.linalg.norm(bone_3))
    return np.stack(rows)


def held_session(robot: LiveRobot, server: Server, browser: Browser) -> tuple[Session, Callable[..., None]]:
    """A session with the page, and what goes on with it until something is true."""
    config = LiveConfig(late=10.0)  # drawing by the CPU, a browser takes seconds for a picture
    session = Session.of(robot, [PageSource(server)], [PageSink(server)], config)
    session.open()

    def until(true: Callable[[], Any], what: str, seconds: float = 180.0) -> None:
        end = time.monotonic() + seconds
        while not true():
            assert time.monotonic() < end, f"{what}: {session.summary()}; {browser.complaints()}"
            session.step(time.monotonic())
            time.sleep(0.01)

    return session, until


def test_a_camera_moves_a_robot_while_the_key_is_held(
    browser: Browser, server: Server, image: np.ndarray, tmp_path: Path
) -> None:
    poses = list[np.ndarray]()

    def answer(local_J33: np.ndarray | None, moment: float) -> np.ndarray:
        if local_J33 is not None:
            poses.append(local_J33.copy())
        return np.full(len(NAMES), 0.2)

    session, until = held_session(make_robot(answer), server, browser)
    until(lambda: browser.ask("document.getElementById('state').textContent") == "stopped", "the page does not connect")
    browser.ask("document.getElementById('model').value = '0'; document.getElementById('camera').click()")
    until(lambda: len(poses) >= 3, "nobody is seen")
    assert not session.pilot.inbox.held and set(session.states) <= {"stopped"}

    browser.key("keyDown")  # once: models are loaded, and no slow browser has lost its connection by that
    until(lambda: session.pilot.inbox.held and session.states["following"] > 0, "the key changes nothing")
    until(lambda: browser.ask("document.querySelectorAll('#joints tr').length") == len(NAMES), "no joint is shown")
    browser.key("keyUp")
    until(lambda: not session.pilot.inbox.held, "letting go changes nothing")
    assert session.last is not None and (session.last.q_N != 0).any()
    assert session.counts["malformed"] == session.counts["version"] == session.counts["repeated"] == 0
    picture = "getComputedStyle(document.getElementById('picture')).visibility"
    assert browser.ask(picture) == "visible"
    browser.ask("document.getElementById('camera').click()")
    assert browser.ask(picture) == "hidden", "who is not seen any more is not shown either"
    assert browser.complaints() == []

    off = np.degrees(np.arccos(np.clip((arms(poses[-1]) * arms(pose_of(image))).sum(1), -1, 1)))
    assert np.median(off) < 8 and off.max() < 25, "MediaPipe's own program in the browser finds what ours does"
    session.close()


def test_a_camera_that_is_unplugged_stops_the_robot_softly(browser: Browser, server: Server) -> None:
    seen = list[float]()

    def answer(local_J33: np.ndarray | None, moment: float) -> np.ndarray:
        if local_J33 is not None:
            seen.append(moment)
        return np.full(len(NAMES), 0.2)

    session, until = held_session(make_robot(answer), server, browser)
    until(lambda: browser.ask("document.getElementById('state').textContent") == "stopped", "the page does not connect")
    browser.ask("document.getElementById('model').value = '0'; document.getElementById('camera').click()")
    until(lambda: len(seen) >= 3, "nobody is seen")  # before the key, as above
    browser.key("keyDown")
    until(lambda: session.states["following"] > 0, "the key changes nothing")
    browser.unplug()  # the key is still held
    notice = "document.getElementById('notice').textContent"
    until(lambda: not session.pilot.inbox.held, "the robot goes on without a camera")
    assert browser.ask(notice) == "the camera is gone"
    assert browser.ask("document.getElementById('camera').textContent") == "Start the camera"
    last = session.last
    assert last is not None
    until(lambda: session.last is not None and not session.last.velocity_N.any(), "it does not stop")
    assert session.last is not None and session.last.state == "stopped"
    assert np.abs(session.last.q_N - last.stop_N).max() < 1e-6, "it brakes to where it said that it would stand"

    browser.key("keyUp")
    browser.ask("document.getElementById('camera').click()")  # plugged in again
    until(lambda: browser.ask("document.getElementById('camera').textContent") == "Stop the camera", "it stays away")
    before = session.states["following"]
    browser.key("keyDown")
    until(lambda: session.states["following"] > before, "the camera is back and nothing moves")
    session.close()
    assert browser.complaints() == []


def test_without_models_the_page_says_what_to_do(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "none"))
    browser.ask("document.getElementById('camera').click()")
    browser.until("document.getElementById('notice').textContent.includes('mrhubo models')")
