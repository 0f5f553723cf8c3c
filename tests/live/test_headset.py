"""The page in the browser of a headset: a real browser, with a stand-in for the device (`navigator.xr`)."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch

pytest.importorskip("websockets")

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.joints import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.live.body import Body
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Landmarks, Nobody
from mrhubo.live.point_sets import POINT_SETS
from mrhubo.live.server import Server
from mrhubo.motion.orientations import HEAD_POINTS
from tests.browser import Browser, find_browser

# What the page uses of WebXR; `fake` says what the device sees, and is given the session.
DEVICE = """
window.fake = {modes: ["immersive-vr"], body: null, head: null};
class FakeSession extends EventTarget {
  visibilityState = "visible";
  async updateRenderState() {}
  async requestReferenceSpace(kind) { return kind; }
  requestAnimationFrame(done) {
    setTimeout(() => done(performance.now(), {
      body: fake.body && new Map(Object.entries(fake.body)),
      getPose: (place) => place && {transform: {position: {x: place[0], y: place[1], z: place[2]}}},
      getViewerPose: () => fake.head && {transform: {matrix: fake.head}},
    }), 11);
  }
  async end() { fake.session = null; this.dispatchEvent(new Event("end")); }
  tell(kind, more) { this.dispatchEvent(Object.assign(new Event(kind), more)); }
}
window.XRWebGLLayer = class { framebuffer = null; };
Object.defineProperty(navigator, "xr", {value: {
  isSessionSupported: async (mode) => fake.modes.includes(mode),
  requestSession: async (mode, {requiredFeatures}) => {
    if (fake.refuses) throw new DOMException("no", "NotSupportedError");
    fake.asked = [mode, ...requiredFeatures];
    return (fake.session = new FakeSession());
  },
}});
"""
LOOK = (0.0, 0.5, 0.1)
LEFT, RIGHT = "fake.left ??= {}", "fake.right ??= {}"


@pytest.fixture(scope="module")
def browser(open_server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    find_browser()
    with Browser(tmp_path_factory.mktemp("browser") / "profile") as found:
        found.call("Page.addScriptToEvaluateOnNewDocument", source=DEVICE)
        found.go(open_server.urls[0])
        found.until("document.getElementById('state').textContent === 'connected'")
        yield found


class Listener:
    """What a session hears of the page."""

    def __init__(self, server: Server) -> None:
        self.server, self.inbox = server, Inbox(10.0)

    def until(self, true: Any, what: str) -> None:
        end = time.monotonic() + 120
        while not true():
            assert time.monotonic() < end, what
            self.server.take(self.inbox, time.monotonic())
            time.sleep(0.01)

    def holds(self, wanted: bool) -> None:
        self.until(lambda: self.inbox.held == wanted, f"held is not {wanted}")

    def hears(self, kind: type) -> Any:
        """The next frame of that kind."""
        found = []

        def heard() -> bool:
            found[:] = [self.inbox.take_frame()]
            return isinstance(found[0], kind)

        self.until(heard, f"no {kind.__name__} comes")
        return found[0]


@pytest.fixture
def listener(browser: Browser, open_server: Server) -> Iterator[Listener]:
    """In the session."""
    browser.ask("document.getElementById('headset-start').click()")
    browser.until("fake.session && document.getElementById('headset-start').textContent === 'Leave'")
    yield Listener(open_server)
    browser.ask("fake.session?.end()")
    browser.until("document.getElementById('headset-start').textContent !== 'Leave'")


def turn(vector: tuple[float, ...]) -> torch.Tensor:
    return rotation.axis_angle_to_matrix(torch.tensor([vector], dtype=torch.float32))[0]


def person() -> tuple[np.ndarray, dict[str, list[float]], list[float]]:
    """Local rotations (21, 3, 3) of a person who looks to the left, and what a headset sees of them."""
    local_J33 = torch.eye(3).repeat(21, 1, 1)
    for joint, vector in (
        ("left_shoulder", (0, 0, -1.2)),
        ("left_elbow", (0, -0.9, 0)),
        ("right_shoulder", (0, 0, 1.2)),
        ("neck", LOOK),
    ):
        local_J33[POSED_JOINT_NAMES.index(joint)] = turn(vector)
    points_K3 = Skeleton().keypoints(local_J33[None])[0].numpy()
    turned = np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]])  # faces along -z, as who begins a session does
    ours = dict(zip(KEYPOINT_NAMES, points_K3 @ turned.T + [0.3, 0.9, -0.2], strict=True))
    theirs = POINT_SETS["webxr"].theirs
    assert theirs is not None
    body = {name: ours[own].tolist() for name, own in theirs.items() if own in ours and own not in HEAD_POINTS}
    pose_44 = np.eye(4)
    pose_44[:3, :3] = turned @ turn(LOOK).numpy() @ turned
    pose_44[:3, 3] = ours["head"]
    return local_J33.numpy(), body, pose_44.T.flatten().tolist()


def test_the_body_that_the_headset_sees_is_the_robots(browser: Browser, listener: Listener) -> None:
    local_J33, body, head = person()
    browser.ask(f"fake.body = {json.dumps(body)}; fake.head = {json.dumps(head)}")
    assert browser.ask("fake.asked") == ["immersive-vr", "local-floor", "body-tracking"]
    landmarks = listener.hears(Landmarks)
    seen = Body().see(landmarks.points, landmarks.sure)
    assert seen is not None
    both = torch.stack([torch.as_tensor(seen.local_J33), torch.as_tensor(local_J33)])
    seen_J33, true_J33 = Skeleton().global_rotations(both)
    off_J = torch.rad2deg(rotation.geodesic_distance(seen_J33, true_J33))
    for joint in ("left_elbow", "right_elbow", "head", "spine3"):
        assert off_J[JOINT_NAMES.index(joint)] < 3, joint
    browser.ask("fake.body = null")
    listener.hears(Nobody)
    assert browser.complaints() == []


def test_a_trigger_or_a_grip_is_the_button(browser: Browser, listener: Listener) -> None:
    def tell(kind: str, hand: str = LEFT) -> None:
        browser.ask(f"fake.session.tell('{kind}', {{inputSource: {hand}}})")

    listener.holds(False)
    tell("selectstart")
    listener.holds(True)
    tell("squeezestart")
    tell("selectstart", RIGHT)
    tell("selectend")
    tell("squeezeend")
    listener.holds(True)  # the other hand's
    tell("selectend", RIGHT)
    listener.holds(False)
    tell("squeezestart")
    listener.holds(True)
    browser.ask("fake.session.visibilityState = 'hidden'; fake.session.tell('visibilitychange', {})")
    listener.holds(False)
    browser.ask("fake.session.visibilityState = 'visible'; fake.session.tell('visibilitychange', {})")
    time.sleep(0.2)
    listener.holds(False)  # what is still pressed does not count any more
    tell("squeezeend")
    tell("squeezestart")
    listener.holds(True)
    browser.ask(f"fake.session.tell('inputsourceschange', {{removed: [{LEFT}]}})")
    listener.holds(False)
    tell("selectstart")
    listener.holds(True)
    browser.ask("fake.session.end()")
    listener.holds(False)


def test_a_browser_without_a_headset_shows_nothing_and_one_without_bodies_says_so(browser: Browser) -> None:
    assert browser.ask("document.getElementById('headset').hidden") is False
    browser.ask("fake.refuses = true; document.getElementById('headset-start').click()")
    browser.until("document.querySelector('#headset [role=alert]').textContent.includes('tracks no bodies')")
    browser.ask("fake.refuses = false")
    browser.ask("import('./headset.js').then(({Headset}) => { fake.modes = []; fake.none = document.createElement('p');"
                " fake.none.hidden = true; new Headset(fake.none, {}); })")  # fmt: skip
    time.sleep(0.1)
    assert browser.ask("fake.none.hidden") is True
