"""What was found out about a robot: which link and point stands for which part of a human body, and why.

Legend: vectors (3,) are tuples of metres, or unit directions; `_3` of a link is in the link's frame, `root_3` in the
root link's frame with every joint at 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Candidate:
    """Another choice that there was."""

    link: str
    offset_3: Vector
    """Metres in the link's frame."""
    why: str
    """What speaks for it, as the end of a sentence."""


@dataclass(frozen=True)
class FoundPoint:
    """A joint centre (or the end of a limb) of the robot."""

    link: str
    offset_3: Vector
    """Metres in the link's frame."""
    root_3: Vector
    """Where it lies with every joint at 0, in the root link's frame."""
    confidence: float
    """0 (a guess) to 1 (nothing else fits)."""
    cue: str
    """What told it."""
    candidates: tuple[Candidate, ...] = ()
    """Where else it may lie, likeliest first; the choice itself is not among them."""


@dataclass(frozen=True)
class FoundEnd:
    """An oriented part: chest, pelvis, head, a hand or a foot."""

    link: str
    axes: Mapping[str, Vector]
    """Unit directions in the link's frame, by the words of the part's row: `forward` and `up`, or `fingers` and
    `thumb`; two at right angles."""
    confidence: float
    cue: str
    candidates: tuple[Candidate, ...] = ()
    sole_3: Vector | None = None
    """Of a foot without shapes, where its sole is guessed to be: how far it reaches from the link's origin backwards,
    forwards and down [m]."""


@dataclass(frozen=True)
class FoundAxis:
    """A direction of the whole robot."""

    root_3: Vector
    """Unit, in the root link's frame with every joint at 0."""
    confidence: float
    cue: str


@dataclass(frozen=True)
class FoundRange:
    """A range narrower than the URDF's limits, or one that the URDF does not give."""

    lower: float
    upper: float
    why: str
    guessed: bool = False
    """Whether the URDF tells no limits, and does not seem to mean that, so that it is what a human's joint does."""


@dataclass(frozen=True)
class Question:
    """What could not be decided, for the user to answer."""

    about: str
    """The part (`left_hand`, `chest`), chain, joint or direction that it is about."""
    text: str
    """A sentence that asks, and says what was taken meanwhile."""
    candidates: tuple[str, ...] = ()
    """Names of links or joints among which to choose."""


@dataclass(frozen=True)
class Discovery:
    """All that was found out about one robot."""

    name: str
    """A short name, from the URDF."""
    forward: FoundAxis
    up: FoundAxis
    """Where the chest faces, and where its head would be; the base may lie, or face anywhere."""
    points: Mapping[str, FoundPoint]
    """By human keypoint: `left_shoulder`, `left_elbow`, `left_wrist`, `left_hip`, `left_knee`, `left_ankle`,
    `left_sole`, and the right ones; those that the robot has."""
    ends: Mapping[str, FoundEnd]
    """By part: `chest`, `pelvis`, `head`, `left_hand`, `left_foot`, and the right ones; those that the robot has."""
    chains: Mapping[str, tuple[str, ...]]
    """Joints from the body outwards, by chain: `left_arm`, `right_arm`, `left_leg`, `right_leg`, `neck`, and `waist`
    (from the pelvis to the chest). Without fingers, toes, and all that does not belong."""
    joints: tuple[str, ...]
    """The joints to move (`robot.joints`): those of the chains that turn a row of the table of body parts."""
    held: Mapping[str, str]
    """Joints of the body that are held, and why: waist and legs, if not the whole body was asked for."""
    left_out: Mapping[str, str]
    """Joints that are no part of the body, and why: fingers, grippers, wheels, antennas, mimics, linkages."""
    ranges: Mapping[str, FoundRange]
    """`robot.ranges` by joint."""
    key_links: tuple[str, ...]
    questions: tuple[Question, ...] = ()
    notes: tuple[str, ...] = ()
    """Sentences about the whole robot that a user should know, such as names that contradict the geometry."""
    geometric: Mapping[str, FoundPoint] = field(default_factory=dict)
    """Joint centres as the axes alone tell them, by human keypoint: where `points` may take what a link's name or a
    frame says, these do not. The yardstick for points that were written by hand."""
    whole_body: bool = False
    """Whether legs and waist move too."""

    @property
    def guessed(self) -> tuple[str, ...]:
        """The joints whose ranges are guesses, as the URDF tells none."""
        return tuple(name for name, found in self.ranges.items() if found.guessed)

    @property
    def sure(self) -> bool:
        """Whether nothing was left to ask."""
        return not self.questions
