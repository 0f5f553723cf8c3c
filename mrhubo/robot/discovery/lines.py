"""Joint axes as lines in space: what lies between them does not depend on the pose of the joints that they carry.

Two neighbouring axes of a chain keep their distance, their angle, and where their common normal meets them,
whatever the joints do (J. Denavit and R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
matrices", 1955). So limbs are measured along a chain of such normals, and no pose need be assumed.

Legend: N axes of a chain, from the body outwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

PARALLEL = 0.09
"""Sine under which two axes count as parallel: 5 degrees."""
ON = 1e-4
"""How near a point is to an axis that it lies on, as a share of the robot or the limb."""
LEAST = 1e-3
"""How long each half of a limb is at least, upper arm or forearm, thigh or shank, as a share of the robot."""


@dataclass(frozen=True, eq=False)
class Line:
    """A point (3,) and a unit direction (3,)."""

    point_3: np.ndarray
    axis_3: np.ndarray

    def nearest(self, point_3: np.ndarray) -> np.ndarray:
        """The line's point nearest to another."""
        return self.point_3 + self.axis_3 * float(self.axis_3 @ (point_3 - self.point_3))

    def distance(self, point_3: np.ndarray) -> float:
        """How far a point is from the line."""
        return math.dist(point_3, self.nearest(point_3))


def cross(a_3: np.ndarray, b_3: np.ndarray) -> np.ndarray:
    """Of two vectors (3,); NumPy's is made for many, and ten times slower for one."""
    return np.array(
        [a_3[1] * b_3[2] - a_3[2] * b_3[1], a_3[2] * b_3[0] - a_3[0] * b_3[2], a_3[0] * b_3[1] - a_3[1] * b_3[0]]
    )


def sine(a_3: np.ndarray, b_3: np.ndarray) -> float:
    """Between two unit directions, whichever way they point."""
    return math.sqrt(float((normal_3 := cross(a_3, b_3)) @ normal_3))


def unit(vector_3: np.ndarray) -> np.ndarray:
    """Of length 1; zero stays zero."""
    length = float(np.linalg.norm(vector_3))
    return vector_3 / length if length > 1e-12 else np.zeros(3)


def reflection(normal_3: np.ndarray) -> np.ndarray:
    """Of directions (3, 3), in a plane across a unit normal."""
    return np.eye(3) - 2 * np.outer(normal_3, normal_3)


def feet(one: Line, other: Line) -> tuple[np.ndarray, np.ndarray]:
    """Where the common normal meets two lines; for parallel ones, at the first one's own point."""
    normal_3 = cross(one.axis_3, other.axis_3)
    square = float(normal_3 @ normal_3)
    if square < PARALLEL**2:
        return one.point_3, other.nearest(one.point_3)
    between_3 = other.point_3 - one.point_3
    s = float(cross(between_3, other.axis_3) @ normal_3) / square
    foot_3 = one.point_3 + s * one.axis_3
    return foot_3, other.nearest(foot_3)


@dataclass(frozen=True)
class Measures:
    """Lengths along a chain of axes, which no pose changes [m]."""

    apart_N: np.ndarray
    """From each axis to the next, along their common normal (N - 1,)."""
    along_N: np.ndarray
    """On each axis, from the normal that comes in to the one that goes out (N,); 0 at the first and last axis, and
    where a parallel neighbour leaves it open."""
    cosine_N: np.ndarray
    """Of the angle between each axis and the next, without its sign (N - 1,)."""
    out_N: np.ndarray
    """Length of the way from the first axis to where it meets each axis (N,)."""
    nodes_N3: np.ndarray
    """Where the way meets each axis first, as the joints stand (N, 3); at the first axis, where it leaves it."""


def measure(lines: Sequence[Line]) -> Measures:
    """The lengths along a chain of axes. Axes that are parallel share the point at which the way comes in; those at the
    chain's beginning, the one at which it leaves.
    """
    count = len(lines)
    apart_N, along_N = np.zeros(max(count - 1, 0)), np.zeros(count)
    cosine_N, out_N, nodes_N3 = np.zeros(max(count - 1, 0)), np.zeros(count), np.zeros((count, 3))
    if not count:
        return Measures(apart_N, along_N, cosine_N, out_N, nodes_N3)
    pairs = [sine(lines[i].axis_3, lines[i + 1].axis_3) < PARALLEL for i in range(count - 1)]
    first = pairs.index(False) if False in pairs else count - 1
    at_3 = feet(lines[first], lines[first + 1])[0] if first + 1 < count else lines[first].point_3
    for i in reversed(range(first + 1)):
        nodes_N3[i] = at_3 = lines[i].nearest(at_3)
    for i in range(count - 1):
        one, other = lines[i], lines[i + 1]
        cosine_N[i] = abs(float(one.axis_3 @ other.axis_3))
        leave_3, enter_3 = (nodes_N3[i], other.nearest(nodes_N3[i])) if pairs[i] else feet(one, other)
        along_N[i] = math.dist(leave_3, nodes_N3[i])
        apart_N[i] = math.dist(enter_3, leave_3)
        out_N[i + 1] = out_N[i] + along_N[i] + apart_N[i]
        nodes_N3[i + 1] = enter_3
    return Measures(apart_N, along_N, cosine_N, out_N, nodes_N3)
