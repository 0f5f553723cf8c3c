"""From points of a body over time to a motion of our own skeleton, whose limbs point where the points do.

Networks and optimiser read directions: where limbs point, and how hands and head are turned, each seen from the chest.
Those are kept exactly. What points leave open is set as a body has it: the spine's turn is shared out in equal parts,
elbows and knees are hinges, and the rest of a forearm's twist is in the wrist.

A straight limb does not tell how it is turned about itself. Where the source has a bone's own rotation, that tells;
else the axis of its elbow or knee is carried along from the last frame in which the limb was bent towards the next.

Points that are missing in some frames are not invented: their limb goes on from where it was last seen, as seen from
the trunk, to where it is seen next, with a confidence of 0. An arm's bone that no frame shows is where the body prior
would have it beside what is seen.

Legend: T frames, J = 21: SMPL's joints 1..21. World: y up, right-handed [m].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, POSED_JOINT_NAMES, REST_K3, SIDES, hinge_axis, local_rotations
from mrhubo.errors import UserError
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import (
    axis_angle_to_matrix,
    matrix_to_axis_angle,
    orthonormal,
    shortest_turn,
    turned,
)
from mrhubo.motion.completion import Bone, complete
from mrhubo.motion.far_places import kept_places
from mrhubo.motion.gaps import fill_directions, fill_numbers, fill_rotations
from mrhubo.motion.hinges import hinge_axes
from mrhubo.motion.motion import Motion
from mrhubo.motion.orientations import frame_of, known_frames, turn_of


@dataclass(frozen=True)
class _Limb:
    """Two bones, a hinge between them, and what is at their end."""

    carrier: str
    joints: tuple[str, str, str]
    """Without the side: where the upper bone starts, the hinge, and where the lower bone ends."""
    hangs: tuple[float, float, float]
    """Where it points, seen from the carrier, if it is never seen."""
    one_way: bool
    """Whether it hardly turns about itself, so that its hinge's axis is known to some ninety degrees without it."""
    completed: bool
    """Whether the body prior tells where it is, if it is never seen: arms are anywhere, most legs stand."""


_LIMBS = (
    _Limb("spine3", ("shoulder", "elbow", "wrist"), (0.0, -1.0, 0.0), False, True),
    _Limb("pelvis", ("hip", "knee", "ankle"), (0.0, -1.0, 0.0), True, False),
)


@dataclass(frozen=True)
class BodyPoints:
    """What a source tells of a body, in a world whose y axis is up."""

    points: Mapping[str, np.ndarray]
    """Points (T, 3) [m] by the names of human keypoints, also `nose`, `left_ear`, `right_ear`, `head_top`; NaN where
    they are not known. Shoulders and hips are needed."""
    turns: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Rotations (T, 3, 3) in the world of pelvis, spine3 (the chest), neck, head, wrists (the hands) or ankles (the
    feet), relative to our rest pose, where the source has them; else points tell."""
    hinges: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Where shoulders and hips have the axes (T, 3) of elbow and knee by their bones' own turn, in the world, in the
    sense of `mrhubo.body.anatomy.hinge_axis`."""
    confidence: Mapping[str, np.ndarray] = field(default_factory=dict)
    """How sure the source is of points (T,), 0..1."""


class _Build:
    """Rotations in the world of each joint, and how sure each is, while they are made."""

    def __init__(self, body: BodyPoints, completed: Mapping[str, np.ndarray] | None = None) -> None:
        self.body, self.notes = body, []
        self.completed = completed or {}
        self.unseen: list[Bone] = []
        self.points = {name: point_T3.astype(np.float64) for name, point_T3 in body.points.items()}
        self.frames = len(next(iter(self.points.values())))
        self.world: dict[str, np.ndarray] = {}
        self.sure: dict[str, np.ndarray] = {}
        self.rest = dict(zip(JOINT_NAMES, REST_K3.astype(np.float64), strict=False))

    def known(self, *names: str) -> np.ndarray:
        """In which frames (T,) all of these points are known."""
        missing = [name for name in names if name not in self.points]
        if missing:
            return np.zeros(self.frames, bool)
        return np.asarray(np.stack([known_frames(self.points[name]) for name in names]).all(0))

    def surety(self, known_T: np.ndarray, *names: str) -> np.ndarray:
        """How sure (T,) something is that hangs on these points: as the least sure of them; 0 where it is not known."""
        told = [self.body.confidence[name] for name in names if name in self.body.confidence]
        least_T = np.stack(told).astype(np.float64).min(0) if told else np.ones(self.frames)
        return np.where(known_T, least_T, 0.0)

    def turn(self, joint: str) -> np.ndarray | None:
        """Rotations (T, 3, 3) of a part, by the source or by its points, NaN where neither tells."""
        given = self.body.turns.get(joint)
        return turn_of(joint, self.points) if given is None else given.astype(np.float64)


def motion_from_points(
    body: BodyPoints, name: str, frame_rate: float, source: str, notes: tuple[str, ...] = (), what: str = ""
) -> Motion:
    """The motion of our skeleton whose limbs, hands, feet and head are turned as a body's, seen from chest and pelvis.

    Args:
        body: what is known of it.
        name: of the motion.
        frame_rate: frames per second.
        source: what the file was taken for.
        notes: what its reader has to say.
        what: the file, for sentences; default: the name.

    Raises:
        UserError: neither points nor turns tell how the chest is turned, in any frame.
    """
    build = _Build(body)
    local_TJ33 = _assemble(build, what or name)
    if build.unseen:
        build = _Build(body, complete(local_TJ33, frame_rate, _given(build), build.unseen))
        local_TJ33 = _assemble(build, what or name)
    world = build.world
    sure_TJ = np.stack([build.sure.get(joint, build.sure["spine3"]) for joint in POSED_JOINT_NAMES], axis=1)
    pelvis_T33 = world["pelvis"]
    position_T3 = None
    if {"left_hip", "right_hip"} <= build.points.keys():
        middle_T3, offset_3 = ((at["left_hip"] + at["right_hip"]) / 2 for at in (build.points, build.rest))
        position_T3 = fill_numbers(middle_T3, known_frames(middle_T3)) - pelvis_T33 @ offset_3
        finite = np.isfinite(position_T3).all()
        position_T3 = kept_places(position_T3, "where the root goes", build.notes) if finite else None
    return Motion.of(
        name=name,
        local_TJ33=orthonormal(local_TJ33).astype(np.float32),
        frame_rate=float(frame_rate),
        description=name,
        root_rotation_T33=orthonormal(pelvis_T33).astype(np.float32),
        root_position_T3=position_T3,
        source=source,
        notes=(*notes, *build.notes),
        confidence_TJ=None if (sure_TJ == 1).all() else np.clip(sure_TJ.astype(np.float32), 0.0, 1.0),
    )


def _assemble(build: _Build, what: str) -> np.ndarray:
    """Local rotations (T, 21, 3, 3) of all joints."""
    _trunk(build, what)
    for limb in _LIMBS:
        for side in SIDES:
            _limb(build, limb, side)
    _head(build)
    return local_rotations(np.stack([build.world[joint] for joint in JOINT_NAMES], axis=1))


def _given(build: _Build) -> list[str]:
    """Keypoints that a source tells in some frame, of trunk, limbs and head."""
    hidden = {bone.end for bone in build.unseen}
    limbs = [f"{side}_{joint}" for limb in _LIMBS for joint in limb.joints for side in SIDES]
    told = [name for name in limbs if name not in hidden and build.known(name).any()]
    return [*told, *(["head"] if build.sure["head"].any() else [])]


def _trunk(build: _Build, what: str) -> None:
    """Pelvis, spine and collars; a pelvis that nothing tells is turned as the chest."""
    chest_T33, pelvis_T33 = build.turn("spine3"), build.turn("pelvis")
    if chest_T33 is None or not known_frames(chest_T33).any():
        raise UserError(
            f"{what}: nothing tells how the chest is turned; both shoulders and both hips must be known in some frame"
        )
    sides = [f"{side}_{joint}" for joint in ("shoulder", "hip") for side in SIDES]
    known_T = known_frames(chest_T33)
    chest_T33 = fill_rotations(chest_T33, known_T)
    build.sure["spine3"] = build.surety(known_T, *sides)
    if not known_T.all():
        build.notes.append(f"how the chest is turned is not known in {_count(~known_T)}: filled in, confidence 0")
    pelvis_T33, _ = _filled(chest_T33, chest_T33 if pelvis_T33 is None else pelvis_T33)
    back_T3 = matrix_to_axis_angle(pelvis_T33.mT @ chest_T33)
    build.world["pelvis"], build.world["spine3"] = pelvis_T33, chest_T33
    for place, joint in enumerate(("spine1", "spine2"), start=1):
        build.world[joint] = pelvis_T33 @ axis_angle_to_matrix(back_T3 * place / 3)
    for side in SIDES:
        build.world[f"{side}_collar"] = chest_T33


def _limb(build: _Build, limb: _Limb, side: str) -> None:
    """An arm or a leg with its hand or foot; all is seen from the part that carries it until the end."""
    upper, hinge, tip = (f"{side}_{name}" for name in limb.joints)
    carrier_T33 = build.world[limb.carrier]
    directions, known = [], []
    for start, end in ((upper, hinge), (hinge, tip)):
        known_T = build.known(start, end)
        if known_T.any():
            seen_T3 = turned(carrier_T33.mT, build.points[end] - build.points[start])
            known_T &= norm(seen_T3) > 1e-6
        if known_T.any():
            directions.append(fill_directions(normalize(np.nan_to_num(seen_T3)), known_T))
        elif end in build.completed:
            directions.append(build.completed[end])
        else:  # hangs, or goes on in the line of the upper bone
            if limb.completed:
                build.unseen.append(Bone(start, end, limb.carrier))
            directions.append(directions[0] if directions else np.tile(limb.hangs, (build.frames, 1)))
        known.append(known_T)
        build.sure[start] = build.surety(known_T, start, end)
        if not known_T.all():
            what = "is never seen" if not known_T.any() else f"is not seen in {_count(~known_T)}"
            how = "completed by the body prior" if end in build.completed else "filled in"
            build.notes.append(f"{_words(start)} to {_words(end)} {what}: {how}, confidence 0")
    upper_T3, lower_T3 = directions
    own_T3 = build.body.hinges.get(upper)
    own_T3 = None if own_T3 is None else turned(carrier_T33.mT, own_T3.astype(np.float64))
    bone_3 = normalize(build.rest[hinge] - build.rest[upper])
    rest_axis_3 = np.array(hinge_axis(hinge))
    usual_T3 = shortest_turn(np.broadcast_to(bone_3, upper_T3.shape), upper_T3) @ rest_axis_3
    axis_T3 = hinge_axes(upper_T3, lower_T3, own_T3, usual_T3, known[0] & known[1], limb.one_way)
    at_rest_33 = frame_of(bone_3[None], rest_axis_3[None])[0]
    upper_T33 = frame_of(upper_T3, axis_T3) @ at_rest_33.T
    lower_bone_3 = normalize(build.rest[tip] - build.rest[hinge])
    lower_T33 = shortest_turn(upper_T33 @ lower_bone_3, lower_T3) @ upper_T33
    build.world[upper], build.world[hinge] = carrier_T33 @ upper_T33, carrier_T33 @ lower_T33
    _tip(build, tip, hinge)
    if limb.carrier == "pelvis":
        build.world[f"{side}_foot"], build.sure[f"{side}_foot"] = build.world[tip], build.sure[tip]


def _tip(build: _Build, tip: str, carrier: str) -> None:
    """A hand or foot; in the line of its limb where nothing tells more."""
    turn_T33 = build.turn(tip)
    lower_T33 = build.world[carrier]
    if turn_T33 is None:
        build.world[tip], build.sure[tip] = lower_T33, build.sure[carrier]
        return
    build.world[tip], known_T = _filled(lower_T33, turn_T33)
    build.sure[tip] = build.surety(known_T, tip)


def _head(build: _Build) -> None:
    """Head and neck, which share its turn; as the chest where nothing tells."""
    chest_T33, head_T33 = build.world["spine3"], build.turn("head")
    if head_T33 is None:
        head_T33 = chest_T33
        build.sure["neck"] = build.sure["head"] = np.zeros(build.frames)
        build.notes.append("nothing tells how the head is turned: it stays as the chest, confidence 0")
    else:
        head_T33, known_T = _filled(chest_T33, head_T33)
        sure_T = build.surety(known_T, "nose", "left_ear", "right_ear")
        build.sure["neck"] = build.sure["head"] = sure_T
        if not known_T.all():
            build.notes.append(f"how the head is turned is not known in {_count(~known_T)}: filled in, confidence 0")
    neck_T33 = build.body.turns.get("neck")
    if neck_T33 is None:
        half_T3 = matrix_to_axis_angle(chest_T33.mT @ head_T33) / 2
        neck_T33 = chest_T33 @ axis_angle_to_matrix(half_T3)
    build.world["neck"], build.world["head"] = _filled(chest_T33, neck_T33)[0], head_T33


def _filled(carrier_T33: np.ndarray, part_T33: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How a part is turned (T, 3, 3), and in which frames (T,) that is known; where it is NaN, it is filled in as its
    carrier sees it.
    """
    known_T = known_frames(part_T33)
    return carrier_T33 @ fill_rotations(np.nan_to_num(carrier_T33.mT @ part_T33), known_T), known_T


def _count(missing_T: np.ndarray) -> str:
    return f"{int(missing_T.sum())} of {len(missing_T)} frames"


def _words(name: str) -> str:
    return name.replace("_", " ")
