"""Tables whose header is of several lines, or whose cells have a point each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mrhubo
from mrhubo.body.joints import JOINT_NAMES
from mrhubo.motion import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.table_header import with_one_header
from tests.motion.readers.markers.bodies import BONES, moving_body
from tests.motion.readers.markers.test_convert import limbs_off


def rows() -> list[list[list[float]]]:
    """Places of joints, frame by frame."""
    place_TJ3 = moving_body("boxing")[0]
    return [[place_TJ3[t, JOINT_NAMES.index(ours)].tolist() for ours in BONES.values()] for t in range(len(place_TJ3))]


def _words(numbers: Sequence[float], sign: str) -> str:
    return sign.join(f"{number:.6f}" for number in numbers)


def total_capture() -> str:
    lines = ["\t".join(_words([x / 0.0254 for x in place], " ") for place in row) + "\t" for row in rows()]
    return "\n".join(["\t".join(BONES) + "\t", *lines, ""])


def deeplabcut() -> str:
    head = [
        "scorer" + ",DLC_3D" * (3 * len(BONES)),
        "bodyparts," + ",".join(name for name in BONES for _ in "xyz"),
        "coords" + ",x,y,z" * len(BONES),
    ]
    return "\n".join([*head, *(f"{t},{_words(sum(row, []), ',')}" for t, row in enumerate(rows()))])


def spreadsheet(sign: str = ",", units: bool = True) -> str:
    """A name over the first of its axes, times, units, and a title."""
    head = [
        "Take 3" + sign * (3 * len(BONES) + 1),
        sign.join(["Frame", "Time", *(name + 2 * sign for name in BONES)]),
        sign.join(["", "", *("X", "Y", "Z") * len(BONES)]),
        *([sign.join(["", "s", *("m",) * (3 * len(BONES))])] if units else []),
    ]
    lines = [f"{t}{sign}{t / 50}{sign}{_words(sum(row, []), sign)}" for t, row in enumerate(rows())]
    return "\n".join([*head, *lines])


@pytest.mark.parametrize(
    ("write", "rate"),
    [
        (total_capture, None), (deeplabcut, None), (spreadsheet, 50), (lambda: spreadsheet("\t", False), 50),
        (lambda: spreadsheet(";").replace(".", ","), 50), (lambda: spreadsheet().replace("\n", "\r\n"), 50),
    ],
)  # fmt: skip
def test_limbs_are_the_bodys(write: Callable[[], str], rate: float | None, tmp_path: Path) -> None:
    path = tmp_path / "take.txt"
    path.write_text(write(), newline="")
    motion = mrhubo.read_motion(path, ReadOptions() if rate else ReadOptions(rate=60))
    assert motion.frame_rate == pytest.approx(rate or 60) and len(motion) == 60
    assert limbs_off(motion) < 0.2 and "the table, by their names" in motion.source


def test_several_animals_are_not_one(tmp_path: Path) -> None:
    lines = deeplabcut().split("\n")
    twice = [line + line[line.index(",") :] for line in lines]
    path = tmp_path / "take.csv"
    path.write_text("\n".join(twice))
    with pytest.raises(NoMotion):
        mrhubo.read_motion(path, ReadOptions(rate=60))


@given(st.text(alphabet='xyzXYZab1. ,;\t"\n', max_size=300))
def test_other_lines_stay(text: str) -> None:
    lines = text.split("\n")
    changed = with_one_header(lines)
    assert changed is lines or len(changed) <= len(lines)


def test_a_plain_header_stays() -> None:
    header = ",".join(f"{name}_{axis}" for name in BONES for axis in "xyz")
    lines = [header, *(_words(np.ravel(row), ",") for row in rows())]
    assert with_one_header(lines) is lines
