"""Upper-body motions from key poses that a person can read: where arms and palms point, how torso and head turn.

Between keys the pose follows quintic curves with continuous acceleration; the elbow follows the shoulder, and the hand
the elbow, a little later. Arm directions are (out, up, forward) in the chest's frame, "out" being away from the body's
middle: one and the same `Arm` is a mirror image on the other side.

Everything is worked out as if it were the left arm; the right one is mirrored at the end. A humerus frame has x along
the upper arm and y such that the elbow flexes about -y: in the rest pose (T-pose, palms down) it equals the chest's.

Legend: T frames, K keys with holds counted twice, C channels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.motion.authoring.stance import Stance, stand

Direction = tuple[float, float, float]
"""(out, up, forward), of any length."""
Angles = tuple[float, float, float]
"""(forward, to the left side, turned left) [deg]."""

MAX_FLEXION = np.radians(150.0)
"""Largest flexion of the elbow [rad]."""
MAX_TWIST = np.radians(100.0)
"""Largest pronation or supination of the forearm [rad], from thumb-up."""
_LAG_S = {"torso": 0.0, "head": 0.02, "shoulder": 0.05, "elbow": 0.09, "wrist": 0.14}
"""Overlapping action: how much later than its key each part arrives [s]."""
_SPINE_SHARES = {"spine1": 0.35, "spine2": 0.35, "spine3": 0.30}
_HEAD_SHARES = {"neck": 0.45, "head": 0.55}
_MIRROR = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Arm:
    """One arm's key pose."""

    upper: Direction
    """Where the upper arm points."""
    fore: Direction
    """Where the forearm points; not just along the upper arm, for the two span the plane in which the elbow bends."""
    palm: Direction
    """Where the palm faces (what of it is at right angles to the forearm counts)."""
    wrist: tuple[float, float] = (0.0, 0.0)
    """The hand's bend towards the palm, and its tilt towards the thumb [deg]."""


@dataclass(frozen=True)
class Key:
    """A key pose at a time. What is None is not keyed here: it goes on between the keys around."""

    time: float
    """When the pose is reached [s]."""
    left: Arm | None = None
    right: Arm | None = None
    torso: Angles | None = None
    """Lean forward, lean to the left, turn to the left [deg], of the chest from the standing pose."""
    head: Angles | None = None
    """Nod, tilt to the left, turn to the left [deg], of the head from the chest."""
    stance: Stance | None = None
    """Where the weight is."""
    hold: float = 0.0
    """How long the pose is held [s]."""


@dataclass(frozen=True)
class Performance:
    """A motion in AMASS's terms: axis-angle [rad] and metres, T frames."""

    pose_body_T63: np.ndarray
    root_orient_T3: np.ndarray
    trans_T3: np.ndarray


def perform(keys: Sequence[Key], frame_rate: float = 60.0, seed: int = 0) -> Performance:
    """The motion from the first key to the last, with breathing and swaying whose phases depend on the seed."""
    end = keys[-1].time + keys[-1].hold
    times_T = np.arange(keys[0].time, end + 0.5 / frame_rate, 1.0 / frame_rate)
    sway = _Sway(times_T, np.random.default_rng(seed))
    rotations: dict[str, Rotation] = {}

    torso_T3 = _curve(keys, "torso", np.radians, times_T) + np.radians(sway((0.7, 0.5, 0.8), 0.21))
    pelvis_T3, spine_T3 = _share_torso(torso_T3)
    spine_T3[:, 0] += np.radians(0.5) * sway.breath_T
    for name, share in _SPINE_SHARES.items():
        rotations[name] = _body_rotation(share * spine_T3)
    head_T3 = _curve(keys, "head", np.radians, times_T) + np.radians(sway((1.0, 0.8, 1.5), 0.33))
    for name, share in _HEAD_SHARES.items():
        rotations[name] = _body_rotation(share * head_T3)
    for side in ("left", "right"):
        for joint, rotation in _arm(keys, side, times_T, sway).items():
            if side == "right":
                rotation = Rotation.from_rotvec(rotation.as_rotvec() * _MIRROR)
            rotations[f"{side}_{joint}"] = rotation

    stance_T3 = _curve(keys, "stance", Stance.numbers, times_T) + 0.01 * sway((0.15, 0.7, 0.4), 0.17)
    pelvis = _body_rotation(pelvis_T3)
    trans_T3, legs = stand(stance_T3, pelvis, pelvis_T3[:, 0])
    rotations |= legs
    still = Rotation.identity(len(times_T))
    pose_TJ3 = np.stack([rotations.get(name, still).as_rotvec() for name in POSED_JOINT_NAMES], axis=1)
    return Performance(pose_TJ3.reshape(len(times_T), 63), pelvis.as_rotvec(), trans_T3)


class _Sway:
    """What keeps a standing person from being frozen: slow sines with random phases."""

    def __init__(self, times_T: np.ndarray, generator: np.random.Generator) -> None:
        self._times_T = times_T
        self._generator = generator
        self.breath_T = self((1.0,), 0.27)[:, 0]

    def __call__(self, amplitudes: Sequence[float], frequency_hz: float) -> np.ndarray:
        """(T, len(amplitudes)): each the sum of a sine near the frequency and a smaller one nearly twice as fast."""
        slow, fast = self._generator.uniform(0.0, 2 * np.pi, (2, len(amplitudes)))
        pace = 2 * np.pi * frequency_hz * self._generator.uniform(0.85, 1.15, len(amplitudes))
        phase_TC = self._times_T[:, None] * pace
        return np.asarray(amplitudes) * (0.7 * np.sin(phase_TC + slow) + 0.3 * np.sin(1.9 * phase_TC + fast))


def _body_rotation(angles_T3: np.ndarray) -> Rotation:
    """(lean forward, lean left, turn left) [rad]: the turn about the vertical first in the chain, then the leans."""
    forward, left, turn = angles_T3.T
    return Rotation.from_euler("YXZ", np.stack((turn, forward, -left), axis=-1))


def _share_torso(torso_T3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What of the torso's lean and turn the pelvis does (the more, the deeper the bow), and what the spine does."""
    share_T3 = np.full_like(torso_T3, 0.3)
    share_T3[:, 0] = 0.25 + 0.35 * _smooth_step(torso_T3[:, 0], np.radians(10.0), np.radians(50.0))
    return share_T3 * torso_T3, (1.0 - share_T3) * torso_T3


def _smooth_step(x: np.ndarray, low: float, high: float) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


# ---------------------------------------------------------------------------------------------------------- arms


def _arm(keys: Sequence[Key], side: str, times_T: np.ndarray, sway: _Sway) -> dict[str, Rotation]:
    """Local rotations of collar, shoulder, elbow and wrist, as of a left arm."""
    keyed = [(key, getattr(key, side)) for key in keys if getattr(key, side) is not None]
    numbers = []
    for key, arm in keyed:
        try:
            numbers.append(_arm_numbers(arm))
        except ValueError as error:
            raise ValueError(f"{side} arm at {key.time:g} s: {error}") from error
    for before, row in zip(numbers, numbers[1:], strict=False):  # of a rotation's two quaternions, the nearer one
        row[:4] *= np.copysign(1.0, row[:4] @ before[:4])
    moments, rows = _with_holds([key for key, _ in keyed], np.stack(numbers))
    shoulder_T4, elbow_T1, wrist_T3 = (
        _quintic(moments, rows[:, columns], times_T - _LAG_S[part])
        for part, columns in (("shoulder", slice(0, 4)), ("elbow", slice(4, 5)), ("wrist", slice(5, 8)))
    )
    humerus = Rotation.from_quat(shoulder_T4) * Rotation.from_rotvec(np.radians(sway((1.2, 1.0, 1.0), 0.29)))
    flexion_T = np.clip(elbow_T1[:, 0] + np.radians(sway((1.5,), 0.31)[:, 0]), np.radians(2.0), MAX_FLEXION)
    twist_T, bend_T, tilt_T = (wrist_T3 + np.radians(sway((1.5, 1.0, 0.7), 0.37))).T

    collar = _collar(humerus.as_matrix()[:, :, 0], sway.breath_T)
    hand = Rotation.from_euler("XZY", np.stack((twist_T, -bend_T, -tilt_T), axis=-1))
    return {
        "collar": collar,
        "shoulder": collar.inv() * humerus,
        "elbow": Rotation.from_euler("y", -flexion_T[:, None]),
        "wrist": hand,
    }


def _collar(upper_T3: np.ndarray, breath_T: np.ndarray) -> Rotation:
    """The collar goes up with an upper arm that is raised, and forward with one that reaches forward or across."""
    out_T, up_T, forward_T = upper_T3.T
    rise_T = np.radians(10.0) * _smooth_step(up_T, -0.3, 1.0) + np.radians(0.4) * breath_T
    advance_T = np.radians(7.0) * _smooth_step(forward_T - 0.5 * out_T, -0.3, 1.2)
    return Rotation.from_euler("YZ", np.stack((-advance_T, rise_T), axis=-1))


def _arm_numbers(arm: Arm) -> np.ndarray:
    """(8,): quaternion of the humerus, flexion, forearm twist, wrist bend and tilt [rad]."""
    upper, fore = _unit(arm.upper), _unit(arm.fore)
    axis = np.cross(upper, fore)
    if np.linalg.norm(axis) < np.sin(np.radians(4.0)):
        raise ValueError("upper arm and forearm are in line, so that it is open where the elbow bends to")
    flexion = np.arctan2(np.linalg.norm(axis), upper @ fore)
    if flexion > MAX_FLEXION:
        raise ValueError(f"the elbow bends by {np.degrees(flexion):.0f} deg, more than an elbow can")
    y = -_unit(axis)
    humerus = Rotation.from_matrix(np.stack((upper, y, np.cross(upper, y)), axis=-1))
    _, elbow_y, elbow_z = (humerus * Rotation.from_euler("y", -flexion)).as_matrix().T
    twist = np.arctan2(-np.dot(arm.palm, elbow_z), -np.dot(arm.palm, elbow_y))
    if abs(twist) > MAX_TWIST:
        raise ValueError(f"the palm asks for {np.degrees(twist):.0f} deg of forearm twist, more than a forearm can")
    return np.array([*humerus.as_quat(), flexion, twist, *np.radians(arm.wrist)])


def _unit(vector: Sequence[float] | np.ndarray) -> np.ndarray:
    return np.asarray(vector, float) / np.linalg.norm(vector)


# -------------------------------------------------------------------------------------------------------- curves


def _curve(keys: Sequence[Key], part: str, numbers_of: Callable[..., np.ndarray], times_T: np.ndarray) -> np.ndarray:
    """(T, 3) of torso, head or stance; zeros where no key has it."""
    keyed = [key for key in keys if getattr(key, part) is not None]
    if not keyed:
        return np.zeros((len(times_T), 3))
    moments, rows = _with_holds(keyed, np.stack([numbers_of(getattr(key, part)) for key in keyed]))
    return _quintic(moments, rows, times_T - _LAG_S.get(part, 0.0))


def _with_holds(keys: Sequence[Key], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and rows, with a second copy of each row whose key is held."""
    moments, copies = [], []
    for key, row in zip(keys, rows, strict=True):
        for moment in (key.time, key.time + key.hold) if key.hold else (key.time,):
            moments.append(moment)
            copies.append(row)
    return np.array(moments), np.stack(copies)


def _quintic(moments_K: np.ndarray, rows_KC: np.ndarray, times_T: np.ndarray) -> np.ndarray:
    """(T, C): through all rows, at rest at the ends, at holds and at turning points, with continuous acceleration.

    Between two keys at rest this is the minimum-jerk curve; on the way through a key, its speed is the harmonic mean of
    the speeds before and after (Fritsch and Carlson), which keeps the curve from overshooting.
    """
    if len(moments_K) == 1:
        return np.repeat(rows_KC, len(times_T), axis=0)
    speeds = np.diff(rows_KC, axis=0) / np.diff(moments_K)[:, None]
    before, after = speeds[:-1], speeds[1:]
    same = before * after > 0
    total = np.where(same, before + after, 1.0)
    slopes = np.zeros_like(rows_KC)
    slopes[1:-1] = np.where(same, 2 * before * after / total, 0.0)
    knots = np.stack((rows_KC, slopes, np.zeros_like(rows_KC)), axis=1)
    return BPoly.from_derivatives(moments_K, knots)(np.clip(times_T, moments_K[0], moments_K[-1]))
