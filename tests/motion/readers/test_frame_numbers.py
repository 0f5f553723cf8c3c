"""Numbers of frames by the names of their files: gaps are kept, steps are counted, the order is that of numbers."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo import UserError
from mrhubo.motion.readers.frame_numbers import frame_numbers

steps = st.lists(st.integers(1, 9), min_size=1, max_size=30).map(lambda steps: [1, *steps])


@given(
    steps,
    st.integers(0, 200),
    st.integers(1, 12),
    st.sampled_from(["{:06d}", "frame{}_keypoints3d", "cam2/v_{:012d}_keypoints", "{0}_t{1}", "take3-{0}-{0}"]),
    st.randoms(use_true_random=False),
)
def test_numbers_are_found_wherever_they_stand(steps: list[int], first: int, step: int, form: str, random) -> None:
    expected = [sum(steps[:place]) for place in range(len(steps) + 1)]
    random.shuffle(expected)
    names = [form.format(first + step * number, 7 + first + step * number) for number in expected]
    assert frame_numbers(names) == expected


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["12_59_58", "12_59_59", "13_00_00"], [0, 1, 2]),  # a clock's, of which no part rises throughout
        (["12033", "12067", "12100", "12201"], [0, 1, 2, 5]),  # times in milliseconds, with a gap
        (["7_1700000033", "9_1700000100"], [0, 1]),
        (["0001_0", "0002_0", "0004_1"], [0, 1, 3]),  # the person after the frame
        (["b3d", "a3d"], [0, 1]),  # nothing varies: as given
        (["frame", "frame 1", "frame 12"], [0, 1, 2]),
        (["9" * 40, "9" * 39 + "8"], [1, 0]),
        ([""], [0]),
        ([], []),
    ],
)
def test_names_of_other_kinds(names: list[str], expected: list[int]) -> None:
    assert frame_numbers(names) == expected


@given(st.lists(st.text("019_a", max_size=40), unique=True, max_size=8))
def test_whatever_is_read_has_numbers_that_start_at_0_and_differ(names: list[str]) -> None:
    try:
        numbers = sorted(frame_numbers(names))
    except UserError as error:
        assert "same number" in str(error)
        return
    assert numbers[:1] == [0][: len(names)] and all(one < other for one, other in pairwise(numbers))
    assert math.gcd(*numbers) <= 1 or len(names) < 2


def test_two_motions_in_one_folder_are_refused() -> None:
    with pytest.raises(UserError, match="'a_1' and 'b_1' have the same number"):
        frame_numbers(["a_1", "b_1", "a_2", "b_2"])
