"""OpenSim's angles: what each of them does to a body, on both sides, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mrhubo
from mrhubo import UserError
from mrhubo.motion import mirror
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.readers.test_deepmimic import ours

FRAMES = 24
TRUNK = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")
BACK = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")
SIDED = (
    "hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle", "subtalar_angle", "mtp_angle",
    "arm_flex", "arm_add", "arm_rot", "elbow_flex", "pro_sup",
)  # fmt: skip
COLUMNS = (*TRUNK, *(f"{name}_{side}" for side in "rl" for name in SIDED), *BACK)
STANDING = {"pelvis_ty": 0.93, **{f"knee_angle_{side}": 3.0 for side in "rl"}, **{f"pro_sup_{s}": 90.0 for s in "rl"}}
FORWARD, UP, RIGHT = np.eye(3)


def rows(angles: Mapping[str, float | np.ndarray]) -> np.ndarray:
    """Frames (T, X) of angles [deg], a number or one a frame; else those of somebody who stands."""
    columns = [np.broadcast_to((STANDING | dict(angles)).get(name, 0.0), (FRAMES,)) for name in COLUMNS]
    return np.stack(columns, axis=1).astype(np.float64)


def text(row_TX: np.ndarray, rate: float = 60.0, degrees: bool = True, columns: tuple[str, ...] = COLUMNS) -> str:
    """As OpenSim writes it."""
    head = f"Coordinates\nversion=1\nnRows={len(row_TX)}\nnColumns={len(columns) + 1}\ninDegrees={'yes' if degrees else 'no'}\n"
    lines = [
        "\t".join(f"{number:16.8f}" for number in (frame / rate, *row)) for frame, row in enumerate(row_TX)
    ]  # fmt: skip
    return "\n".join(
        [
            f"{head}\nUnits are S.I. units (second, meters, Newtons, ...)\n\nendheader",
            "\t".join(("time", *columns)),
            *lines,
            "",
        ]
    )


def read(folder: Path, angles: Mapping[str, float | np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Places and turns of our joints in the last frame of a motion that ends with these angles."""
    share_T = np.linspace(0, 1, FRAMES)
    path = folder / "move.mot"
    path.write_text(
        text(rows({name: STANDING.get(name, 0.0) * (1 - share_T) + share_T * a for name, a in angles.items()}))
    )
    places, turns = ours(mrhubo.read_motion(path))
    return {name: place[-1] for name, place in places.items()}, {name: turn[-1] for name, turn in turns.items()}


def way(places: dict[str, np.ndarray], start: str, end: str) -> np.ndarray:
    bone_3 = places[end] - places[start]
    return bone_3 / np.linalg.norm(bone_3)


@pytest.mark.parametrize(
    ("name", "angle", "joint", "end", "towards"),
    [
        ("arm_flex", 60.0, "shoulder", "elbow", FORWARD),
        ("arm_add", -60.0, "shoulder", "elbow", "out"),
        ("elbow_flex", 60.0, "elbow", "wrist", FORWARD),
        ("hip_flexion", 60.0, "hip", "knee", FORWARD),
        ("hip_adduction", -40.0, "hip", "knee", "out"),
        ("knee_angle", 60.0, "knee", "ankle", -FORWARD),
        ("knee_angle", -60.0, "knee", "ankle", -FORWARD),
    ],
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_go_where_angles_say(
    tmp_path: Path, side: str, name: str, angle: float, joint: str, end: str, towards: np.ndarray | str
) -> None:
    both = {f"{name}_r": angle, f"{name}_l": angle}
    places, _ = read(tmp_path, both)
    before, _ = read(tmp_path, {})
    if isinstance(towards, str):
        towards = RIGHT if side == "right" else -RIGHT
    moved = way(places, f"{side}_{joint}", f"{side}_{end}"), way(before, f"{side}_{joint}", f"{side}_{end}")
    assert moved[0] @ towards == pytest.approx(np.sin(np.radians(abs(angle))), abs=0.08)
    turned = np.degrees(np.arccos(np.clip(moved[0] @ moved[1], -1, 1)))
    assert turned == pytest.approx(abs(angle) - (3.0 if angle > 0 and joint == "knee" else 0.0), abs=5.0)


def test_arms_and_legs_turn_about_z_x_y_one_after_the_other(tmp_path: Path) -> None:
    for name, joint, end, angles in (
        ("arm_flex arm_add arm_rot elbow_flex", "elbow", "wrist", (50.0, -40.0, 30.0, 70.0)),
        ("hip_flexion hip_adduction hip_rotation knee_angle", "knee", "ankle", (50.0, -20.0, 25.0, 70.0)),
    ):
        at = {f"{part}_r": angle for part, angle in zip(name.split(), angles, strict=True)}
        places, _ = read(tmp_path, at)
        upper = Rotation.from_euler("ZXY", angles[:3], degrees=True)
        straight = read(tmp_path, {f"{part}_r": 0.0 for part in name.split()})[0]
        theirs = upper.apply(way(straight, f"right_{'shoulder' if joint == 'elbow' else 'hip'}", f"right_{joint}"))
        mine = way(places, f"right_{'shoulder' if joint == 'elbow' else 'hip'}", f"right_{joint}")
        assert mine @ theirs > np.cos(np.radians(0.1))
        axis = (0.226, 0.022, 0.974) if joint == "elbow" else (0.0, 0.0, -1.0)
        bent = upper * Rotation.from_rotvec(np.radians(angles[3]) * np.array(axis) / np.linalg.norm(axis))
        theirs = bent.apply(way(straight, f"right_{joint}", f"right_{end}"))
        assert way(places, f"right_{joint}", f"right_{end}") @ theirs > np.cos(np.radians(0.2))


def test_trunk_hands_and_feet_turn_as_angles_say(tmp_path: Path) -> None:
    _, turns = read(tmp_path, {"pelvis_rotation": 30.0})
    np.testing.assert_allclose(
        turns["pelvis"] @ [0, 0, 1], Rotation.from_euler("y", 30, degrees=True).apply(FORWARD), atol=1e-3
    )
    for name, axis_3 in (("lumbar_extension", RIGHT), ("lumbar_bending", FORWARD), ("lumbar_rotation", UP)):
        _, turns = read(tmp_path, {name: 20.0})
        mine = Rotation.from_matrix(turns["spine3"] @ turns["pelvis"].T).as_rotvec(degrees=True)
        np.testing.assert_allclose(mine, 20 * axis_3, atol=0.1, err_msg=name)
        np.testing.assert_allclose(turns["head"], turns["spine3"], atol=1e-3)
    for pro_sup, right, left in ((90.0, FORWARD, FORWARD), (0.0, RIGHT, -RIGHT)):
        _, turns = read(tmp_path, {"pro_sup_r": pro_sup, "pro_sup_l": pro_sup})
        assert turns["right_wrist"] @ [0, 0, 1] @ right > 0.97 and turns["left_wrist"] @ [0, 0, 1] @ left > 0.97
    for side in ("left", "right"):
        _, turns = read(tmp_path, {f"ankle_angle_{side[0]}": 20.0})
        assert turns[f"{side}_ankle"] @ [0, 0, 1] @ UP == pytest.approx(np.sin(np.radians(20)), abs=0.08)
        _, turns = read(tmp_path, {f"hip_rotation_{side[0]}": 20.0})
        inward = -RIGHT if side == "right" else RIGHT
        assert turns[f"{side}_ankle"] @ [0, 0, 1] @ inward == pytest.approx(np.sin(np.radians(20)), abs=0.08)


def test_a_mirrored_file_is_the_mirrored_motion(tmp_path: Path) -> None:
    generator, phase_T = np.random.default_rng(1), np.linspace(0, 3, FRAMES)
    moves = {
        name: (70 if name.startswith(("knee", "elbow")) else 0) + generator.uniform(10, 25) * np.sin(phase_T * generator.uniform(1, 2) + generator.uniform(0, 6))
        for name in COLUMNS if name not in TRUNK[3:]
    }  # fmt: skip
    others = {
        name: -angle_T if name.endswith(("_list", "_rotation", "_bending")) else angle_T
        for name, angle_T in moves.items()
    }
    others |= {f"{name}_{side}": moves[f"{name}_{'rl'['lr'.index(side)]}"] for name in SIDED for side in "rl"}
    motions = []
    for number, angles in enumerate((moves, others)):
        path = tmp_path / f"{number}.mot"
        path.write_text(text(rows(angles)))
        motions.append(mrhubo.read_motion(path))
    there, mirrored = motions[1], mirror(motions[0])
    assert np.abs(there.arrays.local_TJ33 - mirrored.arrays.local_TJ33).max() < 2e-3
    turns = [motion.arrays.root_rotation_T33 for motion in (there, mirrored)]
    assert turns[0] is not None and turns[1] is not None
    relative = [turn_T33[0].T @ turn_T33 for turn_T33 in turns]  # which way the mirror stands is not told
    np.testing.assert_allclose(relative[0], relative[1], atol=2e-3)


def test_radians_and_opensim_4s_names_are_read(tmp_path: Path) -> None:
    row_TX = rows({"arm_flex_r": np.linspace(0, 80, FRAMES)})
    (tmp_path / "degrees.mot").write_text(text(row_TX))
    in_radians = row_TX * [1.0 if name in TRUNK[3:] else np.pi / 180 for name in COLUMNS]
    names = tuple(f"/jointset/some/{name}/value" for name in COLUMNS)
    both = np.concatenate((in_radians, 9 * in_radians), axis=1)
    columns = (*names, *(name.replace("/value", "/speed") for name in names))
    (tmp_path / "states.sto").write_text(text(both, degrees=False, columns=columns).replace("\t", " "))
    one, two = (mrhubo.read_motion(tmp_path / name).arrays for name in ("degrees.mot", "states.sto"))
    np.testing.assert_allclose(one.local_TJ33, two.local_TJ33, atol=1e-4)


def test_frames_that_follow_each_other_unevenly_are_interpolated(tmp_path: Path) -> None:
    row_TX = rows({"arm_flex_r": np.linspace(0, 80, FRAMES)})
    lines = text(row_TX).splitlines()
    (tmp_path / "a.mot").write_text("\n".join([*lines[:15], *lines[17:], ""]))
    motion = mrhubo.read_motion(tmp_path / "a.mot")
    assert len(motion) == FRAMES and motion.frame_rate == pytest.approx(60, abs=0.1) and "unevenly" in motion.notes[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.replace("arm_flex", "shoulder_elv"), "without arm_flex"),
        (lambda t: t.replace("0.93000000", "nan"), "NaN"),
        (lambda t: t.replace("0.93000000", "inf"), "infinite"),
        (lambda t: t.replace("0.93000000", "high", 1), "no number"),
        (lambda t: t[: t.index("pro_sup_l")], "no frames"),
        (lambda t: t[: len(t) // 2], "columns"),
        (lambda t: t.replace("0.01666667", "0.00000000"), "--rate"),
        (lambda t: t.replace("0.03333333", "0.01666668"), "--rate"),
    ],
)
def test_what_is_no_motion_is_refused(tmp_path: Path, change: object, said: str) -> None:
    (tmp_path / "a.mot").write_text(change(text(rows({}))))  # type: ignore[operator]
    with pytest.raises(UserError, match=said):
        mrhubo.read_motion(tmp_path / "a.mot")


def test_the_rate_that_is_given_is_taken_where_times_tell_none(tmp_path: Path) -> None:
    (tmp_path / "a.mot").write_text(text(rows({})).replace("0.01666667", "0.00000000"))
    assert mrhubo.read_motion(tmp_path / "a.mot", ReadOptions(rate=50)).frame_rate == 50
