"""Where a person with legs is: a pelvis that is told to hang at one place bends and steps as one whose place is told."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from mrhubo.fast import FastRetargeter
from mrhubo.fast.leg_section import Legs
from mrhubo.fast.plain.ground import Seen, person_points
from mrhubo.live.body import SeenPose
from mrhubo.live.roots import AGAIN_S, MOVED_M, Roots
from tests.live.walkers import drive, make_legged, poses_of
from tests.reference.standing.steppers import squat, walk

PERIOD = 1 / 60


@pytest.fixture(scope="module")
def legged(tmp_path_factory: pytest.TempPathFactory) -> FastRetargeter:
    return make_legged(tmp_path_factory.mktemp("legged"))


@pytest.fixture
def legs(legged: FastRetargeter) -> Legs:
    assert legged.description.legs is not None
    return legged.description.legs


def hanging(frames: list[SeenPose], place: tuple[float, float, float] = (0.0, 0.9, 0.0)) -> list[SeenPose]:
    """The same people, whose pelvis is always told to be at one place."""
    roots = [frame.root for frame in frames]
    return [
        dataclasses.replace(frame, root=root and root._replace(place_3=np.array(place)))
        for frame, root in zip(frames, roots, strict=True)
    ]


def lowest_soles(legs: Legs, frames: list[SeenPose], begun: float = 0.0, roots: Roots | None = None) -> np.ndarray:
    """Height of each frame's lowest sole [m], by the roots that are taken."""
    roots, found = roots or Roots(legs), []
    for number, frame in enumerate(frames):
        _, (turn_33, place_3) = roots.see(frame, begun + number * PERIOD)
        found.append(person_points(legs, Seen(frame.local_J33, turn_33, place_3))[1][:, 1].min())
    return np.array(found)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.0, 0.9, 0.0), (3.0, 1.4, -2.0)])
def test_the_soles_of_a_pelvis_that_hangs_stay_at_the_floor(legs: Legs, place: tuple[float, float, float]) -> None:
    soles_T = lowest_soles(legs, hanging(poses_of(squat(60, 60.0, 0.0)), place))
    assert np.ptp(soles_T) < 1e-9


def test_a_pelvis_that_has_moved_is_where_it_is_told_to_be(legs: Legs) -> None:
    frames, roots = poses_of(walk(60)), Roots(legs)
    for number, frame in enumerate([*frames, *[frames[-1]] * 9]):  # it may stand still afterwards
        _, (_, place_3) = roots.see(frame, number * PERIOD)
        assert frame.root is not None and frame.root.place_3 is not None
        assert np.abs(place_3 - frame.root.place_3).max() < (MOVED_M if number < 9 else 1e-12)


def test_who_comes_back_after_a_pause_may_hang_again(legs: Legs) -> None:
    walking, roots = poses_of(walk(30)), Roots(legs)
    lowest_soles(legs, walking, roots=roots)
    squatting = hanging(poses_of(squat(60, 60.0, 0.0)), (5.0, 0.9, 0.0))
    assert np.ptp(lowest_soles(legs, squatting, 30 * PERIOD + AGAIN_S, roots)) < 1e-9


def test_a_robot_squats_with_a_person_whose_pelvis_hangs(legged: FastRetargeter) -> None:
    frames = poses_of(squat(90, 60.0, 0.0))
    told, kept = (drive(legged, found)[1] for found in (frames, hanging(frames)))
    np.testing.assert_allclose(kept.place_T3, told.place_T3, atol=0.02)
    assert np.ptp(told.place_T3[:, 2]) > 0.03 and kept.contact_TR.all() and kept.lowest_T.max() < 1e-6


def test_a_robot_steps_with_a_person_who_stood_far_from_0(legged: FastRetargeter) -> None:
    """Nothing leaps where a pelvis that stood still for a while begins to go."""
    frames = poses_of(walk(120))
    away = [
        dataclasses.replace(frame, root=frame.root._replace(place_3=frame.root.place_3 + [40.0, 0.3, -7.0]))  # pyright: ignore
        for frame in [*[frames[0]] * 60, *frames]
    ]
    _, sent = drive(legged, away)
    goes_T, turns_T = sent.speed()
    assert goes_T.max() < 2.0 and turns_T.max() < 5.0 and sent.place_T3[-1, 0] > 0.2


def test_replays_are_as_before(external_dir: Path, legs: Legs) -> None:
    from mrhubo.motion import read_motion

    frames, roots = poses_of(read_motion(external_dir / "cmu" / "whole_body" / "49_03.npz"))[:120], Roots(legs)
    for number, frame in enumerate(frames):
        _, (_, place_3) = roots.see(frame, number / 60)
        assert frame.root is not None and frame.root.place_3 is not None
        assert np.abs(place_3 - frame.root.place_3).max() < 2 * MOVED_M
