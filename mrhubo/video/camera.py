"""The pictures of a camera of this machine, by OpenCV (https://docs.opencv.org/4.x/d8/dfe/classcv_1_1VideoCapture.html):
V4L2 on Linux, AVFoundation on macOS, Media Foundation on Windows. PyAV's wheels read no cameras on Linux.

Legend: H, W pixels.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.lazy import import_optional
from mrhubo.video.frames import Frame

_SIZE = 640, 480
"""Pixels that are asked for, and more than the models look at; a camera has what is nearest."""
_DIGITS = 3
_GONE_S, _AGAIN_S = 0.5, 0.01
"""A camera that gives no picture for so long is gone; until then it is asked again after so long [s]."""
_HIDDEN_BUFFER = 1
"""Pictures that a driver keeps for us: with more of them the oldest comes first."""


class Camera:
    """A camera that is open."""

    def __init__(self, device: str = "0") -> None:
        """Opens it.

        Args:
            device: its number, or its path, as `/dev/video2`.

        Raises:
            UserError: OpenCV is not installed; there is no such camera, or it gives no picture, as one that another
                program has.
        """
        cv2 = import_optional("cv2", "a camera needs OpenCV: pip install 'mrhubo[camera]'")
        with contextlib.suppress(AttributeError):  # it tells of every camera that is not there
            cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
        self.device, self._cv2 = device, cv2
        is_number = device.isdecimal() and len(device) <= _DIGITS
        if not is_number and not Path(device).is_char_device():
            raise UserError(
                f"camera {shortened(device)}: is no camera; they have the numbers 0, 1, ..., and on Linux the paths"
                " /dev/video0, ..."
            )
        self._capture: Any = cv2.VideoCapture(int(device) if is_number else device)
        if not self._capture.isOpened():
            found = listed(str(path) for path in Path("/dev").glob("video*"))
            hint = "" if found == "none" else f"; this machine has {found}"
            raise UserError(f"camera {device}: is not there, or another program has it{hint}")
        for setting, value in (
            (cv2.CAP_PROP_FRAME_WIDTH, _SIZE[0]), (cv2.CAP_PROP_FRAME_HEIGHT, _SIZE[1]),
            (cv2.CAP_PROP_BUFFERSIZE, _HIDDEN_BUFFER),
        ):  # fmt: skip
            self._capture.set(setting, value)
        try:
            image_HW3 = self._read()
            if image_HW3 is None:
                raise UserError(
                    f"camera {device}: gives no picture; another program may have it, or may not be allowed to"
                )
        except UserError:
            self.close()
            raise
        self.size = image_HW3.shape[1], image_HW3.shape[0]
        """Width and height of its pictures [pixels]."""

    def frames(self, clock: Callable[[], float] = time.monotonic) -> Iterator[Frame]:
        """Its pictures as they come, each with the moment on a clock [s], until it is closed. One that does not come,
        as where a cable has a loose contact, is left out.

        Raises:
            UserError: it is gone, or gives what is no picture.
        """
        last = clock()
        while True:
            image_HW3 = self._read()
            if image_HW3 is not None:
                last = clock()
                yield Frame(last, image_HW3)
            elif clock() - last < _GONE_S:
                time.sleep(_AGAIN_S)
            else:
                raise UserError(f"camera {self.device}: is gone; was it unplugged?")

    def _read(self) -> np.ndarray | None:
        try:
            came, image_HW3 = self._capture.read()
        except (self._cv2.error, OSError):
            return None
        if not came or image_HW3 is None or not image_HW3.size:
            return None
        if image_HW3.dtype != np.uint8:
            raise UserError(f"camera {self.device}: gives pictures of {image_HW3.dtype}; only those of uint8 are read")
        return self._cv2.cvtColor(image_HW3, self._cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """Gives it back; may be called twice."""
        self._capture.release()
