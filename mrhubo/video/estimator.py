"""The points of a body in one picture after another.

The detector looks for somebody until there is somebody; from then on each picture's landmarks tell where to look in the
next (`mediapipe/modules/pose_landmark/pose_landmark_cpu.pbtxt`). Somebody who is lost is looked for again in the same
picture; of several, who is nearest to where they were is taken.

Legend: K = 33 points, H, W pixels.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from mrhubo.errors import UserError, unknown_name
from mrhubo.video.detector import Detector
from mrhubo.video.landmarks import POINTS, LandmarkNetwork, Landmarks
from mrhubo.video.models import DETECTOR, MODELS, find_models
from mrhubo.video.region import Region

PRESENT = 0.5
"""From this presence on there is somebody."""
_LOOKS, _SURELY = 10, 0.95
"""Of so many pictures in a row in which nobody is found, parts of one are looked through; and from this presence on
there is somebody: in so many parts something looks like a body now and then."""
_ELSEWHERE = 0.35
"""How far from a body, in sides of the smaller square around one, another is: of one body, detector and landmarks are
0.15 apart at most."""


class Estimate(NamedTuple):
    """The points of a body in a picture."""

    point_K3: np.ndarray
    """In space [m], from the middle of the hips, float64: x to the right of the picture, y up, z towards the camera.
    NaN where nobody is there."""
    visibility_K: np.ndarray
    """How likely each point is seen, and hidden by nothing, 0 to 1."""
    presence: float
    """How sure the network is that there is somebody, 0 to 1."""
    pixel_K2: np.ndarray
    """In the picture [pixels], x to the right, y down; NaN where nobody is there."""


class PoseEstimator:
    """Finds one body in pictures that follow each other."""

    def __init__(self, model: str = "full", threads: int = 1, folder: Path | None = None) -> None:
        """Loads the networks.

        Args:
            model: `lite`, `full` or `heavy`: the slower, the more exact (docs/camera.md).
            threads: of the CPU that the networks may use.
            folder: of the models; default: where `mrhubo models` puts them.

        Raises:
            UserError: there is no such model, it has not been fetched or is damaged, or LiteRT is not installed.
        """
        if model not in MODELS:
            raise UserError(unknown_name("model of poses", model, MODELS))
        folder = find_models() if folder is None else folder
        self._detector = Detector(folder / DETECTOR, threads)
        self._network = LandmarkNetwork(folder / f"pose_landmark_{model}.tflite", threads)
        self._region: Region | None = None
        self._last: Region | None = None
        self._missed = 0

    def reset(self) -> None:
        """Forgets where somebody was: what comes next has nothing to do with what came before."""
        self._region, self._last, self._missed = None, None, 0

    def landmarks(self, image_HW3: np.ndarray) -> Estimate:
        """The points of the body in the next picture.

        Args:
            image_HW3: RGB, uint8.

        Raises:
            ValueError: it is no such picture.
        """
        if image_HW3.ndim != 3 or image_HW3.shape[2] != 3 or image_HW3.dtype != np.uint8 or 0 in image_HW3.shape:
            raise ValueError(f"a picture is (height, width, 3) of uint8, not {image_HW3.shape} of {image_HW3.dtype}")
        known, self._region = self._region, None
        found = None if known is None else self._network.find(image_HW3, known)
        if found is None or not _is_body(found):
            found = self._anew(image_HW3, self._detector.find(image_HW3), PRESENT) or found
            if self._missed % _LOOKS == 0 and (found is None or not _is_body(found)):
                found = self._anew(image_HW3, self._detector.find_small(image_HW3), _SURELY) or found
        if found is not None and _is_body(found):
            self._region = found.region
            self._last, self._missed = found.region or self._last, 0
            return Estimate(found.point_K3, found.visibility_K, found.presence, found.pixel_K2)
        self._missed += 1
        nowhere = np.full((POINTS, 3), np.nan)
        presence = 0.0 if found is None else found.presence
        return Estimate(nowhere, np.zeros(POINTS), presence, nowhere[:, :2].copy())

    def _anew(self, image_HW3: np.ndarray, regions: list[Region], presence: float) -> Landmarks | None:
        """The body in the region that is nearest to where somebody was last, or in the first; None where there is none,
        or it is not so sure that there is somebody.
        """
        if not regions:
            return None
        region = min(regions, key=self._last.apart) if self._last else regions[0]
        found = self._network.find(image_HW3, self._detector.closer(image_HW3, region))
        return found if found.presence >= presence else None

    def sees_others(self, image_HW3: np.ndarray) -> bool:
        """Whether somebody is in a picture, RGB, uint8, where the one that was found in the last picture is not."""
        here = self._region
        return here is not None and any(here.apart(region) > _ELSEWHERE for region in self._detector.find(image_HW3))


def _is_body(found: Landmarks) -> bool:
    return found.presence >= PRESENT and bool(np.isfinite(found.point_K3).all() and np.isfinite(found.pixel_K2).all())
