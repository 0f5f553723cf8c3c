"""People of whom files have points: who is who, with and without names, and what is known of them."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from mrhubo import UserError
from mrhubo.motion.readers.linking import LINKED, link
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.sightings import Sighting, check_size, frames_of_one, known_points, person_called

PATH = Path("clip")
BODY_K3 = np.random.default_rng(0).normal(size=(17, 3))


def found(sightings: list[Sighting], person: str | None = None) -> tuple[str, list[int | None], list[str]]:
    notes: list[str] = []
    return *frames_of_one(PATH, sightings, ReadOptions(person=person), notes), notes


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("scale", [1.0, 1000.0])
def test_people_who_change_places_in_the_list_are_told_apart(named: bool, scale: float) -> None:
    """Two people, one of whom loses half of the points in every third frame; in any unit."""
    random = np.random.default_rng(1)
    sightings: list[Sighting] = []
    places: dict[int, list[int]] = {0: [], 1: []}
    for frame in range(40):
        for person in random.permutation(2).tolist():
            point_K3 = scale * (BODY_K3 + [1.5 * person, 0, 0.05 * frame] + 0.02 * random.normal(size=(17, 3)))
            if person and frame % 3 == 0:
                point_K3[random.permutation(17)[:9]] = np.nan
            places[person].append(len(sightings))
            sightings.append(Sighting(frame, "ab"[person] if named else None, point_K3))
    first = sightings[0].point_K3 is sightings[places[0][0]].point_K3
    names = ("a", "b") if named else ("0", "1") if first else ("1", "0")
    for person, name in enumerate(names):
        chosen, frames, notes = found(sightings, name)
        assert chosen == name and frames == places[person]
        assert (LINKED in notes) != named


def test_whoever_has_a_name_in_some_frames_only_is_never_mistaken() -> None:
    """A tracker lost its person, -1, while another was there."""
    rows = [(0, "0", 0.0), (0, "1", 9.0), (1, None, 0.0), (1, "1", 9.0), (2, "0", 0.0), (2, "1", 9.0)]
    sightings = [Sighting(frame, name, BODY_K3 + x) for frame, name, x in rows]
    assert found(sightings, "0")[1] == [0, None, 4] and found(sightings, "1")[1] == [1, 3, 5]
    chosen, frames, notes = found(sightings, "2")
    assert (chosen, frames) == ("2", [2]) and LINKED in notes


def test_people_whose_points_are_around_one_origin_are_told_apart_in_the_picture() -> None:
    """Both do the same, and in every frame the other one comes first."""
    sightings = [
        Sighting(frame, None, BODY_K3 + 0.02 * frame, picture_2=np.array([person + 0.03 * frame, 0.5]))
        for frame in range(20)
        for person in ((0, 1) if frame % 2 else (1, 0))
    ]
    expected = [2 * frame + (frame % 2) for frame in range(20)]
    assert found(sightings, "0")[1] == expected


def test_a_name_that_two_people_of_a_frame_have_is_none() -> None:
    rows = [(0, 0.0), (0, 9.0), (1, 9.0), (1, 0.0), (2, 0.0), (2, 9.0)]
    sightings = [Sighting(frame, "0", BODY_K3 + x) for frame, x in rows]
    assert found(sightings, "0")[1] == [0, 3, 4] and found(sightings, "1")[1] == [1, 2, 5]


def test_one_person_alone_is_one_person_wherever_they_are() -> None:
    """Without a name, with a gap and a leap; in some frames a person without points, as OpenPose has them, is there."""
    sightings = [Sighting(frame, None, BODY_K3 + 9 * (frame > 50)) for frame in (0, 1, 60, 61)]
    sightings += [Sighting(frame, None, np.zeros((17, 3)), np.zeros(17)) for frame in (1, 60)]
    person, frames, notes = found(sightings)
    assert (person, frames, notes) == ("0", [0, 1, *[None] * 58, 2, 3], [])


@pytest.mark.parametrize(
    ("value", "expected"),
    [([-1], None), (-1, None), ([3], "3"), (0, "0"), (2.0, "2"), ("left one", "left one"), ("", None), ([], None),
     (True, None), ({"a": 1}, None), (float("nan"), None), (None, None), ([1, 2], None)],
)  # fmt: skip
def test_what_files_call_people(value: object, expected: str | None) -> None:
    assert person_called(value) == expected


def test_points_that_are_missing() -> None:
    point_K3 = np.array([[0, 0, 0], [0, 0, 0], [1, 2, 3], [1, np.nan, 3], [4, 5, 6.0]])
    known_K = np.isfinite(known_points(point_K3, np.array([1, 1, 1, 1, 0.1]))).all(-1)
    assert known_K.tolist() == [False, False, True, False, False]


def test_arrays_that_are_too_large_are_refused_before_they_are_made() -> None:
    check_size(PATH, "'points'", 100_000, 55)
    for frames, points in ((500_001, 17), (9, 1_001), (100_000, 100)):
        with pytest.raises(UserError, match="at most"):
            check_size(PATH, "'points'", frames, points)
    with pytest.raises(UserError, match=r"seen in 2 of 1,000,000 frames"):
        found([Sighting(0, None, BODY_K3), Sighting(999_999, None, BODY_K3)])


def test_people_are_followed_in_time_that_grows_with_the_frames() -> None:
    """People who come and go: each frame has five others."""

    def seconds(frames: int) -> float:
        random = np.random.default_rng(0)
        places = [random.uniform(-1000, 1000, (5, 3)) for _ in range(frames)]
        start = time.process_time()
        link(places, 1.0)
        return time.process_time() - start

    seconds(100)
    assert seconds(3_000) < 12 * max(seconds(500), 0.02)


def test_whoever_is_lost_is_lost_by_the_numbers_of_frames() -> None:
    here, away = np.zeros((1, 3)), np.full((1, 3), 5.0)
    both = np.concatenate([here, away])
    assert link([both, here, both], 1.0, [0, 25, 50]) == [[0, 1], [0], [0, 2]]
    assert link([both, here, both], 1.0, [0, 10, 20]) == [[0, 1], [0], [0, 1]]
