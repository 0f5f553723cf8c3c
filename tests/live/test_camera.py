"""A person before a camera, in Python: pictures become points in threads of the source's own, and the newest counts."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.inbox import Inbox
from mrhubo.live.loop import Session, run_session
from mrhubo.live.messages import Landmarks, Nobody
from mrhubo.live.plan import Plan
from mrhubo.live.sources.camera import CameraSource, to_content
from mrhubo.video import PoseEstimator
from mrhubo.video.estimator import Estimate
from tests.live.figures import lifted_hand, pose_of
from tests.live.robots import NAMES, make_robot
from tests.video.films import needs_models, numbered, write_video

CONFIG = LiveConfig(ramp_time=0.0, late=10.0, heartbeat_timeout=0.19, stop_time=0.5)


@pytest.fixture(scope="module")
def figure() -> np.ndarray:
    return lifted_hand((320, 240))


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory, figure: np.ndarray) -> Path:
    """1 s of a figure that stands still, and 0.4 s of nobody."""
    images = [figure] * 25 + [np.full_like(figure, 128)] * 10
    return write_video(tmp_path_factory.mktemp("films") / "film.mp4", images)


class FilmedCamera:
    """OpenCV's own reader of films, as a camera that is unplugged at the film's end."""

    def __init__(self, film: Any) -> None:
        self._film = film

    def __getattr__(self, name: str) -> Any:
        return getattr(self._film, name)

    def read(self) -> tuple[bool, np.ndarray | None]:
        time.sleep(0.04)
        return self._film.read()


@pytest.fixture
def cv2(monkeypatch: pytest.MonkeyPatch, film: Path) -> Any:
    """OpenCV, whose camera 0 is the film."""
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    open_film = cv2.VideoCapture
    monkeypatch.setattr(
        cv2, "VideoCapture", lambda device: FilmedCamera(open_film(str(film) if device == 0 else "/dev/no-camera"))
    )
    return cv2


def followed(source: CameraSource) -> tuple[Session, list[np.ndarray]]:
    """A session with a source, not begun, and the poses that will be answered in it."""
    poses = list[np.ndarray]()

    def answer(local_J33: np.ndarray | None, moment: float) -> np.ndarray:
        if local_J33 is not None:
            poses.append(local_J33.copy())
        return np.full(len(NAMES), 0.2)

    return Session.of(make_robot(answer), [source], [], CONFIG), poses


def no_thread_goes_on() -> None:
    """Of a source that is closed; a look at a picture that has begun is ended, however busy the machine is."""
    until = time.monotonic() + 180.0
    while [thread for thread in threading.enumerate() if thread.name.startswith("camera")]:
        assert time.monotonic() < until, "a thread goes on"
        time.sleep(0.01)


def test_a_film_is_followed_as_if_a_camera_saw_it(film: Path, figure: np.ndarray) -> None:
    needs_models()
    source = CameraSource(film=film, model="lite")
    assert source.notes() == [f"film: {film}, model lite"] and not source.has_heartbeat
    for _ in range(2):  # it may be opened again
        session, poses = followed(source)
        begun = time.monotonic()
        run_session(session)
        assert 1.3 < time.monotonic() - begun < 120.0, "a film is played at its own pace"
        assert session.states["following"] > 0 and 2 <= session.counts["frames"] <= 35
        assert not session.counts["malformed"] + session.counts["repeated"] + session.counts["late"]
        angle = np.arccos(np.clip((np.einsum("jab,jab->j", poses[-1], pose_of(figure)) - 1) / 2, -1, 1))
        assert np.degrees(angle).max() < 10.0


def test_a_camera_that_is_unplugged_stops_the_robot_and_ends_the_session(cv2: Any, figure: np.ndarray) -> None:
    needs_models()
    source = CameraSource(model="lite")
    session, poses = followed(source)
    with pytest.raises(UserError, match="camera 0: is gone; was it unplugged?"):
        run_session(session)
    assert poses and session.last is not None and session.last.state == "ended"
    assert not session.last.velocity_N.any(), "it has braked"
    no_thread_goes_on()


def test_the_newest_picture_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slow estimator leaves pictures out; how late an answer is does not grow."""
    needs_models()
    film = write_video(tmp_path / "film.mp4", numbered(24), rate=12)
    seen = list[tuple[float, int]]()

    def slow(self: PoseEstimator, image_HW3: np.ndarray) -> Estimate:
        seen.append((time.monotonic(), round((float(image_HW3[-1, -1].mean()) - 20) / 8)))
        time.sleep(0.3)
        return Estimate(np.full((33, 3), np.nan), np.zeros(33), 0.0, np.full((33, 2), np.nan))

    monkeypatch.setattr(PoseEstimator, "landmarks", slow)
    source, inbox = CameraSource(film=film, model="lite"), Inbox(10.0)
    source.open()
    while source.read(inbox, time.monotonic()):
        time.sleep(0.01)
    source.close()
    assert 2 <= len(seen) <= 9 and inbox.counts["frames"] == len(seen)
    assert isinstance(inbox.take_frame(), Nobody)
    assert seen[-1][1] == pytest.approx(23, abs=1), "the last picture is looked at"
    lag = np.array([moment - seen[0][0] - (number - seen[0][1]) / 12 for moment, number in seen])
    assert lag.max() < 1.5, "24 looks at every picture would take 5 s longer than the film"


def test_what_is_not_there_is_told_before_anything_is_begun(tmp_path: Path, film: Path, cv2: Any) -> None:
    needs_models()
    plan = Plan()
    for text, what in (
        ("camera:7", "camera 7: is not there"),
        (f"camera:{film}", "is no camera; they have the numbers"),
        ("camera:/dev/video99@lite", "camera /dev/video99: is no camera"),
        ("camera:12345678901234567890", "is no camera"),
        ("video", "names no film"),
        ("video:nowhere.mp4", "nowhere.mp4: there is no such file"),
        (f"video:{Path(__file__)}@heavy", "is no video"),
    ):
        with pytest.raises(UserError, match=what):
            plan.add_source(text)
    assert plan.sources == []
    plan.add_source("camera:0@lite")
    plan.add_source("camera@lite")
    plan.add_source(f"video:{film}@heavy")
    assert [source.notes()[0].split(", ")[-1] for source in plan.sources] == ["model lite", "model lite", "model heavy"]
    with pytest.raises(UserError, match="film"):
        plan.add_sink(f"file:{film}")
        plan.refuse_inputs([])


def test_a_film_whose_name_ends_as_a_model_does_is_played_and_a_wrong_model_is_told(
    film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_models()
    monkeypatch.chdir(tmp_path)
    plan = Plan()
    for name in ("dance@lite", "@heavy", "dance.mp4"):
        (tmp_path / name).write_bytes(film.read_bytes())
    for text, told in (
        ("dance@lite", "dance@lite, model full"),
        ("dance@lite@heavy", "dance@lite, model heavy"),
        ("@heavy", "@heavy, model full"),
    ):
        plan.add_source(f"video:{text}")
        assert plan.sources[-1].notes() == [f"film: {told}"]
    for text, what in (("video:dance.mp4@ful", "nearest: 'full'"), ("camera:0@huge", "available: "),
                       ("camera:@huge", "'huge'"), ("video:dance@me.mp4", "there is no such file")):  # fmt: skip
        with pytest.raises(UserError, match=what):
            plan.add_source(text)


def test_a_film_that_shows_one_picture_for_long_ends_at_once(tmp_path: Path, figure: np.ndarray) -> None:
    needs_models()
    path = write_video(tmp_path / "film.mkv", [figure, figure, figure], [0, 40, 60_000])
    session, _ = followed(CameraSource(film=path, model="lite"))
    run_session(session, 0.5)
    no_thread_goes_on()


def test_a_damaged_film_ends_the_session_with_a_sentence(film: Path, tmp_path: Path) -> None:
    needs_models()
    broken = tmp_path / "broken.mp4"
    data = bytearray(film.read_bytes())
    middle = data.index(b"mdat") + 4
    data[middle + (len(data) - middle) // 3 : -2000] = bytes(len(data) - 2000 - middle - (len(data) - middle) // 3)
    broken.write_bytes(data)
    session, _ = followed(CameraSource(film=broken, model="lite"))
    with pytest.raises(UserError, match=f"{broken}: is a damaged video|{broken}: breaks off"):
        run_session(session)
    assert session.last is not None and session.last.state == "ended"


def test_points_that_are_doubtful_are_left_out() -> None:
    visibility_K = np.linspace(0, 1, 33)
    point_K3 = np.random.default_rng(0).normal(size=(33, 3))
    found = Estimate(point_K3, visibility_K, 1.0, point_K3[:, :2])
    content = to_content(found, point_K3)
    assert isinstance(content, Landmarks) and not content.in_world
    assert set(content.sure) == set(content.points) and min(content.sure.values()) >= 0.3
    assert content.points["left_ankle"] == pytest.approx(point_K3[27])
    assert "left_shoulder" in content.points and "nose" not in content.points
    assert isinstance(to_content(found, np.full((33, 3), np.nan)), Nobody)
