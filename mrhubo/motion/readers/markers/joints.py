"""Where joints are, and how trunk, head, hands and feet are turned, by markers on the skin.

Pelvis: markers on its front and back tell how it is turned, and by them where hips are (Harrington et al., Journal of
Biomechanics 40, 2007, pp. 595-602). Shoulders are below the acromions (Rab, Petuskey, Bagley, Gait and Posture 15,
2002, pp. 113-119). Elbows, knees and ankles are between markers on both sides; or beside one on the outer side, as far
as half of the joint is wide, at right angles to both bones (the chord of Davis et al., Human Movement Science 10, 1991,
pp. 575-587).

Legend: T frames, M markers of a part, F some frames. World: y up, right-handed [m].
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.motion.gaps import fill_directions
from mrhubo.motion.orientations import frame_of, known_frames
from mrhubo.motion.positions import BodyPoints
from mrhubo.motion.readers.keypoints import typical

_HALF_WIDTHS = {"elbow": 0.041, "knee": 0.054, "ankle": 0.043}
"""Half of the joint and of a marker [m], of an adult (bones' breadths of NASA-STD-3000, volume I, section 3)."""
_LEG = 0.86
"""From hip to ankle of the adult who has those [m]."""
_SIZES = (0.4, 1.5)
"""How large bodies are: a small child's, a giant's."""
_ACROMION = 0.17
"""How far below the acromion the shoulder is, of the way from one acromion to the other (Rab et al., 2002)."""
_TILT_DEG = 11.0
"""How far the pelvis' front is lower than its back where people stand (Levine and Whittle, Journal of Orthopaedic and
Sports Physical Therapy 24, 1996, pp. 130-135)."""
_RIGID = (
    ("left_front_head", "right_front_head", "left_back_head", "right_back_head"),
    ("left_front_pelvis", "right_front_pelvis", "left_back_pelvis", "right_back_pelvis", "sacrum"),
    ("back_neck", "back_low", "front_neck", "front_low"),
)
"""Markers that keep their places on each other, so that three tell a further one."""
_FEWEST = 3

Markers = Mapping[str, np.ndarray]
"""Points (T, 3) by places on the body, NaN where a marker is not seen."""


def body_of_markers(markers: Markers) -> BodyPoints:
    """Joints, turns and hinges of a body.

    Args:
        markers: of places of `mrhubo.motion.readers.markers.labels`, acromions and pelvis among them.
    """
    markers = _filled(markers)
    points: dict[str, np.ndarray] = {}
    turns: dict[str, np.ndarray] = {}
    hinges: dict[str, np.ndarray] = {}
    pelvis_T33 = _pelvis(markers)
    turns["pelvis"] = pelvis_T33 @ _about_x(_TILT_DEG).T
    points |= _hips(markers, pelvis_T33)
    if (chest_T33 := _chest(markers)) is not None:
        turns["spine3"] = chest_T33
    points |= _shoulders(markers, chest_T33, points)
    if (head_T33 := _head(markers)) is not None:
        turns["head"] = head_T33
    size = _size(markers, points)
    for side in SIDES:
        arm, arm_axis_T3 = _arm(markers, side, points, size)
        leg, leg_axis_T3 = _leg(markers, side, points, pelvis_T33, size)
        points |= arm | leg | _ends(markers, side, arm)
        for joint, axis_T3 in (("shoulder", arm_axis_T3), ("hip", leg_axis_T3)):
            if axis_T3 is not None and (known_T := known_frames(axis_T3)).any():
                hinges[f"{side}_{joint}"] = fill_directions(axis_T3, known_T)
    return BodyPoints(points, turns, hinges)


def _filled(markers: Markers) -> dict[str, np.ndarray]:
    """The markers, with those of rigid parts where they are hidden, by three others that are seen."""
    found = dict(markers)
    for part in _RIGID:
        names = [name for name in part if name in markers]
        if len(names) > _FEWEST:
            point_TM3 = _rigid(np.stack([markers[name] for name in names], axis=1))
            found |= {name: point_TM3[:, i] for i, name in enumerate(names)}
    return found


def _rigid(point_TM3: np.ndarray) -> np.ndarray:
    """Points of a rigid part, with those that are hidden, by the shape in which they are all seen."""
    seen_TM = np.asarray(np.isfinite(point_TM3).all(-1))
    whole_T = np.asarray(seen_TM.all(-1))
    part_T = ~whole_T & (seen_TM.sum(-1) >= _FEWEST)
    if not whole_T.any() or not part_T.any():
        return point_TM3
    first_M3 = point_TM3[int(whole_T.argmax())]
    onto_F34 = _onto(np.broadcast_to(first_M3, point_TM3[whole_T].shape), point_TM3[whole_T], seen_TM[whole_T])
    back_FM3 = np.einsum("fji,fmj->fmi", onto_F34[..., :3], point_TM3[whole_T] - onto_F34[:, None, :, 3])
    shape_M3 = np.median(back_FM3, axis=0)
    onto_F34 = _onto(np.broadcast_to(shape_M3, point_TM3[part_T].shape), point_TM3[part_T], seen_TM[part_T])
    guess_FM3 = np.einsum("fij,mj->fmi", onto_F34[..., :3], shape_M3) + onto_F34[:, None, :, 3]
    found_TM3 = point_TM3.copy()
    found_TM3[part_T] = np.where(seen_TM[part_T][..., None], point_TM3[part_T], guess_FM3)
    return found_TM3


def _onto(from_FM3: np.ndarray, to_FM3: np.ndarray, seen_FM: np.ndarray) -> np.ndarray:
    """Turns and ways (F, 3, 4) that lead points to others best, those that are seen (Kabsch, Acta Cryst. A32, 1976)."""
    weight_FM1 = seen_FM[..., None] / seen_FM.sum(-1)[:, None, None]
    to_FM3 = np.nan_to_num(to_FM3)
    start_F13, end_F13 = ((weight_FM1 * x).sum(1, keepdims=True) for x in (from_FM3, to_FM3))
    left_F33, _, right_F33 = np.linalg.svd((weight_FM1 * (to_FM3 - end_F13)).mT @ (from_FM3 - start_F13))
    left_F33[..., -1] *= np.sign(np.linalg.det(left_F33 @ right_F33))[:, None]
    turn_F33 = left_F33 @ right_F33
    return np.concatenate([turn_F33, (end_F13 - (turn_F33 @ start_F13.mT).mT).mT], axis=-1)


def _back(markers: Markers) -> np.ndarray:
    """The middle of the pelvis' back (T, 3)."""
    both = [markers.get(f"{side}_back_pelvis") for side in SIDES]
    if both[0] is None or both[1] is None:
        return markers["sacrum"]
    return (both[0] + both[1]) / 2


def _pelvis(markers: Markers) -> np.ndarray:
    """How the pelvis is turned (T, 3, 3): columns to the left, up and forward, in the plane of its markers."""
    left_T3, right_T3 = (markers[f"{side}_front_pelvis"] for side in SIDES)
    return _level(left_T3 - right_T3, (left_T3 + right_T3) / 2 - _back(markers))


def _hips(markers: Markers, pelvis_T33: np.ndarray) -> dict[str, np.ndarray]:
    left_T3, right_T3 = (markers[f"{side}_front_pelvis"] for side in SIDES)
    middle_T3 = (left_T3 + right_T3) / 2
    width, depth = (typical(norm(x)) for x in (left_T3 - right_T3, middle_T3 - _back(markers)))
    beside, above, before = 0.33 * width + 0.0073, -0.30 * width - 0.0109, -0.24 * depth - 0.0099
    return {
        f"{side}_hip": middle_T3 + pelvis_T33 @ np.array([sign * beside, above, before])
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True)
    }


def _chest(markers: Markers) -> np.ndarray | None:
    """How the chest is turned (T, 3, 3), by markers at its four corners."""
    if not {*_RIGID[2]} <= markers.keys():
        return None
    back_neck_T3, back_low_T3, front_neck_T3, front_low_T3 = (markers[name] for name in _RIGID[2])
    up_T3 = (back_neck_T3 + front_neck_T3) - (back_low_T3 + front_low_T3)
    forward_T3 = (front_neck_T3 + front_low_T3) - (back_neck_T3 + back_low_T3)
    frame_T33 = frame_of(up_T3, forward_T3)
    return np.stack([frame_T33[..., 2], frame_T33[..., 0], frame_T33[..., 1]], axis=-1)


def _shoulders(markers: Markers, chest_T33: np.ndarray | None, hips: Markers) -> dict[str, np.ndarray]:
    left_T3, right_T3 = (markers[f"{side}_acromion"] for side in SIDES)
    up_T3 = normalize(left_T3 + right_T3 - hips["left_hip"] - hips["right_hip"])
    if chest_T33 is not None:
        up_T3 = np.where(known_frames(chest_T33)[:, None], chest_T33[..., 1], up_T3)
    below_T3 = _ACROMION * typical(norm(left_T3 - right_T3)) * up_T3
    return {"left_shoulder": left_T3 - below_T3, "right_shoulder": right_T3 - below_T3}


def _head(markers: Markers) -> np.ndarray | None:
    """How the head is turned (T, 3, 3), by markers of a level band around it."""
    if {*_RIGID[0]} <= markers.keys():
        front_left_T3, front_right_T3, back_left_T3, back_right_T3 = (markers[name] for name in _RIGID[0])
        left_T3 = front_left_T3 + back_left_T3 - front_right_T3 - back_right_T3
        forward_T3 = front_left_T3 + front_right_T3 - back_left_T3 - back_right_T3
    elif {"left_side_head", "right_side_head", "brow"} <= markers.keys():
        left_T3 = markers["left_side_head"] - markers["right_side_head"]
        forward_T3 = 2 * markers["brow"] - markers["left_side_head"] - markers["right_side_head"]
    else:
        return None
    return _level(left_T3, forward_T3)


def _size(markers: Markers, hips: Markers) -> float:
    """How large the body is, 1 of an adult."""
    legs = [
        norm(markers[f"{side}_lateral_knee"] - hips[f"{side}_hip"])
        + norm(markers[f"{side}_lateral_ankle"] - markers[f"{side}_lateral_knee"])
        for side in SIDES
        if {f"{side}_lateral_knee", f"{side}_lateral_ankle"} <= markers.keys()
    ]
    size = typical(np.stack(legs)) / _LEG if legs else 1.0
    return float(np.clip(size, *_SIZES)) if np.isfinite(size) else 1.0


def _arm(markers: Markers, side: str, points: Markers, size: float) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
    """Elbow and wrist as far as they are known, and the axis about which the elbow bends."""
    thumb, little = (markers.get(f"{side}_{name}_wrist") for name in ("thumb", "little"))
    wrist_T3 = (thumb + little) / 2 if thumb is not None and little is not None else markers.get(f"{side}_wrist")
    wrist_T3 = next((x for x in (wrist_T3, thumb, little) if x is not None), None)
    found = {} if wrist_T3 is None else {f"{side}_wrist": wrist_T3}
    outer = markers.get(f"{side}_lateral_elbow")
    if outer is None:
        return found, None
    sign = 1.0 if side == "left" else -1.0
    start_T3 = points[f"{side}_shoulder"]
    end_T3 = start_T3 * np.nan if wrist_T3 is None else wrist_T3
    inner = markers.get(f"{side}_medial_elbow")
    elbow_T3, lateral_T3 = _beside(outer, inner, start_T3, end_T3, size * _HALF_WIDTHS["elbow"], -sign)
    return found | {f"{side}_elbow": elbow_T3}, -sign * lateral_T3


def _leg(
    markers: Markers, side: str, points: Markers, pelvis_T33: np.ndarray, size: float
) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
    """Knee and ankle as far as they are known, and the axis about which the knee bends."""
    knee, ankle = (markers.get(f"{side}_lateral_{name}") for name in ("knee", "ankle"))
    if knee is None:
        return {}, None
    sign = 1.0 if side == "left" else -1.0
    half = size * _HALF_WIDTHS["ankle"]
    inner = {name: markers.get(f"{side}_medial_{name}") for name in ("knee", "ankle")}
    hip_T3, lateral_T3 = points[f"{side}_hip"], sign * pelvis_T33[..., 0]
    ankle_T3 = knee * np.nan if ankle is None else ankle
    knee_T3 = knee
    for _ in range(2):  # the ankle is beside its marker along the knee's axis, which needs the ankle
        end_T3 = ankle_T3 - half * lateral_T3
        if inner["ankle"] is not None:
            both_T3 = (ankle_T3 + inner["ankle"]) / 2
            end_T3 = np.where(known_frames(both_T3)[:, None], both_T3, end_T3)
        knee_T3, lateral_T3 = _beside(knee, inner["knee"], hip_T3, end_T3, size * _HALF_WIDTHS["knee"], sign)
    found = {f"{side}_knee": knee_T3}
    return found if ankle is None else found | {f"{side}_ankle": end_T3}, sign * lateral_T3


def _ends(markers: Markers, side: str, arm: Markers) -> dict[str, np.ndarray]:
    """Points of hand and foot."""
    found = {}
    thumb, little, hand = (markers.get(f"{side}_{name}") for name in ("thumb_wrist", "little_wrist", "hand"))
    first, last = (markers.get(f"{side}_{name}_knuckle") for name in ("thumb", "little"))
    if first is not None and last is not None:
        found |= {f"{side}_index": first, f"{side}_pinky": last}
    elif thumb is not None and little is not None and (middle := hand if hand is not None else first) is not None:
        found |= {f"{side}_index": middle + (thumb - little) / 2, f"{side}_pinky": middle - (thumb - little) / 2}
    heel, toe = markers.get(f"{side}_heel"), markers.get(f"{side}_toe")
    big, small = (markers.get(f"{side}_{name}_toe") for name in ("big", "little"))
    if toe is None and big is not None and small is not None:
        toe = (big + small) / 2
    return found | ({f"{side}_heel": heel, f"{side}_toe": toe} if heel is not None and toe is not None else {})


def _beside(
    outer_T3: np.ndarray, inner: np.ndarray | None, start_T3: np.ndarray, end_T3: np.ndarray, half: float, sense: float
) -> tuple[np.ndarray, np.ndarray]:
    """A joint (T, 3) and the unit vector (T, 3) from it to its outer marker.

    Args:
        outer_T3: the marker on the outer side.
        inner: that on the inner side (T, 3), if there is one.
        start_T3: where the upper bone starts.
        end_T3: where the lower bone ends.
        half: how far the joint is from a marker [m].
        sense: 1 where upper and lower bone and the way to the marker are right-handed when the joint is bent, or -1.
    """
    along_T3 = normalize(end_T3 - start_T3)
    to_T3 = outer_T3 - start_T3
    across_T3 = to_T3 - along_T3 * (to_T3 * along_T3).sum(-1, keepdims=True)
    far_T = norm(across_T3)
    cosine_T = np.clip(half / np.maximum(far_T, 1e-6), 0.0, 1.0)
    sine_T = np.sqrt(1.0 - cosine_T**2)
    first_T3 = normalize(across_T3)
    # of the two vectors at right angles to both bones that reach the marker, the one on the side to which it bends
    lateral_T3 = cosine_T[:, None] * first_T3 - sense * sine_T[:, None] * cross(along_T3, first_T3)
    joint_T3 = outer_T3 - half * lateral_T3
    # without the lower bone's end, its own middle alone tells, of two markers
    if inner is not None:
        both_T3, way_T3 = (outer_T3 + inner) / 2, normalize(outer_T3 - inner)
        known_T1 = known_frames(both_T3)[:, None]
        joint_T3, lateral_T3 = np.where(known_T1, both_T3, joint_T3), np.where(known_T1, way_T3, lateral_T3)
    return joint_T3, lateral_T3


def _level(left_T3: np.ndarray, forward_T3: np.ndarray) -> np.ndarray:
    """How a part is turned (T, 3, 3) whose vectors to the left and forward are level: columns left, up, forward."""
    frame_T33 = frame_of(left_T3, forward_T3)
    return np.stack([frame_T33[..., 0], -frame_T33[..., 2], frame_T33[..., 1]], axis=-1)


def _about_x(angle_deg: float) -> np.ndarray:
    """A turn about the axis to the left, by which what is in front comes down."""
    sine, cosine = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
