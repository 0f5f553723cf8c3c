"""A robot with legs follows live: what is sent keeps to all limits, its feet and its base to the floor and to itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast import Description, FastRetargeter
from mrhubo.fast.rotations import axis_angle_to_matrix, matrix_to_axis_angle
from mrhubo.live.body import Root, SeenPose
from mrhubo.live.messages import Landmarks
from mrhubo.live.pilot import Pilot
from mrhubo.live.robot import LiveRobot
from mrhubo.live.roots import AGAIN_S
from mrhubo.motion import Motion, read_motion
from mrhubo.retargeter import without_training
from mrhubo.retargeter.confidence import STANDARD
from tests.live.messages import beat, message
from tests.live.walkers import Sent, drive, make_legged, poses_of
from tests.reference.standing.steppers import crawl, jump, kneel, lie, lie_prone, squat, stand_on_hands, walk

PERIOD = 1 / 60
CLIPS = ["16_17", "49_03", "127_05"]
LEGS = [place for place, name in enumerate(POSED_JOINT_NAMES) if name.split("_")[-1] in ("hip", "knee", "ankle")]
ARMS = [place for place, name in enumerate(POSED_JOINT_NAMES) if name.split("_")[-1] in ("shoulder", "elbow", "wrist")]
QUICK = LiveConfig(ramp_time=0.0, acceleration=2_000.0)


@pytest.fixture(scope="module")
def legged(tmp_path_factory: pytest.TempPathFactory) -> FastRetargeter:
    return make_legged(tmp_path_factory.mktemp("legged"))


def assert_inside(pilot: Pilot, sent: Sent, fastest: float = 2.0) -> None:
    """Positions, speeds and accelerations of joints, from standing on; soles, and the base from one output to the next,
    which goes no faster than that [m/s].
    """
    governor, config = pilot.governor, pilot.config
    q_TN = np.concatenate([np.tile(pilot.robot.home_N, (2, 1)), sent.q_TN])
    velocity_TN = np.diff(q_TN, axis=0) * config.rate
    assert (q_TN >= governor.lower_N - 1e-9).all() and (q_TN <= governor.upper_N + 1e-9).all()
    assert (np.abs(velocity_TN) <= governor.speed_N + 1e-9).all()
    assert np.abs(np.diff(velocity_TN, axis=0)).max() * config.rate <= config.acceleration + 1e-6
    assert sent.lowest_T.min() > -1e-6
    assert np.isfinite(sent.place_T3).all()
    goes_T, turns_T = sent.speed(config.rate)
    assert goes_T.max() < fastest and turns_T.max() < 12.0, "the base jumps"


def assert_rests(sent: Sent, frame: int) -> None:
    """All is at rest from there on."""
    goes_T, turns_T = sent.speed()
    assert goes_T[frame:].max() < 1e-6 and turns_T[frame:].max() < 1e-6
    assert np.abs(np.diff(sent.q_TN[frame:], axis=0)).max() < 1e-9


@pytest.mark.parametrize("clip", CLIPS)
def test_people_are_followed_with_stops(external_dir: Path, legged: FastRetargeter, clip: str) -> None:
    frames = poses_of(read_motion(external_dir / "cmu" / "whole_body" / f"{clip}.npz"))[:240]
    config = LiveConfig(ramp_time=0.3)
    pilot, sent = drive(legged, frames, config, held=lambda frame: frame % 80 < 60, after=30)
    assert_inside(pilot, sent, 4.0 if clip == "127_05" else 2.5)  # a run
    assert {output.state for output in sent.outputs} == {"following", "stopped"}
    for stop in range(60, len(frames), 80):  # the button is let go of; who is in the air comes down
        rest = stop + round((config.stop_time - config.heartbeat_timeout) * config.rate)
        assert np.ptp(sent.place_T3[rest : stop + 19, :2], axis=0).max() < 1e-6
        assert np.ptp(sent.turn_T33[rest : stop + 19], axis=0).max() < 1e-6
        goes_T, turns_T = sent.speed()
        again_T = np.arange(6) / 60 / config.ramp_time  # how far the ramp has risen
        assert (goes_T[stop + 19 : stop + 25] < 7.0 * again_T + 0.01).all(), "a jump"
        assert (turns_T[stop + 19 : stop + 25] < 12.0 * again_T + 0.01).all(), "a jump"
    assert_rests(sent, len(frames) + 20)
    assert pilot.inbox.counts["jumped"] == pilot.inbox.counts["malformed"] == 0


def test_a_foot_that_stands_alone_keeps_still(external_dir: Path, legged: FastRetargeter) -> None:
    """Of the foot on which the robot stands, of its soles' ends the middle moves by what contacts are blended alone."""
    frames = poses_of(read_motion(external_dir / "cmu" / "whole_body" / "16_17.npz"))
    _, sent = drive(legged, frames, LiveConfig(ramp_time=0.3), held=lambda frame: frame % 80 < 70)
    middle_TR2 = sent.point_TH3.reshape(len(frames), 2, 2, 3)[..., :2].mean(axis=2)
    speed_TR = np.linalg.norm(np.diff(middle_TR2, axis=0), axis=-1) * 60
    alone_T = sent.contact_TR.sum(axis=1) == 1
    settled_T = np.convolve(alone_T, np.ones(7), "same") == 7
    stands_TR = (sent.contact_TR & settled_T[:, None])[1:] & (sent.contact_TR & settled_T[:, None])[:-1]
    assert stands_TR.sum() > 40
    assert np.median(speed_TR[stands_TR]) < 0.02 and np.percentile(speed_TR[stands_TR], 90) < 0.25
    assert np.linalg.norm(sent.place_T3[-1, :2] - sent.place_T3[0, :2]) > 0.5, "it goes nowhere"


def test_without_limits_to_speak_of_it_goes_where_the_stream_goes(legged: FastRetargeter) -> None:
    pilot, sent = drive(legged, poses_of(walk(100)), dataclasses.replace(QUICK, stop_time=1.0))
    assert pilot.legs is not None and pilot.legs.stance is not None
    stance = pilot.legs.stance
    np.testing.assert_allclose(sent.q_TN[-1], stance.q_N, atol=0.03)
    np.testing.assert_allclose(sent.turn_T33[-1], stance.base.turn_33, atol=0.02)
    way = sent.place_T3[-1, 0] - sent.place_T3[20, 0]
    scale = pilot.robot.standing.legs.scale_1[0]  # pyright: ignore
    assert way == pytest.approx(0.6 * scale * 79 / 60, rel=0.1)
    assert abs(sent.place_T3[-1, 2] - stance.base.place_3[2]) < 5e-3


def test_where_a_person_is_and_looks_at_first_changes_nothing(legged: FastRetargeter) -> None:
    frames, turn_33 = poses_of(walk(50)), rotation.axis_angle_to_matrix(torch.tensor([0.0, 2.0, 0.0])).numpy()
    elsewhere = [
        dataclasses.replace(f, root=Root(turn_33 @ f.root.turn_33, turn_33 @ f.root.place_3 + [3.0, 0.0, -8.0]))  # pyright: ignore
        for f in frames
    ]
    one, other = (drive(legged, found, QUICK)[1] for found in (frames, elsewhere))
    np.testing.assert_allclose(one.q_TN, other.q_TN, atol=2e-3)
    np.testing.assert_allclose(one.place_T3, other.place_T3, atol=2e-3)
    np.testing.assert_allclose(one.turn_T33, other.turn_T33, atol=2e-3)
    assert one.place_T3[-1, 0] > 0.2 and np.ptp(one.place_T3[:, 1]) < 0.1, "the robot looks along x"


def test_what_a_person_goes_while_the_robot_is_stopped_is_not_made_up_for(legged: FastRetargeter) -> None:
    frames = poses_of(walk(150))
    _, sent = drive(legged, frames, LiveConfig(ramp_time=0.2), held=lambda frame: not 40 <= frame < 110)
    x_T = sent.place_T3[:, 0]
    assert x_T[48:110].max() - x_T[48:110].min() < 1e-6
    assert x_T[40] - x_T[0] > 0.1 and x_T[-1] - x_T[110] > 0.1
    assert x_T[-1] - x_T[110] < 0.6 * 40 / 60 + 0.1, "it hurries after the person"


def test_where_it_would_stand_is_where_it_stands(legged: FastRetargeter) -> None:
    frames = poses_of(squat(60, 60.0))
    for stop in (20, 33, 47):
        pilot, sent = drive(legged, frames, QUICK, held=lambda frame, stop=stop: frame < stop)
        told = sent.outputs[stop - 1].standing
        assert told is not None and np.abs(sent.outputs[stop - 1].velocity_N).max() > 0.1
        np.testing.assert_allclose(told.stop.position_3, sent.place_T3[-1], atol=2e-3)
        assert abs(told.stop.quaternion_wxyz_4 @ sent.outputs[-1].standing.base.quaternion_wxyz_4) > 1 - 1e-4  # pyright: ignore
        assert_rests(sent, stop + round(pilot.governor.brake_time * 60) + 1)


def test_who_jumps_and_is_stopped_lands(legged: FastRetargeter) -> None:
    frames = poses_of(jump(60, 60.0))
    pilot, flies = drive(legged, frames, QUICK)
    highest = int(flies.lowest_T.argmax())
    assert flies.lowest_T[highest] > 0.02
    _, sent = drive(legged, frames, QUICK, held=lambda frame: frame < highest, after=90)
    assert_inside(pilot, sent)
    assert sent.lowest_T[-1] < 2e-3 and sent.contact_TR[-1].all()
    assert_rests(sent, len(frames) + 60)


def between(one: SeenPose, other: SeenPose, frames: int) -> list[SeenPose]:
    """Poses on the way from one to another."""
    assert one.root is not None and other.root is not None
    turn_J3 = matrix_to_axis_angle(one.local_J33.mT @ other.local_J33)
    root_3 = matrix_to_axis_angle(one.root.turn_33.T @ other.root.turn_33)
    found = []
    for share in (np.arange(frames) + 0.5) / frames:
        turn_33 = one.root.turn_33 @ axis_angle_to_matrix(share * root_3)
        place_3 = (1 - share) * one.root.place_3 + share * other.root.place_3
        local_J33 = one.local_J33 @ axis_angle_to_matrix(share * turn_J3)
        found.append(SeenPose(local_J33, one.sure_J, Root(turn_33, place_3)))
    return found


@pytest.mark.parametrize("posture", [kneel, crawl, lie, lie_prone, stand_on_hands])
def test_nothing_of_who_lies_or_kneels_is_in_the_floor(tmp_path: Path, posture: Callable[..., Motion]) -> None:
    """Also on the way down, and when the robot is stopped there, on its side without a sole on the floor."""
    stood, down = poses_of(squat(20, 60.0)), poses_of(posture(60, 60.0))
    frames = [*stood, *between(stood[-1], down[0], 60), *down]
    pilot, sent = drive(make_legged(tmp_path, thick=True), frames, LiveConfig(ramp_time=0.3), lambda t: t < 110)
    assert_inside(pilot, sent, fastest=4.0)
    assert sent.lowest_T[-1] < 2e-3, "it floats"
    assert_rests(sent, len(frames) - 3)


# What is not seen


def hidden(frames: list[SeenPose], joints: list[int]) -> list[SeenPose]:
    """The same with some joints that are not seen."""
    sure_J = np.ones(21)
    sure_J[joints] = 0.0
    return [dataclasses.replace(frame, sure_J=sure_J) for frame in frames]


def arms(pilot: Pilot) -> np.ndarray:
    names = pilot.robot.joint_names
    return np.array([any(part in name for part in ("shoulder", "elbow")) for name in names])


@pytest.mark.parametrize("joints", [LEGS, LEGS[:1], [LEGS[-1]]])
def test_legs_that_are_not_seen_stand_and_so_does_the_base(legged: FastRetargeter, joints: list[int]) -> None:
    frames = poses_of(walk(60))
    for place in ARMS:
        for t, frame in enumerate(frames):
            frame.local_J33[place] = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, 0.02 * t])).numpy()
    pilot, sent = drive(legged, hidden(frames, joints), QUICK)
    arm_N = arms(pilot)
    assert np.abs(sent.q_TN[-1, arm_N] - sent.q_TN[0, arm_N]).max() > 0.3, "arms follow"
    legs_N = pilot.legs._legs_N  # pyright: ignore
    assert legs_N.sum() == 10 and (sent.q_TN[:, legs_N] == pilot.robot.home_N[legs_N]).all()
    assert np.ptp(sent.place_T3, axis=0).max() < 1e-9 and np.ptp(sent.turn_T33, axis=0).max() < 1e-9
    assert {output.state for output in sent.outputs[1:]} == {"doubtful"}


def test_legs_that_are_seen_again_ramp_up(legged: FastRetargeter) -> None:
    frames = poses_of(squat(160, 60.0, 0.0))
    config = LiveConfig(ramp_time=0.5)
    pilot, sent = drive(legged, [*hidden(frames[:60], LEGS), *frames[60:]], config)
    assert_inside(pilot, sent)
    legs_N, speed_N = pilot.legs._legs_N, pilot.governor.speed_N  # pyright: ignore
    velocity_TN = np.abs(np.diff(sent.q_TN, axis=0)) * 60
    ramp_T1 = np.clip(np.arange(len(velocity_TN) - 60) / 60 / config.ramp_time, 0, 1)[:, None]
    assert velocity_TN[:59, legs_N].max() == 0 and velocity_TN[60:, legs_N].max() > 0.2
    assert (velocity_TN[60:, legs_N] <= (ramp_T1 + 0.04) * speed_N[legs_N]).all()


def test_nobody_leaves_it_standing(legged: FastRetargeter) -> None:
    pilot, sent = drive(legged, [*poses_of(walk(40)), *[None] * 60], QUICK)
    assert_inside(pilot, sent)
    assert_rests(sent, 60)


def test_who_tells_nothing_of_the_pelvis_moves_no_legs(legged: FastRetargeter) -> None:
    frames = [dataclasses.replace(frame, root=None) for frame in poses_of(squat(60, 60.0))]
    pilot, sent = drive(legged, frames, QUICK)
    legs_N = pilot.legs._legs_N  # pyright: ignore
    assert (sent.q_TN[:, legs_N] == pilot.robot.home_N[legs_N]).all() and np.ptp(sent.place_T3, axis=0).max() < 1e-9


def points(frames: list[SeenPose], in_world: bool, without: tuple[str, ...] = ()) -> list[Landmarks]:
    """What a camera or a headset sees of them."""
    found = []
    for frame in frames:
        assert frame.root is not None and frame.root.place_3 is not None
        point_K3 = Skeleton().keypoints(torch.from_numpy(frame.local_J33)[None])[0].numpy() @ frame.root.turn_33.T
        point_K3 = point_K3 + (frame.root.place_3 if in_world else 0.0)
        told = dict(zip(KEYPOINT_NAMES, map(tuple, point_K3.tolist()), strict=True))
        kept = {name: at for name, at in told.items() if name.split("_")[-1] not in without}
        found.append(Landmarks(kept, {}, in_world))
    return found


def test_points_in_the_world_lead_where_the_person_goes(legged: FastRetargeter) -> None:
    frames = poses_of(walk(50))
    one, other = (drive(legged, found, QUICK)[1] for found in (frames, points(frames, True)))
    np.testing.assert_allclose(other.place_T3, one.place_T3, atol=0.03)
    assert one.place_T3[-1, 0] > 0.2


def test_points_from_the_hips_bend_the_knees_and_go_nowhere(legged: FastRetargeter) -> None:
    frames = poses_of(squat(90, 60.0, 0.0))
    pilot, sent = drive(legged, points(frames, False), LiveConfig(ramp_time=0.2))
    assert_inside(pilot, sent)
    knee = sent.q_TN[:, pilot.robot.joint_names.index("l_knee")]
    assert np.ptp(knee) > 0.5 and np.ptp(sent.place_T3[:, 2]) > 0.03
    assert np.ptp(sent.place_T3[:, :2], axis=0).max() < 0.25 and sent.lowest_T.max() < 1e-6
    assert np.ptp(sent.point_TH3[..., :2].mean(axis=1), axis=0).max() < 1e-6, "planted soles stay"


def test_a_webcam_that_sees_no_knees_moves_arms_alone(legged: FastRetargeter) -> None:
    frames = points(poses_of(walk(40)), False, without=("knee", "ankle", "foot", "toe", "heel"))
    pilot, sent = drive(legged, frames, QUICK)
    legs_N = pilot.legs._legs_N  # pyright: ignore
    assert (sent.q_TN[:, legs_N] == pilot.robot.home_N[legs_N]).all() and np.ptp(sent.place_T3, axis=0).max() < 1e-9
    assert sent.outputs[-1].confidence["left_leg"] == 0


# Roots that make no sense

GARBAGE: list[Any] = [
    {"rotation": [0, 0, 0], "place": [float("nan"), 0, 0]},
    {"rotation": [0, 0, 0], "place": [1e9, 0, 0]},
    {"rotation": [0, 0, 0], "place": [0, 0]},
    {"rotation": [0, 0, 0], "place": "here"},
    {"rotation": [0, 0, 0, 0], "place": [0, 0, 0]},
    {"rotation": [1e5, 0, 0], "place": [0, 0, 0]},
    {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "place": [0, 0, 0]},
    {"rotation": None},
    {"place": [0, 0, 0]},
    [0, 0, 0],
    7,
    True,
]


@pytest.mark.parametrize("root", GARBAGE)
def test_roots_that_are_none_are_refused(legged: FastRetargeter, root: Any) -> None:
    pilot = Pilot(LiveRobot.of_retargeter(legged, LiveConfig()), LiveConfig(), False)
    for number, told in enumerate(({"rotation": [0, 0, 0], "place": [0, 0.9, 0]}, root, {"rotation": [0, 0, 0, 1]})):
        pilot.inbox.offer(message(number, time=number / 60, root=told), "a", number / 60)
        pilot.inbox.offer(beat(number, number / 60), "b", number / 60)
        pilot.tick(number / 60)
    assert pilot.inbox.counts["malformed"] == 1 and pilot.inbox.counts["frames"] == 2


@pytest.mark.parametrize("far", [5.0, 900.0])
def test_roots_that_jump_are_counted_and_change_nothing(legged: FastRetargeter, far: float) -> None:
    frames = poses_of(walk(120))
    jumping = list(frames)
    for number in (20, 21, 50):
        root = frames[number].root
        assert root is not None and root.place_3 is not None
        jumping[number] = dataclasses.replace(frames[number], root=root._replace(place_3=root.place_3 + [far, 0, 0]))
    pilot, sent = drive(legged, jumping, QUICK)
    assert pilot.inbox.counts["jumped"] == 3
    assert_inside(pilot, sent)
    _, without = drive(legged, [None if number in (20, 21, 50) else f for number, f in enumerate(frames)], QUICK)
    assert np.abs(sent.place_T3[-1] - without.place_T3[-1]).max() < 0.02
    # Another place of the world is taken for good after a while; the robot does not go there.
    moved = [dataclasses.replace(f, root=f.root._replace(place_3=f.root.place_3 + [far, 0, 0])) for f in frames[40:]]  # pyright: ignore
    pilot, sent = drive(legged, [*frames[:40], *moved], QUICK)
    assert pilot.inbox.counts["jumped"] == pytest.approx(AGAIN_S * 60, abs=2)
    assert_inside(pilot, sent)
    assert sent.place_T3[-1, 0] - sent.place_T3[70, 0] > 0.1, "it goes on"


# The robots that ship


def test_a_robot_of_a_config_stands_at_home_with_its_soles_on_the_floor(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(without_training, "calibrated", lambda _: STANDARD)  # it takes some seconds
    robot = LiveRobot.of_robot(str(root / "conf" / "nao-whole-body.yaml"), LiveConfig(), "numpy")
    for home_N in (robot.home_N, LiveRobot.of_robot("nao-whole-body", LiveConfig(home="zero"), "numpy").home_N):
        sent = Sent.of(robot, [Pilot(dataclasses.replace(robot, home_N=home_N), LiveConfig(), True).tick(0.0)])
        assert abs(sent.lowest_T[0]) < 1e-6 and sent.contact_TR.all()
        assert np.ptp(sent.point_TH3[0, :, 2]) < 0.003 and np.allclose(sent.turn_T33[0], np.eye(3), atol=0.02)
    assert robot.foot_names == ("left_foot", "right_foot") and robot.legs_X.tolist() == [False, False, False, True]


def test_a_package_that_does_not_tell_how_its_robot_stands_is_refused(
    legged: FastRetargeter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old: Callable[..., FastRetargeter] = lambda *_: FastRetargeter(  # noqa: E731
        dataclasses.replace(legged.description, legs=None), "numpy"
    )
    assert isinstance(legged.description, Description)
    monkeypatch.setattr("mrhubo.load_fast", old)
    with pytest.raises(UserError, match="mrhubo fit"):
        LiveRobot.of_package(str(tmp_path), LiveConfig())
