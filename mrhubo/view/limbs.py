"""Arms, hands, legs and feet as tapered capsules around joint centres.

Points and frames are in the world frame (x forward, y left, z up), metres; ``scale`` is the figure's size over that of
the adult for whom the radii are meant. A part whose points are missing is an empty list.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

Row = tuple[np.ndarray, np.ndarray, float, float]
"""A tapered capsule: start, end, m, world frame; radius at the start, at the end, m."""
Points = Mapping[str, np.ndarray]
"""Name -> position (3,), m, world frame."""


def unit(vector_3: np.ndarray, fallback_3: np.ndarray | None = None) -> np.ndarray:
    """The vector (3,) at length 1; where it has no direction, the fallback, which is up by default."""
    length = float(np.linalg.norm(vector_3))
    if length > 1e-6:
        return vector_3 / length
    return np.array([0.0, 0.0, 1.0]) if fallback_3 is None else fallback_3


def frame(up_3: np.ndarray, left_3: np.ndarray) -> np.ndarray:
    """Columns left, up, forward (3, 3) of a right-handed frame; up is kept, left is made orthogonal to it."""
    up = unit(up_3)
    left = unit(left_3 - up * (left_3 @ up), np.array([0.0, 1.0, 0.0]))
    return np.stack([left, up, np.cross(left, up)], axis=1)


def at(origin_3: np.ndarray, frame_33: np.ndarray, scale: float, left: float, up: float, forward: float) -> np.ndarray:
    """The point (3,) at an offset (m, times ``scale``) from an origin, along the columns of a frame."""
    return origin_3 + frame_33 @ (scale * np.array([left, up, forward]))


def pelvis_frame(points: Points) -> np.ndarray | None:
    """Left, up, forward (columns, (3, 3)) of the pelvis, from the points that it holds."""
    for high in ("spine1", "spine2", "spine3", "neck"):
        if {"left_hip", "right_hip", "pelvis", high} <= points.keys():
            return frame(points[high] - points["pelvis"], points["left_hip"] - points["right_hip"])
    return None


def arm(points: Points, side: str, scale: float) -> list[Row]:
    """Upper arm and forearm; ``side``: left or right."""
    shoulder, elbow, wrist = (points.get(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist"))
    rows: list[Row] = []
    if shoulder is not None and elbow is not None:
        middle = shoulder + 0.45 * (elbow - shoulder)
        rows += [(shoulder, middle, 0.058 * scale, 0.048 * scale), (middle, elbow, 0.048 * scale, 0.039 * scale)]
    if elbow is not None and wrist is not None:
        thick = elbow + 0.28 * (wrist - elbow)
        rows += [(elbow, thick, 0.039 * scale, 0.043 * scale), (thick, wrist, 0.043 * scale, 0.027 * scale)]
    return rows


def hand(points: Points, side: str, scale: float) -> list[Row]:
    """Palm, four slightly bent fingers, thumb; only a mitten where the knuckles are missing."""
    wrist = points.get(f"{side}_wrist")
    if wrist is None:
        return []
    knuckles = {name: points[f"{side}_{name}"] for name in ("index", "middle", "pinky") if f"{side}_{name}" in points}
    if not knuckles:
        elbow = points.get(f"{side}_elbow")
        if elbow is None:
            return []
        reach = unit(wrist - elbow)
        palm = wrist + 0.085 * scale * reach
        tip = palm + 0.06 * scale * reach
        return [(wrist, palm, 0.028 * scale, 0.033 * scale), (palm, tip, 0.033 * scale, 0.018 * scale)]
    middle = knuckles["middle"] if "middle" in knuckles else np.mean(list(knuckles.values()), axis=0)
    reach = middle - wrist
    ahead = unit(reach)
    thumb = points.get(f"{side}_thumb")
    across = thumb - wrist if thumb is not None else np.zeros(3)
    if "index" in knuckles and "pinky" in knuckles:
        across = knuckles["index"] - knuckles["pinky"]
    across = across - ahead * (across @ ahead)
    if float(np.linalg.norm(across)) < 1e-4:
        tip = middle + 0.7 * reach
        return [(wrist, middle, 0.028 * scale, 0.034 * scale), (middle, tip, 0.034 * scale, 0.016 * scale)]
    across = unit(across)
    palmar = np.cross(ahead, across) * (1.0 if side == "left" else -1.0)  # out of the palm
    rows: list[Row] = []
    for place in (0.030, 0.010, -0.010, -0.030):  # index, middle, ring, little finger
        knuckle = middle + scale * place * across - ahead * scale * (0.012 if abs(place) > 0.02 else 0.0)
        length = (0.078 if abs(place) < 0.02 else 0.066) * scale
        bend = knuckle + length * unit(ahead + 0.22 * palmar) * 0.55
        tip = bend + length * unit(ahead + 0.6 * palmar) * 0.45
        rows.append((wrist + 0.4 * scale * place * across, knuckle, 0.021 * scale, 0.0145 * scale))
        rows.append((knuckle, bend, 0.0135 * scale, 0.0115 * scale))
        rows.append((bend, tip, 0.0115 * scale, 0.0095 * scale))
    root = wrist + scale * (0.018 * across + 0.022 * ahead + 0.004 * palmar)
    knuckle = thumb if thumb is not None else wrist + scale * (0.05 * across + 0.05 * ahead + 0.012 * palmar)
    tip = knuckle + 0.038 * scale * unit(0.9 * ahead + 0.45 * across)
    rows += [(root, knuckle, 0.0195 * scale, 0.015 * scale), (knuckle, tip, 0.015 * scale, 0.0105 * scale)]
    return rows


def leg(points: Points, side: str, scale: float) -> list[Row]:
    """Thigh with its share of the seat, and calf."""
    hip, knee, ankle, ball = (points.get(f"{side}_{name}") for name in ("hip", "knee", "ankle", "foot"))
    rows: list[Row] = []
    if hip is not None and knee is not None:
        along = knee - hip
        top, middle = hip + 0.06 * along, hip + 0.4 * along
        rows += [(top, middle, 0.084 * scale, 0.077 * scale), (middle, knee, 0.077 * scale, 0.054 * scale)]
        pelvis = pelvis_frame(points)
        if pelvis is not None:
            seat = at(points["pelvis"], pelvis, scale, 0.068 if side == "left" else -0.068, -0.06, 0.004)
            rows.append((seat, top, 0.098 * scale, 0.084 * scale))
    if knee is not None and ankle is not None:
        back = np.zeros(3)
        if ball is not None:
            along = unit(ankle - knee)
            back = ankle - ball
            back = unit(back - along * (back @ along), np.zeros(3))
        calf = knee + 0.3 * (ankle - knee) + 0.012 * scale * back
        rows += [(knee, calf, 0.052 * scale, 0.055 * scale), (calf, ankle, 0.055 * scale, 0.035 * scale)]
    return rows


def foot(points: Points, side: str, scale: float) -> list[Row]:
    """Heel, ball and toe of a shoe; toe and heel are guessed where they are missing."""
    ankle, ball = points.get(f"{side}_ankle"), points.get(f"{side}_foot")
    if ankle is None:
        return []
    toe, heel = points.get(f"{side}_toe"), points.get(f"{side}_heel")
    if ball is None:
        ball = toe if toe is None else ankle + 0.7 * (toe - ankle)
    if ball is None:
        return []
    if toe is None:
        toe = ball + 0.07 * scale * unit(ball - ankle - _sole_drop(ankle, ball))
    if heel is None:
        heel = ball - 0.17 * scale * unit(ball - ankle - _sole_drop(ankle, ball))
    forward = unit(toe - heel)
    heel, toe = heel + 0.03 * scale * forward, toe - 0.022 * scale * forward
    return [
        (ankle, heel, 0.037 * scale, 0.034 * scale),
        (ankle, ball, 0.038 * scale, 0.036 * scale),
        (heel, ball, 0.034 * scale, 0.036 * scale),
        (ball, toe, 0.038 * scale, 0.024 * scale),
    ]


def _sole_drop(ankle_3: np.ndarray, ball_3: np.ndarray) -> np.ndarray:
    """The part of ankle -> ball that goes down to the sole when the foot stands flat: a third of its length."""
    reach = ball_3 - ankle_3
    down = np.array([0.0, 0.0, -1.0])
    forward = unit(reach)
    down = down - forward * (down @ forward)
    return unit(down, np.zeros(3)) * 0.32 * float(np.linalg.norm(reach))
