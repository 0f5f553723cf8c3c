"""The table of body parts agrees with the human body, and nothing else knows a part by its name."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
import torch

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_JOINT, KEYPOINT_NAMES, PARENTS, Skeleton, ancestors
from mrhubo.robot.parts import PARTS, BodyPart, LimbPart, OrientedPart, points_beyond

NAMES = [part.name for part in PARTS]


@pytest.mark.parametrize("part", PARTS, ids=NAMES)
def test_rows_name_what_there_is_and_stand_after_what_they_hang_on(part: BodyPart) -> None:
    before = NAMES[: NAMES.index(part.name)]
    assert {part.hangs_on, part.seen_from} - {None} <= set(before)
    assert {part.joint, *part.inputs} <= set(JOINT_NAMES)
    assert part.weight > 0
    if isinstance(part, LimbPart):
        assert {part.start, part.end} <= set(KEYPOINT_NAMES) and part.joint == part.start
    if isinstance(part, OrientedPart) and part.seen_from:
        assert part.turned_by[-1] == part.joint
        chain = [JOINT_NAMES.index(name) for name in part.turned_by]
        assert [PARENTS[joint] for joint in chain[1:]] == chain[:-1], "joints that share a turn hang on each other"
        for point in part.points:
            assert JOINT_NAMES.index(part.joint) in ancestors(KEYPOINT_JOINT[KEYPOINT_NAMES.index(point)])
        assert set(part.stands) <= set(part.points)


def test_a_limb_ends_at_the_joint_below_its_own() -> None:
    for part in PARTS:
        if isinstance(part, LimbPart):
            assert PARENTS[JOINT_NAMES.index(part.end)] == JOINT_NAMES.index(part.joint)


def test_what_moves_with_a_limb_is_all_that_the_human_has_beyond_its_start() -> None:
    """Of the keypoints that the table knows: those whose joint hangs on the limb's own."""
    known = {point for part in PARTS for point in part.outer_points}
    for part in PARTS:
        if isinstance(part, LimbPart):
            joint = JOINT_NAMES.index(part.joint)
            beyond = {
                name
                for name, carrier in zip(KEYPOINT_NAMES, KEYPOINT_JOINT, strict=True)
                if joint in ancestors(carrier) and name in known and name != part.start
            }
            assert set(points_beyond(part)) == beyond


def test_names_of_parts_and_directions_are_distinct() -> None:
    directions = [name for part in PARTS for name in part.direction_names]
    assert len(set(directions)) == len(directions) and len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("part", [p for p in PARTS if isinstance(p, OrientedPart)], ids=lambda part: part.name)
def test_an_oriented_part_turns_from_rest(part: OrientedPart) -> None:
    first, second = torch.tensor(part.rest)
    torch.testing.assert_close(part.turn(first, second), torch.eye(3))
    turn_33 = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(0))).Q
    turn_33 = turn_33 * torch.linalg.det(turn_33)
    torch.testing.assert_close(part.turn(turn_33 @ first, turn_33 @ second), turn_33)


def test_a_hand_rests_along_its_knuckles_the_head_looks_past_its_eyes_and_feet_point_to_their_toes() -> None:
    at = dict(zip(KEYPOINT_NAMES, Skeleton().rest_K3, strict=True))
    for part in PARTS:
        if isinstance(part, OrientedPart) and part.points and not part.by_itself:
            middle = torch.stack([at[name] for name in part.points]).mean(0) - at[part.joint]
            assert float(middle @ torch.tensor(part.rest[0])) > 0.05


_SURGERY = {"split", "rsplit", "replace", "startswith", "endswith", "removeprefix", "removesuffix", "partition"}
_WORDS = {
    "left",
    "right",
    "hand",
    "head",
    "eye",
    "hip",
    "knee",
    "ankle",
    "foot",
    "collar",
    "shoulder",
    "elbow",
    "wrist",
}


def test_no_name_of_a_part_is_taken_apart(root: Path) -> None:
    """Sides and parts come from tables: no string method is called with a word of the body, nor is one looked for."""
    found = []
    for path in sorted((root / "mrhubo").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            words: list[ast.expr] = []
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _SURGERY:
                words = [*node.args, *(e for a in node.args if isinstance(a, ast.Tuple) for e in a.elts)]
            elif isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn):
                words = [node.left] if isinstance(node.comparators[0], ast.Name) else []
            for word in words:
                text = word.value if isinstance(word, ast.Constant) and isinstance(word.value, str) else ""
                if {text.strip("_"), text.rstrip("_")} & _WORDS and not _is_a_set(node):
                    found.append(f"{path.relative_to(root)}:{node.lineno}: {text!r}")
    # the names of a search range of `robot.manual`, which may leave out the side
    assert [entry for entry in found if "manual_scale.py" not in entry] == []


def _is_a_set(node: ast.AST) -> bool:
    """`"neck" in points` asks for a whole name, where `"eye" in name` looks for a part of one."""
    return isinstance(node, ast.Compare) and isinstance(node.comparators[0], ast.Name) and node.comparators[0].id in (
        "points", "knuckles", "names",
    )  # fmt: skip
