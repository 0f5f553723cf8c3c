"""A figure that we draw, as cameras and our estimator see it."""

from __future__ import annotations

import numpy as np
import torch

from mrhubo.live.body import Body
from mrhubo.live.messages import Landmarks
from mrhubo.live.sources.camera import to_content
from mrhubo.video import PoseEstimator
from mrhubo.view import Camera, human_figure, render


def lifted_hand(size: tuple[int, int]) -> np.ndarray:
    """A figure that lifts a hand: a picture (H, W, 3), RGB, uint8; `size`: width and height in pixels."""
    local_J33 = torch.eye(3).repeat(21, 1, 1)
    for joint, angle in ((15, -1.1), (16, 1.25), (17, -0.6)):
        local_J33[joint] = torch.matrix_exp(torch.tensor([[0.0, -angle, 0.0], [angle, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    figure = human_figure(local_J33)
    camera = Camera.framing(figure, size, azimuth_deg=0, elevation_deg=0, margin=0.08)
    return np.asarray(render(figure, size, camera, (0.5, 0.55, 0.5), supersample=1))


def pose_of(image: np.ndarray) -> np.ndarray:
    """Local rotations (21, 3, 3) of who is seen in a picture, after some looks at it."""
    estimator = PoseEstimator("lite")
    for _ in range(5):
        found = estimator.landmarks(image)
    content = to_content(found, found.point_K3)
    assert isinstance(content, Landmarks)
    seen = Body().see(content.points, content.sure)
    assert seen is not None
    return seen.local_J33
