"""Xsens' recordings in XML."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES
from mrhubo.motion import Motion, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.xsens import SEGMENTS
from tests.motion.damage import Step, accidents, altered_words, damaged, read_or_refused
from tests.motion.readers.test_nymeria import FRAMES, JOINTS, TO_ROBOT, body, check

_CONTACTS = np.arange(4 * FRAMES).reshape(FRAMES, 4) % 3 == 0


def _row(numbers: np.ndarray) -> str:
    return " ".join(f"{x:.6f}" for x in numbers.ravel())


def subject(
    order: list[int] | None = None, label: str = "Actor", rate: str = 'frameRate="240"', backward: bool = False
) -> str:
    """Somebody who moves as our body does, perhaps back in time, with segments in another order."""
    place_TJ3, world_TJ33 = body()
    frames = range(FRAMES)[:: -1 if backward else 1]
    joints = [JOINT_NAMES.index(name) for name in JOINTS]
    order = list(range(len(SEGMENTS))) if order is None else order
    names = [SEGMENTS[i] if i >= 0 else "Prop1" for i in order]
    text = f'<subject label="{label}" {rate} segmentCount="{len(order)}" configuration="FullBody"><segments>\n'
    text += "".join(
        f'<segment label="{name}" id="{i}"><points><point label="p"><pos_b>0 0 0</pos_b></point></points></segment>\n'
        for i, name in enumerate(names)
    )
    text += "</segments><footContactDefinition>\n"
    for name in ("RightFoot_Toe", "LeftFoot_Heel", "RightFoot_Heel", "LeftFoot_Toe"):
        text += f'<contactDefinition label="{name}" index="0"/>\n'
    text += "</footContactDefinition>\n<frames>\n"
    still = " ".join(["1 0 0 0"] * len(order))
    for kind in ("identity", "tpose", "tpose-isb"):
        text += f'<frame type="{kind}"><orientation>{still}</orientation><position>{"9 " * 3 * len(order)}</position></frame>\n'
    for number, frame in enumerate(frames):
        turn = TO_ROBOT @ world_TJ33[frame][joints] @ TO_ROBOT.T
        quaternion = np.roll(Rotation.from_matrix(turn).as_quat(), 1, axis=1)[order]
        place = (place_TJ3[frame][joints] @ TO_ROBOT.T)[order]
        planted = _CONTACTS[frame][[3, 0, 2, 1]].astype(int)
        text += (
            f'<frame time="{number}" type="normal" index="{number}"><orientation>{_row(quaternion)}</orientation>'
            f"<position>{_row(place)}</position><velocity>{_row(place)}</velocity>"
            f"<footContacts>{' '.join(map(str, planted))}</footContacts></frame>\n"
        )
    return text + "</frames></subject>\n"


def mvnx(*subjects: str) -> str:
    """A file."""
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<mvnx version="4" xmlns="http://www.xsens.com/mvn/mvnx">\n'
    return f'{head}<mvn version="2023.2" build="1"/><comment>a dance</comment>\n{"".join(subjects)}</mvnx>\n'


def read(text: str, folder: Path, options: ReadOptions | None = None) -> Motion:
    path = folder / "dance.mvnx"
    path.write_text(text)
    return mrhubo.read_motion(path, options)


@pytest.mark.parametrize("shuffled", [False, True])
def test_trunk_head_hands_and_limbs_are_turned_as_segments_are(shuffled: bool, tmp_path: Path) -> None:
    """Segments go by their labels, and a prop is none of the body."""
    order = np.random.default_rng(1).permutation([-1, *range(len(SEGMENTS))]).tolist() if shuffled else None
    place_TJ3, world_TJ33 = body()
    motion = read(mvnx(subject(order)), tmp_path)
    assert len(motion) == FRAMES and motion.frame_rate == 240 and motion.source.startswith("MVNX file of Xsens")
    assert not motion.notes
    check(motion, place_TJ3, world_TJ33)


def test_fingers_are_passed_over(tmp_path: Path) -> None:
    """Gloves have segments and numbers of their own."""
    fingers = "".join(f'<segment label="{name}" id="1"/>' for name in ("LeftCarpus", "LeftFirstMC", "LeftFirstPP"))
    text = mvnx(subject())
    text = text.replace("</segments>", f"</segments><fingerTrackingSegmentsLeft>{fingers}</fingerTrackingSegmentsLeft>")
    own = f"<orientationFingersLeft>{'1 0 0 0 ' * 3}</orientationFingersLeft>"
    check(read(text.replace("<footContacts>", f"{own}<footContacts>"), tmp_path), *body())


def test_planted_feet_are_read(tmp_path: Path) -> None:
    """By their names, which stand in another order than ours."""
    found = read(mvnx(subject()), tmp_path).arrays.contact_T4
    assert found is not None
    np.testing.assert_array_equal(found, _CONTACTS)


def test_who_is_asked_for_is_read(tmp_path: Path) -> None:
    text = mvnx(subject(label="Ann"), subject(label="Ben", backward=True))
    first = read(text, tmp_path)
    assert "'Ann' (12 frames), 'Ben' (12 frames)" in first.notes[0]
    assert first.checksum == read(mvnx(subject()), tmp_path).checksum
    second = read(text, tmp_path, ReadOptions(person="Ben"))
    np.testing.assert_allclose(second.arrays.local_TJ33[::-1], first.arrays.local_TJ33, atol=1e-5)


def test_rate_is_asked_for_where_it_is_not_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="tells no frameRate; say what it is, by --rate"):
        read(mvnx(subject(rate="")), tmp_path)
    assert read(mvnx(subject(rate="")), tmp_path, ReadOptions(rate=60.0)).frame_rate == 60.0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</subject>", "", "is damaged: .*; export it from MVN again"),
        ('label="LeftHand"', 'label="Stump"', "and segments LeftHand were not recorded"),
        ('type="normal"', 'type="tpose"', "without frames of how segments are turned"),
        (r"<orientation>\S+ ", "<orientation>", "<orientation> of frame 0 holds 91 numbers; expected 92"),
        ("<(/?)position>", r"<\1place>", "has 12 frames with an <orientation> and 0 with a <position>"),
        (r"<orientation>\S+ ", "<orientation>one ", "<orientation> of frame 0 holds what is no number"),
        (r"<position>\S+ \S+ ", "<position>nan 1e9 ", "<position> holds NaN, infinite numbers, or some beyond"),
    ],
)
def test_what_is_refused_is_told(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=said):
        read(re.sub(old, new, mvnx(subject(order=list(range(22, -1, -1))))), tmp_path)


def test_no_motion_of_half_a_body(tmp_path: Path) -> None:
    with pytest.raises(NoMotion, match="the whole body is needed"):
        read(mvnx(subject(order=list(range(15)))), tmp_path)


def test_entities_are_not_made(tmp_path: Path) -> None:
    """A name that stands for a name, ten times over and over, would fill the memory."""
    names = "".join(f'<!ENTITY a{i + 1} "{f"&a{i};" * 10}">' for i in range(12))
    text = mvnx(subject()).replace("\n<mvnx", f'\n<!DOCTYPE mvnx [<!ENTITY a0 "1 ">{names}]>\n<mvnx', 1)
    text = text.replace("<comment>a dance", "<comment>&a12;")
    path = tmp_path / "dance.mvnx"
    path.write_text(text)
    read_or_refused(path)


@given(seed=st.integers(0, 2**31), steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_in_a_sentence(seed: int, steps: list[Step], tmp_path: Path) -> None:
    path, good = tmp_path / "dance.mvnx", mvnx(subject()).encode()
    path.write_bytes(altered_words(seed, good) if seed % 2 else damaged(good, steps))
    read_or_refused(path)
