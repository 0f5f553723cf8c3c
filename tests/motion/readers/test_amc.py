"""ASF/AMC files: a motion, and the skeleton beside it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import torch
from hypothesis import HealthCheck, given, settings

import mrhubo
from mrhubo import UserError
from mrhubo.body.skeleton import JOINT_NAMES, Skeleton
from mrhubo.motion.readers.asf_file import read_amc, read_asf
from mrhubo.motion.readers.options import ReadOptions
from tests.motion.damage import Step, accidents, damaged, read_or_refused

_BONES = {  # name: (above, direction, length, dof)
    "lowerback": ("root", (0, 1, 0), 2.0, "rx ry rz"), "thorax": ("lowerback", (0, 1, 0), 4.0, "rx ry rz"),
    "head": ("thorax", (0, 1, 0), 3.0, "rx ry rz"),
    **{f"{s}{bone}": (above.format(s), (x * sign, y, z), length, dof) for s, sign in (("l", 1), ("r", -1))
       for bone, above, (x, y, z), length, dof in (
           ("hipjoint", "root", (0.7, -0.7, 0), 2.5, ""), ("femur", "{}hipjoint", (0, -1, 0), 7.5, "rx ry rz"),
           ("tibia", "{}femur", (0, -1, 0), 7.3, "rx"), ("foot", "{}tibia", (0, -0.3, 1), 2.0, "rx rz"),
           ("clavicle", "thorax", (1, 0.2, 0), 3.6, ""), ("humerus", "{}clavicle", (1, 0, 0), 5.0, "rx ry rz"),
           ("radius", "{}humerus", (1, 0, 0), 4.5, "rx"), ("hand", "{}radius", (1, 0, 0), 1.2, "rx rz"),
       )},
}  # fmt: skip
_AXES = {"lradius": "180 -30 -90", "rradius": "180 30 90", "lhumerus": "180 -30 -90", "rhumerus": "180 30 90"}


def asf() -> str:
    lines = [":version 1.10", ":name TEST", ":units", "  mass 1.0", "  length 0.45", "  angle deg", ":root",
             "   order TX TY TZ RX RY RZ", "   axis XYZ", "   position 0 0 0", "   orientation 0 0 0", ":bonedata"]  # fmt: skip
    for number, (name, (_, direction, length, dof)) in enumerate(_BONES.items(), start=1):
        lines += ["  begin", f"     id {number}", f"     name {name}",
                  f"     direction {' '.join(map(str, direction))}", f"     length {length}",
                  f"     axis {_AXES.get(name, '0 0 0')} XYZ"]  # fmt: skip
        lines += [f"    dof {dof}", "    limits (-180 180)"] if dof else []
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    lines += [f"    {above} {name}" for name, (above, *_) in _BONES.items()]
    return "\n".join([*lines, "  end", ""])


def amc(frames: list[dict[str, list[float]]]) -> str:
    lines = ["#!OML:ASF test", ":FULLY-SPECIFIED", ":DEGREES"]
    for number, frame in enumerate(frames, start=1):
        lines += [str(number), "root 0 15 0 0 0 0"]
        for name, (_, _, _, dof) in _BONES.items():
            if dof:
                lines.append(f"{name} {' '.join(map(str, frame.get(name, [0.0] * len(dof.split()))))}")
    return "\n".join([*lines, ""])


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """Forty frames in which elbows and knees bend more and more; the path of the motion."""
    (tmp_path / "07.asf").write_text(asf())
    frames = [{"lradius": [2.0 * i], "rradius": [1.0 * i], "ltibia": [1.0 * i], "rtibia": [0.5 * i]} for i in range(40)]
    path = tmp_path / "07_01.amc"
    path.write_text(amc(frames))
    return path


def elbow_bend(motion: mrhubo.Motion, side: str) -> torch.Tensor:
    """Degrees (T,) between upper arm and forearm."""
    turn = Skeleton().global_rotations(motion.local_TJ33)
    upper, lower = (turn[:, JOINT_NAMES.index(f"{side}_{name}"), :, 0] for name in ("shoulder", "elbow"))
    return torch.rad2deg(torch.atan2(torch.linalg.cross(upper, lower).norm(dim=-1), (upper * lower).sum(-1)))


def test_bones_turn_about_their_own_axes(files: Path) -> None:
    found = mrhubo.read_motion(files, ReadOptions(rate=120.0))
    assert found.frame_rate == 120.0 and len(found) == 40 and "CMU's units" in found.source
    torch.testing.assert_close(elbow_bend(found, "left"), 2.0 * torch.arange(40.0), atol=0.1, rtol=0)
    torch.testing.assert_close(elbow_bend(found, "right"), 1.0 * torch.arange(40.0), atol=0.1, rtol=0)


def test_the_frame_rate_and_the_skeleton_are_asked_for(files: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--rate"):
        mrhubo.read_motion(files)
    with pytest.raises(UserError, match=r"name the \.amc file"):
        mrhubo.read_motion(tmp_path / "07.asf")
    (tmp_path / "07.asf").rename(tmp_path / "other.asf")
    assert len(mrhubo.read_motion(files, ReadOptions(rate=120.0))) == 40  # the only one
    shutil.copy(tmp_path / "other.asf", tmp_path / "08.asf")
    with pytest.raises(UserError, match=r"08\.asf, other\.asf"):
        mrhubo.read_motion(files, ReadOptions(rate=120.0))
    (tmp_path / "other.asf").unlink()
    (tmp_path / "08.asf").unlink()
    with pytest.raises(UserError, match=r"needs the \.asf file"):
        mrhubo.read_motion(files, ReadOptions(rate=120.0))


@pytest.mark.parametrize(
    ("name", "skeleton"),
    [
        ("HDM_bd_01-01_01_120", "HDM_bd"),
        ("HDM_bdx_01", "HDM"),
        ("HDM_dg", "HDM_dg"),
        ("HDM_dg_late_2", "HDM_dg_late"),
    ],
)
def test_the_skeleton_of_several_is_that_of_the_longest_beginning(files: Path, name: str, skeleton: str) -> None:
    folder = files.parent
    for other in ("HDM", "HDM_bd", "HDM_dg", "HDM_dg_late", "HD"):
        shutil.copy(folder / "07.asf", folder / f"{other}.asf")
    found = mrhubo.read_motion(files.rename(folder / f"{name}.amc"), ReadOptions(rate=120.0))
    assert f"skeleton {skeleton}.asf" in found.source


def test_a_cut_off_last_frame_is_left_out(files: Path) -> None:
    files.write_text(files.read_text().rpartition("\n40\n")[0] + "\n40\nroot 0 15 0 0 0 0\n")
    found = mrhubo.read_motion(files, ReadOptions(rate=120.0))
    assert len(found) == 39 and "cut off" in found.notes[0]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("lradius 4.0\n", "lradius 4.0 5.0\n", "2 numbers"),
        ("lradius 4.0\n", "lradius x\n", "no numbers"),
        ("lradius 4.0\n", "lradius nan\n", "not finite"),
        ("lradius 4.0\n", "", "no line for 'lradius'"),
        ("lradius 4.0\n", "tail 4.0\n", "'tail'"),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, words: str, files: Path) -> None:
    files.write_text(files.read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=words):
        mrhubo.read_motion(files, ReadOptions(rate=120.0))


@given(steps=accidents)
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_motions_are_read_or_refused_in_a_sentence(files: Path, steps: list[Step]) -> None:
    path = files.with_name("07_02.amc")
    path.write_bytes(damaged("\n".join(files.read_text().split("\n")[:60]).encode(), steps))
    read_or_refused(path)


@given(steps=accidents)
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_skeletons_are_read_or_refused_in_a_sentence(tmp_path: Path, steps: list[Step]) -> None:
    path = tmp_path / "07.asf"
    path.write_bytes(damaged(asf().encode(), steps))
    motion = tmp_path / "07_01.amc"
    motion.write_text(amc([{}] * 3))
    try:
        tree, _ = read_amc(motion, read_asf(path))
    except UserError as error:
        assert "\n" not in str(error) and "07" in str(error)
        return
    assert len(tree) == 3


def test_an_original_walk(external_dir: Path) -> None:
    """CMU's 02_01: arms hang and swing, elbows are loosely bent."""
    samples = external_dir / "cmu" / "formats"
    if not samples.is_dir():
        pytest.skip("data/external/cmu/formats is not here")
    found = mrhubo.read_motion(samples / "02_01.amc", ReadOptions(rate=120.0))
    assert len(found) == 343 and "02.asf" in found.source
    for side in ("left", "right"):
        bend_T = elbow_bend(found, side)
        assert 5 < float(bend_T.min()) and float(bend_T.max()) < 80
        turn = Skeleton().global_rotations(found.local_TJ33)
        arm_T3 = (turn[:, 9].mT @ turn[:, JOINT_NAMES.index(f"{side}_shoulder"), :, :1])[..., 0]
        assert float((arm_T3[:, 1] * (1 if side == "left" else -1)).max()) < -0.8
