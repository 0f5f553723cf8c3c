"""BVH files of many makers: where limbs point must not depend on how a maker writes."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torch import Tensor

import mrhubo
import mrhubo.rotation
from mrhubo import UserError
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, SIDES, Skeleton
from mrhubo.motion import Motion
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.bvh_writer import NAMES, Style, names_of, write_bvh
from tests.motion.damage import Step, accidents, damaged, read_or_refused

ROOT = Path(__file__).resolve().parents[3]
_SEEN_FROM = {"shoulder": "spine3", "elbow": "spine3", "hip": "pelvis", "knee": "pelvis"}
_ENDS = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "ankle"}
Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def limb_directions(local_TJ33: Tensor) -> dict[str, Tensor]:
    """Unit directions (T, 3) of upper arms, forearms, thighs and shins, seen from chest or pelvis."""
    skeleton = Skeleton().double()
    turn = skeleton.global_rotations(local_TJ33.double())
    found = {}
    for joint, end in _ENDS.items():
        for side in SIDES:
            rows = [KEYPOINT_NAMES.index(f"{side}_{name}") for name in (joint, end)]
            bone_3 = torch.nn.functional.normalize(skeleton.rest_K3[rows[1]] - skeleton.rest_K3[rows[0]], dim=0)
            view_T33 = turn[:, JOINT_NAMES.index(_SEEN_FROM[joint])]
            found[f"{side}_{joint}"] = (view_T33.mT @ turn[:, rows[0]] @ bone_3[:, None])[..., 0]
    return found


def degrees(one_T3: Tensor, other_T3: Tensor) -> Tensor:
    sine_T = torch.linalg.cross(one_T3, other_T3).norm(dim=-1)
    return torch.rad2deg(torch.atan2(sine_T, (one_T3 * other_T3).sum(-1)))


def limb_error(one: Tensor, other: Tensor) -> Tensor:
    """Degrees (T, limbs) between the limbs of two motions."""
    first, second = limb_directions(one), limb_directions(other)
    return torch.stack([degrees(first[name], second[name]) for name in first], dim=-1)


def turned(motion: Motion, joint: str) -> Tensor:
    """A joint's rotation (T, 3, 3) seen from the chest."""
    turn = Skeleton().double().global_rotations(motion.local_TJ33.double())
    return turn[:, JOINT_NAMES.index("spine3")].mT @ turn[:, JOINT_NAMES.index(joint)]


@pytest.fixture(scope="module")
def motion() -> Motion:
    """Thirty frames in which arms, legs and head move."""
    clip = mrhubo.read_motion(ROOT / "data" / "motions" / "wave.npz")
    rows = torch.arange(0, len(clip), 10)[:30]
    generator = torch.Generator().manual_seed(0)
    local = clip.local_TJ33[rows].clone()
    for side in SIDES:  # legs that bend, so that knees tell where forward is
        for joint, angle in (("hip", -0.5), ("knee", 0.9)):
            turn = torch.rand(len(rows), generator=generator)[:, None] * torch.tensor([angle, 0.0, 0.0])
            local[:, POSED_JOINT_NAMES.index(f"{side}_{joint}")] = mrhubo.rotation.axis_angle_to_matrix(turn)
    assert clip.root_rotation_T33 is not None and clip.root_position_T3 is not None
    return dataclasses.replace(
        clip,
        local_TJ33=local,
        root_rotation_T33=clip.root_rotation_T33[rows],
        root_position_T3=clip.root_position_T3[rows],
    )


def read(motion: Motion, style: Style, folder: Path, options: ReadOptions | None = None) -> Motion:
    path = folder / "motion.bvh"
    path.write_text(write_bvh(motion, style))
    return mrhubo.read_motion(path, options)


_ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
styles = st.builds(
    Style,
    names=st.sampled_from(sorted(NAMES)),
    order=st.one_of(
        st.sampled_from(_ORDERS), st.fixed_dictionaries({j: st.sampled_from(_ORDERS) for j in JOINT_NAMES})
    ),
    unit=st.sampled_from([1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45]),
    world=st.sampled_from([np.eye(3), Z_UP, np.diag([-1.0, -1, 1]), np.diag([-1.0, 1, -1])]),
    axes=st.sampled_from(["world", "bone", "random", "hanging"]),
    collars=st.booleans(),
    toes=st.booleans(),
    extra_root=st.booleans(),
    rolls=st.booleans(),
    doubled=st.booleans(),
    positions=st.booleans(),
    t_pose_first=st.booleans(),
    fingers=st.booleans(),
    prop=st.booleans(),
    twists=st.booleans(),
    cloth=st.booleans(),
    lower_rolls=st.booleans(),
    seed=st.integers(0, 1000),
)


@given(style=styles)
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_limbs_point_as_in_the_file_whoever_wrote_it(motion: Motion, style: Style, tmp_path: Path) -> None:
    found = read(motion, style, tmp_path)
    assert len(found) == len(motion)
    assert float(limb_error(found.local_TJ33, motion.local_TJ33).max()) < 0.1
    assert found.root_position_T3 is not None and motion.root_position_T3 is not None
    height_T = found.root_position_T3[:, 1]
    torch.testing.assert_close(height_T, motion.root_position_T3[:, 1], atol=2e-3, rtol=0)


QUIRKS = {
    "line ends of old Macs": lambda text: text.replace("\n", "\r").encode(),
    "a byte order mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "small letters": lambda text: text.replace("HIERARCHY", "hierarchy").replace("JOINT", "joint").encode(),
    "names in Shift JIS": lambda text: text.replace("Left", "左").replace("Right", "右").encode("cp932"),
    "names in UTF-8": lambda text: text.replace("Left", "左").replace("Right", "右").encode(),
    "names in Latin 1": lambda text: text.replace("Head", "Schädel").encode("latin1"),
    "what old systems end files with": lambda text: text.encode() + b"\n\x1a",
    "zeros of a disk": lambda text: text.encode() + b"\0\0\0",
    "words after the frames": lambda text: text.encode() + b"END OF FILE",
    "no number of frames": lambda text: re.sub(r"Frames: \d+", "Frames: 0", text).encode(),
    "another person": lambda text: _twice(text).encode(),
}


def _twice(text: str) -> str:
    """The file with a second person, of the same joints, who moves as the first one backward in time."""
    hierarchy, motion = text.removeprefix("HIERARCHY\n").split("MOTION\n")
    frames, time, *rows = motion.splitlines()
    both = "\n".join(f"{row} {other}" for row, other in zip(rows, rows[::-1], strict=True))
    return f"HIERARCHY\n{hierarchy}HIERARCHY\n{hierarchy}MOTION\n{frames}\n{time}\n{both}\n"


@pytest.mark.parametrize("quirk", QUIRKS)
def test_how_the_text_is_written_does_not_matter(motion: Motion, quirk: str, tmp_path: Path) -> None:
    path = tmp_path / "motion.bvh"
    path.write_bytes(QUIRKS[quirk](write_bvh(motion, Style(fingers=False))))
    found = mrhubo.read_motion(path)
    assert len(found) == len(motion) and float(limb_error(found.local_TJ33, motion.local_TJ33).max()) < 0.1
    if quirk == "another person":
        other = mrhubo.read_motion(path, ReadOptions(person="mixamorig:Hips 2"))
        assert float(limb_error(other.local_TJ33, motion.local_TJ33.flip(0)).max()) < 0.1


@pytest.mark.parametrize("what", ["on the back", "on all fours"])
def test_who_never_stands_is_upright_all_the_same(motion: Motion, what: str, tmp_path: Path) -> None:
    """By the skeleton at rest and the floor; the axis along which they lie is none."""
    lies = what == "on the back"
    turn = mrhubo.rotation.axis_angle_to_matrix(torch.tensor([(-1.0 if lies else 1.0) * torch.pi / 2, 0.0, 0.0]))
    way = torch.linspace(0, 0 if lies else 6, len(motion))
    lying = motion.changed(
        root_rotation_T33=turn.expand(len(motion), 3, 3),
        root_position_T3=torch.stack([0 * way, 0 * way + (0.15 if lies else 0.5), way], dim=1),
    )
    found = read(lying, Style(axes="world"), tmp_path)
    assert found.root_rotation_T33 is not None and torch.allclose(found.root_rotation_T33, turn, atol=1e-3)
    assert "lies along" in " ".join(found.notes)


_RIGS = {
    "a skirt and hair": Style(cloth=True),
    "bones in pieces": Style(rolls=True, lower_rolls=True, toes=False, fingers=False),
    "limbs three times": Style(names="nameless", copies=True, doubled=True),
}


@pytest.mark.parametrize("rig", _RIGS)
def test_rigs_of_animators(rig: str, motion: Motion, tmp_path: Path) -> None:
    assert float(limb_error(read(motion, _RIGS[rig], tmp_path).local_TJ33, motion.local_TJ33).max()) < 0.1


def test_feet_without_toes_are_flat_at_rest(motion: Motion, tmp_path: Path) -> None:
    """Files without ends of bones, as glTF has none, tell nothing of toes."""
    found = read(motion, Style(toes=False, ends=False), tmp_path)
    for side in SIDES:
        error = mrhubo.rotation.geodesic_distance(turned(found, f"{side}_ankle"), turned(motion, f"{side}_ankle"))
        assert float(torch.rad2deg(error).max()) < 0.1


@pytest.mark.parametrize("axes", ["world", "hanging"])
def test_head_and_hands_are_turned_as_in_the_file(axes: str, motion: Motion, tmp_path: Path) -> None:
    found = read(motion, Style(axes=axes, fingers=False), tmp_path)
    for joint in ("head", "left_wrist", "right_wrist"):
        error = mrhubo.rotation.geodesic_distance(turned(found, joint), turned(motion, joint))
        assert float(torch.rad2deg(error).max()) < 0.1, joint


@pytest.mark.parametrize("pointed_deg", [0.0, 60.0])  # toes of a dancer tell nothing, but knees do
def test_toes_and_knees_are_believed_rather_than_names(pointed_deg: float, motion: Motion, tmp_path: Path) -> None:
    local = motion.local_TJ33.clone()
    turn = mrhubo.rotation.axis_angle_to_matrix(torch.tensor([np.radians(pointed_deg), 0.0, 0.0], dtype=local.dtype))
    for ankle in ("left_ankle", "right_ankle"):
        local[:, JOINT_NAMES.index(ankle) - 1] = local[:, JOINT_NAMES.index(ankle) - 1] @ turn
    motion = motion.changed(local_TJ33=local)
    found = read(motion, Style(swapped_names=True), tmp_path)
    assert float(limb_error(found.local_TJ33, motion.local_TJ33).max()) < 0.1
    assert "toes and knees are believed" in " ".join(found.notes)


@pytest.mark.parametrize("names", ["biped", "nameless"])
def test_limbs_that_hang_on_neck_and_spine_without_moving_with_them(names: str, motion: Motion, tmp_path: Path) -> None:
    local = motion.local_TJ33.clone()
    wave = 0.4 * torch.sin(torch.arange(len(local)) / 3.0)[:, None]
    for joint, axis in (("neck", [0.3, 1.0, 0.2]), ("spine1", [0.2, 0.5, 1.0])):
        turn = mrhubo.rotation.axis_angle_to_matrix(wave * torch.tensor(axis))
        local[:, POSED_JOINT_NAMES.index(joint)] = local[:, POSED_JOINT_NAMES.index(joint)] @ turn
    moving = dataclasses.replace(motion, local_TJ33=local)
    found = read(moving, Style(names=names, biped=True, positions=True), tmp_path)
    assert float(limb_error(found.local_TJ33, moving.local_TJ33).max()) < 0.5


def test_first_frame_that_jumps_is_left_out(motion: Motion, tmp_path: Path) -> None:
    found = read(motion, Style(t_pose_first=True), tmp_path)
    assert len(found) == len(motion) and "first frame" in found.notes[0]
    assert not read(motion, Style(), tmp_path).notes


@pytest.mark.parametrize(
    ("step", "rate"), [("0.033333", 30), ("0.0083333", 120), ("0,016667", 60), ("0.033367", 30_000 / 1001)]
)
def test_a_rounded_frame_time_means_the_round_rate(step: str, rate: float, motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(re.sub("Frame Time: .*", f"Frame Time: {step}", write_bvh(motion, Style())))
    assert mrhubo.read_motion(path).frame_rate == rate


@pytest.mark.parametrize(
    ("step", "taken", "given"), [("0.03", 30, 29), ("0.008", 125, 120), ("0.02", 50, 60), ("0.04", 25, 24)]
)
def test_a_single_digit_of_the_frame_time_is_doubted(
    step: str, taken: float, given: float, motion: Motion, tmp_path: Path
) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(re.sub("Frame Time: .*", f"Frame Time: {step}", write_bvh(motion, Style())))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == taken and "--rate says otherwise" in " ".join(found.notes)
    found = mrhubo.read_motion(path, ReadOptions(rate=given))
    believed = given != 29  # which no one has
    assert found.frame_rate == (given if believed else taken)
    assert ("is believed, and not 29" in " ".join(found.notes)) != believed


@pytest.mark.parametrize("height", [0.85, 1.0, 1.2, 1.8, 2.1])
@pytest.mark.parametrize("unit", [1.0, 0.01, 0.001])
def test_a_child_is_no_adult_in_inches(height: float, unit: float, motion: Motion, tmp_path: Path) -> None:
    found = read(motion, Style(unit=unit * 1.7 / height), tmp_path)
    assert {1.0: " metres,", 0.01: " centimetres,", 0.001: " millimetres,"}[unit] in found.source


def test_frame_rate(motion: Motion, tmp_path: Path) -> None:
    odd = dataclasses.replace(motion, frame_rate=239.01)
    assert read(odd, Style(), tmp_path).frame_rate == pytest.approx(239.01, rel=1e-6)
    text = write_bvh(motion, Style()).replace("Frame Time: ", "Frame Time: 0 #")
    path = tmp_path / "still.bvh"
    path.write_text(text.split("#")[0] + "\n" + "\n".join(text.splitlines()[-30:]))
    with pytest.raises(UserError, match="--rate"):
        mrhubo.read_motion(path)
    assert mrhubo.read_motion(path, ReadOptions(rate=50.0)).frame_rate == 50.0


def test_map_names_joints(motion: Motion, tmp_path: Path) -> None:
    style = Style(names="nameless", toes=False)
    names = names_of(style)
    given_map = tmp_path / "map.yaml"
    given_map.write_text(
        "up: y\nunit: 0.02\n"
        + "".join(
            f"{joint}: {names[other]}\n"  # left and right exchanged
            for joint, other in (
                (f"{side}_{name}", f"{opposite}_{name}")
                for side, opposite in (("left", "right"), ("right", "left"))
                for name in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
            )
        )
        + f"spine3: {names['spine3']}\npelvis: {names['pelvis']}\n"
    )
    found = read(motion, style, tmp_path, ReadOptions(bvh_map=given_map))
    assert float(limb_error(found.local_TJ33, motion.local_TJ33).mean()) > 5
    given_map.write_text(f"left_shouldr: {names['left_shoulder']}")
    with pytest.raises(UserError, match="nearest: 'left_shoulder'"):
        read(motion, style, tmp_path, ReadOptions(bvh_map=given_map))
    given_map.write_text(f"unit: 1{'0' * 400}")
    with pytest.raises(UserError, match="unit: expected metres"):
        read(motion, style, tmp_path, ReadOptions(bvh_map=given_map))
    given_map.write_text("left_shoulder: no_such_bone")
    with pytest.raises(UserError, match="no_such_bone"):
        read(motion, style, tmp_path, ReadOptions(bvh_map=given_map))


@given(steps=accidents)
@settings(max_examples=16, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_or_refused_in_a_sentence(motion: Motion, steps: list[Step], tmp_path: Path) -> None:
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    short = dataclasses.replace(motion, local_TJ33=motion.local_TJ33[:3], root_rotation_T33=motion.root_rotation_T33[:3],
                                root_position_T3=motion.root_position_T3[:3])  # fmt: skip
    path = tmp_path / "damaged.bvh"
    path.write_bytes(damaged(write_bvh(short, Style(positions=True)).encode(), steps))
    read_or_refused(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("HIERARCHY\n", "MOTION"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\nMOTION\n", "ends inside joint 'a'"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Wrotation\n}\nMOTION\n", "Wrotation"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\n", "three numbers"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\nx\n", "'x'"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\nnan\n", "nan"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 0\nFrame Time: 0.1\n", "0 numbers"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n1\n", "no arms"),
        ("HIERARCHY\n" + "JOINT a\n{\n" * 3, "MOTION"),
        ("HIERARCHY\nROOT a\n{\n" + "JOINT a\n{\n" * 200 + "\nMOTION\n", "one inside the other"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.bvh"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        mrhubo.read_motion(path)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("change", "held"),
    [(lambda row: row.rpartition(" ")[0], -1), (lambda row: f"{row} 0.0", 1), (lambda row: row.replace(".", ".0,", 1), 1)],
)  # fmt: skip
def test_a_number_too_few_or_too_many_is_no_other_joints(
    change: Callable[[str], str], held: int, motion: Motion, tmp_path: Path
) -> None:
    """A line that lacks a number, or has one more, would move all numbers that follow to other joints."""
    text = write_bvh(motion, Style())
    channels = sum(int(count) for count in re.findall(r"CHANNELS (\d+)", text))
    start, *rows = text.rpartition("Frame Time:")[2].splitlines()
    rows[5] = change(rows[5])
    path = tmp_path / "damaged.bvh"
    path.write_text("\n".join([text.rpartition("Frame Time:")[0] + "Frame Time:" + start, *rows]))
    with pytest.raises(UserError) as caught:
        mrhubo.read_motion(path)
    assert f"frame 5 holds {channels + held} numbers, and the joints have {channels} channels" in str(caught.value)


@pytest.mark.parametrize("rest", ["", " -", " 1.", " 1e-"])
def test_a_file_that_was_cut_off_is_read_as_far_as_it_goes(rest: str, motion: Motion, tmp_path: Path) -> None:
    text = write_bvh(motion, Style())
    path = tmp_path / "cut.bvh"
    path.write_text(text.rstrip().rpartition("\n")[0] + "\n1.0 2.0" + rest)
    found = mrhubo.read_motion(path)
    assert len(found) == len(motion) - 1 and any("cut off" in note for note in found.notes)


def test_the_same_take_in_two_forms(external_dir: Path) -> None:
    """CMU's 02_05, converted for MotionBuilder, and our own conversion at 24 frames per second."""
    samples = external_dir / "cmu" / "formats"
    if not samples.is_dir():
        pytest.skip("data/external/cmu/formats is not here")
    found = mrhubo.read_motion(samples / "cmu_motionbuilder_02_05.bvh")
    other = mrhubo.read_motion(external_dir / "cmu" / "evaluation" / "02_05.npz")
    keys = torch.arange(1, len(found) // 5)
    error = limb_error(found.local_TJ33[5 * keys - 1], other.local_TJ33[keys - 1]).mean(dim=0)
    arms = [name.endswith(("shoulder", "elbow")) for name in limb_directions(other.local_TJ33[:1])]
    assert float(error[torch.tensor(arms)].max()) < 1.0 and float(error.max()) < 3.0
    assert "CMU's units" in found.source and "first frame" in found.notes[0]
    assert found.root_position_T3 is not None and 0.7 < float(found.root_position_T3[:, 1].mean()) < 1.1


def test_a_tpose_that_is_not_quite_one(external_dir: Path) -> None:
    path = external_dir / "cmu" / "formats" / "cmu_daz_94_07.bvh"
    if not path.is_file():
        pytest.skip("data/external/cmu/formats is not here")
    found = mrhubo.read_motion(path)
    assert len(found) == 399 and "centimetres" in found.source and "first frame" in found.notes[0]
    assert found.root_rotation_T33 is not None  # in whose frame 0 the body faces the other way
    turn = mrhubo.rotation.geodesic_distance(found.root_rotation_T33[1:], found.root_rotation_T33[:-1])
    assert float(torch.rad2deg(turn).max()) < 15.0
