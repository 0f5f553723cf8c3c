"""A part of a motion is that part; a mirror image is one for the body too, and mirrored twice is the motion."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from mrhubo.body import JOINT_NAMES, Skeleton, mirror_pose
from mrhubo.errors import UserError
from mrhubo.motion import Motion, mirror, trim
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_sixd


@pytest.fixture
def motion() -> Motion:
    generator = torch.Generator().manual_seed(0)
    turn_TX3 = torch.randn(11, 22, 3, generator=generator)
    local = axis_angle_to_matrix(turn_TX3)
    trust = torch.rand(11, 21, generator=generator)
    place = torch.randn(11, 3, generator=generator)
    return Motion("a", local[:, 1:], 10.0, root_rotation_T33=local[:, 0], root_position_T3=place, confidence_TJ=trust)


@pytest.mark.parametrize(
    ("start", "end", "first", "count"),
    [
        (0.0, None, 0, 11),
        (0.3, None, 3, 8),
        (0.25, 0.55, 3, 3),
        (0.3, 0.3, 3, 1),
        (0.0, 99.0, 0, 11),
        (1.0, None, 10, 1),
    ],
)
def test_the_frames_of_a_span_are_kept(motion: Motion, start: float, end: float | None, first: int, count: int) -> None:
    found = trim(motion, start, end)
    for field in ("local_TJ33", "root_rotation_T33", "root_position_T3", "confidence_TJ"):
        assert torch.equal(getattr(found, field), getattr(motion, field)[first : first + count]), field
    bare = dataclasses.replace(motion, root_rotation_T33=None, root_position_T3=None, confidence_TJ=None)
    assert len(trim(bare, start, end)) == count


@pytest.mark.parametrize(("start", "end"), [(1.01, None), (0.31, 0.39), (-1.0, None), (0.5, 0.4), (float("nan"), None)])
def test_no_span_is_refused(motion: Motion, start: float, end: float | None) -> None:
    with pytest.raises(
        UserError, match="a: has no frame from .*; it lasts from 0 to 1.000 s|from .* s to .* is no span of time"
    ):
        trim(motion, start, end)


def test_a_mirror_image_has_left_and_right_exchanged(motion: Motion) -> None:
    found = mirror(motion)
    assert found.name == "a_mirrored" and found.notes
    torch.testing.assert_close(matrix_to_sixd(found.local_TJ33), mirror_pose(matrix_to_sixd(motion.local_TJ33)))
    skeleton = Skeleton()
    places = [skeleton.keypoints(m.local_TJ33)[:, : len(JOINT_NAMES)] for m in (motion, found)]
    other = [JOINT_NAMES.index(_other(name)) for name in JOINT_NAMES]
    mirrored = places[0][:, other] * torch.tensor([-1.0, 1.0, 1.0])
    torch.testing.assert_close(places[1], mirrored, atol=1e-5, rtol=0)
    assert found.root_position_T3 is not None and motion.root_position_T3 is not None
    torch.testing.assert_close(found.root_position_T3[:, 1:], motion.root_position_T3[:, 1:])


def _other(name: str) -> str:
    side, _, rest = name.partition("_")
    return {"left": "right_", "right": "left_"}.get(side, "") + rest if rest else name


def test_mirrored_twice_is_the_motion(motion: Motion) -> None:
    found = mirror(mirror(motion))
    for field in ("local_TJ33", "root_rotation_T33", "root_position_T3", "confidence_TJ"):
        assert torch.equal(getattr(found, field), getattr(motion, field)), field
    assert not torch.equal(mirror(motion).local_TJ33, motion.local_TJ33)
