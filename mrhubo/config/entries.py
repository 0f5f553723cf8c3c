"""Typed entries of a robot's mappings: what a link or several stand for, vectors and ranges.

Numbers that a YAML file writes without a point stay whole here: configs are told apart by their text, and so are the
pairs made from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from mrhubo.config.fields import left_out
from mrhubo.config.kinds import Rule

_XYZ = Rule("three numbers [x, y, z]", low=-1e3, high=1e3, length=3)

Vector = Annotated[list[float], _XYZ]
WrittenVector = Annotated[list[int | float], _XYZ]
"""A vector whose whole numbers stay whole."""
Range = Annotated[list[float], Rule("two numbers [low, high], low below high", length=2, rising=True)]
LinkName = Annotated[str, Rule("a link name")]
Weights = Annotated[dict[str, int | float], Rule("a mapping {LINK: WEIGHT}", low=1e-6, high=1e6)]


@dataclass
class PointEntry:
    """A point fixed to a link."""

    link: str
    """The link."""
    offset: WrittenVector | None = left_out()
    """Where on it, m, in the link's frame; default: its origin. For `robot.manual` in the base's frame."""


@dataclass
class HandEntry:
    """A hand fixed to a link."""

    link: str
    """The link."""
    fingers: WrittenVector
    """Where the fingers point, in the link's frame."""
    thumb: WrittenVector
    """Where the thumb lies, in the link's frame."""


@dataclass
class FrameEntry:
    """A chest, pelvis, head or foot fixed to a link; where nothing else is given, write the link alone."""

    link: str
    """The link."""
    forward: WrittenVector | None = left_out()
    """Where it looks, in the link's frame; default [1, 0, 0]."""
    up: WrittenVector | None = left_out()
    """Where its top is, in the link's frame; default [0, 0, 1]."""
    sole: WrittenVector | None = left_out()
    """Of a foot, how far its sole reaches from the link's origin backwards, forwards and down, m; default: as its
    shapes tell."""


@dataclass
class MeanEntry:
    """A weighted mean of links' positions."""

    links: Weights
    """Links and their weights."""
    offset: WrittenVector | None = left_out()
    """Added to it, m, in the base's frame."""


@dataclass
class ConstantEntry:
    """A point fixed to the robot's base."""

    offset: WrittenVector
    """Where, m, in the base's frame."""


KeypointEntry = LinkName | PointEntry | HandEntry | FrameEntry
"""An entry of `robot.keypoints`."""
ManualEntry = LinkName | PointEntry | MeanEntry | ConstantEntry
"""An entry of `robot.manual.keypoints`."""
