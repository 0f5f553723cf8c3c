"""Videos for tests: of a pattern that tells which frame it is, and of a figure that we draw."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.video.models import find_models


def needs_models() -> None:
    """Skips a test where the models have not been fetched, or LiteRT is not installed."""
    pytest.importorskip("ai_edge_litert", reason="ai-edge-litert is not installed")
    try:
        find_models()
    except UserError as error:
        pytest.skip(str(error))


def write_video(
    path: Path,
    images: Sequence[np.ndarray],
    times_ms: Sequence[int] | None = None,
    rate: int = 25,
    codec: str = "mpeg4",
) -> Path:
    """Pictures (H, W, 3) as a video, at given times or at a rate."""
    av = pytest.importorskip("av", reason="PyAV is not installed")
    height, width = images[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        if codec == "mpeg4":
            stream.bit_rate = 4_000_000
        if times_ms is not None:
            stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
        for number, image_HW3 in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image_HW3, format="rgb24")
            frame.pts = number if times_ms is None else times_ms[number]
            frame.time_base = Fraction(1, rate) if times_ms is None else Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def numbered(count: int, width: int = 96, height: int = 64) -> list[np.ndarray]:
    """Grey pictures, each brighter than the one before, with a white upper left quarter."""
    images = []
    for number in range(count):
        image_HW3 = np.full((height, width, 3), 20 + 8 * number, np.uint8)
        image_HW3[: height // 2, : width // 2] = 255
        images.append(image_HW3)
    return images
