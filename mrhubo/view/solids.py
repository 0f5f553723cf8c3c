"""Solids: what a picture is made of. Capsules (also tapered ones and spheres), flat-ended cylinders, boxes, and meshes.

World frame: x forward, y left, z up, metres (REP 103). Human points come in the human frame (x to the body's left, y
up, z forward) and are turned by `mrhubo.frames.human_to_world`.

Axes: S solids, P points.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from mrhubo.view.surfaces import Color, Placed, outlines

_EMPTY = np.zeros(0)


@dataclass
class Solids:
    """A figure. Row s of every array is one solid, whose axis runs from ``starts_S3[s]`` to ``ends_S3[s]``.

    * capsule: the convex hull of a sphere at either end; start == end is a sphere; different radii make it tapered;
    * cylinder: ``flat_S`` is true: the ends are flat discs (no taper);
    * box: ``sides_S3`` is not zero: half of the box's width as a vector at right angles to the axis; the radius is
      half of its thickness, in the direction of axis x side.
    """

    starts_S3: np.ndarray
    """Start of the axis, m, world frame."""
    ends_S3: np.ndarray
    """End of the axis, m, world frame."""
    radii_S: np.ndarray
    """Radius at the start, m."""
    colors_S3: np.ndarray
    """RGB, 0..1."""
    end_radii_S: np.ndarray = field(default_factory=_EMPTY.copy)
    """Radius at the end, m; default: the radius at the start."""
    flat_S: np.ndarray = field(default_factory=_EMPTY.copy)
    """True: a flat-ended cylinder; default: false."""
    sides_S3: np.ndarray = field(default_factory=_EMPTY.copy)
    """Not zero: a box; half of its width as a vector, m; default: zero."""
    meshes: tuple[Placed, ...] = ()
    """Surfaces beside the rows."""

    def __post_init__(self) -> None:
        self.starts_S3 = np.asarray(self.starts_S3, float).reshape(-1, 3)
        count = len(self.starts_S3)
        self.ends_S3 = np.asarray(self.ends_S3, float).reshape(-1, 3)
        self.radii_S = np.asarray(self.radii_S, float).reshape(-1)
        self.colors_S3 = np.asarray(self.colors_S3, float).reshape(-1, 3)
        end_radii = np.asarray(self.end_radii_S, float).reshape(-1)
        self.end_radii_S = self.radii_S.copy() if len(end_radii) == 0 else end_radii
        flat = np.asarray(self.flat_S, bool).reshape(-1)
        self.flat_S = np.zeros(count, bool) if len(flat) == 0 else flat
        sides = np.asarray(self.sides_S3, float).reshape(-1, 3)
        self.sides_S3 = np.zeros((count, 3)) if len(sides) == 0 else sides
        for name in _rows():
            value = getattr(self, name)
            if len(value) != count:
                raise ValueError(f"Solids: {name} has {len(value)} rows, starts_S3 has {count}")
            if not np.isfinite(value).all():
                row = int(np.argwhere(~np.isfinite(value))[0, 0])
                raise ValueError(f"Solids: {name}[{row}] is not finite: {value[row]}")
        if count and min(self.radii_S.min(), self.end_radii_S.min()) < 0.0:
            raise ValueError("Solids: a radius is negative")

    def __len__(self) -> int:
        """How many rows there are; meshes do not count."""
        return len(self.starts_S3)

    @property
    def nothing(self) -> bool:
        """Whether there is nothing to be seen."""
        return len(self) == 0 and not self.meshes

    @classmethod
    def empty(cls) -> Solids:
        """No solids."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))

    @classmethod
    def capsules(
        cls, rows: Sequence[tuple[np.ndarray, np.ndarray, float, float]], color: Color | Sequence[Color]
    ) -> Solids:
        """From rows of (start (3,), end (3,), start radius, end radius), m, world frame; one colour, or one per row."""
        if not rows:
            return cls.empty()
        starts, ends, radii, end_radii = zip(*rows, strict=True)
        colors = np.broadcast_to(np.asarray(color, float), (len(rows), 3))
        return cls(np.array(starts), np.array(ends), np.array(radii), colors.copy(), np.array(end_radii))

    @classmethod
    def concatenate(cls, parts: Iterable[Solids]) -> Solids:
        """All solids of the parts, in their order."""
        parts = [cls.empty(), *parts]
        rows = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _rows()}
        return cls(**rows, meshes=tuple(mesh for part in parts for mesh in part.meshes))

    def transformed(self, pose_44: np.ndarray) -> Solids:
        """A copy moved by a rigid motion (4, 4), m: what was given in the frame of the pose, in the world frame."""
        pose = np.asarray(pose_44, float)
        rotation_33, offset_3 = pose[:3, :3], pose[:3, 3]
        return Solids(
            self.starts_S3 @ rotation_33.T + offset_3,
            self.ends_S3 @ rotation_33.T + offset_3,
            self.radii_S.copy(),
            self.colors_S3.copy(),
            self.end_radii_S.copy(),
            self.flat_S.copy(),
            self.sides_S3 @ rotation_33.T,
            tuple(mesh.moved(rotation_33, offset_3) for mesh in self.meshes),
        )

    def translated(self, offset_3: np.ndarray) -> Solids:
        """A copy moved by ``offset_3`` (3,), m, world frame."""
        pose = np.eye(4)
        pose[:3, 3] = offset_3
        return self.transformed(pose)

    def scaled(self, factor: float) -> Solids:
        """A copy ``factor`` times as large, about the origin."""
        return Solids(
            self.starts_S3 * factor,
            self.ends_S3 * factor,
            self.radii_S * factor,
            self.colors_S3.copy(),
            self.end_radii_S * factor,
            self.flat_S.copy(),
            self.sides_S3 * factor,
            tuple(mesh.moved(factor * np.eye(3), np.zeros(3)) for mesh in self.meshes),
        )

    def recolored(self, color: Color) -> Solids:
        """A copy in one RGB colour, 0..1."""
        copy = self.translated(np.zeros(3))
        copy.colors_S3[:] = color
        copy.meshes = tuple(mesh.recolored(color) for mesh in copy.meshes)
        return copy

    def extent(self, direction_3: np.ndarray) -> tuple[float, float]:
        """Least and greatest coordinate of the figure's surface along a unit direction (3,), m; of meshes by their
        outlines.
        """
        if self.nothing:
            raise ValueError("Solids: an empty figure has no extent")
        direction = np.asarray(direction_3, float)
        meshed_P = (outlines(self.meshes) @ direction).ravel()
        box_S = np.any(self.sides_S3 != 0.0, axis=1)
        axis_S3 = _unit(self.ends_S3 - self.starts_S3)
        reach_S = np.ones(len(self))  # of a sphere, in radii
        reach_S[self.flat_S] = np.linalg.norm(np.cross(axis_S3[self.flat_S], direction), axis=1)
        thickness_S3 = np.cross(axis_S3[box_S], _unit(self.sides_S3[box_S]))
        reach_S[box_S] = np.abs(thickness_S3 @ direction)
        side_S = np.abs(self.sides_S3 @ direction)
        start_S, end_S = self.starts_S3 @ direction, self.ends_S3 @ direction
        start_reach_S, end_reach_S = self.radii_S * reach_S + side_S, self.end_radii_S * reach_S + side_S
        low_P = np.concatenate([start_S - start_reach_S, end_S - end_reach_S, meshed_P])
        high_P = np.concatenate([start_S + start_reach_S, end_S + end_reach_S, meshed_P])
        return float(low_P.min()), float(high_P.max())

    def bounds(self) -> np.ndarray:
        """Corners (2, 3) of the axis-aligned box around the figure, m, world frame: least, then greatest x, y, z."""
        return np.array([self.extent(axis) for axis in np.eye(3)]).T


def _rows() -> list[str]:
    """The names of the arrays."""
    return [item.name for item in fields(Solids) if item.name != "meshes"]


def _unit(vectors_S3: np.ndarray) -> np.ndarray:
    return vectors_S3 / np.maximum(np.linalg.norm(vectors_S3, axis=-1, keepdims=True), 1e-12)
