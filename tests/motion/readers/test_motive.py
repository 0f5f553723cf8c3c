"""Skeletons in the tables of OptiTrack's Motive."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES
from mrhubo.fast.rotations import angles_between
from mrhubo.motion import Motion, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.motive_bones import carriers, farther
from tests.motion.damage import Step, accidents, altered_words, damaged, read_or_refused
from tests.motion.marker_writer import c3d
from tests.motion.readers.markers.test_convert import marked
from tests.motion.readers.test_nymeria import FRAMES, TO_ROBOT, TURNED, body, check

_TRUNK = {"Hip": "pelvis", "Ab": "spine1", "Ab2": "spine2", "Chest": "spine3", "Neck": "neck", "Head": "head"}
_LIMBS = {
    "Shoulder": "collar", "UArm": "shoulder", "FArm": "elbow", "Hand": "wrist", "Thigh": "hip", "Shin": "knee",
    "Foot": "ankle", "Toe": "foot",
}  # fmt: skip
BONES = _TRUNK | {
    f"{letter}{bone}": f"{side}_{joint}"
    for letter, side in (("L", "left"), ("R", "right"))
    for bone, joint in _LIMBS.items()
}
"""Motive's names of bones, and ours of where they begin."""
_TURNED = [joint for joint in TURNED if joint != "neck"]  # points tell how the neck is turned


@dataclass(frozen=True)
class Export:
    """How somebody exports a take."""

    skeletons: Sequence[str] = ("Fred",)
    """The second moves back in time."""
    mark: str = ":"
    version: str = "1.23"
    order: str = ""
    """Of angles; empty: quaternions."""
    world_33: np.ndarray | None = None
    unit: float = 1.0
    short_hip: bool = False
    """Whether the hip is called as the skeleton."""
    shuffled: bool = False
    space: str = "Global"
    rate: str = "Capture Frame Rate,240.000000,Export Frame Rate,120.000000"
    gap: Sequence[int] = ()
    """Frames in which the last skeleton is not tracked."""


def motive(how: Export = Export()) -> str:
    """A table of those who move as our body does, and of markers."""
    place_TJ3, world_TJ33 = body()
    joints = [JOINT_NAMES.index(joint) for joint in BONES.values()]
    world_33 = np.eye(3) if how.world_33 is None else how.world_33
    place_TB3 = how.unit * place_TJ3[:, joints] @ world_33.T
    turn = Rotation.from_matrix((world_33 @ world_TJ33[:, joints] @ world_33.T).reshape(-1, 3, 3))
    if how.order:
        angles = turn.as_euler(how.order, degrees=True)[:, [how.order.upper().index(axis) for axis in "XYZ"]]
        turn_TBX, axes = angles.reshape(FRAMES, len(BONES), 3), "XYZ"
    else:
        turn_TBX, axes = turn.as_quat().reshape(FRAMES, len(BONES), 4), "XYZW"
    rows_TBX = np.concatenate([turn_TBX, place_TB3], axis=-1)
    order = np.random.default_rng(2).permutation(len(BONES)) if how.shuffled else np.arange(len(BONES))
    rows_TBX, bones = rows_TBX[:, order], [list(BONES)[i] for i in order]
    names = [
        skeleton if bone == "Hip" and how.short_hip else f"{skeleton}{how.mark}{bone}"
        for skeleton in how.skeletons
        for bone in bones
    ]
    width = len(axes) + 3
    head = f"Format Version,{how.version},Take Name,dance,Take Notes,,{how.rate},"
    head += f"Rotation Type,{how.order.upper() or 'Quaternion'},Length Units,Meters,Coordinate Space,{how.space}"
    tail = ",{0},{0},{0}"
    rows = [
        ("Type", [cell for _ in names for cell in ["Bone"] * width], "Marker"),
        ("Name", [cell for name in names for cell in [name] * width], '"A, marker"'),
        ("ID", ['"04C1"'] * (width * len(names)), '"04C2"'),
        ("", [*["Rotation"] * len(axes), *["Position"] * 3] * len(names), "Position"),
    ]
    if how.version == "1.25":
        rows.insert(3, ("Parent", ["Root"] * (width * len(names)), ""))
    text = head + "\n\n" + "".join(f",{name},{','.join(cells)}{tail.format(end)}\n" for name, cells, end in rows)
    text += f"Frame,Time (Seconds),{','.join([*axes, *'XYZ'] * len(names))},X,Y,Z\n"
    for frame in range(FRAMES):
        cells = []
        for number in range(len(how.skeletons)):
            numbers = rows_TBX[-1 - frame if number else frame].ravel()
            lost = frame in how.gap and number == len(how.skeletons) - 1
            cells += [""] * numbers.size if lost else [f"{x:.6f}" for x in numbers]
        text += f"{frame},{frame / 120:.6f},{','.join(cells)},0.5,,\n"
    return text


def read(text: str, folder: Path, options: ReadOptions | None = None) -> Motion:
    path = folder / "take.csv"
    path.write_text(text)
    return mrhubo.read_motion(path, options)


@pytest.mark.parametrize(
    "how",
    [
        Export(),
        Export(version="1.25", short_hip=True, shuffled=True),
        Export(order="XYZ"),  # axes turn with what is turned
        Export(order="zyx", unit=1000.0),  # axes stay
        Export(("Fred 001",), mark="_", version="1.2"),
    ],
    ids=lambda how: f"{how.version} {how.order}",
)
def test_trunk_head_hands_and_limbs_are_turned_as_bones_are(how: Export, tmp_path: Path) -> None:
    """Which bone carries which is told by how they move, whatever their order and their hip's name."""
    motion = read(motive(how), tmp_path)
    assert len(motion) == FRAMES and motion.frame_rate == 120 and not motion.notes
    assert "OptiTrack Motive" in motion.source and how.skeletons[0] in motion.source
    check(motion, *body(), _TURNED)


def test_a_world_with_z_up_is_turned_up(tmp_path: Path) -> None:
    motion = read(motive(Export(world_33=TO_ROBOT)), tmp_path)
    assert "z up" in motion.source
    np.testing.assert_allclose(
        motion.arrays.local_TJ33, read(motive(), tmp_path).arrays.local_TJ33, atol=1e-3
    )  # the chest's axes come from the root's


def test_who_never_bends_the_back_is_read_as_well(tmp_path: Path) -> None:
    """Neck and shoulders keep their places on each other then, and only names say what carries them."""
    text = motive()
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame,"))
    for at in range(start + 2, len(lines)):  # nothing moves at all
        lines[at] = ",".join([*lines[at].split(",")[:2], *lines[start + 1].split(",")[2:]])
    motion = read("\n".join(lines), tmp_path)
    place_TJ3, world_TJ33 = body()
    check(motion, place_TJ3[:1].repeat(FRAMES, 0), world_TJ33[:1].repeat(FRAMES, 0), _TURNED)


_FINGERS = [f"{side}{finger}{i}" for side in "LR" for finger in ("Thumb", "Index", "Pinky") for i in (1, 2)]
NAMINGS: dict[str, tuple[list[str], dict[str, str]]] = {
    "Motive": ([*BONES, *_FINGERS], {}),
    "FBX": (
        ["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"],
        dict(zip(_LIMBS, ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase"), strict=True)),
    ),
    "BVH": (
        ["Hips", "Chest", "Chest2", "Chest3", "Neck", "Head"],
        dict(zip(_LIMBS, ("Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toe"), strict=True)),
    ),
}
"""The trunk's bones, and those of limbs in the order of ours, as Motive calls them in each way of naming."""


@pytest.mark.parametrize("naming", NAMINGS)
def test_names_tell_what_nearness_does_not(naming: str) -> None:
    """Shoulders begin beside the neck, hands stay beside the thighs, and knuckles keep their places on each other."""
    names, limbs = NAMINGS[naming]
    sides = {"L": "Left", "R": "Right"}
    names = names if not limbs else names + [sides[s] + limbs[part] for s in "LR" for part in _LIMBS]
    ours = [*BONES, *(_FINGERS if not limbs else [])]
    place_TJ3, _ = body()
    place_3 = dict(zip(BONES, place_TJ3[0, [JOINT_NAMES.index(joint) for joint in BONES.values()]], strict=True))
    for number, (side, sign) in enumerate((("L", 1), ("R", -1))):
        place_3[f"{side}Shoulder"] = place_3["Neck"] + [0.03 * sign, -0.03, 0.0]
        place_3[f"{side}Hand"] = place_3[f"{side}Thigh"] + [0.05 * sign, 0.0, 0.02]
        for i, finger in enumerate(_FINGERS[6 * number : 6 * number + 6]):
            place_3[finger] = place_3[f"{side}Hand"] + [0.0, -0.1 - 0.03 * (i % 2), 0.01 * (i // 2)]
    place_FB3 = np.tile(np.stack([place_3[bone] for bone in ours]), (4, 1, 1))
    turn_FB33 = np.tile(np.eye(3), (4, len(ours), 1, 1))
    order, parents, total = carriers(place_FB3, turn_FB33, farther([name.lower() for name in names], 0), 0)
    found = {ours[bone]: ours[order[parent]] for bone, parent in zip(order, parents, strict=True) if parent >= 0}
    assert np.isfinite(total)
    for side in "LR":
        shoulder, *arm = (side + part for part in ("Shoulder", "UArm", "FArm", "Hand"))
        assert found[shoulder] in _TRUNK.keys() - {"Neck", "Head"}
        thigh, *leg = (side + part for part in ("Thigh", "Shin", "Foot", "Toe"))
        for way in ([shoulder, *arm], [thigh, *leg], *([f"{side}Hand", f"{side}{f}1", f"{side}{f}2"]
                    for f in ("Thumb", "Index", "Pinky") if not limbs)):  # fmt: skip
            assert all(found[bone] == above for above, bone in itertools.pairwise(way))


def test_who_is_asked_for_is_read(tmp_path: Path) -> None:
    text = motive(Export(("Ann", "Ben")))
    first = read(text, tmp_path)
    assert "'Ann' (12 frames), 'Ben' (12 frames)" in first.notes[0]
    second = read(text, tmp_path, ReadOptions(person="Ben"))
    np.testing.assert_allclose(second.arrays.local_TJ33[::-1], first.arrays.local_TJ33, atol=1e-5)
    with pytest.raises(UserError, match="there is no person 'Cid'"):
        read(text, tmp_path, ReadOptions(person="Cid"))
    alone = read(motive(), tmp_path, ReadOptions(person="Fred"))
    assert not alone.notes


def test_frames_that_are_not_tracked_are_unsure(tmp_path: Path) -> None:
    """From one frame to the next; those at the ends are none of the motion."""
    whole, motion = read(motive(), tmp_path), read(motive(Export(gap=(0, 4, 5, 11))), tmp_path)
    sure_TJ = motion.arrays.confidence_TJ
    assert sure_TJ is not None and len(motion) == FRAMES - 2
    np.testing.assert_array_equal(sure_TJ[:, 0], [1, 1, 1, 0, 0, 1, 1, 1, 1, 1])
    known = [1, 2, 3, 6, 7, 8, 9, 10]
    turned = angles_between(
        motion.arrays.local_TJ33[sure_TJ[:, 0] > 0].astype(float), whole.arrays.local_TJ33[known].astype(float)
    )
    assert turned.max() < 1e-3
    gap_33, before_33, after_33 = (motion.arrays.local_TJ33[frame, 17].astype(float) for frame in (3, 2, 5))
    assert angles_between(gap_33, before_33) < angles_between(after_33, before_33)


def test_toes_that_are_not_tracked_are_left_out(tmp_path: Path) -> None:
    """Else there would be no frame in which all bones are tracked."""
    lines = motive().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame,"))
    columns = [i for i, cell in enumerate(lines[start - 3].split(",")) if cell.endswith("Toe")]
    for at in range(start + 1, len(lines)):
        cells = lines[at].split(",")
        lines[at] = ",".join("" if i in columns else cell for i, cell in enumerate(cells))
    motion = read("\n".join(lines), tmp_path)
    assert len(motion) == FRAMES and motion.confidence_TJ is None
    assert motion.notes == (
        "bones that are tracked in less than half of the frames are left out: Fred:LToe, Fred:RToe",
    )
    check(motion, *body(), [joint for joint in _TURNED if joint != "left_ankle"])


def test_frames_that_are_left_out_stay_gaps(tmp_path: Path) -> None:
    text = re.sub(r"(?m)^[45],.*\n", "", motive())
    sure_TJ = read(text, tmp_path).arrays.confidence_TJ
    assert sure_TJ is not None
    np.testing.assert_array_equal(np.flatnonzero(sure_TJ[:, 0] == 0), [4, 5])


def test_rate_is_that_of_the_export_the_recording_or_the_times(tmp_path: Path) -> None:
    assert read(motive(Export(rate="Capture Frame Rate,240.000000")), tmp_path).frame_rate == 240
    assert read(motive(Export(rate="Take Date,today")), tmp_path).frame_rate == pytest.approx(120, rel=1e-3)
    text = re.sub(r"(?m)^(\d+),[\d.]+,", r"\1,,", motive(Export(rate="Take Date,today")))
    with pytest.raises(UserError, match="say what it is, by --rate"):
        read(text, tmp_path)
    assert read(text, tmp_path, ReadOptions(rate=60.0)).frame_rate == 60


@pytest.mark.parametrize(
    ("how", "old", "new", "said"),
    [
        (Export(space="Local"), "$", "", "export it again with the global one"),
        (Export(), "(?m)^Frame,.*", "", "without a line that begins with 'Frame'"),
        (Export(), "Position", "Error", "has no rotation or no position of the bones"),
        (
            Export(order="XYZ"),
            "Rotation Type,XYZ",
            "Rotation Type,Euler",
            "in which order the angles .* with quaternions",
        ),
        (Export(), r"(?m)^3,0.025000,[^,]*", "3,0.025,one", "line 11 holds 'one', no number"),
        (Export(), r"(?m)^3,.*", "3,0.025,1", "line 11 has 3 columns; expected 156; was it cut off?"),
        (Export(), r"(?m)^\d+,.*\n", "", "has a header and no frames"),
        (Export(gap=range(FRAMES)), "$", "", "nobody is tracked with all bones in any frame"),
        (Export(), r"(?m)^5,", "5000000000,", "frames are numbered up to"),
    ],
)
def test_what_is_refused_is_told(how: Export, old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=said):
        read(re.sub(old, new, motive(how)), tmp_path)


def test_no_motion_of_rigid_bodies_and_markers_or_half_a_body(tmp_path: Path) -> None:
    with pytest.raises(NoMotion, match="without bones and markers, of rigid body; make a skeleton"):
        read(motive().replace("Bone", "Rigid Body").replace(",Marker", ",Rigid Body"), tmp_path)
    with pytest.raises(NoMotion, match="no markers or joints of a whole body .*: A, marker;"):
        read(motive().replace("Bone", "Rigid Body"), tmp_path)
    with pytest.raises(NoMotion, match="no arms and legs"):
        read(re.sub("Fred:R[^,]*", "Fred:Prop", motive()), tmp_path)


def test_markers_are_read_where_there_are_no_skeletons(tmp_path: Path) -> None:
    point_TK3, labels = marked(unit=1.0, world_33=np.eye(3))
    point_TK3[3:6, labels.index("LFIN")] = np.nan
    names = [f"Fred:{label}" for label in labels] + ["Unlabeled 1001"]
    rows = [("Type", ["Marker"]), ("Name", names), ("ID", ['"1"']), ("", ["Position"])]
    text = "Format Version,1.23,Capture Frame Rate,120.0,Coordinate Space,Global\n\n"
    for name, cells in rows:
        cells = cells if len(cells) > 1 else cells * len(names)
        text += f",{name}," + ",".join(cell for cell in cells for _ in range(3)) + "\n"
    text += "Frame,Time (Seconds)," + ",".join("XYZ" * len(names)) + "\n"
    for frame, point_K3 in enumerate(point_TK3):
        text += f"{frame},{frame / 120:.6f}," + ",".join("" if np.isnan(x) else f"{x:.6f}" for x in point_K3.ravel())
        text += ",1,2,3\n"
    motion = read(text, tmp_path)
    (tmp_path / "box.c3d").write_bytes(c3d(point_TK3, labels))
    wanted = mrhubo.read_motion(tmp_path / "box.c3d")
    assert motion.frame_rate == 120 and motion.source.startswith("table of OptiTrack Motive, 30 of 30 points")
    np.testing.assert_allclose(motion.arrays.local_TJ33, wanted.arrays.local_TJ33, atol=1e-3)


@given(seed=st.integers(0, 2**31), steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_in_a_sentence(seed: int, steps: list[Step], tmp_path: Path) -> None:
    path, good = tmp_path / "take.csv", motive().encode()
    path.write_bytes(altered_words(seed, good) if seed % 2 else damaged(good, steps))
    read_or_refused(path)
