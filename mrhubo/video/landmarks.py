"""Where the points of a body are that fills a square of a picture: BlazePose GHUM's network for landmarks.

V. Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020 (https://arxiv.org/abs/2006.10204); I.
Grishchenko et al., "BlazePose GHUM Holistic: Real-time 3D Human Landmarks and Pose Estimation", 2022
(https://arxiv.org/abs/2206.11678). Options and steps: `mediapipe/modules/pose_landmark/tensors_to_pose_landmarks_and_
segmentation.pbtxt`, `refine_landmarks_from_heatmap_calculator.cc`, `world_landmark_projection_calculator.cc` in
https://github.com/google-ai-edge/mediapipe (Apache-2.0).

Legend: P = 39 points that the network tells: K = 33 on the body, two that tell where it is, four of the hands.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrhubo.video.interpreter import Network
from mrhubo.video.region import Region

SIDE = 256
POINTS = 33
"""K: in the order of `mrhubo.motion.readers.keypoint_sets.SETS["MediaPipe"]`."""
_TOLD = 39
_HEAT = 64
_HIPS, _CIRCLE = 33, 34
_REACH = 3
"""Cells of the heat map to each side of a point that refine it."""
_SURE = 0.5


class Landmarks(NamedTuple):
    """What the network finds."""

    point_K3: np.ndarray
    """In space [m], float64: x to the right of the picture, y up, z towards the camera; from the middle of the hips."""
    visibility_K: np.ndarray
    """How likely each is seen, and hidden by nothing, 0 to 1."""
    pixel_K2: np.ndarray
    """In the picture [pixels]."""
    presence: float
    """How sure the network is that there is a body in its square, 0 to 1."""
    region: Region | None
    """Where the body is, for the next picture."""


class LandmarkNetwork:
    """Finds the points of a body in a region."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Raises a UserError where the file is no such network; arguments as for `Network`."""
        self._network = Network(path, threads)
        mask = (SIDE, SIDE, 1)
        self._network.check((5 * _TOLD,), (1,), mask, (_HEAT, _HEAT, _TOLD), (3 * _TOLD,))

    def find(self, image_HW3: np.ndarray, region: Region) -> Landmarks:
        """The landmarks of the body in a region of a picture (H, W, 3), RGB, uint8."""
        found = self._network(region.crop(image_HW3, SIDE))
        told_P5 = found["Identity"].reshape(_TOLD, 5).astype(np.float64)
        share_P2 = refined(told_P5[:, :2] / SIDE, found["Identity_3"])
        pixel_P2 = region.to_picture(share_P2)
        world_P3 = region.turn(found["Identity_4"].reshape(_TOLD, 3).astype(np.float64))
        return Landmarks(
            world_P3[:POINTS] * [1.0, -1.0, -1.0],
            _sigmoid(told_P5[:POINTS, 3]),
            pixel_P2[:POINTS],
            float(found["Identity_1"][0]),
            Region.around(pixel_P2[_HIPS], pixel_P2[_CIRCLE]),
        )


def refined(share_P2: np.ndarray, heat_YXP: np.ndarray) -> np.ndarray:
    """Points (P, 2), 0 to 1, each at the centre of its heat map's cells around it, where one of those is sure of it."""
    cell_P2 = np.clip(np.nan_to_num(share_P2) * _HEAT, -1e6, 1e6).astype(np.int64)
    near = np.arange(-_REACH, _REACH + 1)
    x_P7, y_P7 = (cell_P2[:, axis, None] + near for axis in (0, 1))
    inside_P77 = ((y_P7 >= 0) & (y_P7 < _HEAT))[:, :, None] & ((x_P7 >= 0) & (x_P7 < _HEAT))[:, None, :]
    row_P77, column_P77 = (np.clip(cells, 0, _HEAT - 1) for cells in (y_P7[:, :, None], x_P7[:, None, :]))
    logit_P77 = heat_YXP[row_P77, column_P77, np.arange(len(share_P2))[:, None, None]]
    sure_P77 = np.where(inside_P77, _sigmoid(logit_P77.astype(np.float64)), 0.0)
    total_P = sure_P77.sum((1, 2))
    x_P = (sure_P77 * x_P7[:, None, :]).sum((1, 2)) / np.maximum(total_P, 1e-12)
    y_P = (sure_P77 * y_P7[:, :, None]).sum((1, 2)) / np.maximum(total_P, 1e-12)
    sure_P = (sure_P77.max((1, 2)) >= _SURE) & np.isfinite(share_P2).all(1)
    return np.where(sure_P[:, None], np.stack([x_P, y_P], axis=1) / _HEAT, share_P2)


def _sigmoid(logit: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(logit, -100, 100)))
