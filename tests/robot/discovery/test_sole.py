"""Where soles are that no shape tells, as where the meshes did not come with the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mrhubo
from mrhubo.describing.yaml_file import keypoint_entries, unsure
from mrhubo.motion import trim
from mrhubo.robot.discovery import Discovery, discover
from mrhubo.robot.soles import sole_balls
from mrhubo.robot.urdf import describe

FOOT = '<link name="left_foot_link">'
MOTIONS = Path(__file__).parents[3] / "data/motions"
MESH = '<visual><geometry><mesh filename="package://walker/meshes/foot.stl"/></geometry></visual>'
"""Of no file that is there."""


def walker(folder: Path, *changes: tuple[str, str]) -> Path:
    """A humanoid without a single shape: arms of four joints, legs of six, feet of 1 kg."""
    joints: list[str] = []
    links = ["base"]

    def add(name: str, parent: str, xyz: tuple[float, float, float], axis: str, low: float, high: float) -> None:
        links.append(f"{name}_link")
        joints.append(
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}_link"/>'
            f'<origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}"/><axis xyz="{axis}"/>'
            f'<limit lower="{low}" upper="{high}" effort="50" velocity="12"/></joint>'
        )

    for side, y in (("left", 1.0), ("right", -1.0)):
        roll = (-0.3, 2.0) if y > 0 else (-2.0, 0.3)
        arm = [("shoulder_pitch", (0, 0.15 * y, 0.4), "0 1 0", -3, 2), ("shoulder_roll", (0, 0.05 * y, 0), "1 0 0", *roll),
               ("shoulder_yaw", (0, 0, -0.1), "0 0 1", -1.5, 1.5), ("elbow", (0, 0, -0.15), "0 1 0", -2.2, 0),
               ("wrist_roll", (0, 0, -0.12), "0 0 1", -1.5, 1.5), ("wrist_pitch", (0, 0, -0.12), "0 1 0", -1, 1)]  # fmt: skip
        leg = [("hip_yaw", (0, 0.1 * y, -0.1), "0 0 1", -0.8, 0.8), ("hip_roll", (0, 0, 0), "1 0 0", -0.5, 0.5),
               ("hip_pitch", (0, 0, 0), "0 1 0", -2, 0.7), ("knee", (0, 0, -0.35), "0 1 0", 0, 2.3),
               ("ankle", (0, 0, -0.35), "0 1 0", -1, 1), ("foot", (0, 0, 0), "1 0 0", -0.5, 0.5)]  # fmt: skip
        for chain in (arm, leg):
            parent = "base"
            for name, xyz, axis, low, high in chain:
                add(f"{side}_{name}", parent, xyz, axis, low, high)
                parent = f"{side}_{name}_link"
    bodies = "".join(f'<link name="{link}">{_mass(link)}</link>' for link in links)
    text = f'<robot name="walker">{bodies}{"".join(joints)}</robot>'
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (folder / "walker.urdf").write_text(text)
    return folder / "walker.urdf"


def _mass(link: str) -> str:
    where = "0.03 0 -0.04" if "foot" in link else "0 0 -0.1"
    return f'<inertial><origin xyz="{where}"/><mass value="1"/></inertial>'


def foot(found: Discovery) -> np.ndarray:
    """The left sole's reach (3,) as its config gives it: backwards, forwards and down."""
    return np.array(keypoint_entries(found)["left_foot"]["sole"])


def asked(found: Discovery) -> str:
    return unsure(found)["left_foot"]


def test_a_foot_of_mass_alone_reaches_farther_down_than_its_centre(tmp_path: Path) -> None:
    found = discover(walker(tmp_path), whole_body=True)
    back, ahead, below = foot(found)
    assert 0.05 < below < 0.08 and 0.05 < back < 0.12 < ahead < 0.25
    assert "centre of mass" in asked(found) and set(unsure(found)) >= {"left_foot", "right_foot"}
    assert "left_foot" not in unsure(discover(tmp_path / "walker.urdf"))


def test_a_foot_of_which_nothing_is_told_is_as_usual(tmp_path: Path) -> None:
    found = discover(walker(tmp_path, (FOOT + _mass("left_foot_link"), FOOT)), whole_body=True)
    assert 0.05 < foot(found)[2] < 0.09 and "as usual" in asked(found)


def test_a_frame_under_the_foot_tells_how_low_it_is(tmp_path: Path) -> None:
    for low, right in ((-0.09, 0.09), (-0.01, 0.062)):  # of a sole, and of a sensor above the centre of mass
        frame = (
            '<link name="pad"/><joint name="pad_joint" type="fixed"><parent link="left_foot_link"/>'
            f'<child link="pad"/><origin xyz="0 0 {low}"/></joint></robot>'
        )
        found = discover(walker(tmp_path, ("</robot>", frame)), whole_body=True)
        assert foot(found)[2] == pytest.approx(right, abs=1e-3) and ("'pad'" in asked(found)) == (right == -low)


def test_shapes_that_tell_are_not_asked_about(tmp_path: Path) -> None:
    box = '<collision><origin xyz="0.04 0 -0.05"/><geometry><box size="0.2 0.1 0.02"/></geometry></collision>'
    found = discover(walker(tmp_path, (FOOT, FOOT + box)), whole_body=True)
    assert keypoint_entries(found)["left_foot"] == "left_foot_link" and "left_foot" not in unsure(found)


def test_a_ball_that_marks_a_frame_beside_a_mesh_is_no_sole(tmp_path: Path) -> None:
    ball = "<visual><geometry><sphere radius='0.02'/></geometry></visual>"
    for look, known in ((ball, True), (MESH + ball, False)):
        file = walker(tmp_path, (FOOT, FOOT + look))
        assert sole_balls("left_foot_link", describe(file))[1] == known


def test_the_base_stands_as_high_as_the_guessed_soles(tmp_path: Path) -> None:
    with pytest.warns(mrhubo.errors.InputWarning, match="no shape tells where its sole is"):
        retargeter = mrhubo.for_robot(walker(tmp_path), whole_body=True)
    result = retargeter(trim(mrhubo.read_motion(MOTIONS / "wave.npz"), 0.0, 0.5))
    assert result.root_position is not None
    below = foot(discover(tmp_path / "walker.urdf", whole_body=True))[2]
    assert np.asarray(result.root_position)[:, 2].max() == pytest.approx(0.8 + below, abs=0.02)
