"""Which joints are arms and legs, of bodies that are not built as people are."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.motion.readers.tree.anatomy import find_anatomy
from mrhubo.motion.readers.tree.hierarchy import Joint, JointTree

_TRUNK = (
    ("Hips", "", (0.0, 0.0, 0.0)), ("Spine", "Hips", (0.0, 0.12, 0.0)), ("Chest", "Spine", (0.0, 0.2, 0.0)),
    ("Neck", "Chest", (0.0, 0.25, 0.0)), ("Head", "Neck", (0.0, 0.1, 0.0)), ("HeadTop", "Head", (0.0, 0.2, 0.0)),
)  # fmt: skip


def _body(arm: float, leg: float, width: float) -> JointTree:
    """A body whose arms and legs are longer than a man's by these factors, and its shoulders wider; it moves a bit."""
    rows = list(_TRUNK)
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        rows += [
            (f"{side}Shoulder", "Chest", (0.03 * x, 0.2, 0.0)),
            (f"{side}Arm", f"{side}Shoulder", (0.15 * x * width, 0.0, 0.0)),
            (f"{side}ForeArm", f"{side}Arm", (0.28 * x * arm, 0.0, 0.0)),
            (f"{side}Hand", f"{side}ForeArm", (0.25 * x * arm, 0.0, 0.0)),
            (f"{side}HandEnd", f"{side}Hand", (0.12 * x * arm, 0.0, 0.0)),
            (f"{side}UpLeg", "Hips", (0.09 * x, -0.04, 0.0)),
            (f"{side}Leg", f"{side}UpLeg", (0.0, -0.42 * leg, 0.0)),
            (f"{side}Foot", f"{side}Leg", (0.0, -0.41 * leg, 0.0)),
            (f"{side}Toe", f"{side}Foot", (0.0, -0.05 * leg, 0.13 * leg)),
        ]
    places = {name: place for place, (name, _, _) in enumerate(rows)}
    joints = tuple(
        Joint(name, places.get(parent, -1), offset, tuple((axis, 3 * i + j) for j, axis in enumerate("zyx")), ())
        for i, (name, parent, offset) in enumerate(rows)
    )
    return JointTree(joints, np.random.default_rng(0).uniform(-20, 20, (20, 3 * len(rows))).astype(np.float32), "rest")


@pytest.mark.parametrize(
    ("arm", "leg", "width"), [(1.0, 1.0, 1.0), (1.5, 0.7, 1.6), (1.3, 0.9, 1.4), (0.6, 0.45, 0.6), (1.0, 0.6, 1.0)]
)
def test_names_tell_arms_and_legs_of_apes_and_cartoons(arm: float, leg: float, width: float) -> None:
    tree = _body(arm, leg, width)
    found = {ours: tree.names[place] for ours, place in find_anatomy(tree).place.items()}
    assert found["pelvis"] == "Hips" and found["spine3"] == "Chest" and found["head"] == "Head"
    for side, name in (("left", "Left"), ("right", "Right")):
        ends = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
        parts = ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")
        assert [found[f"{side}_{end}"] for end in ends] == [f"{name}{part}" for part in parts]
