"""Whether there are bodies in a picture, and where: BlazePose's detector.

V. Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020 (https://arxiv.org/abs/2006.10204). The
numbers are the options of `mediapipe/modules/pose_detection/pose_detection_cpu.pbtxt`, and what is done with them is
that of `ssd_anchors_calculator.cc`, `tensors_to_detections_calculator.cc` and `non_max_suppression_calculator.cc` in
https://github.com/google-ai-edge/mediapipe (Apache-2.0).

Legend: A anchors, S side of the network's input in pixels.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.video.interpreter import Network
from mrhubo.video.region import Region

SIDE = 224
_STRIDES = (8, 16, 32, 32, 32)
_PER_LAYER = 2
"""Anchors of each layer at a place, both of the same size: one has the layer's scale, one a scale between two layers,
and a fixed size takes the place of both."""
_SURE = 0.5
_OVERLAP = 0.3
_CLOSER, _FILLS, _WIDER, _WANDERS = 2, 0.6, 1.3, 0.5
"""How often a body is looked at again whose square is smaller than this share of a picture's longer side, how much
wider, and how far off, in sides of the smaller square, the same one is then."""
_LONGEST = 8
"""Parts of a picture that is longer, in sides of a part, would be too many."""
_HIPS, _CIRCLE = 0, 1
"""Of the four points that each anchor tells: the middle of the hips, and where the circle around them that holds the
whole body is straight above."""


def anchors() -> np.ndarray:
    """The middles (2254, 2) of the anchors, x and y from 0 to 1: rows from top to bottom in each group of layers of one
    stride, from left to right in a row, all of the group's anchors at one place together.
    """
    grids = []
    for stride in dict.fromkeys(_STRIDES):
        cells = -(-SIDE // stride)
        middle = (np.arange(cells) + 0.5) / cells
        grid_X2 = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
        grids.append(np.repeat(grid_X2, _PER_LAYER * _STRIDES.count(stride), axis=0))
    return np.concatenate(grids)


class Detector:
    """Finds bodies in a picture."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Raises a UserError where the file is no such network; arguments as for `Network`."""
        self._network = Network(path, threads)
        self._anchor_A2 = anchors()
        self._network.check((len(self._anchor_A2), 12), (len(self._anchor_A2), 1))

    def find(self, image_HW3: np.ndarray) -> list[Region]:
        """The regions of bodies in a picture (H, W, 3), RGB, uint8, the surest first; none where there is nobody, or
        only bodies that are less tall than a fifth of the longer side.
        """
        whole = Region.whole(image_HW3.shape[1], image_HW3.shape[0])
        return self._look(image_HW3, whole)

    def find_small(self, image_HW3: np.ndarray) -> list[Region]:
        """The same of bodies in parts of a picture, squares of its shorter side, or else of half of it: of the first
        part in which there are some. Takes some twenty times as long where there is nobody.
        """
        height, width = image_HW3.shape[:2]
        for side in (min(height, width), min(height, width) // 2):
            if not 0 < max(height, width) <= _LONGEST * side:
                break
            for part in parts_of(width, height, side):
                if found := self._look(image_HW3, part):
                    return found
        return []

    def closer(self, image_HW3: np.ndarray, region: Region) -> Region:
        """The same body's, of a square that it fills better, if it is small in a picture: the network tells the hips of
        those in wrong places.
        """
        for _ in range(_CLOSER):
            if region.size > _FILLS * max(image_HW3.shape[:2]):
                break
            again = self._look(image_HW3, Region(region.x, region.y, _WIDER * region.size))
            if not again or region.apart(nearest := min(again, key=region.apart)) > _WANDERS:
                break
            region = nearest
        return region

    def _look(self, image_HW3: np.ndarray, square: Region) -> list[Region]:
        """The regions of the bodies that the network finds in a square."""
        found = self._network(2 * square.crop(image_HW3, SIDE) - 1)
        bodies_X42 = bodies(found["Identity"], found["Identity_1"][:, 0], self._anchor_A2)
        regions = (Region.around(*square.to_picture(points_42[[_HIPS, _CIRCLE]])) for points_42 in bodies_X42)
        return [region for region in regions if region is not None]


def parts_of(width: int, height: int, side: int) -> list[Region]:
    """Squares of a picture that cover half of each other, from left to right and from top to bottom."""
    across, down = (
        np.linspace(side / 2, length - side / 2, int(np.ceil(2 * (length - side) / side)) + 1)
        for length in (width, height)
    )
    return [Region(float(x), float(y), float(side)) for y in down for x in across]


def bodies(told_A12: np.ndarray, logit_A: np.ndarray, anchor_A2: np.ndarray) -> list[np.ndarray]:
    """The points (4, 2), 0 to 1, of detections, the surest first: each averaged with those whose boxes overlap its own,
    as much as they are sure, and that do not count again.

    Args:
        told_A12: middle, size and four points of boxes, from the anchors, in pixels of the network's input.
        logit_A: how sure the network is.
        anchor_A2: `anchors()`.
    """
    sure_A = 1 / (1 + np.exp(-np.clip(logit_A.astype(np.float64), -100, 100)))
    sure_A = np.where(np.isfinite(told_A12).all(1), sure_A, 0.0)
    chosen_X = np.flatnonzero(sure_A >= _SURE)
    told_X62 = told_A12[chosen_X].astype(np.float64).reshape(-1, 6, 2) / SIDE
    left_X = sure_A[chosen_X]
    middle_X2, size_X2 = told_X62[:, 0] + anchor_A2[chosen_X], told_X62[:, 1]
    point_X42 = told_X62[:, 2:] + anchor_A2[chosen_X, None]
    low_X2, high_X2 = middle_X2 - size_X2 / 2, middle_X2 + size_X2 / 2
    area_X = np.clip(size_X2, 0, None).prod(1)
    found = []
    while left_X.any():
        best = int(left_X.argmax())
        common_X = np.clip(np.minimum(high_X2, high_X2[best]) - np.maximum(low_X2, low_X2[best]), 0, None).prod(1)
        same_X = common_X > _OVERLAP * (area_X + area_X[best] - common_X)
        same_X[best] = True
        weight_X = np.where(same_X, left_X, 0.0)
        found.append(np.einsum("x,xpc->pc", weight_X, point_X42) / weight_X.sum())
        left_X = np.where(same_X, 0.0, left_X)
    return found
