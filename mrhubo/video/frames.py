"""The pictures of a video file, each with the moment at which it is shown.

FFmpeg reads them, through PyAV (https://pyav.basswood-io.com). It is told which kind of file it is, by the file's first
bytes, and given the open file: kinds that name other files or servers (playlists) are never tried.

Legend: H, W pixels.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import open_regular
from mrhubo.lazy import import_optional

_MAX_SIDE = 8_192
_MAX_PIXELS = 2**25
MAX_FRAMES = 200_000
"""Of a video; some two hours."""
_LAST = 1.0
"""For so long may the last frame be shown [s], in a file that tells how long it is, but not of how many frames."""
_MAX_BYTES = 64 * 2**30
_BEHIND = 0.04
"""A film whose next frame takes longer to read than this [s], and is over by then, goes on from there."""


class Frame(NamedTuple):
    """A picture of a video."""

    time: float
    """When it is shown, from the first one on [s]."""
    image_HW3: np.ndarray
    """RGB, uint8, upright as a player shows it."""


def video_kind(start: bytes) -> str | None:
    """FFmpeg's name for the kind of video that begins with these bytes; None where it is none that is read."""
    if start[4:8] in (b"ftyp", b"moov", b"mdat", b"wide") and start[8:11] not in (b"M4A", b"avi", b"hei", b"mif"):
        return "mov"
    if start.startswith(b"\x1aE\xdf\xa3"):
        return "matroska"
    if start[:4] == b"RIFF" and start[8:12] == b"AVI ":
        return "avi"
    return "yuv4mpegpipe" if start.startswith(b"YUV4MPEG2 ") else None


def frames(path: Path) -> Generator[Frame, None, None]:
    """The frames of a video, in the order in which they are shown. One that is shown no later than the one before is
    left out.

    Raises:
        UserError: PyAV is not installed; or the file is missing, no video, damaged, breaks off, or has frames that are
            too large or too many.
    """
    av = import_optional("av", f"{path}: videos need PyAV: pip install 'mrhubo[video]'")
    with open_regular(path, _MAX_BYTES) as handle:
        kind = video_kind(handle.read(64))
        if kind is None:
            raise UserError(f"{path}: is no video that is read here; expected MP4, MOV, Matroska, WebM, AVI or Y4M")
        handle.seek(0)
        try:
            with av.open(handle, format=kind, metadata_errors="replace") as container:
                if not container.streams.video:
                    raise UserError(f"{path}: has no pictures")
                yield from _decoded(path, container)
        except (av.FFmpegError, ValueError, OverflowError, MemoryError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UserError(f"{path}: is a damaged video, or one that cannot be read: {reason}") from error


def as_shown(
    film: Iterator[Frame], clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], object] = time.sleep
) -> Iterator[Frame]:
    """The frames of a film, each when a player would show it; those that are over when they are asked for are left out.
    Their times are those of the clock [s]. A film that is read more slowly than it plays is shown more slowly.
    """
    waiting = next(film, None)
    if waiting is None:
        return
    begun = asked = clock()
    for frame in film:
        now = clock()
        if now >= begun + frame.time and now - asked > _BEHIND:
            begun = now - waiting.time
        if now < begun + frame.time:
            yield _when_due(waiting, begun, clock, sleep)
            asked = clock()
        waiting = frame
    yield _when_due(waiting, begun, clock, sleep)


def _when_due(frame: Frame, begun: float, clock: Callable[[], float], sleep: Callable[[float], object]) -> Frame:
    due = begun + frame.time
    sleep(max(0.0, due - clock()))
    return Frame(due, frame.image_HW3)


def _decoded(path: Path, container) -> Iterator[Frame]:  # noqa: ANN001 (importing its type takes PyAV)
    stream = container.streams.video[0]
    if stream.codec_context is None:
        raise UserError(f"{path}: its pictures are coded in a way that FFmpeg does not know, or it is damaged")
    _check_size(path, stream.codec_context.width, stream.codec_context.height)
    rate = float(stream.average_rate or 0)
    count, first, last = 0, None, -np.inf
    for frame in container.decode(stream):
        _check_size(path, frame.width, frame.height)
        if frame.time is None and not rate > 0:
            raise UserError(f"{path}: does not tell when its frames are shown")
        time = count / rate if frame.time is None else float(frame.time)
        count += 1
        if count > MAX_FRAMES:
            raise UserError(f"{path}: has more than {MAX_FRAMES:,} frames; cut it into shorter ones")
        if time <= last:
            continue
        first, last = time if first is None else first, time
        yield Frame(time - first, _upright(frame.to_ndarray(format="rgb24"), frame.rotation))
    if not count:
        raise UserError(f"{path}: has no pictures, or breaks off before the first")
    if count < stream.frames:
        raise UserError(f"{path}: breaks off after {count:,} of {stream.frames:,} frames; was it copied to its end?")
    told = (container.duration or 0) / 1e6
    if len(container.streams) == 1 and last - (first or 0.0) < told - _LAST:
        raise UserError(f"{path}: breaks off after {last:.3g} of {told:.3g} s; was it copied to its end?")


def _upright(image_HW3: np.ndarray, degrees: int) -> np.ndarray:
    """Turned counterclockwise, as phones ask for that film upright with a sensor that lies."""
    return np.ascontiguousarray(np.rot90(image_HW3, round(degrees / 90)))


def _check_size(path: Path, width: int, height: int) -> None:
    if max(width, height) > _MAX_SIDE or width * height > _MAX_PIXELS:
        raise UserError(
            f"{path}: its frames have {width} x {height} pixels; at most {_MAX_SIDE} on a side and {_MAX_PIXELS:,} in"
            " all are read"
        )
