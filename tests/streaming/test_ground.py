"""A robot with feet follows a person with a root: soles on the floor, planted feet in their places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.errors import UserError
from mrhubo.evaluation.whole_body import score_whole_body
from mrhubo.frames import human_to_world
from mrhubo.motion import Motion
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.nearest import NearestJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.streaming import Stream, StreamSettings
from tests.reference.standing.steppers import crawl, jump, kneel, lie_prone, moved, squat, stand_on_hands, walk
from tests.reference.walkers import walker

SETTINGS = StreamSettings(avoid_collisions=False)


@pytest.fixture(scope="module")
def biped(tmp_path_factory: pytest.TempPathFactory) -> Retargeter:
    """A robot with legs that nothing was trained for."""
    body_map = walker(tmp_path_factory.mktemp("walker"))
    return Retargeter(NearestJoints(body_map), body_map, BodyPrior.open(), None, phi_threshold=0.01)


def followed(retargeter: Retargeter, motion: Motion, **options: object) -> tuple[Tensor, Tensor, Tensor]:
    """Joint angles, places and rotations of the base of a motion that is followed."""
    found = Stream(retargeter, motion.frame_rate, settings=SETTINGS, **options).retarget(motion)  # pyright: ignore
    assert found.root_position is not None and found.root_quaternion_wxyz is not None
    return found.q, found.root_position, rotation.wxyz_to_matrix(found.root_quaternion_wxyz)


@pytest.fixture(scope="module")
def squatting(biped: Retargeter) -> tuple[Motion, tuple[Tensor, Tensor, Tensor]]:
    motion = squat(48, sway=0.1)
    return motion, followed(biped, motion)


def soles(retargeter: Retargeter, answer: tuple[Tensor, Tensor, Tensor]) -> tuple[np.ndarray, np.ndarray]:
    """Places of the points of soles (T, P, 3), and heights of what can touch the floor (T, K) [m]."""
    legs = Stream(retargeter)._legs
    found = legs.on_floor(retargeter.body_map.robot.forward(answer[0]), *answer[1:])
    return found.point_BP3.numpy(), (found.ball_BK3[..., 2] - legs.radius_K).numpy()


def test_planted_feet_stay_and_no_sole_is_under_the_floor(biped: Retargeter, squatting) -> None:  # noqa: ANN001
    motion, answer = squatting
    point_TP3, height_TK = soles(biped, answer)
    assert height_TK.min() > -1e-5
    # The middle of what is planted, here all points of both soles, does not move at all.
    assert np.abs(point_TP3[1:].mean(axis=1) - point_TP3[0].mean(axis=0))[:, :2].max() < 1e-5
    assert np.linalg.norm(point_TP3[1:] - point_TP3[0], axis=-1).max() < 0.03
    score = score_whole_body(biped.body_map, motion, *answer)
    assert score.speed_max <= 1 and score.outside == 0 and score.sunk == 0 and score.floating == 0
    assert score.slide_cm_s < 1 and score.heading_deg < 0.1 and score.parts_deg["knee"] < 4


def test_who_kneels_on_the_instep_points_as_the_person_does() -> None:
    """A foot that lies with its sole up, as thick as NAO's, touches the floor with what is lowest, and not with its
    sole.
    """
    body_map = BodyMap.of(Robot.from_config("nao-whole-body"))
    retargeter = Retargeter(NearestJoints(body_map), body_map, BodyPrior.open(), None, phi_threshold=0.01)
    motion = kneel()
    answer = followed(retargeter, motion)
    score = score_whole_body(body_map, motion, *answer)
    assert max(score.parts_deg[part] for part in ("knee", "ankle", "foot")) < 3
    assert score.sunk == 0 and score.floating_max_cm < 1
    assert answer[1][:, 2].diff().abs().max() < 0.01


@pytest.mark.parametrize("motion", [crawl(12), lie_prone(12), stand_on_hands(12)], ids=["crawls", "prone", "on hands"])
def test_nothing_else_is_under_the_floor(motion: Motion) -> None:
    body_map = BodyMap.of(Robot.from_config("nao-whole-body"))
    retargeter = Retargeter(NearestJoints(body_map), body_map, BodyPrior.open(), None, phi_threshold=0.01)
    score = score_whole_body(body_map, motion, *followed(retargeter, motion))
    assert score.body_sunk_max_cm < 0.01 and score.sunk_max_cm < 0.01


def test_a_root_that_jumps_leaves_the_robot_where_it_stands(biped: Retargeter, squatting) -> None:  # noqa: ANN001
    motion, answer = squatting
    place_T3 = motion.root_position_T3.clone()
    place_T3[20:] += torch.tensor([3.0, 0.5, 0.0])
    found = followed(biped, motion.changed(root_position_T3=place_T3))
    torch.testing.assert_close(found[1], answer[1], atol=0.01, rtol=0)


def test_who_jumps_flies_as_high_as_the_person(biped: Retargeter) -> None:
    motion = jump(48, rate=60.0)
    answer = followed(biped, motion)
    _, height_TK = soles(biped, answer)
    lowest_T = height_TK.min(axis=1)
    assert lowest_T.min() > -1e-5 and lowest_T[:15].max() < 0.01 and lowest_T[-9:].max() < 0.02
    assert lowest_T.max() == pytest.approx(0.15 * Stream(biped)._legs.scale, rel=0.3)


@pytest.mark.parametrize("rate", [24.0, 60.0])
def test_a_person_elsewhere_who_looks_elsewhere_is_followed_there(biped: Retargeter, rate: float) -> None:
    """From a cold start, whichever way that is."""
    motion, turns = squat(16, rate), (-2 * np.pi * np.random.default_rng(0).random(5)).tolist()
    stream = Stream(biped, settings=SETTINGS)
    here, *others = stream.retarget_all([motion, *(moved(motion, turn, (0.4, -0.7, 2.0)) for turn in turns)])
    assert here.root_position is not None
    away_3 = stream._legs.scale * human_to_world(torch.tensor([0.4, 0.0, 2.0]))
    for turn, there in zip(turns, others, strict=True):
        assert there.root_position is not None
        torch.testing.assert_close(there.q, here.q, atol=3e-4, rtol=0)
        turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, turn]))
        torch.testing.assert_close(there.root_position, here.root_position @ turn_33.T + away_3, atol=1e-3, rtol=0)


def test_a_walk_goes_as_far_as_the_person_and_its_feet_keep_still(biped: Retargeter) -> None:
    motion = walk(80)
    answer = followed(biped, motion)
    score = score_whole_body(biped.body_map, motion, *answer)
    assert motion.root_position_T3 is not None
    gone = float((answer[1][-1] - answer[1][0])[0])
    assert gone == pytest.approx(0.79 * Stream(biped)._legs.scale, rel=0.06)
    assert score.path_cm_m < 5 and score.slide_cm_s < max(2.0, score.human_slide_cm_s) and score.sunk == 0


def test_frames_one_by_one_are_answered_as_the_motion(biped: Retargeter) -> None:
    motion = squat(12, 60.0)
    whole = Stream(biped, settings=SETTINGS).retarget(motion)
    stream = Stream(biped, settings=SETTINGS)
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    for t, root in enumerate(zip(motion.root_rotation_T33, motion.root_position_T3, strict=True)):
        answer = stream(motion.local_TJ33[t], root=root)
        assert whole.root_position is not None and answer.root_position is not None and answer.contact is not None
        torch.testing.assert_close(answer.q, whole.q[t], atol=1e-5, rtol=0)
        torch.testing.assert_close(answer.root_position, whole.root_position[t], atol=1e-5, rtol=0)
        assert answer.contact_names == ("left_foot", "right_foot") and bool(answer.contact.all())
    stands = answer.root_position
    for _ in range(6):  # who is not seen leaves the robot where it stands
        answer = stream(None)
    assert answer.root_position is not None and stands is not None and float(answer.confidence) == 0
    assert float((answer.root_position - stands).norm()) < 0.02


def test_roots_and_contacts_that_make_no_sense_are_refused(biped: Retargeter) -> None:
    pose, eye, zero = squat(2).local_TJ33[0], torch.eye(3), torch.zeros(3)
    stream = Stream(biped, settings=SETTINGS)
    assert stream.contact_points == ("left_heel", "left_toe", "right_heel", "right_toe")
    for root, message in (((eye, torch.zeros(2)), r"a root is a rotation \(3, 3\)"), ((2 * eye, zero), "no rotation")):
        with pytest.raises(UserError, match=message):
            stream(pose, root=root)
    with pytest.raises(UserError, match="expected contacts of 4 points: left_heel"):
        stream(pose, root=(eye, zero), contacts=[True, False])
    assert stream(pose, root=(eye, zero), contacts=[True] * 4).root_position is not None
    assert float(stream(pose, root=(eye, torch.full((3,), torch.nan))).confidence) == 0
    with pytest.raises(UserError, match="earlier poses came with a root"):
        stream(pose)
    stream.reset()
    assert stream(pose).root_position is None
    with pytest.raises(UserError, match="earlier poses came without a root"):
        stream(pose, root=(eye, zero))
    with pytest.raises(UserError, match="the floor's height must be a number"):
        Stream(biped, floor=float("nan"))


@pytest.mark.parametrize(("root", "waist"), [("chest", True), ("pelvis", False)])
def test_robots_hung_up_at_the_chest_or_without_a_waist_stand_too(tmp_path: Path, root: str, waist: bool) -> None:
    body_map, motion = walker(tmp_path, root, waist), squat(10, 24.0)
    retargeter = Retargeter(NearestJoints(body_map), body_map, BodyPrior.open(), None, phi_threshold=0.01)
    answer = followed(retargeter, motion)
    point_TP3, height_TK = soles(retargeter, answer)
    assert -1e-5 < height_TK.min() and height_TK.max() < 0.03
    assert np.abs(point_TP3[1:].mean(axis=1) - point_TP3[0].mean(axis=0))[:, :2].max() < 1e-5


def test_a_robot_without_feet_does_not_look_at_roots(retargeter: Retargeter) -> None:
    pose = squat(2).local_TJ33[0]
    stream = Stream(retargeter, settings=SETTINGS)
    answer = stream(pose, root=(torch.eye(3), torch.zeros(3)))
    assert answer.root_position is None and answer.contact is None and stream.contact_points == ()
    torch.testing.assert_close(answer.q, Stream(retargeter, settings=SETTINGS)(pose).q)


def test_people_may_come_later_than_the_stream_and_than_each_other(biped: Retargeter) -> None:
    motion = squat(8, 60.0)
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    alone, later, both = (
        Stream(biped, settings=SETTINGS),
        Stream(biped, settings=SETTINGS),
        Stream(biped, 60.0, 2, SETTINGS),
    )
    assert later(None).root_position is None  # nobody yet, so it is open whether roots will come
    for t, (turn_33, place_3) in enumerate(zip(motion.root_rotation_T33, motion.root_position_T3, strict=True)):
        pose, absent = motion.local_TJ33[t], torch.full((21, 3, 3), torch.nan)
        found = both(torch.stack((pose, absent if t < 4 else motion.local_TJ33[t - 4])),
                     root=(torch.stack((turn_33, turn_33)), torch.stack((place_3, motion.root_position_T3[max(t - 4, 0)]))))  # fmt: skip
        expected = alone(pose, root=(turn_33, place_3))
        assert later(pose, root=(turn_33, place_3)).root_position is not None
        assert found.root_position is not None and expected.root_position is not None
        torch.testing.assert_close(found.root_position[0], expected.root_position, atol=1e-4, rtol=0)
        if t == 0:
            first = expected.root_position
    # The second one has come four frames later and stands as high as the first did.
    assert found.root_position is not None and abs(float(found.root_position[1, 2] - first[2])) < 0.1
    assert bool(found.contact is not None and found.contact.all())


def test_a_pelvis_that_is_lost_for_a_frame_does_not_throw_the_base(biped: Retargeter) -> None:
    motion = squat(14, 60.0)
    assert motion.root_rotation_T33 is not None
    glitch_33 = rotation.axis_angle_to_matrix(torch.tensor([0.3, -0.4, 0.2]))
    turn_T33, local_TJ33 = motion.root_rotation_T33.clone(), motion.local_TJ33.clone()
    turn_T33[7] = turn_T33[7] @ glitch_33
    local_TJ33[7, :3] = glitch_33.mT @ local_TJ33[7, :3]  # limbs stay where they are
    _, wanted_T3, _ = followed(biped, motion)
    found = followed(biped, motion.changed(root_rotation_T33=turn_T33.numpy(), local_TJ33=local_TJ33.numpy()))
    assert float((found[1] - wanted_T3).norm(dim=-1).max()) < 0.01
    stream = Stream(biped, 60.0, settings=SETTINGS)
    assert motion.root_position_T3 is not None
    for t, (pose, turn_33, place_3) in enumerate(zip(local_TJ33, turn_T33, motion.root_position_T3, strict=True)):
        answer = stream(pose, root=(turn_33, place_3))
        torch.testing.assert_close(answer.q, found[0][t], atol=1e-5, rtol=0)


def test_neither_answers_nor_arrays_that_were_given_are_remembered(biped: Retargeter) -> None:
    """Who changes an answer, or fills the same arrays anew, changes nothing of what comes."""
    motion = squat(6, 60.0)
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    one, other = Stream(biped, settings=SETTINGS), Stream(biped, settings=SETTINGS)
    begin = biped.body_map.robot.home().clone()
    for stream in (one, other):
        stream.reset(begin if stream is one else begin.clone())
    begin.fill_(9.0)
    pose, turn_33, place_3, contacts = torch.empty(21, 3, 3), torch.empty(3, 3), torch.empty(3), np.zeros(4, bool)
    for t in range(6):
        frame = (motion.local_TJ33[t], motion.root_rotation_T33[t], motion.root_position_T3[t])
        for place, value in zip((pose, turn_33, place_3), frame, strict=True):
            place.copy_(value)
        contacts[:] = t < 3
        found = one(pose, root=(turn_33, place_3), contacts=contacts)
        expected = other(frame[0], root=(frame[1], frame[2]), contacts=[t < 3] * 4)
        for name in ("q", "root_position", "root_quaternion_wxyz", "contact", "phi"):
            torch.testing.assert_close(getattr(found, name), getattr(expected, name), atol=0, rtol=0)
            getattr(found, name).zero_()
        one.joints(None).zero_()
        other.joints(None)
        contacts[:] = False


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"root": (torch.diag(torch.tensor([1.0, 1.0, -1.0])), torch.zeros(3))}, "no rotation"),
        ({"root": (torch.eye(3),)}, r"a root is a rotation \(3, 3\) and a place"),
        ({"root": 5}, r"a root is a rotation \(3, 3\) and a place"),
        ({"root": (torch.eye(3), torch.zeros(3)), "contacts": [0.2] * 4}, "expected contacts of 4 points"),
        ({"root": (torch.eye(3), torch.zeros(3)), "contacts": [[True] * 2] * 2}, "expected contacts of 4 points"),
    ],
)
def test_what_is_no_root_and_no_contact_is_refused(biped: Retargeter, options: dict[str, Any], message: str) -> None:
    """A mirror is orthonormal, and no rotation."""
    with pytest.raises(UserError, match=message):
        Stream(biped, settings=SETTINGS)(torch.eye(3).expand(21, 3, 3), **options)
