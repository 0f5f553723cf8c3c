"""Entries of `robot.keypoints` to paste, in place of what is wrong, and the words that they come in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrhubo.config import flow_yaml
from mrhubo.robot.entries import DEFAULT_AXES, End, Point
from mrhubo.robot.keypoints import Keypoints
from mrhubo.robot.parts import OrientedPart

_NEAR = 5e-4
"""Metres, and cosine, that an entry need not tell."""


def point_entry(name: str, point: Point) -> str:
    """``left_wrist: {link: l_lower, offset: [0, 0, -0.22]}``, or the link alone where that says the same."""
    if max(map(abs, point.offset_3)) < _NEAR:
        return f"{name}: {flow_yaml(point.link)}"
    return f"{name}: {{link: {flow_yaml(point.link)}, offset: {numbers(point.offset_3)}}}"


def end_entry(name: str, end: End, words: tuple[str, str]) -> str:
    """``left_hand: {link: l_hand, fingers: [0, 0, -1], thumb: [1, 0, 0]}``."""
    return axes_entry(name, end.link, dict(zip(words, end.axes_23.tolist(), strict=True)))


def axes_entry(name: str, link: str, axes: Mapping[str, Sequence[float]]) -> str:
    """``chest: {link: torso, forward: [0, 0, 1], up: [-1, 0, 0]}``, or the link alone where it says the same."""
    if all(
        word in DEFAULT_AXES and np.allclose(axis_3, DEFAULT_AXES[word], atol=_NEAR) for word, axis_3 in axes.items()
    ):
        return f"{name}: {flow_yaml(link)}"
    directions = ", ".join(f"{word}: {numbers(axis_3)}" for word, axis_3 in axes.items())
    return f"{name}: {{link: {flow_yaml(link)}, {directions}}}"


def entry(keypoints: Keypoints, name: str, like: str) -> str:
    """An entry of one name with the value that another one has."""
    if like in keypoints.points:
        return point_entry(name, keypoints.points[like])
    return end_entry(name, keypoints.ends[like], next(part.words for part in oriented(keypoints) if part.name == like))


def oriented(keypoints: Keypoints) -> list[OrientedPart]:
    """The oriented parts that a robot has."""
    return [part for part in keypoints.parts if isinstance(part, OrientedPart)]


def exchanged(keypoints: Keypoints) -> str:
    """The entries of left and right, exchanged."""
    both = [names for pair in keypoints.pairs for names in (pair, pair[::-1])]
    return ", ".join(entry(keypoints, name, other) for name, other in both)


def numbers(values: Sequence[float]) -> str:
    """``[0.1, 0, -0.22]``, to a tenth of a millimetre."""
    return "[" + ", ".join(f"{round(float(value), 4) + 0.0:g}" for value in values) + "]"


def quoted(names: Sequence[str]) -> str:
    """``'a', 'b'``."""
    return ", ".join(f"'{name}'" for name in names)
