"""Places of a root that are far away, or not known in some frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.motion import ReadOptions, read_motion, trim
from mrhubo.motion.far_places import kept_places
from tests.motion.bvh_writer import Style, write_bvh

FRAMES = 20
WAY_T3 = np.linspace([0.0, 0.9, 0.0], [0.3, 0.95, 1.4], FRAMES)
far = st.floats(-5e6, 5e6)


@given(x=far, y=far, z=far)
def test_ways_far_from_the_origin_keep_their_steps(x: float, y: float, z: float) -> None:
    notes: list[str] = []
    kept_T3 = kept_places(WAY_T3 + [x, y, z], "'trans'", notes)
    assert kept_T3 is not None and (np.abs(kept_T3) <= 2e4 + 2).all()
    np.testing.assert_allclose(np.diff(kept_T3, axis=0), np.diff(WAY_T3, axis=0), atol=5e-3)
    assert bool(notes) == (np.abs(WAY_T3 + [x, y, z]).max() > 2e4)


@given(
    missing=st.sets(st.integers(0, FRAMES - 1), min_size=1, max_size=FRAMES - 1),
    wrong=st.sampled_from((np.nan, np.inf, 1e30)),
)
def test_places_that_are_not_known_are_filled_in_or_left_out(missing: set[int], wrong: float) -> None:
    notes, place_T3 = [], WAY_T3.copy()
    place_T3[sorted(missing)] = wrong
    kept_T3 = kept_places(place_T3, "'trans'", notes)
    assert len(notes) == 1
    if len(missing) < FRAMES / 2:
        assert kept_T3 is not None and "filled in" in notes[0]
        inside = range(min(set(range(FRAMES)) - missing), max(set(range(FRAMES)) - missing) + 1)
        np.testing.assert_allclose(kept_T3[inside], WAY_T3[inside], atol=1e-5)
    else:
        assert kept_T3 is None and "left out" in notes[0]


def test_a_root_that_is_lost_is_left_out() -> None:
    notes: list[str] = []
    assert (
        kept_places(np.linspace([0.0, 0, 0], [1e7, 0, 0], FRAMES), "'trans'", notes) is None and "farther" in notes[0]
    )


@pytest.mark.parametrize("form", ["npz", "bvh"])
def test_files_in_surveyors_coordinates_are_read(form: str, tmp_path: Path) -> None:
    shipped = Path(__file__).resolve().parents[2] / "data/motions/wave.npz"
    motion = trim(read_motion(shipped), end=1.0)
    away = np.array([512_345.0, 12.0, 4_600_000.0])
    place_T3 = np.linspace([0.0, 0.9, 0.0], [0.3, 0.95, 1.4], len(motion))
    path = tmp_path / f"far.{form}"
    if form == "bvh":
        moving = motion.changed(
            root_position_T3=place_T3.astype(np.float32),
            root_rotation_T33=np.tile(np.eye(3, dtype=np.float32), (len(motion), 1, 1)),
        )
        text = write_bvh(moving, Style(unit=1.0, names="mixamo"))
        head, _, rows = text.partition("Frame Time: ")
        lines = rows.splitlines()
        for number, line in enumerate(lines[1:], start=1):
            words = line.split()
            words[:3] = [f"{float(word) + by:.6f}" for word, by in zip(words[:3], away, strict=True)]
            lines[number] = " ".join(words)
        path.write_text(head + "Frame Time: " + "\n".join(lines) + "\n")
    else:
        with np.load(shipped) as told:
            np.savez(
                path,
                **{
                    **told,
                    "trans": place_T3 + away,
                    **{k: told[k][: len(motion)] for k in ("pose_body", "root_orient")},
                },
            )
    found = read_motion(path, ReadOptions())
    kept_T3 = found.arrays.root_position_T3
    assert kept_T3 is not None and any("far from the origin" in note for note in found.notes)
    np.testing.assert_allclose(kept_T3 - kept_T3[0], place_T3 - place_T3[0], atol=5e-3)
