"""A camera of this machine, or a film that is played, in which an estimator finds a person (`mrhubo.video`).

Two threads of its own: one takes pictures, one finds the body in the newest. A slow estimator leaves pictures out, and
none waits.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Landmarks, Message, Nobody
from mrhubo.live.named import NamedSource
from mrhubo.live.point_sets import POINT_SETS
from mrhubo.video.camera import Camera
from mrhubo.video.estimator import Estimate, PoseEstimator
from mrhubo.video.frames import Frame, as_shown, frames
from mrhubo.video.smoothing import OneEuro

_NAMES = POINT_SETS["mediapipe"].names or ()
_PATIENCE = 1.0
"""For so long may a picture, or a look at one, take at the end [s]."""


def to_content(found: Estimate, point_K3: np.ndarray) -> Landmarks | Nobody:
    """What a picture tells of a person, by our names.

    Args:
        found: what the estimator found.
        point_K3: its points (33, 3) [m], smoothed.
    """
    if not np.isfinite(point_K3).all():
        return Nobody()
    told = [
        (name, (x, y, z), sure)
        for name, (x, y, z), sure in zip(_NAMES, point_K3.tolist(), found.visibility_K.tolist(), strict=True)
        if name != "-"
    ]
    return Landmarks.of(told)


class CameraSource(NamedSource):
    """A person before a camera, or in a film as if it were one."""

    has_heartbeat = False

    def __init__(self, device: str = "0", film: Path | None = None, model: str = "full") -> None:
        """Looks whether all is there.

        Args:
            device: the camera, as for `mrhubo.video.camera.Camera`.
            film: a video file in its place, played once.
            model: the estimator's: `lite`, `full` or `heavy`.

        Raises:
            UserError: the camera or the film, a model or a library is not there.
        """
        self._device, self._film, self._model = device, film, model
        self._camera: Camera | None = None
        self._threads: list[threading.Thread] = []
        self._stop, self._lock = threading.Event(), threading.Condition()
        self._picture: Frame | None = None
        self._seen: tuple[float, Landmarks | Nobody] | None = None
        self._fault: Exception | None = None
        self._session, self._number = "", 0
        if film is None:
            Camera(device).close()
        else:
            with contextlib.closing(frames(film)) as pictures:
                next(pictures)
        self._estimator = PoseEstimator(model)

    def notes(self) -> list[str]:
        """What is looked at."""
        what = f"camera {self._device}" if self._film is None else f"film: {self._film}"
        if self._camera is not None:
            what += f": {self._camera.size[0]} x {self._camera.size[1]} pixels"
        return [f"{what}, model {self._model}"]

    def open(self) -> None:
        """Begins to look.

        Raises:
            UserError: the camera is not there any more.
        """
        self._stop = threading.Event()  # of this session: a thread that an earlier one left in a driver stays stopped
        self._picture = self._seen = self._fault = None
        self._session, self._number = str(time.time_ns()), 0
        self._estimator.reset()
        if self._film is not None:
            pictures = as_shown(frames(self._film), sleep=self._stop.wait)
        else:
            self._camera = Camera(self._device)
            pictures = self._camera.frames()
        self._threads = [
            threading.Thread(target=self._guarded, args=(self._stop, *work), name=f"camera {name}", daemon=True)
            for name, *work in (("pictures", self._take, pictures), ("points", self._look))
        ]
        for thread in self._threads:
            thread.start()

    def _guarded(self, stop: threading.Event, work: Callable[..., None], *arguments: Any) -> None:
        """Does it; an error is the session's, which learns of it when it reads."""
        try:
            work(stop, *arguments)
        except Exception as error:
            if not stop.is_set():
                self._fault = self._fault or error
        finally:
            with self._lock:
                self._lock.notify_all()

    def _take(self, stop: threading.Event, pictures: Iterator[Frame]) -> None:
        for picture in pictures:
            if stop.is_set():
                return
            with self._lock:
                self._picture = picture
                self._lock.notify_all()

    def _look(self, stop: threading.Event) -> None:
        taker, one_euro, last = self._threads[0], OneEuro(), None
        while not stop.is_set():
            with self._lock:
                self._lock.wait_for(lambda: self._picture or stop.is_set() or not taker.is_alive(), 0.1)
                picture, self._picture = self._picture, None
                if picture is None and not taker.is_alive():
                    return
            if picture is not None:
                found = self._estimator.landmarks(picture.image_HW3)
                rate = 0.0 if last is None else 1.0 / max(picture.time - last, 1e-3)
                last = picture.time
                with self._lock:
                    self._seen = picture.time, to_content(found, one_euro.step(found.point_K3, rate))

    def read(self, inbox: Inbox, now: float) -> bool:
        """Gives what the newest picture tells, once; False after a film's last.

        Raises:
            UserError: the camera is gone, or the film is damaged.
        """
        is_over = not any(thread.is_alive() for thread in self._threads)
        with self._lock:
            seen, self._seen = self._seen, None
        if seen is not None:
            self._number += 1
            inbox.offer(Message(self._session, self._number, *seen), self._session, now)
        if self._fault is not None:
            raise self._fault
        return not is_over

    def close(self) -> None:
        """Gives the camera back."""
        self._stop.set()
        for thread in self._threads:
            thread.join(_PATIENCE)
        if self._camera is not None and not any(thread.is_alive() for thread in self._threads):
            self._camera.close()  # where a driver hangs, it is left to the end of the process
        self._camera, self._threads = None, []
