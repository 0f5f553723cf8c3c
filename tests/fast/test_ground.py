"""A robot with feet stands and goes without PyTorch as with it: the same joint angles, base and contacts."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES, SIDES
from mrhubo.errors import InputWarning, UserError
from mrhubo.fast import FastRetargeter, FastStream, StreamSettings
from mrhubo.fast.description import FILE, Description
from mrhubo.fast.engines import FORMS
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.motion import Motion
from mrhubo.reference.standing import Standing
from mrhubo.retargeter import Retargeter, without_training
from mrhubo.retargeter.confidence import STANDARD
from mrhubo.retargeter.nearest import NearestJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot_motion import RobotMotion
from mrhubo.rotation import axis_angle_to_matrix
from mrhubo.streaming import Stream
from tests.fast.altered import Altered
from tests.fast.exact import double, in_double
from tests.reference.standing.steppers import bow, crawl, jump, kneel, lie, moved, squat, walk
from tests.reference.walkers import walker, write_urdf

pytestmark = pytest.mark.usefixtures("one_thread")
SAME_RAD, SAME_M = 1e-5, 1e-5
Frames = list[tuple[Any, ...]]
FORM = pytest.mark.parametrize("form", FORMS)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Retargeter]:
    """Function of a robot's name: NAO, whose legs share a joint, or one hung up at its pelvis or at its chest, and what
    its root follows.
    """
    found: dict[str, Retargeter] = {}

    def of(name: str) -> Retargeter:
        if name not in found:
            body_map = (
                BodyMap.of(Robot.from_config("nao-whole-body"))
                if name == "nao"
                else walker(
                    tmp_path_factory.mktemp("walker"), **dict(zip(("root", "follows"), name.split(), strict=False))
                )
            )
            torch.manual_seed(1)
            prior = BodyPrior(hidden=20).eval()
            found[name] = Retargeter(NearestJoints(body_map), body_map, prior, None, phi_threshold=0.01)
        return found[name]

    return of


@pytest.fixture(scope="module")
def make_fast(made: Callable[[str], Retargeter]) -> Callable[[str, str], FastRetargeter]:
    """Function of a robot's name and a form."""
    found: dict[tuple[str, str], FastRetargeter] = {}

    def of(name: str, form: str) -> FastRetargeter:
        if form == "compiled":
            pytest.importorskip("numba")
        if (name, form) not in found:
            found[name, form] = FastRetargeter(made(name).describe(), form)
        return found[name, form]

    return of


def frames_of(motion: Motion) -> Frames:
    """Poses, times and roots of frames."""
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    roots = list(zip(motion.root_rotation_T33, motion.root_position_T3, strict=True))
    return [
        (pose, t / motion.frame_rate, root) for t, (pose, root) in enumerate(zip(motion.local_TJ33, roots, strict=True))
    ]


def striding() -> Frames:
    """Somebody who comes late, walks, is not seen for a while, at last for long, and goes on."""
    found = frames_of(walk(36))
    for t in (0, 1, 20, 21):
        found[t] = (None, *found[t][1:])
    for t in range(26, 36):
        pose, time, root = found[t]
        found[t] = pose, time + 2.5, root
    return found


def told() -> Frames:
    """Contacts that are told."""
    return [(*frame, [t < 6, True, t % 5 > 0, t > 3]) for t, frame in enumerate(frames_of(squat(10, 30.0)))]


def touching() -> Frames:
    """The same, with arms that hang down and inwards, through the thighs of who has wide ones."""
    found = told()
    for pose, *_ in found:
        for side, sign in zip(SIDES, (-1.0, 1.0), strict=True):
            turn_3 = torch.tensor([-0.5, 0.0, sign * 1.9])
            pose[POSED_JOINT_NAMES.index(f"{side}_shoulder")] = axis_angle_to_matrix(turn_3)
    return found


def bowing() -> Frames:
    """A back that bends farther than a waist can."""
    return frames_of(bow(16, 30.0))


def kneeling() -> Frames:
    """Feet that lie on their insteps."""
    return frames_of(kneel(12))


def crawling() -> Frames:
    """Somebody on all fours, whose robot's hands would be in the floor."""
    return frames_of(crawl(8))


def lying() -> Frames:
    """Feet that lie on their sides."""
    return frames_of(lie(10))


def lost() -> Frames:
    """Somebody who is found elsewhere from one frame to the next."""
    found = frames_of(squat(12, 30.0))
    for t in range(6, 12):
        pose, time, (turn, place) = found[t]
        found[t] = pose, time, (turn, place + torch.tensor([2.0, 0.3, -1.0]))
    return found


def climbing() -> Frames:
    """Somebody whose floor is soon 4 m higher."""
    found = frames_of(squat(16, 30.0))
    for t in range(16):
        pose, time, (turn, place) = found[t]
        found[t] = pose, time, (turn, place + torch.tensor([0.0, 0.4 * min(t, 10), 0.0]))
    return found


def on_hands() -> Frames:
    """Somebody who stands, and then stands upside down."""
    found, over_33 = frames_of(squat(12, 30.0)), torch.diag(torch.tensor([1.0, -1.0, -1.0]))
    for t in range(5, 12):
        pose, time, (turn, place) = found[t]
        found[t] = pose, time, (over_33 @ turn, place + torch.tensor([0.0, 0.2, 0.0]))
    return found


def flying() -> Frames:
    """A jump, elsewhere."""
    return frames_of(moved(jump(24, 30.0), 1.0, (0.3, 0.4, 1.0)))


def exactly(retargeter: Retargeter, frames: Frames, settings: StreamSettings) -> list[Any]:
    """The answers of PyTorch in float64."""
    exact = in_double(retargeter)
    with double():
        stream = Stream(exact, settings=settings)
        stream._standing = Standing(stream._legs)
        assert stream._standing.avoidance is not None
        stream._standing = stream._standing.double()
        return [
            stream(None if pose is None else pose.double(), time, tuple(part.double() for part in root), *contacts)
            for pose, time, root, *contacts in frames
        ]


def quickly(fast: FastRetargeter, frames: Frames, settings: StreamSettings) -> list[RobotMotion]:
    """Those of a form."""
    stream = FastStream(fast, settings=settings)
    return [
        stream(None if pose is None else pose.numpy(), time, tuple(part.numpy() for part in root), *contacts)
        for pose, time, root, *contacts in frames
    ]


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("pelvis", striding),
        ("chest", told),
        ("pelvis", flying),
        ("nao", kneeling),
        ("nao", crawling),
        ("pelvis", lying),
        ("chest", lost),
        ("pelvis", climbing),
        ("nao", on_hands),
        ("nao", touching),
        ("chest", flying),
        ("pelvis chest", bowing),
        ("chest between", bowing),
    ],
)
def test_the_numbers_are_those_of_the_stream_in_pytorch(
    made: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter], name: str,
    frames: Callable[[], Frames],
) -> None:  # fmt: skip
    given, settings = frames(), StreamSettings(worse_time=0.05)
    wanted = exactly(made(name), given, settings)
    for form in FORMS:
        found = quickly(make_fast(name, form), given, settings)
        for t, (own, other) in enumerate(zip(found, wanted, strict=True)):
            np.testing.assert_allclose(own.q, other.q.numpy(), atol=SAME_RAD, rtol=0, err_msg=f"{form}, {t}")
            assert own.root_position is not None and own.root_quaternion_wxyz is not None
            np.testing.assert_allclose(own.root_position, other.root_position.numpy(), atol=SAME_M, rtol=0)
            turn_4 = other.root_quaternion_wxyz.numpy()
            np.testing.assert_allclose(own.root_quaternion_wxyz, turn_4, atol=SAME_RAD, rtol=0)
            np.testing.assert_array_equal(own.contact, other.contact.numpy())
            assert own.contact_names == other.contact_names
    if (
        name == "nao" and frames is touching
    ):  # its arms meet its thighs; who gives way does so with soles in their places
        shown = quickly(make_fast(name, "numpy"), given, StreamSettings(worse_time=0.05, avoid_collisions=False))
        assert max(np.abs(a.q - b.q).max() for a, b in zip(shown, found, strict=True)) > 1e-3


@FORM
def test_what_stands_stays_and_who_is_gone_leaves_the_robot_standing(
    make_fast: Callable[[str, str], FastRetargeter], form: str
) -> None:
    fast, frames = make_fast("pelvis", form), frames_of(squat(20, 30.0))
    found = quickly(fast, [*frames, *((None, 1.0 + t / 10, frames[0][2]) for t in range(5))], StreamSettings())
    places = np.stack([answer.root_position for answer in found])
    assert np.linalg.norm(places[-1] - places[19]) < 0.02 and places[:, 2].min() > 0.4
    assert [answer.confidence > 0 for answer in found] == [True] * 20 + [False] * 5
    q_TN = np.stack([answer.q for answer in found[:20]]).astype(float)
    limits = fast.facts
    assert ((q_TN >= limits.lower) & (q_TN <= limits.upper)).all()
    assert (np.abs(np.diff(q_TN, axis=0)) * 30 <= limits.velocity).all()
    turned = [(pose, time, (turn_33.mT.contiguous().mT, place_3)) for pose, time, (turn_33, place_3) in frames[:2]]
    for one, other in zip(found, quickly(fast, turned, StreamSettings()), strict=False):
        np.testing.assert_array_equal(one.root_position, other.root_position)
    if form == "compiled":  # of roots in another order of memory it would take seconds, in the midst of a session
        assert len(fast.engine._ground_kernels.look.signatures) == 1


@FORM
def test_where_no_network_answers_the_nearest_poses_do(
    made: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter], array: np.ndarray, form: str
) -> None:
    exact = in_double(made("pelvis"))
    target = exact.body_map.human_directions(torch.from_numpy(array).double())
    wanted = exact.network.of_directions(target).numpy()
    off_B = np.abs(make_fast("pelvis", form).predict(array) - wanted).max(axis=1)
    assert np.sort(off_B)[-3] < SAME_RAD  # of these 44, two may have two poses that are equally near


def test_roots_and_contacts_that_make_no_sense_are_refused(
    make_fast: Callable[[str, str], FastRetargeter],
) -> None:
    pose, eye, zero = squat(2).local_TJ33[0].numpy(), np.eye(3), np.zeros(3)
    stream = FastStream(make_fast("pelvis", "numpy"))
    assert stream.contact_points == ("left_heel", "left_toe", "right_heel", "right_toe")
    for root, message in (
        ((eye, np.zeros(2)), r"a root is a rotation \(3, 3\)"), ((2 * eye, zero), "no rotation"), (3.0, "a root is"),
        ((eye, "abc"), "a root is a rotation"),
    ):  # fmt: skip
        with pytest.raises(UserError, match=message):
            stream(pose, root=root)  # type: ignore[arg-type]
    for contacts in ([True, False], [0.5] * 4):
        with pytest.raises(UserError, match="expected contacts of 4 points: left_heel"):
            stream(pose, root=(eye, zero), contacts=contacts)
    assert stream(None).root_position is None  # nobody yet, so it is open whether roots will come
    assert stream(pose, root=(eye, zero), contacts=[True] * 4).root_position is not None
    assert float(stream(pose, root=(eye, np.full(3, np.nan))).confidence) == 0  # type: ignore[arg-type]
    with pytest.raises(UserError, match="earlier poses came with a root"):
        stream(pose)
    stream.reset()
    assert stream(pose).root_position is None
    with pytest.raises(UserError, match="earlier poses came without a root"):
        stream(pose, root=(eye, zero))
    with pytest.raises(UserError, match="the floor's height must be a number"):
        FastStream(make_fast("pelvis", "numpy"), floor=float("nan"))


def test_a_robot_of_which_there_is_a_model_alone_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(without_training, "calibrated", lambda _: STANDARD)  # it takes some seconds
    urdf = write_urdf(tmp_path / "walker.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # what is a guess
        retargeter = mrhubo.for_robot(urdf, whole_body=True, start="nearest")
    fast = mrhubo.load_fast(retargeter, "numpy")
    answer = quickly(fast, frames_of(squat(2)), StreamSettings())[-1]
    assert answer.root_position is not None and answer.contact_names == ("left_foot", "right_foot")
    assert "l_knee" in answer.joint_names and answer.robot.made_by == "the optimiser of mrhubo"
    with pytest.raises(UserError, match="start 'near' does not exist; nearest: 'nearest'"):
        mrhubo.for_robot(urdf, start="near")


def test_one_file_stands(made: Callable[[str], Retargeter], tmp_path: Path) -> None:
    """Which is refused where it is damaged: compiled functions would read what is not theirs."""
    retargeter = made("pelvis chest")
    file = retargeter.save_description(tmp_path)
    assert file == tmp_path / FILE
    frames = frames_of(bow(3, 30.0))
    read, own = (quickly(each, frames, StreamSettings()) for each in (
        mrhubo.load_fast(file, "numpy"), FastRetargeter(retargeter.describe(), "numpy")))  # fmt: skip
    np.testing.assert_array_equal(read[-1].root_position, own[-1].root_position)
    tensors, metadata = read_tensors(file)
    cells = {**tensors, "cost.cell_CU": torch.zeros_like(tensors["cost.cell_CU"])}
    write_tensors(tmp_path / "changed.safetensors", cells, metadata)
    with pytest.raises(UserError, match="a start without a pose"):
        Description.read(tmp_path / "changed.safetensors")
    altered = Altered(file)
    names = [name for name in altered.arrays if name.startswith(("legs.", "root."))]
    assert len(names) > 25
    for name in names:
        altered.refused(name, altered.arrays[name][:-1])
        if altered.arrays[name].dtype.kind != "f":
            altered.refused(name, altered.arrays[name].astype(np.float64))
            for value in (-7, 10**6):
                altered.refused_with(name, value)
