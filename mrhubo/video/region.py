"""A square of a picture, turned as the body in it: what a network sees, and where what it finds is in the picture.

Coordinates of pictures are pixels: x to the right, y down, (0, 0) the upper left corner of the first pixel.

Legend: H, W pixels, S side of a network's input in pixels, K points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from PIL import Image

_LARGER = 1.25
"""Side over the diameter of a body's circle, as in MediaPipe's graphs."""


@dataclass(frozen=True)
class Region:
    """A square."""

    x: float
    """Middle [pixels]."""
    y: float
    size: float
    """Side [pixels]."""
    angle: float = 0.0
    """How far its upward side is turned clockwise from the picture's [rad]."""

    @classmethod
    def whole(cls, width: int, height: int) -> Region:
        """The smallest that holds a whole picture."""
        return cls(width / 2, height / 2, float(max(width, height)))

    @classmethod
    def around(cls, hips_2: np.ndarray, circle_2: np.ndarray) -> Region | None:
        """That of a body: a little larger than the circle around the hips through a point straight above them that the
        networks find; None where the two are one, or no numbers.

        MediaPipe's `pose_detection_to_roi.pbtxt` and `alignment_points_to_rects_calculator.cc`.
        """
        right, down = (circle_2 - hips_2).tolist()
        radius = math.hypot(right, down)
        if not math.isfinite(radius + float(hips_2.sum())) or radius < 1:
            return None
        return cls(float(hips_2[0]), float(hips_2[1]), 2 * radius * _LARGER, math.atan2(right, -down))

    def apart(self, other: Region) -> float:
        """How far the middle of another is away, in sides of the smaller one."""
        return math.hypot(self.x - other.x, self.y - other.y) / min(self.size, other.size)

    def crop(self, image_HW3: np.ndarray, side: int) -> np.ndarray:
        """What is in it (S, S, 3), 0 to 1, float32; black beyond the picture's edges.

        Where the picture is much finer than the crop, its pixels are averaged first.

        Args:
            image_HW3: RGB, uint8.
            side: of the crop in pixels, S.
        """
        height, width = image_HW3.shape[:2]
        reach = self.size / 2 * (abs(math.cos(self.angle)) + abs(math.sin(self.angle))) + 2
        left, right = (round(min(max(self.x + way * reach, 0), width)) for way in (-1, 1))
        top, bottom = (round(min(max(self.y + way * reach, 0), height)) for way in (-1, 1))
        if right <= left or bottom <= top:
            return np.zeros((side, side, 3), np.float32)
        part = Image.fromarray(np.ascontiguousarray(image_HW3[top:bottom, left:right]))
        finer = max(1, int(self.size / side))
        if finer > 1:
            part = part.reduce(finer)
        step = self.size / side / finer
        cos, sin = step * math.cos(self.angle), step * math.sin(self.angle)
        x, y = (self.x - left) / finer, (self.y - top) / finer
        way = (cos, -sin, x - side / 2 * (cos - sin), sin, cos, y - side / 2 * (sin + cos))
        crop = part.transform((side, side), Image.Transform.AFFINE, way, Image.Resampling.BILINEAR)
        return np.asarray(crop, np.float32) / np.float32(255)

    def to_picture(self, share_K2: np.ndarray) -> np.ndarray:
        """Where points (K, 2) of the crop, 0 to 1 from its upper left corner, are in the picture [pixels]."""
        turned_K2 = self.turn(share_K2 - 0.5)
        return turned_K2 * self.size + np.array([self.x, self.y])

    def turn(self, vector_KX: np.ndarray) -> np.ndarray:
        """Vectors (K, 2 or more) as the crop sees them, turned as the picture does: the first two numbers are."""
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        turned_KX = vector_KX.copy()
        turned_KX[:, 0] = cos * vector_KX[:, 0] - sin * vector_KX[:, 1]
        turned_KX[:, 1] = sin * vector_KX[:, 0] + cos * vector_KX[:, 1]
        return turned_KX
