"""Pictures as an MP4 film (H.264), by PyAV: https://pyav.org."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from PIL.Image import Image

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.lazy import import_optional

_QUALITY = "20"
"""H.264's constant rate factor: 18 is hardly to be told from the original, 23 is usual."""


def save_mp4(frames: Iterable[Image], path: Path, frame_rate: float) -> int:
    """Writes pictures of one size as a film, whole or not at all; they are taken one by one, so it may be long.

    Args:
        frames: the pictures.
        path: of the file; folders are made, and a file that is there is replaced.
        frame_rate: frames per second.

    Returns:
        How many there were.

    Raises:
        UserError: PyAV is not installed or cannot write H.264, or the disk refuses.
    """
    av = import_optional("av", "an .mp4 file needs the package av: pip install 'mrhubo[view]'")
    with atomic_path(path) as temporary:
        count = 0
        with av.open(str(temporary), "w", format="mp4") as container:
            try:
                stream = container.add_stream("libx264", rate=Fraction(frame_rate).limit_denominator(10_000))
            except (ValueError, av.FFmpegError) as error:
                raise UserError(f"{path}: this PyAV writes no H.264: {error}; name a .gif file") from error
            stream.pix_fmt, stream.options = "yuv420p", {"crf": _QUALITY, "preset": "veryfast"}
            for picture in frames:
                pixels_HW3 = _even(np.asarray(picture.convert("RGB")))
                if not count:
                    stream.height, stream.width = pixels_HW3.shape[:2]
                _write(container, stream, av.VideoFrame.from_ndarray(pixels_HW3, format="rgb24"))
                count += 1
            _write(container, stream, None)
    return count


def _write(container: Any, stream: Any, frame: Any) -> None:
    for packet in stream.encode(frame):
        container.mux(packet)


def _even(pixels_HW3: np.ndarray) -> np.ndarray:
    """A picture of even width and height, as colours are stored for four pixels together: a row or column of white
    more where it takes one.
    """
    height, width = pixels_HW3.shape[:2]
    return np.pad(pixels_HW3, [(0, height % 2), (0, width % 2), (0, 0)], constant_values=255)
