"""The orthographic camera, and how it frames figures: one alone, or several at one common scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.view.solids import Solids

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Camera:
    """Orthographic camera that looks at ``target`` (m, world frame: x forward, y left, z up)."""

    azimuth_deg: float = 30.0
    """Where the viewer stands, seen from above: 0 in front of the figure, positive towards the figure's left."""
    elevation_deg: float = 12.0
    """How high the viewer stands: 0 level, 90 straight above."""
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The point in the middle of the picture, m, world frame."""
    width_m: float = 2.0
    """Width of the picture, m."""

    def basis(self) -> np.ndarray:
        """Rotation (3, 3) from the world frame to the picture frame; rows: right, up, towards the viewer."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        return np.stack(
            [
                right,
                np.cos(elevation) * _UP - np.sin(elevation) * level,
                np.cos(elevation) * level + np.sin(elevation) * _UP,
            ]
        )

    @classmethod
    def framing(
        cls,
        figures: Solids | Sequence[Solids],
        size: tuple[int, int] = (300, 300),
        azimuth_deg: float = 30.0,
        elevation_deg: float = 12.0,
        margin: float = 0.07,
    ) -> Camera:
        """The camera that shows all figures whole in ``size`` pixels; ``margin``: the share left free on each side."""
        solids = figures if isinstance(figures, Solids) else Solids.concatenate(figures)
        camera = cls(azimuth_deg, elevation_deg)
        (left, right), (low, high), (far, near) = camera._extents(solids)
        target = np.array([left + right, low + high, far + near]) / 2.0 @ camera.basis()
        width_m = _width_m(right - left, high - low, size, margin)
        return replace(camera, target=_triple(target), width_m=width_m)

    def _extents(self, solids: Solids) -> list[tuple[float, float]]:
        return [solids.extent(axis) for axis in self.basis()]


def common_cameras(
    figures: Sequence[Solids],
    size: tuple[int, int] = (300, 300),
    azimuth_deg: float = 30.0,
    elevation_deg: float = 12.0,
    margin: float = 0.07,
    ground: float | None = None,
) -> list[Camera]:
    """A camera for each figure, all at one scale: each figure in the middle of its picture, all on one ground line.

    ``ground``: height z of the floor that is there, m, above which who jumps stays; None: the lowest point of each.
    """
    cameras = [Camera.framing(figure, size, azimuth_deg, elevation_deg, margin) for figure in figures]
    extents = [camera._extents(figure) for camera, figure in zip(cameras, figures, strict=True)]
    floors = [
        low if ground is None else float(_below(figure, ground) @ camera.basis()[1])
        for camera, figure, (_, (low, _), _) in zip(cameras, figures, extents, strict=True)
    ]
    width = max((right - left for (left, right), _, _ in extents), default=1.0)
    above = max((high - floor for floor, (_, (_, high), _) in zip(floors, extents, strict=True)), default=1.0)
    below = max((floor - low for floor, (_, (low, _), _) in zip(floors, extents, strict=True)), default=0.0)
    above, below = max(above, 0.0), max(below, 0.0)
    width_m = _width_m(width, above + below, size, margin)
    framed: list[Camera] = []
    for camera, floor, ((left, right), _, (far, near)) in zip(cameras, floors, extents, strict=True):
        target = np.array([(left + right) / 2.0, floor + (above - below) / 2.0, (far + near) / 2.0]) @ camera.basis()
        framed.append(replace(camera, target=_triple(target), width_m=width_m))
    return framed


def _below(figure: Solids, ground: float) -> np.ndarray:
    """The point (3,) of a floor below the middle of a figure [m]."""
    middle = [sum(figure.extent(axis)) / 2 for axis in np.eye(3)[:2]]
    return np.array([*middle, ground])


def _width_m(width: float, height: float, size: tuple[int, int], margin: float) -> float:
    """Width of a picture of ``size`` pixels that holds width x height metres and the margins."""
    free = 1.0 - 2.0 * margin
    return max(width / free, height / free * size[0] / size[1], 1e-6)


def _triple(vector_3: np.ndarray) -> tuple[float, float, float]:
    x, y, z = vector_3.tolist()
    return x, y, z
