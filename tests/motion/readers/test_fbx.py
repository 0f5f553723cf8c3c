"""FBX files of many makers: bodies move as in the motion, however nodes, curves and files are written."""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mrhubo
from mrhubo import UserError
from mrhubo.motion import Motion, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.fbx_curves import Curve, read_curve
from mrhubo.motion.readers.scene.fbx_file import Array, BadFbx, Record, read_fbx_file
from mrhubo.motion.readers.scene.fbx_old import modernised
from tests.motion.bvh_writer import Style
from tests.motion.damage import Step, accidents, damaged, read_or_refused
from tests.motion.fbx_writer import SECOND, Manner, properties, record, to_bytes, write_fbx
from tests.motion.readers.test_bvh import Z_UP, degrees, limb_error, turned
from tests.motion.readers.test_bvh import motion as motion  # a fixture

_POSED = Style(t_pose_first=True)
"""With a first frame to which a skin is bound."""
_WRITTEN = {
    "without a skin": (Style(), Manner(skin=False)),
    "plain": (_POSED, Manner()),
    "bones along their axes": (_POSED, Manner(own_axes=True, packed=False)),
    "turned before and after": (Style(t_pose_first=True, names="blender"), Manner(own_axes=True, turns=True)),
    "text": (_POSED, Manner(own_axes=True, turns=True, is_text=True)),
    "pivots and orders": (
        Style(t_pose_first=True, names="biped"),
        Manner(own_axes=True, turns=True, pivots=True, orders=True, version=7500),
    ),
    "scaled by a node above": (Style(t_pose_first=True, names="soma"), Manner(own_axes=True, scale=100.0)),
    "a pose that is told by itself": (_POSED, Manner(own_axes=True, skin=False, bind_poses=True)),
    "z up, no bones": (Style(t_pose_first=True, names="bandai", world=Z_UP), Manner(own_axes=True, bones=False)),
    "of 2009": (_POSED, Manner(own_axes=True, turns=True, pivots=True, orders=True, version=6100)),
    "of 2009, text": (_POSED, Manner(own_axes=True, version=6100, is_text=True, bind_poses=True, skin=False)),
    "of 2009, lines": (_POSED, Manner(version=6100, kind="line", is_text=True)),
    "twists and rolls": (Style(t_pose_first=True, twists=True, rolls=True), Manner(own_axes=True, seed=3)),
    "names exchanged": (Style(t_pose_first=True, swapped_names=True), Manner(own_axes=True, kind="line")),
}


@pytest.mark.parametrize("name", _WRITTEN)
def test_bodies_move_as_in_the_motion(name: str, motion: Motion, tmp_path: Path) -> None:
    style, manner = _WRITTEN[name]
    path = tmp_path / "dance.fbx"
    write_fbx(motion, style, manner, path)
    found = mrhubo.read_motion(path)
    assert len(found) == len(motion) and found.frame_rate == motion.frame_rate and found.name == "dance"
    assert limb_error(motion.local_TJ33, found.local_TJ33).max() < 0.01
    for joint in ("head", "left_wrist", "right_wrist"):
        for axis in range(3):
            error_T = degrees(turned(motion, joint)[..., axis], turned(found, joint)[..., axis])
            assert error_T.max() < (0.1 if joint == "head" else 3.0), joint  # fingers tell hands, some degrees off ours
    assert found.root_position_T3 is not None and motion.root_position_T3 is not None
    assert (found.root_position_T3 - motion.root_position_T3).abs().max() < 1e-4
    assert found.root_rotation_T33 is not None and motion.root_rotation_T33 is not None
    assert (found.root_rotation_T33 - motion.root_rotation_T33).abs().max() < 1e-3


def test_source_says_what_was_found(motion: Motion, tmp_path: Path) -> None:
    write_fbx(motion, _POSED, Manner(own_axes=True), tmp_path / "a.fbx")
    found = mrhubo.read_motion(tmp_path / "a.fbx")
    assert "FBX file, animation 'Take 001': 38 joints, centimetres, y up" in found.source
    assert "rest is the pose in which its skin was bound" in found.source and not found.notes


@pytest.mark.parametrize("version", [7400, 6100])
def test_who_swims_throughout_lies(version: int, motion: Motion, tmp_path: Path) -> None:
    """In the axis that is up as the file says; no floor tells it."""
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    turn_33 = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]).to(motion.root_rotation_T33)
    height_T3 = torch.tensor([0.0, 1.0, 0.0]).to(motion.root_position_T3).repeat(len(motion), 1)
    turn_T33 = turn_33 @ motion.root_rotation_T33
    swims = motion.changed(root_rotation_T33=turn_T33, root_position_T3=height_T3)
    write_fbx(swims, _POSED, Manner(own_axes=True, version=version), tmp_path / "a.fbx")
    found = mrhubo.read_motion(tmp_path / "a.fbx")
    assert "y up (as the file says)" in found.source and found.root_rotation_T33 is not None
    assert (found.root_rotation_T33 - turn_T33).abs().max() < 1e-3


def test_pose_that_nodes_were_left_in_is_no_rest(motion: Motion, tmp_path: Path) -> None:
    """Programs leave the first frame's pose in the nodes; arms hang in it, but nobody stands at attention."""
    write_fbx(motion, Style(axes="random"), Manner(skin=False, own_axes=True, turns=True), tmp_path / "a.fbx")
    found = mrhubo.read_motion(tmp_path / "a.fbx")
    assert "no pose at rest" in found.source
    assert limb_error(motion.local_TJ33, found.local_TJ33).max() < 0.01


def test_animation_is_chosen(motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "a.fbx"
    write_fbx(motion, _POSED, Manner(), path, takes=("walk", "wave"))
    longest, other = mrhubo.read_motion(path), mrhubo.read_motion(path, ReadOptions(animation="wave"))
    assert len(longest) == len(motion) and "'walk' is the longest animation" in longest.notes[0]
    assert "'wave' (0.233 s)" in longest.notes[0] and len(other) == len(motion) // 2 and not other.notes
    assert limb_error(motion.local_TJ33[: len(other)], other.local_TJ33).max() < 0.01
    with pytest.raises(UserError, match="has no animation 'run'; there are 'walk' \\(0.483 s\\), 'wave'"):
        mrhubo.read_motion(path, ReadOptions(animation="run"))


def test_rate_is_that_of_the_keys(motion: Motion, tmp_path: Path) -> None:
    """Of a recording; an animator's few keys have the scene's."""
    path = tmp_path / "a.fbx"
    write_fbx(motion, _POSED, Manner(rate=30.0, time_mode=(6, 24.0)), path)
    assert mrhubo.read_motion(path).frame_rate == 30.0
    write_fbx(motion.changed(frame_rate=30_000 / 1001), _POSED, Manner(time_mode=(6, 30.0)), path)
    assert mrhubo.read_motion(path).frame_rate == pytest.approx(30_000 / 1001, rel=1e-9)
    write_fbx(motion, _POSED, Manner(rate=6.0, time_mode=(11, 24.0)), path)
    assert mrhubo.read_motion(path).frame_rate == 24.0
    write_fbx(motion, _POSED, Manner(rate=6.0, time_mode=(14, 47.5)), path)
    assert mrhubo.read_motion(path).frame_rate == 47.5
    asked = mrhubo.read_motion(path, ReadOptions(rate=100.0))
    assert asked.frame_rate == 47.5 and "100 that was given is left out" in asked.notes[0]


def _curve(kind: int, slopes: bool = False) -> Curve:
    """A sine told every tenth of its period, by kind, with or without its slopes."""
    time_K = np.arange(21) / 10
    right_K, left_K = (2 * np.pi * np.cos(2 * np.pi * (time_K + step)) for step in (0.0, 0.1))
    data_K4 = np.stack([right_K, left_K, 0 * time_K, 0 * time_K], axis=-1) if slopes else np.zeros((1, 4))
    inside = {
        "KeyTime": [round(time * SECOND) for time in time_K],
        "KeyValueFloat": np.sin(2 * np.pi * time_K).tolist(),
        "KeyAttrFlags": [kind] * len(data_K4),
        "KeyAttrRefCount": [len(time_K) // len(data_K4)] * len(data_K4),
        "KeyAttrDataFloat": data_K4.reshape(-1).tolist(),
    }
    found = read_curve(Record("AnimationCurve", [], [Record(name, values) for name, values in inside.items()]), SECOND)
    assert found is not None
    return found


def test_ways_between_keys() -> None:
    """The nearer to a sine, the more is told of the way; keys are exact, and beyond them nothing moves."""
    time_F = np.linspace(0.1, 1.9, 500)
    error = {}
    for kind, curve in {
        "told": _curve(0x408, slopes=True), "found": _curve(0x108), "line": _curve(0x4), "constant": _curve(0x2),
        "next": _curve(0x102),
    }.items():  # fmt: skip
        error[kind] = float(np.abs(curve.at(time_F) - np.sin(2 * np.pi * time_F)).max())
        np.testing.assert_allclose(curve.at(curve.time_K), curve.value_K, atol=1e-12)
        np.testing.assert_allclose(curve.at(np.array([-5.0, 9.0])), curve.value_K[[0, -1]])
    assert error["told"] < 0.002 and error["found"] < 0.02 and 0.03 < error["line"] < 0.06
    assert (
        0.5 < error["constant"] < 0.7 and _curve(0x102).at(np.array([0.11]))[0] == _curve(0x2).at(np.array([0.21]))[0]
    )


@given(st.floats(0.05, 1.0), st.floats(0.05, 1.0), st.floats(-9, 9), st.floats(-9, 9), st.floats(0.0, 1.0))
def test_cubics_are_beziers(first: float, second: float, right: float, left: float, along: float) -> None:
    """A point of Bezier's curve between two keys, 2 s and 3 units apart, is on ours."""
    curve = Curve(
        np.array([1.0, 3.0]),
        np.array([5.0, 8.0]),
        np.full(2, 0x8),
        np.array([[right, left]] * 2),
        np.array([[first, second]] * 2),
    )
    x = 1 + 2 * np.array([0.0, first, 1 - second, 1.0])
    y = np.array([5.0, 5.0 + right * 2 * first, 8.0 - left * 2 * second, 8.0])
    weight = np.array([(1 - along) ** 3, 3 * (1 - along) ** 2 * along, 3 * (1 - along) * along**2, along**3])
    if first + second > 1 + 1e-6:
        assert np.isfinite(curve.at(np.array([weight @ x]))).all()  # time may run back on such a curve
    else:
        slope = max(abs(right), abs(left), 3.0)
        assert curve.at(np.array([weight @ x]))[0] == pytest.approx(
            weight @ y, abs=1e-6 + 1e-3 * slope * (first < 0.06)
        )


def test_weights_are_bits_of_a_float() -> None:
    bits = np.array([2_000 + (5_000 << 16)], np.uint32)
    for data in (
        Array("<f4", 4, np.array([1.0, -1.0, bits.view(np.float32)[0], 0.0], "<f4").tobytes()),
        Array("", 4, f"1.0,-1,{bits[0]},0".encode()),
    ):
        curve = read_curve(
            Record(
                "AnimationCurve",
                [],
                [
                    Record("KeyTime", [Array("<i8", 2, np.array([0, SECOND]).tobytes())]),
                    Record("KeyValueFloat", [Array("<f4", 2, np.array([0, 1], "<f4").tobytes())]),
                    Record("KeyAttrFlags", [Array("<i4", 1, np.array([0x3000408], "<i4").tobytes())]),
                    Record("KeyAttrRefCount", [Array("<i4", 1, np.array([2], "<i4").tobytes())]),
                    Record("KeyAttrDataFloat", [data]),
                ],
            ),
            SECOND,
        )
        assert curve is not None
        np.testing.assert_allclose(curve.weight_K2, [[0.2, 0.5]] * 2)
        np.testing.assert_allclose(curve.slope_K2, [[1.0, -1.0]] * 2)


def test_curves_of_old_files_are_those_of_new_ones(motion: Motion, tmp_path: Path) -> None:
    """Slopes, and how long tangents are, between keys too."""
    for manner in (Manner(rate=10.0), Manner(rate=10.0, weighted=True), Manner(rate=10.0, kind="constant")):
        found = []
        for version in (7400, 6100):
            path = tmp_path / f"{version}.fbx"
            write_fbx(motion, _POSED, dataclasses.replace(manner, version=version), path)
            root, _ = read_fbx_file(path)
            record = modernised(root) if version < 7000 else root
            curves = [read_curve(row, SECOND) for row in record.first("Objects").named("AnimationCurve")]
            found.append(np.stack([curve.at(np.linspace(0, 0.4, 50)) for curve in curves if curve is not None]))
        np.testing.assert_allclose(found[0], found[1], atol=1e-4)


@pytest.mark.parametrize(
    ("key", "said"),
    [("1,2,L,3", "last key is cut off"), ("1,2,U,s,1", "last key"), ("1,2,Q", "with a key that is none"),
     ("1,2,U,q,n", "'q' is no kind of slope"), ("1,2,U,a,z", "a key that is none"), ("L,2,L", "a key that is none")],
)  # fmt: skip
def test_damaged_keys_of_old_files_are_refused(key: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.fbx"
    path.write_text(
        'FBXHeaderExtension: {\n FBXVersion: 6100\n}\nObjects: {\n Model: "Model::Hips", "Limb" {\n }\n}\nTakes: {\n'
        ' Take: "A" {\n Model: "Model::Hips" {\n Channel: "Transform" {\n Channel: "R" {\n Channel: "X" {\n'
        f" KeyCount: 1\n Key: {key}\n }}\n }}\n }}\n }}\n }}\n}}\n"
    )
    with pytest.raises(UserError, match=said):
        mrhubo.read_motion(path)


def _scene(objects: list[tuple], links: list[tuple]) -> list[tuple]:
    return [
        record("FBXHeaderExtension", inside=[record("FBXVersion", 7400)]),
        record("Objects", inside=objects),
        record("Connections", inside=links),
    ]


def test_scenes_without_a_moving_body_are_no_motion(tmp_path: Path) -> None:
    path = tmp_path / "box.fbx"
    box = record("Model", 7, "Box\0\1Model", "Mesh", inside=[properties()])
    path.write_bytes(to_bytes(_scene([box], [record("C", "OO", 7, 0)]), Manner()))
    with pytest.raises(NoMotion, match="holds a scene in which nothing moves; export the animation with it"):
        mrhubo.read_motion(path)
    path.write_bytes(to_bytes(_scene([], []), Manner()))
    with pytest.raises(NoMotion, match="without nodes"):
        mrhubo.read_motion(path)


def test_what_is_refused_is_told(motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "a.fbx"
    write_fbx(motion, _POSED, Manner(), path)
    good = path.read_bytes()
    path.write_bytes(good[:23] + struct.pack("<I", 5800) + good[27:])
    with pytest.raises(UserError, match="version 5.8, from before 2006; save it as FBX 2013"):
        mrhubo.read_motion(path)
    path.write_bytes(good[:-50_000])
    with pytest.raises(UserError, match="is a damaged FBX file: has a record at byte .* that ends at"):
        mrhubo.read_motion(path)
    loop = [record("Model", n, f"n{n}\0\1Model", "Null", inside=[properties()]) for n in (7, 8)]
    links = [record("C", "OO", 7, 8), record("C", "OO", 8, 7)]
    path.write_bytes(to_bytes(_scene(loop, links), Manner()))
    with pytest.raises(UserError, match="in each other in a circle"):
        mrhubo.read_motion(path)
    path.write_text("; FBX 7.4.0 project file\nObjects: {\n Model: 3, }}\n")
    with pytest.raises(UserError, match="a closing brace too many"):
        mrhubo.read_motion(path)
    path.write_text("; FBX 7.4.0 project file\nObjects: {\n Model: 3,\n")
    with pytest.raises(UserError, match="ends inside 'Objects'"):
        mrhubo.read_motion(path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (Array("<f4", 3, b"1234"), "4 bytes where it promises 12"),
        (Array("<f4", 10**9, b""), "at most 50,000,000"),
        (Array("<f4", 3, b"1234", is_packed=True), "cannot be unpacked"),
        (Array("", 3, b"1,2"), "2 numbers where it promises 3"),
        (Array("", 2, b"1,x"), "what is no number"),
    ],
)
def test_arrays_hold_what_they_promise(content: Array, said: str) -> None:
    with pytest.raises(BadFbx, match=said):
        content.numbers()


def test_two_people(motion: Motion, tmp_path: Path) -> None:
    """The same skeleton twice in one scene."""
    path = tmp_path / "a.fbx"
    write_fbx(dataclasses.replace(motion), _POSED, Manner(), path, people=2)
    found = mrhubo.read_motion(path)
    assert "'Armature' is seen longest" in found.notes[0] and "'Armature 2'" in found.notes[0]
    other = mrhubo.read_motion(path, ReadOptions(person="Armature 2"))
    assert limb_error(found.local_TJ33, other.local_TJ33).max() < 0.01


@pytest.fixture(scope="module")
def good_files(motion: Motion, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, ...]:
    """A binary file, one that is not packed, a text, and two of an old version."""
    path = tmp_path_factory.mktemp("fbx") / "good.fbx"
    short = dataclasses.replace(
        motion,
        local_TJ33=motion.local_TJ33[:4],
        root_rotation_T33=None if motion.root_rotation_T33 is None else motion.root_rotation_T33[:4],
        root_position_T3=None if motion.root_position_T3 is None else motion.root_position_T3[:4],
    )
    found = []
    for manner in (
        Manner(), Manner(packed=False, version=7500, own_axes=True), Manner(is_text=True), Manner(version=6100),
        Manner(version=6100, is_text=True),
    ):  # fmt: skip
        write_fbx(short, _POSED, manner, path)
        found.append(path.read_bytes())
    return tuple(found)


@given(which=st.integers(0, 4), steps=accidents)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_in_a_sentence(
    which: int, steps: list[Step], good_files: tuple[bytes, ...], tmp_path: Path
) -> None:
    path = tmp_path / "damaged.fbx"
    path.write_bytes(damaged(good_files[which], steps))
    read_or_refused(path)
