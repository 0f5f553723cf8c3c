"""A robot's motion in memory: joint angles over time and all that is known of them, as plain NumPy arrays.

Legend: ... leading axes, of which the last is the time (T frames), none for a single pose; N joints, C branches (an
arm, the head), D directions (limbs, hands, head), F feet.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened

PER_FRAME = {
    "q": ("joint_names",),
    "confidence": (),
    "branch_confidence": ("branch_names",),
    "direction_error_deg": ("direction_names",),
    "phi": (),
    "collision": (),
    "root_position": (3,),
    "root_quaternion_wxyz": (4,),
    "contact": ("contact_names",),
}
"""Fields with a value a frame, by name, and their further axes: sizes, or the field whose names they have."""
NAMES = ("joint_names", "branch_names", "direction_names", "contact_names")
"""Fields that name what is along an axis."""
FLAGS = ("collision", "contact")
"""Fields of `PER_FRAME` that are true or false."""
_LIMITS = ("lower", "upper", "velocity")
_UNIT = 1e-3
"""How far the norm of a quaternion may be from 1: rounded text still passes."""


@dataclass(frozen=True)
class FollowingJoint:
    """A joint of the robot that the motion does not turn by itself: it mimics another, or it is held.

    Its angle [rad] is `multiplier` * (angle of `joint`) + `offset`.
    """

    name: str
    joint: str = ""
    """The joint of the motion that it follows; empty: none, it is held at `offset`."""
    multiplier: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Raises a UserError where multiplier or offset is no finite number."""
        for name in ("multiplier", "offset"):
            number = _float(getattr(self, name))
            if not math.isfinite(number):
                raise UserError(f"joint '{shortened(self.name)}' has a {name} that is no finite number")
            object.__setattr__(self, name, number)


@dataclass(frozen=True, eq=False)
class RobotFacts:
    """What is known of the robot that moves, and of who moves it."""

    name: str = ""
    made_by: str = ""
    """Who found the joint angles: a package, or the optimiser."""
    checksum: str = ""
    """Of the package, or of the robot's kinematics where the optimiser found them; 16 hex digits."""
    lower: np.ndarray | None = None
    """Lower limits (N,) [rad] of the motion's joints."""
    upper: np.ndarray | None = None
    """Upper limits (N,) [rad]."""
    velocity: np.ndarray | None = None
    """How fast they may turn (N,) [rad/s]."""
    others: tuple[FollowingJoint, ...] = ()
    """The robot's other joints that are not fixed."""
    on_base: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Links that are fixed to the base, itself the first, each with its place [m] and its quaternion, w first, in the
    base's frame; empty where they are not known, as in files."""

    def __post_init__(self) -> None:
        """Raises a UserError where limits are no numbers. All answers of a retargeter share them, so they are copies
        that nobody writes into.
        """
        for name in _LIMITS:
            given = getattr(self, name)
            if given is not None:
                limit_N = np.array(_array(name, given, np.shape(given), np.float32))
                limit_N.setflags(write=False)
                object.__setattr__(self, name, limit_N)


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """A robot's motion. Arrays of numbers are float32, whatever they are given as: finer than any joint's sensor."""

    q: np.ndarray
    """Joint angles (..., N) [rad]."""
    joint_names: tuple[str, ...]
    """The N joints, by their names in the URDF."""
    frame_rate: float | None = None
    """Frames per second, where it is known."""
    name: str = ""
    """Of the motion."""
    source: str = ""
    """What the human motion was read from, in words."""
    robot: RobotFacts = field(default_factory=RobotFacts)
    confidence: np.ndarray | None = None
    """(...), 0..1: that of the least certain branch."""
    branch_confidence: np.ndarray | None = None
    """(..., C), 0..1."""
    branch_names: tuple[str, ...] = ()
    direction_error_deg: np.ndarray | None = None
    """Angle (..., D) [deg] between the robot's and the human's limb, hand and head directions."""
    direction_names: tuple[str, ...] = ()
    phi: np.ndarray | None = None
    """Reconstruction error (...) of the human pose under the body prior."""
    collision: np.ndarray | None = None
    """Whether the robot touches itself (...), bool; None: not known, for want of collision shapes."""
    root_position: np.ndarray | None = None
    """Place (..., 3) [m] of the base in the world: x forward, y left, z up; None where the base is fixed."""
    root_quaternion_wxyz: np.ndarray | None = None
    """Rotation (..., 4) of the base in the world, a unit quaternion, w first; None where the base is fixed."""
    contact: np.ndarray | None = None
    """Whether each foot is planted (..., F), bool; None: not known."""
    contact_names: tuple[str, ...] = ()
    """The F feet."""

    @classmethod
    def trusted(cls, **parts: Any) -> RobotMotion:
        """Of parts that are known to fit together, all of them: looking at them takes longer than a frame's answer."""
        motion = object.__new__(cls)
        motion.__dict__.update(parts)
        return motion

    def __post_init__(self) -> None:
        """Raises a UserError where the parts do not fit together or are no numbers."""
        for name in NAMES:
            object.__setattr__(self, name, _names(name, getattr(self, name)))
        if not self.joint_names:
            raise UserError("joint_names is empty; a motion moves one joint at least")
        leading = np.shape(self.q)[:-1]
        for name, further in PER_FRAME.items():
            given = getattr(self, name)
            if given is not None:
                sizes = [len(getattr(self, axis)) if isinstance(axis, str) else axis for axis in further]
                kind = np.bool_ if name in FLAGS else np.float32
                object.__setattr__(self, name, _array(name, given, (*leading, *sizes), kind))
        if (self.root_position is None) != (self.root_quaternion_wxyz is None):
            raise UserError("root_position and root_quaternion_wxyz go together; one of them is missing")
        if self.root_quaternion_wxyz is not None:
            norm = np.linalg.norm(self.root_quaternion_wxyz, axis=-1)
            if norm.size and np.abs(norm - 1).max() > _UNIT:
                raise UserError("root_quaternion_wxyz holds a quaternion whose norm is not 1")
        if self.frame_rate is not None:
            object.__setattr__(self, "frame_rate", _rate(self.frame_rate))
        self._check_robot()

    def _check_robot(self) -> None:
        for name in _LIMITS:
            given = getattr(self.robot, name)
            if given is not None and given.shape != (len(self.joint_names),):
                raise UserError(f"{name} has shape {given.shape}; expected a number for each joint")
        own = set(self.joint_names)
        for other in self.robot.others:
            if other.name in own or (other.joint and other.joint not in own):
                raise UserError(f"joint '{shortened(other.name)}' is the motion's own, or follows one that is not")

    @property
    def frames(self) -> int:
        """How many poses there are."""
        return math.prod(self.q.shape[:-1])

    def __len__(self) -> int:
        return self.frames

    def single(self) -> RobotMotion:
        """The same with one leading axis; a single pose becomes a motion of one frame.

        Raises:
            UserError: there are several leading axes, so these are more motions than one.
        """
        if self.q.ndim > 2:
            raise UserError(
                f"such a file holds one motion, found joint angles of shape {self.q.shape}; use .npz, or a file each"
            )
        if self.q.ndim == 2:
            return self
        arrays = {name: getattr(self, name) for name in PER_FRAME}
        return replace(self, **{name: array[None] for name, array in arrays.items() if array is not None})


def find_repeated(names: Iterable[str]) -> str | None:
    """The name that is there twice, of several the first in order; None: there is none."""
    return min((name for name, count in Counter(names).items() if count > 1), default=None)


def _names(field_name: str, given: Sequence[str]) -> tuple[str, ...]:
    names = tuple(map(str, given))
    if (repeated := find_repeated(names)) is not None:
        raise UserError(f"{field_name} has '{shortened(repeated)}' twice")
    if any(not name or not name.isprintable() for name in names):
        raise UserError(f"{field_name} has a name that is empty or no text")
    return names


def _array(name: str, given: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    array = np.asarray(given)
    if array.dtype.kind not in "fiub":
        raise UserError(f"{name} must hold numbers, found {array.dtype}")
    if array.shape != shape:
        raise UserError(f"{name} has shape {array.shape}; expected {shape}")
    with np.errstate(over="ignore"):
        array = np.ascontiguousarray(array, kind).reshape(shape)
    if kind is np.float32 and not np.isfinite(array).all():
        raise UserError(f"{name} holds NaN or infinite numbers")
    return array


def _rate(given: Any) -> float:
    is_real = isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)
    rate = _float(given) if is_real else math.nan
    if not 0 < rate < math.inf:
        raise UserError(f"frame_rate must be a positive number of frames per second, found {shortened(given)}")
    return rate


def _float(given: Any) -> float:
    """A number as a float; NaN where it is none, or a whole number that is longer than any float."""
    try:
        return float(given)
    except (TypeError, ValueError, OverflowError):
        return math.nan
