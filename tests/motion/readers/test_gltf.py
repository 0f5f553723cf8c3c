"""glTF files of many programs: where limbs point must not depend on how a program writes."""

from __future__ import annotations

import base64
import copy
import dataclasses
import json
import struct
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

import mrhubo.rotation
from mrhubo import UserError
from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.gltf import is_gltf, read_gltf
from mrhubo.motion.readers.scene.gltf_file import GltfFile
from mrhubo.motion.readers.scene.gltf_moves import Places, find_animations
from tests.motion.bvh_writer import Style
from tests.motion.damage import Step, accidents, altered_words, damaged, read_or_refused
from tests.motion.gltf_writer import Manner, Parts, add_body, glb, write_gltf
from tests.motion.readers.test_bvh import Z_UP, degrees, limb_directions, limb_error, motion, styles, turned

__all__ = ["motion"]  # a fixture
_METRES = Style(unit=1.0, fingers=False)


def read(content: bytes, folder: Path, options: ReadOptions | None = None, name: str = "dance.glb") -> Motion:
    path = folder / name
    path.write_bytes(content)
    return read_gltf(path, options or ReadOptions())


def off(found: Motion, motion: Motion) -> float:
    """The largest angle between limbs [deg]."""
    assert len(found) == len(motion)
    return float(limb_error(found.local_TJ33, motion.local_TJ33).max())


manners = st.builds(
    Manner,
    armature=st.booleans(),
    skin=st.sampled_from(["t", "a", None]),
    own=st.sampled_from(["bound", "first"]),
    method=st.sampled_from(["LINEAR", "STEP", "CUBICSPLINE"]),
    turns=st.sampled_from(["f4", "i2"]),
    scales=st.booleans(),
    matrices=st.booleans(),
    drop=st.booleans(),
    sparse=st.booleans(),
    stride=st.sampled_from([0, 8]),
    start=st.sampled_from([0.0, 0.5, 100.25]),
    vrm=st.sampled_from([None, None, "VRMC_vrm", "VRM"]),
    prop=st.booleans(),
    scale_of_skin=st.sampled_from([1.0, 0.01, 39.37]),
).filter(lambda manner: manner.own == "bound" or (manner.skin is not None and manner.vrm is None))
"""Nodes as in the first frame are at no rest: there must be something else that tells it."""


@given(style=styles, manner=manners)
@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_limbs_point_as_in_the_file_whoever_wrote_it(
    motion: Motion, style: Style, manner: Manner, tmp_path: Path
) -> None:
    found = read(write_gltf(motion, style, manner).glb(), tmp_path)
    assert off(found, motion) < 0.1 and found.frame_rate == motion.frame_rate
    assert found.root_position_T3 is not None and motion.root_position_T3 is not None
    height_T = found.root_position_T3[:, 1]
    torch.testing.assert_close(height_T, motion.root_position_T3[:, 1], atol=2e-3, rtol=0)


PROGRAMS = {
    "Blender": (Style(world=Z_UP, axes="bone", fingers=False), Manner(armature=True)),
    "Blender, bound with arms down": (Style(world=Z_UP, axes="bone", fingers=False), Manner(armature=True, skin="a")),
    "axes anyhow, as the first frame": (Style(unit=1.0, axes="random", fingers=False), Manner(own="first")),
    "a skin in centimetres": (Style(unit=1.0, axes="random", fingers=False), Manner(scale_of_skin=0.01)),
    "gltfpack": (Style(unit=1.0, axes="bone", fingers=False), Manner(turns="i2", drop=True, method="LINEAR")),
    "Maya's cubic splines": (Style(unit=1.0, axes="bone", fingers=False), Manner(method="CUBICSPLINE")),
    "steps": (Style(unit=1.0, axes="bone", fingers=False), Manner(method="STEP", start=0.5)),
    "quaternions of either sign": (Style(unit=1.0, axes="random", fingers=False), Manner(opposite=True)),
    "no skin": (_METRES, Manner(skin=None)),
    "VRM 0": (Style(unit=1.0, axes="random", fingers=False), Manner(vrm="VRM")),
    "VRM 1": (Style(unit=1.0, axes="random", fingers=False), Manner(vrm="VRMC_vrm")),
    "VRM animation": (_METRES, Manner(vrm="VRMC_vrm_animation", skin=None)),
    "a weapon that is hidden": (Style(unit=1.0, axes="random", fingers=False), Manner(scales=True)),
}


@pytest.mark.parametrize("program", PROGRAMS)
def test_trunk_head_hands_and_feet_are_turned_as_in_the_file(program: str, motion: Motion, tmp_path: Path) -> None:
    style, manner = PROGRAMS[program]
    found = read(write_gltf(motion, style, manner).glb(), tmp_path)
    assert off(found, motion) < 0.1
    for joint in ("head", "left_wrist", "right_wrist", "left_ankle", "right_ankle", "pelvis"):
        error = mrhubo.rotation.geodesic_distance(turned(found, joint), turned(motion, joint))
        assert float(torch.rad2deg(error).max()) < 0.1, joint
    assert found.root_rotation_T33 is not None and motion.root_rotation_T33 is not None
    error = mrhubo.rotation.geodesic_distance(found.root_rotation_T33, motion.root_rotation_T33)
    assert float(torch.rad2deg(error).max()) < 0.1
    assert not found.notes


def test_nodes_that_stand_at_no_pose_are_told_by_their_skin(motion: Motion, tmp_path: Path) -> None:
    found = read(write_gltf(motion, _METRES, Manner(own="nothing")).glb(), tmp_path)
    assert off(found, motion) < 0.1 and "rest is the pose in which its skin was bound" in found.source
    found = read(write_gltf(motion, _METRES, Manner(skin=None)).glb(), tmp_path)
    assert "rest is its nodes' own pose" in found.source and "glTF scene, animation 'dance'" in found.source
    found = read(write_gltf(motion, _METRES, Manner(vrm="VRMC_vrm_animation")).glb(), tmp_path)
    assert "rest is its nodes' own pose" in found.source and "VRM animation" in found.source


def test_bytes_as_rotations(motion: Motion, tmp_path: Path) -> None:
    """Quaternions in 8 bits are told to half a degree each, and four of them turn a forearm."""
    found = read(write_gltf(motion, _METRES, Manner(turns="i1")).glb(), tmp_path)
    assert 0.1 < off(found, motion) < 2.0


def _with_draco(parts: Parts) -> bytes:
    parts.top["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    parts.top["meshes"] = [{"primitives": [{"attributes": {"POSITION": 10**6}, "extensions": {
        "KHR_draco_mesh_compression": {"bufferView": 10**6}}}]}]  # fmt: skip
    return parts.glb()


def _with_pointers(parts: Parts) -> bytes:
    animation = parts.top["animations"][0]
    animation["samplers"].append({"input": 0, "output": 10**6})
    sampler = len(animation["samplers"]) - 1
    animation["channels"] += [
        {"sampler": sampler, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/x"}}}},
        {"sampler": sampler, "target": {"path": "weights", "node": 0}},
        {"sampler": sampler, "target": {"path": {}, "node": 0}},
    ]
    return parts.glb()


def _packed_but_whole(parts: Parts) -> bytes:
    """With what is packed, and the same bytes unpacked for programs that do not know how."""
    parts.top["extensionsUsed"] = ["EXT_meshopt_compression"]
    for view in parts.top["bufferViews"]:
        view["extensions"] = {"EXT_meshopt_compression": {"buffer": 1, "byteLength": 3, "mode": "ATTRIBUTES"}}
    return parts.glb()


def _without_names(parts: Parts) -> bytes:
    for node in parts.top["nodes"]:
        del node["name"]
    del parts.top["animations"][0]["name"]
    return parts.glb()


def _second_skin(parts: Parts) -> bytes:
    """Gloves, which are bound in axes of their own."""
    skin = parts.top["skins"][0]
    rows = [i for i, node in enumerate(skin["joints"]) if "Hand" in parts.top["nodes"][node]["name"]]
    view = parts.top["bufferViews"][parts.top["accessors"][skin["inverseBindMatrices"]]["bufferView"]]
    start = view["byteOffset"]
    inverse_J44 = np.frombuffer(bytes(parts.binary[start : start + view["byteLength"]]), "<f4").reshape(-1, 4, 4).mT
    turn_44 = np.eye(4)
    turn_44[:3] = np.concatenate([Rotation.from_rotvec([0.3, 1.0, 2.0]).as_matrix(), [[1.0], [2.0], [3.0]]], axis=1)
    matrices = parts.accessor((inverse_J44[rows] @ turn_44).mT)
    parts.top["skins"].insert(0, {"joints": [skin["joints"][i] for i in rows], "inverseBindMatrices": matrices})
    return parts.glb()


FORMS: dict[str, Callable[[Parts], bytes]] = {
    "base64 in JSON": lambda parts: parts.gltf(),
    "a byte order mark": lambda parts: b"\xef\xbb\xbf" + parts.gltf(),
    "a file beside it": lambda parts: parts.gltf("the%20numbers.bin"),
    "a file whose name has a percent sign": lambda parts: parts.gltf("100%25.bin"),
    "a file in a folder beside it": lambda parts: parts.gltf("data/numbers.bin"),
    "bytes after its end": lambda parts: parts.glb() + b"\0\0\0",
    "meshes packed by Draco": _with_draco,
    "what extensions move": _with_pointers,
    "packed, and unpacked beside": _packed_but_whole,
    "no names": _without_names,
    "a second skin": _second_skin,
}


@pytest.mark.parametrize("form", FORMS)
def test_how_the_file_is_laid_out_does_not_matter(form: str, motion: Motion, tmp_path: Path) -> None:
    parts = write_gltf(motion, _METRES, Manner())
    (tmp_path / "data").mkdir()
    for name in ("the numbers.bin", "100%25.bin", "data/numbers.bin"):
        (tmp_path / name).write_bytes(bytes(parts.binary))
    assert off(read(FORMS[form](parts), tmp_path), motion) < 0.1


def test_keys_that_tell_nothing_may_be_left_out(motion: Motion, tmp_path: Path) -> None:
    """Who holds still has few keys; the rate is that of the others."""
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    rows = torch.cat([torch.arange(8), torch.full((14,), 8), torch.arange(8, 20)])
    held = motion.changed(
        local_TJ33=motion.local_TJ33[rows],
        root_rotation_T33=motion.root_rotation_T33[rows],
        root_position_T3=motion.root_position_T3[rows],
    )
    parts = write_gltf(held, _METRES, Manner(drop=True, prop=False))
    counts = {parts.top["accessors"][one["input"]]["count"] for one in parts.top["animations"][0]["samplers"]}
    assert max(counts) < len(held)
    found = read(parts.glb(), tmp_path)
    assert off(found, held) < 0.1 and found.frame_rate == motion.frame_rate and not found.notes


def _scene_of(key_K: np.ndarray, value_KX: np.ndarray, path: str, method: str, kind: str = "f4") -> GltfFile:
    """A file with one node that moves."""
    parts = Parts()
    parts.top["nodes"] = [{}]
    sampler = {"input": parts.accessor(key_K), "output": parts.accessor(value_KX, kind), "interpolation": method}
    channel = {"sampler": 0, "target": {"node": 0, "path": path}}
    parts.top["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    top = {**parts.top, "buffers": [{"byteLength": len(parts.binary)}]}
    return GltfFile(Path("dance.glb"), top, memoryview(bytes(parts.binary)))


def _sampled(file: GltfFile, time_F: np.ndarray) -> np.ndarray:
    """Where the node is in its parent (F, 3, 4)."""
    one_N3 = np.ones((1, 3))
    still = Places(np.eye(3, 4)[None], 0 * one_N3, np.eye(3)[None], one_N3)
    (animation,) = find_animations(file, still, {0: 0})
    return animation.local_FN34(time_F)[:, 0]


@pytest.mark.parametrize("path", ["translation", "rotation", "scale"])
@pytest.mark.parametrize("method", ["LINEAR", "STEP", "CUBICSPLINE"])
def test_between_keys_as_the_specification_says(path: str, method: str) -> None:
    """Against SciPy's interpolation, also before the first key and after the last."""
    rng = np.random.default_rng(1)
    key_K = np.sort(rng.uniform(0.5, 3.0, 12)).astype(np.float32)
    time_F = np.concatenate([[0.0, 0.4, 3.1, 9.0], rng.uniform(0.5, 3.0, 200), key_K])
    time_F = time_F[
        ~((key_K - time_F[:, None] > 0) & (key_K - time_F[:, None] < 3e-3)).any(axis=1)
    ]  # see the next test
    width = 4 if path == "rotation" else 3
    value_KX = rng.normal(size=(len(key_K), width)).astype(np.float32)
    value_KX /= np.linalg.norm(value_KX, axis=1, keepdims=True) if path == "rotation" else 1.0
    slopes = rng.normal(size=(2, len(key_K), width)).astype(np.float32)
    written = value_KX
    if method == "CUBICSPLINE":
        written = np.stack([slopes[0], value_KX, slopes[1]], axis=1).reshape(-1, width)
    found = _sampled(_scene_of(key_K, written, path, method), time_F)
    at_F = np.clip(time_F, key_K[0], key_K[-1])
    before_F = np.clip(np.searchsorted(key_K, at_F, side="right") - 1, 0, len(key_K) - 2)
    if method == "STEP":
        expected = value_KX[np.searchsorted(key_K, at_F, side="right") - 1]
    elif method == "CUBICSPLINE":
        rows = np.stack([before_F, before_F + 1])
        expected = np.stack([
            CubicHermiteSpline(key_K[pair], value_KX[pair], np.stack([slopes[1][pair[0]], slopes[0][pair[1]]]))(t)
            for t, pair in zip(at_F, rows.T, strict=True)
        ])  # fmt: skip
    elif path == "rotation":
        expected = Slerp(key_K, Rotation.from_quat(value_KX))(at_F).as_quat()
    else:
        expected = np.stack([np.interp(at_F, key_K, value_KX[:, i]) for i in range(width)], axis=1)
    if path == "translation":
        np.testing.assert_allclose(found[..., 3], expected, atol=2e-6)
    elif path == "rotation":
        np.testing.assert_allclose(found[..., :3], Rotation.from_quat(expected).as_matrix(), atol=2e-6)
    else:
        np.testing.assert_allclose(np.diagonal(found[..., :3], axis1=1, axis2=2), expected, atol=2e-6)


def test_steps_are_exact_at_keys_whose_times_are_rounded() -> None:
    """Of times in float32 and in whole milliseconds half come a little later than the frame that they are of."""
    value_K3 = np.arange(90.0)[:, None] * [1.0, 0.0, 0.0]
    for key_K in ((np.arange(90) / 30).astype(np.float32), np.round(np.arange(90) / 30, 3)):
        found = _sampled(_scene_of(key_K, value_K3, "translation", "STEP"), np.arange(90) / 30)
        np.testing.assert_array_equal(found[:, 0, 3], np.arange(90))


def test_a_single_key_is_a_pose() -> None:
    for method, keys in (("LINEAR", 1), ("STEP", 1), ("CUBICSPLINE", 3)):
        file = _scene_of(np.array([2.0]), np.tile([1.0, 2.0, 3.0], (keys, 1)), "translation", method)
        np.testing.assert_array_equal(_sampled(file, np.array([0.0, 2.0, 5.0]))[..., 3], [[1.0, 2.0, 3.0]] * 3)


RNG = np.random.default_rng(0)
RATES = {
    "30, as float32": (np.arange(90) / 30, 30.0),
    "that of video": (np.arange(90) * 1001 / 30000, 30000 / 1001),
    "120 in milliseconds": (np.round(np.arange(300) / 120, 3), 120.0),
    "60, an hour after the start": (3600 + np.arange(90) / 60, 60.0),
    "24, from frame 1 on": (np.arange(1, 60) / 24, 24.0),
    "an odd one": (np.arange(60) / 239.01, 239.01),
    "60, of which some are left out": (np.delete(np.arange(200), [5, 6, 7, 30, 31, 80, 120, 121]) / 60, 60.0),
    "30, of which most are left out": (np.cumsum([0, *RNG.choice([2, 3, 5, 7], 60)]) / 30, 30.0),
    "a few keys": (np.array([0.0, 0.5, 1.25, 2.0]), None),
    "a key each second": (np.arange(20.0), None),
    "at any times": (np.cumsum(RNG.uniform(0.02, 0.3, 60)), None),
    "faster than is believed": (np.arange(50) / 3000, None),
    "a pair of keys, close": (np.array([0.0, 1 / 24]), 24.0),
}


@pytest.mark.parametrize("keys", RATES)
def test_frame_rate_is_that_of_keys(keys: str, motion: Motion, tmp_path: Path) -> None:
    key_K, rate = RATES[keys]
    parts = write_gltf(motion, _METRES, Manner(prop=False))
    animation = parts.top["animations"][0]
    quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (len(key_K), 1))
    animation["samplers"] = [{"input": parts.accessor(key_K), "output": parts.accessor(quaternions)}]
    animation["channels"] = [{"sampler": 0, "target": {"node": 3, "path": "rotation"}}]
    found = read(parts.glb(), tmp_path)
    assert found.frame_rate == pytest.approx(rate or 30.0, rel=1e-6)
    assert ("it is read at 30 frames a second; --rate says otherwise" in " ".join(found.notes)) == (rate is None)
    assert len(found) == int((key_K[-1] - key_K[0]) * (rate or 30.0) + 0.1) + 1
    assert read(parts.glb(), tmp_path, ReadOptions(rate=50.0)).frame_rate == pytest.approx(rate or 50.0, rel=1e-6)


def test_most_channels_tell_the_rate_where_one_is_off(motion: Motion, tmp_path: Path) -> None:
    parts = write_gltf(motion, _METRES, Manner(prop=False))
    sampler = parts.top["animations"][0]["samplers"][-1]
    sampler["input"] = parts.accessor(np.sort(np.random.default_rng(0).uniform(0, 29 / 60, len(motion))))
    assert read(parts.glb(), tmp_path).frame_rate == 60.0


def _with_more(parts: Parts, parent: str, name: str, place: list[float], own: list[float] | None = None) -> None:
    """Adds a bone, and one at its end, to the parts of a file."""
    nodes = parts.top["nodes"]
    above = next(node for node in nodes if node["name"].endswith(parent))
    above.setdefault("children", []).append(len(nodes))
    nodes += [{"name": name, "translation": place, "children": [len(nodes) + 1]},
              {"name": f"{name}_end", "translation": own or place}]  # fmt: skip
    parts.top["skins"][0]["joints"] += [len(nodes) - 2, len(nodes) - 1]


def test_what_a_hand_holds_is_no_finger(motion: Motion, tmp_path: Path) -> None:
    style, manner = Style(unit=1.0), Manner(skin="t", own="bound")
    alone = read(write_gltf(motion, style, manner).glb(), tmp_path)
    parts = write_gltf(motion, style, manner)
    del parts.top["skins"][0]["inverseBindMatrices"]  # of bones that are there
    _with_more(parts, "RightHand", "Sword", [-0.05, 0.0, 0.1], [0.0, 0.0, 0.9])
    found = read(parts.glb(), tmp_path)
    error = mrhubo.rotation.geodesic_distance(turned(found, "right_wrist"), turned(alone, "right_wrist"))
    assert float(torch.rad2deg(error).max()) < 0.1 and off(found, motion) < 0.1


def test_feet_with_five_toes_point_where_the_middle_one_does(motion: Motion, tmp_path: Path) -> None:
    parts = write_gltf(motion, _METRES, Manner())
    del parts.top["skins"][0]["inverseBindMatrices"]
    nodes = parts.top["nodes"]
    for side, inner in (("Left", -1.0), ("Right", 1.0)):
        toe = next(node for node in nodes if node["name"].endswith(f"{side}ToeBase"))
        middle = np.array(toe["translation"])
        for i in (-2, -1, 1, 2):  # the big toe is the longest
            place = (middle + [0.015 * i, 0.0, 0.01 * i * inner]).tolist()
            _with_more(parts, f"{side}Foot", f"{side}Toe{i}", place, [0.0, 0.0, 0.1 + 0.03 * i * inner])
    found = read(parts.glb(), tmp_path)
    for joint in ("left_ankle", "right_ankle"):
        error = mrhubo.rotation.geodesic_distance(turned(found, joint), turned(motion, joint))
        assert float(torch.rad2deg(error).max()) < 0.1, joint


def _several(motion: Motion, names: tuple[str | None, ...]) -> Parts:
    """An animation of the same body for each name, each a little longer."""
    parts = write_gltf(motion, _METRES, Manner(prop=False), names[0])
    for i, name in enumerate(names[1:], start=1):
        animation = copy.deepcopy(parts.top["animations"][0])
        animation["name"] = name
        for sampler in animation["samplers"]:
            key_K = np.arange(len(motion)) * (1 + i) / motion.frame_rate
            sampler["input"] = parts.accessor(key_K)
        parts.top["animations"].append({key: value for key, value in animation.items() if value is not None})
    return parts


def test_several_animations(motion: Motion, tmp_path: Path) -> None:
    parts = _several(motion, ("walk", "run", None, "walk"))
    parts.top["nodes"].append({"name": "Door"})
    door = {"sampler": 0, "target": {"node": len(parts.top["nodes"]) - 1, "path": "translation"}}
    sampler = {"input": parts.accessor(np.arange(100.0)), "output": parts.accessor(np.ones((100, 3)))}
    parts.top["animations"].append({"name": "door", "channels": [door], "samplers": [sampler]})
    found = read(parts.glb(), tmp_path)
    assert found.frame_rate == 15.0 and "'walk 3'" in found.source
    (note,) = found.notes
    assert "'walk 3' is the longest animation" in note and "'run' (0.967 s), 'walk' (0.483 s)" in note
    assert "'animation 2'" in note and "door" not in note
    for name, rate in (("walk", 60.0), ("run", 30.0), ("animation 2", 20.0)):
        found = read(parts.glb(), tmp_path, ReadOptions(animation=name))
        assert found.frame_rate == rate and not found.notes and off(found, motion) < 0.1
    with pytest.raises(UserError, match="has no animation 'jump'; there are 'walk 3'"):
        read(parts.glb(), tmp_path, ReadOptions(animation="jump"))


def test_a_take_that_holds_a_pose_is_not_taken(motion: Motion, tmp_path: Path) -> None:
    """However long it is, as an empty `Take 001` beside the motion."""
    parts = _several(motion, ("dance", "Take 001"))
    for sampler in parts.top["animations"][1]["samplers"]:
        width = 4 if parts.top["accessors"][sampler["output"]]["type"] == "VEC4" else 3
        sampler["input"] = parts.accessor(np.array([0.0, 100.0]))
        sampler["output"] = parts.accessor(np.tile([0.5] * width, (2, 1)))
    found = read(parts.glb(), tmp_path)
    assert off(found, motion) < 0.1 and "'dance' is the longest animation in which something turns" in found.notes[0]


def test_a_figure_of_rigid_parts_may_wear_a_skinned_cape(motion: Motion, tmp_path: Path) -> None:
    """Bones of the cape alone are called such; the body's nodes are not."""
    parts = write_gltf(motion, _METRES, Manner())
    skin = parts.top["skins"][0]
    skin["joints"], _ = [], skin.pop("inverseBindMatrices")
    for i in range(6):
        _with_more(parts, "Spine2", f"Cape{i}", [0.05 * i, 0.1, -0.1], [0.0, -0.4, 0.0])
    found = read(parts.glb(), tmp_path)
    assert off(found, motion) < 0.1 and not found.notes


def test_two_people(motion: Motion, tmp_path: Path) -> None:
    parts, back = Parts(), motion.changed(local_TJ33=motion.local_TJ33.flip(0))
    add_body(parts, motion, _METRES, Manner(prop=False), "dance")
    add_body(parts, back, dataclasses.replace(_METRES, names="xsens"), Manner(prop=False), "dance")
    first, second = parts.top["animations"]
    for channel in second["channels"]:
        channel["sampler"] += len(first["samplers"])
    parts.top["animations"] = [{"name": "dance", **{key: first[key] + second[key] for key in ("samplers", "channels")}}]
    assert off(read(parts.glb(), tmp_path, ReadOptions(person="mixamorig:Hips")), motion) < 0.1
    assert off(read(parts.glb(), tmp_path, ReadOptions(person="Hips")), back) < 0.1
    nodes = parts.top["nodes"]  # as some programs write them, under a node of the scene
    children = {child for node in nodes for child in node.get("children", ())}
    nodes.append({"name": "RootNode", "children": [place for place in range(len(nodes)) if place not in children]})
    found = read(parts.glb(), tmp_path, ReadOptions(person="Hips"))
    assert off(found, back) < 0.1 and not found.notes
    assert "'mixamorig:Hips' is seen longest" in read(parts.glb(), tmp_path).notes[0]


def test_people_go_with_what_carries_them(motion: Motion, tmp_path: Path) -> None:
    """A node that moves them both, as one of a whole scene or that of a character's root motion."""
    parts = Parts()
    add_body(parts, motion, _METRES, Manner(prop=False), "dance")
    add_body(parts, motion, dataclasses.replace(_METRES, names="xsens"), Manner(prop=False), "dance")
    (first, second), nodes = parts.top["animations"], parts.top["nodes"]
    for channel in second["channels"]:
        channel["sampler"] += len(first["samplers"])
    whole = {key: first[key] + second[key] for key in ("samplers", "channels")}
    children = {child for node in nodes for child in node.get("children", ())}
    roots = [place for place in range(len(nodes)) if place not in children]
    angle_T, way_T3 = np.linspace(0.2, 1.5, len(motion)), np.linspace([1.0, 0.1, 0.0], [3.0, 0.1, 2.0], len(motion))
    stage_T = Rotation.from_rotvec(angle_T[:, None] * [0.0, 1.0, 0.0])
    times = parts.accessor(np.arange(len(motion)) / motion.frame_rate)
    for path, value_TX in (("rotation", stage_T.as_quat()), ("translation", way_T3)):
        whole["channels"].append({"sampler": len(whole["samplers"]), "target": {"node": len(nodes), "path": path}})
        whole["samplers"].append({"input": times, "output": parts.accessor(value_TX)})
    nodes.append({"name": "Stage", "children": roots})
    parts.top["animations"] = [whole]
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    turn_T33 = torch.tensor(stage_T.as_matrix(), dtype=torch.float64)
    place_T3 = (turn_T33 @ motion.root_position_T3.double()[..., None])[..., 0] + torch.tensor(way_T3)
    for person in ("mixamorig:Hips", "Hips"):
        found = read(parts.glb(), tmp_path, ReadOptions(person=person))
        assert off(found, motion) < 0.1
        assert found.root_rotation_T33 is not None and found.root_position_T3 is not None
        assert (found.root_rotation_T33 - turn_T33 @ motion.root_rotation_T33.double()).abs().max() < 1e-3
        assert (found.root_position_T3 - place_T3).abs().max() < 2e-3


def test_who_moves_is_taken_before_who_does_not(motion: Motion, tmp_path: Path) -> None:
    """Programs write an animation for each of those in a scene, in which the others stand still."""
    parts, back = Parts(), motion.changed(local_TJ33=motion.local_TJ33.flip(0))
    add_body(parts, motion, _METRES, Manner(prop=False), "Ann")
    add_body(parts, back, dataclasses.replace(_METRES, names="xsens"), Manner(prop=False), "Ben")
    for name, moves, who in (("Ann", motion, "mixamorig:Hips"), ("Ben", back, "Hips")):
        found = read(parts.glb(), tmp_path, ReadOptions(animation=name))
        assert off(found, moves) < 0.1 and f"'{who}' is seen longest" in found.notes[-1]
    still = read(parts.glb(), tmp_path, ReadOptions(animation="Ben", person="mixamorig:Hips"))
    assert len(still) == len(motion) and not still.notes


def test_vrm_says_which_node_is_which(motion: Motion, tmp_path: Path) -> None:
    """Also where toes and knees say otherwise: of an avatar whose sides are exchanged, left is what is called so."""
    parts = write_gltf(motion, _METRES, Manner(vrm="VRMC_vrm"))
    assert off(read(parts.glb(), tmp_path), motion) < 0.1
    bones = parts.top["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    parts.top["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"] = {
        name.replace("left", "?").replace("right", "left").replace("?", "right"): bone for name, bone in bones.items()
    }
    found = read(parts.glb(), tmp_path)
    mine, theirs = limb_directions(found.local_TJ33), limb_directions(motion.local_TJ33)
    for joint in ("shoulder", "elbow"):
        across_T3 = mine[f"left_{joint}"] * torch.tensor([-1.0, 1.0, -1.0])  # who is seen from behind
        assert float(degrees(across_T3, theirs[f"right_{joint}"]).max()) < 1.0
    del parts.top["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]["leftLowerLeg"]
    assert off(read(parts.glb(), tmp_path), motion) < 0.1


def test_pose_that_nodes_were_left_in_is_no_rest(motion: Motion, tmp_path: Path) -> None:
    """Nothing but the first frame is known of how bones are turned."""
    found = read(write_gltf(motion, _METRES, Manner(own="first", skin=None)).glb(), tmp_path)
    assert "no pose at rest" in found.source and off(found, motion) < 0.5


def _lying(motion: Motion, quarter: float, height: float) -> Motion:
    """Somebody who does the same lying, face down (1) or up (-1), at a height, in one place."""
    turn_33 = torch.tensor(Rotation.from_rotvec([quarter * np.pi / 2, 0.0, 0.0]).as_matrix(), dtype=torch.float32)
    assert motion.root_rotation_T33 is not None
    place_T3 = torch.tensor([0.0, height, 0.0]).repeat(len(motion), 1)
    return motion.changed(root_rotation_T33=turn_33 @ motion.root_rotation_T33, root_position_T3=place_T3)


@pytest.mark.parametrize("quarter", [1.0, -1.0])
@pytest.mark.parametrize("height", [0.1, 1.0])
@pytest.mark.parametrize("manner", [Manner(), Manner(own="first"), Manner(own="first", skin="a")])
def test_who_lies_throughout_lies(
    motion: Motion, quarter: float, height: float, manner: Manner, tmp_path: Path
) -> None:
    """On the floor, and on a bed or in water, also where nodes were left lying; glTF has y up."""
    lying = _lying(motion, quarter, height)
    style = Style(unit=1.0, axes="random", fingers=False)
    found = read(write_gltf(lying, style, manner).glb(), tmp_path)
    assert off(found, lying) < 0.1 and "y up" in found.source
    assert found.root_rotation_T33 is not None and lying.root_rotation_T33 is not None
    error = mrhubo.rotation.geodesic_distance(found.root_rotation_T33, lying.root_rotation_T33)
    assert float(torch.rad2deg(error).max()) < 0.1


def test_who_stands_in_another_axis_is_believed_where_a_floor_is(motion: Motion, tmp_path: Path) -> None:
    """Scripts write what has z up as it is."""
    for manner in (Manner(), Manner(own="first")):
        found = read(write_gltf(motion, dataclasses.replace(_METRES, world=Z_UP), manner).glb(), tmp_path)
        assert off(found, motion) < 0.1 and "z up" in found.source
        assert found.root_rotation_T33 is not None and motion.root_rotation_T33 is not None
        error = mrhubo.rotation.geodesic_distance(found.root_rotation_T33, motion.root_rotation_T33)
        assert float(torch.rad2deg(error).max()) < 0.1


@pytest.mark.parametrize("held", [1, 10])
def test_a_motion_that_begins_with_arms_half_down_tells_its_rest(held: int, motion: Motion, tmp_path: Path) -> None:
    """As in an A-pose, in which both sides are alike to the degree."""
    local_TJ33 = torch.eye(3).repeat(held, 21, 1, 1).to(motion.local_TJ33)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        turn_33 = Rotation.from_rotvec([0.0, 0.0, sign * np.radians(45)]).as_matrix()
        local_TJ33[:, POSED_JOINT_NAMES.index(f"{side}_shoulder")] = torch.tensor(turn_33).to(local_TJ33)
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    whole = motion.changed(
        local_TJ33=torch.cat([local_TJ33, motion.local_TJ33]),
        root_rotation_T33=torch.cat(
            [torch.eye(3).repeat(held, 1, 1).to(motion.root_rotation_T33), motion.root_rotation_T33]
        ),
        root_position_T3=torch.cat([motion.root_position_T3[:1].repeat(held, 1), motion.root_position_T3]),
    )
    style = Style(unit=1.0, axes="random", fingers=False)
    found = read(write_gltf(whole, style, Manner(own="first", skin=None)).glb(), tmp_path)
    assert "rest is its first frame" in found.source
    for joint in ("head", "left_wrist", "right_wrist", "left_ankle"):
        one, other = turned(found, joint)[-len(motion) :], turned(motion, joint)
        assert float(torch.rad2deg(mrhubo.rotation.geodesic_distance(one, other)).max()) < 0.5, joint


def test_a_file_in_which_nobody_moves_is_no_motion(motion: Motion, tmp_path: Path) -> None:
    parts = write_gltf(motion, _METRES, Manner())
    animation = parts.top["animations"][0]
    animation["channels"] = [animation["channels"][-1]]  # the camera's
    with pytest.raises(NoMotion, match="export the animation"):
        read(parts.glb(), tmp_path)
    parts.top["nodes"] = []
    with pytest.raises(NoMotion, match="without nodes, in which nothing can move"):
        read(parts.glb(), tmp_path)


def _at(parts: Parts, *keys: Any) -> Any:
    """What is there in the JSON."""
    value: Any = parts.top
    for key in keys:
        value = value[key]
    return value


def _set(*way: Any) -> Callable[[Parts], bytes | None]:
    """Changes the JSON: keys, and the last of them what to put there; a function is called with what is there."""
    *keys, last, value = way

    def change(parts: Parts) -> None:
        holder = _at(parts, *keys)
        holder[last] = value(holder[last]) if callable(value) else value

    return change


def _sampler_accessor(which: str, *way: Any) -> Callable[[Parts], bytes | None]:
    def change(parts: Parts) -> None:
        place = _at(parts, "animations", 0, "samplers", 1, which)
        _set("accessors", place, *way)(parts)

    return change


def _times(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Parts], bytes | None]:
    """Other times of a channel."""

    def changed(parts: Parts) -> None:
        time_K = np.arange(30) / 60
        _at(parts, "animations", 0, "samplers", 1)["input"] = parts.accessor(change(time_K))

    return changed


def _values(value: Callable[[int], np.ndarray]) -> Callable[[Parts], bytes | None]:
    def changed(parts: Parts) -> None:
        animation = _at(parts, "animations", 0)
        channel = next(one for one in animation["channels"] if one["target"]["path"] == "rotation")
        animation["samplers"][channel["sampler"]]["output"] = parts.accessor(value(30))

    return changed


def _packed(parts: Parts) -> bytes:
    """As gltfpack packs."""
    extension = {"buffer": 0, "byteLength": 10, "byteStride": 4, "count": 10, "mode": "ATTRIBUTES"}
    for view in parts.top["bufferViews"]:
        view |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": extension}}
    fallback = {"byteLength": len(parts.binary), "extensions": {"EXT_meshopt_compression": {"fallback": True}}}
    top = {**parts.top, "buffers": [{"byteLength": 12}, fallback], "extensionsRequired": ["EXT_meshopt_compression"]}
    return glb(json.dumps(top).encode(), bytes(12))


def _with_uri(uri: str) -> Callable[[Parts], bytes | None]:
    return lambda parts: parts.gltf(uri)


def _many_children(parts: Parts) -> None:
    """A chain of nodes."""
    first = len(parts.top["nodes"])
    parts.top["nodes"] += [{"children": [first + i + 1]} for i in range(600)] + [{}]


def _bound_to_too_few(parts: Parts) -> None:
    skin = _at(parts, "skins", 0)
    skin["inverseBindMatrices"] = parts.accessor(np.tile(np.eye(4), (3, 1, 1)))


def _header(start: int, content: bytes) -> Callable[[Parts], bytes | None]:
    def changed(parts: Parts) -> bytes:
        file = parts.glb()
        return file[:start] + content + file[start + len(content) :]

    return changed


REFUSED: dict[str, tuple[Callable[[Parts], bytes | None], str]] = {
    "version 1": (_header(4, struct.pack("<I", 1)), "is glTF 1, in a binary file; 2 is read; convert it"),
    "version 3": (_header(4, struct.pack("<I", 3)), "is glTF 3, in a binary file; 2 is read"),
    "version 1 in JSON": (_set("asset", "version", "1.1"), "is glTF 1.1; 2.0 is read; convert it"),
    "cut off": (lambda parts: parts.glb()[:-100], "was it copied or downloaded to its end?"),
    "a header alone": (lambda parts: parts.glb()[:12], "has 12 bytes, in which no glTF is"),
    "a chunk too long": (_header(12, struct.pack("<I", 10**9)), "a part of it ends beyond its"),
    "no JSON first": (_header(16, b"BIN\0"), "does not begin with JSON"),
    "JSON is damaged": (_header(20, b"{{"), "its JSON is damaged"),
    "JSON is a list": (lambda _: glb(b"[]", b""), "its JSON is no object"),
    "deep JSON": (lambda _: glb(b'{"nodes":' + b"[" * 100_000, b""), "its JSON is damaged"),
    "nodes are none": (_set("nodes", {"0": {}}), "'nodes' of the file is no list of objects"),
    "too many nodes": (_set("nodes", [{}] * 20_001), "has 20,001 nodes; at most 20,000"),
    "a child is not there": (_set("nodes", 0, "children", [9999]), "'children' of node 0 is 9999; expected a whole"),
    "children are none": (_set("nodes", 0, "children", "1"), "'children' of node 0 is no list"),
    "two parents": (_set("nodes", 3, "children", lambda old: [*old, 1]), "node 1 hangs on two others, 0 and 3"),
    "a circle": (_set("nodes", 4, "children", [0]), "hang on each other in a circle"),
    "its own child": (_set("nodes", -1, "children", [-1]), "'children' of node"),
    "too deep": (_many_children, "or too deep"),
    "a place of text": (_set("nodes", 2, "translation", ["a", 0, 0]), "'translation' of node 2 is no list of 3 numbers"),
    "a place of two": (_set("nodes", 2, "translation", [0, 0]), "'translation' of node 2 is no list of 3 numbers"),
    "infinitely far": (_set("nodes", 2, "translation", [float("inf"), 0, 0]), "'translation' of node 2 is no list"),
    "turned by nothing": (_set("nodes", 2, "rotation", [0, 0, 0, 0]), "'rotation' of node 2 is 0"),
    "a matrix of 15": (_set("nodes", 2, "matrix", [0] * 15), "'matrix' of node 2 is no list of 16 numbers"),
    "a flat matrix": (_set("nodes", 2, "matrix", [0] * 16), "scaled to nothing"),
    "a bone is not there": (_set("skins", 0, "joints", [9999]), "'joints' of skin 0 is 9999"),
    "few matrices": (_bound_to_too_few, "joints and 3 matrices; the file is damaged"),
    "matrices of another type": (_set("skins", 0, "inverseBindMatrices", 1), "is of type SCALAR; expected MAT4"),
    "VRM's bone is not there": (
        _set("extensions", {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 9999}}}}}),
        "'node' of a bone of VRMC_vrm is 9999",
    ),
    "no accessor": (_set("animations", 0, "samplers", 1, "input", 9999), "'input' of channel 1 of animation 'dance'"),
    "no accessors at all": (_set("accessors", []), "expected none, as there is nothing to name"),
    "an accessor of text": (_set("animations", 0, "samplers", 1, "input", "x"), "'input' of channel 1 of animation"),
    "no sampler": (_set("animations", 0, "channels", 1, "sampler", 9999), "'sampler' of channel 1 of animation"),
    "no node": (_set("animations", 0, "channels", 1, "target", "node", -5), "'node' of channel 1 of animation"),
    "another way between keys": (
        _set("animations", 0, "samplers", 1, "interpolation", "BEZIER"),
        "is interpolated by BEZIER; expected STEP, LINEAR, CUBICSPLINE",
    ),
    "too few values": (_sampler_accessor("output", "count", 3), "has 30 times and 3 values; expected 30"),
    "splines of plain keys": (
        _set("animations", 0, "samplers", 1, "interpolation", "CUBICSPLINE"),
        "has 30 times and 30 values; expected 90",
    ),
    "beyond its buffer": (_sampler_accessor("output", "count", 10**6), "do not lie in its buffer"),
    "a count that is absurd": (_sampler_accessor("output", "count", 10**15), "'count' of accessor"),
    "a count below": (_sampler_accessor("output", "count", -1), "'count' of accessor"),
    "no channels": (_set("animations", 0, "channels", slice(0, None), []), "export the animation"),
    "an unknown component": (_sampler_accessor("output", "componentType", 5124), "'componentType' of accessor"),
    "places as times": (_sampler_accessor("input", "type", "VEC3"), "is of type VEC3; expected SCALAR"),
    "times that fall": (_times(lambda time_K: time_K[::-1]), "do not rise"),
    "times of NaN": (_times(lambda time_K: np.where(time_K > 0.2, np.nan, time_K)), "holds NaN or infinite numbers"),
    "two keys a year apart": (_times(lambda time_K: time_K * 1e8), "are spread over 4.83e+07 s; cut it"),
    "rotations of NaN": (_values(lambda count: np.full((count, 4), np.nan)), "holds NaN or infinite numbers"),
    "rotations of 0": (_values(lambda count: np.zeros((count, 4))), "has keys of 0, which are no rotations"),
    "packed": (_packed, "packed by meshopt; export it without compression"),
    "no buffer": (_set("bufferViews", 0, "buffer", 7), "'buffer' of buffer view 0"),
    "no bytes": (lambda parts: json.dumps({**parts.top, "buffers": [{"byteLength": 9}]}).encode(), "has no bytes"),
    "base64 of something else": (_with_uri("data:application/octet-stream;base64,%%%%"), "is no base64"),
    "too few bytes": (_with_uri("data:application/octet-stream;base64,AAAA"), "and has 3"),
    "a file that is missing": (_with_uri("gone.bin"), "buffer 0 is 'gone.bin', which is not there; put it beside"),
    "a file above": (_with_uri("../a.bin"), "does not lie beside the file"),
    "a file above, hidden": (_with_uri("a/%2e%2e/%2e%2e/a.bin"), "does not lie beside the file"),
    "a file elsewhere": (_with_uri("/etc/passwd"), "does not lie beside the file"),
    "a file of Windows": (_with_uri("C:\\a.bin"), "does not lie beside the file"),
    "a file on a server": (_with_uri("https://example.org/a.bin"), "does not lie beside the file"),
    "a name that is none": (_with_uri("a%00.bin"), "which is not there"),
    "a folder": (_with_uri("folder"), "is a folder"),
    "a pipe of bytes": (_with_uri("short.bin"), "and has 4"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_wrong_is_said(what: str, motion: Motion, tmp_path: Path) -> None:
    change, words = REFUSED[what]
    (tmp_path / "folder").mkdir()
    (tmp_path / "short.bin").write_bytes(b"1234")
    parts = write_gltf(motion, _METRES, Manner())
    content = change(parts)
    with pytest.raises(UserError) as caught:
        read(parts.glb() if content is None else content, tmp_path)
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'dance.glb'}: ") and words in said and "\n" not in said


def test_a_small_file_cannot_ask_for_much(motion: Motion, tmp_path: Path) -> None:
    """Of memory: accessors without bytes, or with the same ones again and again."""

    def nothing(parts: Parts) -> None:
        for accessor in parts.top["accessors"][1:]:
            accessor |= {"count": 30_000_000 // 4}
            del accessor["bufferView"]

    def huge_sparse(parts: Parts) -> None:
        view = parts.view(bytes(64))
        for accessor in parts.top["accessors"][1:]:
            accessor |= {"count": 8_000_000, "sparse": {
                "count": 1, "indices": {"bufferView": view, "componentType": 5123}, "values": {"bufferView": view}}}  # fmt: skip
            del accessor["bufferView"]

    for change in (nothing, huge_sparse):
        parts = write_gltf(motion, _METRES, Manner())
        change(parts)
        tracemalloc.start()
        begun = time.monotonic()
        with pytest.raises(UserError):
            read(parts.glb(), tmp_path)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 400e6 and time.monotonic() - begun < 60


def test_the_beginning_tells_gltf(motion: Motion, tmp_path: Path) -> None:
    parts = write_gltf(motion, _METRES, Manner())
    path = tmp_path / "dance.gltf"

    def tells(content: bytes) -> bool:
        path.write_bytes(content)
        return is_gltf(Content.open(path))

    assert tells(parts.glb()) and tells(parts.gltf()) and tells(b"\xef\xbb\xbf \n" + parts.gltf())
    top = json.loads(parts.gltf())
    top["buffers"][0]["uri"] += base64.b64encode(bytes(99_999)).decode()
    top["animations"] *= 100
    top["nodes"] *= 100
    top["accessors"] *= 100
    top["bufferViews"] *= 100
    for first in ("asset", "nodes", "animations", "accessors", "bufferViews", "buffers"):
        ordered = {first: top[first], **top}
        for indent in (None, 2):
            assert tells(json.dumps(ordered, indent=indent).encode()), first
    for other in (
        b"[]", b"{}", b'{"keypoints": [[[0, 0, 0]]], "fps": 30}', b'{"Loop": "wrap", "Frames": [[0.1, 2]]}', b"HIERARCHY",
        b'{"asset": 1, "frames": []}', b'{"nodes": ["left_hip"], "keypoints": []}', b'["asset", {"nodes": []}]',
        b'{"joints": [{"rotation": [0, 0, 0], "translation": [0]}]}',
    ):  # fmt: skip
        assert not tells(other), other


def _short(motion: Motion) -> Motion:
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    return motion.changed(
        local_TJ33=motion.local_TJ33[:4],
        root_rotation_T33=motion.root_rotation_T33[:4],
        root_position_T3=motion.root_position_T3[:4],
    )


_FILES = (
    lambda motion: write_gltf(motion, _METRES, Manner(skin="a")).glb(),
    lambda motion: write_gltf(motion, _METRES, Manner(method="CUBICSPLINE", vrm="VRM", matrices=True)).gltf(),
    lambda motion: write_gltf(motion, _METRES, Manner(sparse=True, turns="i2", scales=True, stride=4)).glb(),
)


@given(steps=accidents, which=st.sampled_from(_FILES))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_or_refused_in_a_sentence(
    motion: Motion, steps: list[Step], which: Callable[[Motion], bytes], tmp_path: Path
) -> None:
    path = tmp_path / "dance.glb"
    path.write_bytes(damaged(which(_short(motion)), steps))
    read_or_refused(path)


@given(seed=st.integers(0, 2**31), which=st.sampled_from(_FILES))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_json_that_says_something_else_is_read_or_refused(
    motion: Motion, seed: int, which: Callable[[Motion], bytes], tmp_path: Path
) -> None:
    """Numbers, names and lists are exchanged for others, and the file is whole."""
    content = which(_short(motion))
    size = struct.unpack_from("<I", content, 12)[0] if content.startswith(b"glTF") else len(content)
    start = 20 if content.startswith(b"glTF") else 0
    top = json.loads(content[start : start + size])
    text = altered_words(seed, json.dumps(top, indent=1).encode())
    path = tmp_path / "dance.glb"
    path.write_bytes(glb(text, content[start + size + 8 :]) if start else text)
    read_or_refused(path)
