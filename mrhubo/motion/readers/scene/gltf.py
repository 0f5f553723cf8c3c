"""Human motions from glTF 2.0: .glb and .gltf, and VRM's avatars (.vrm) and animations (.vrma), which are .glb files.

VRM: https://github.com/vrm-c/vrm-specification; in a VRMC_vrm_animation nodes stand in a T-pose by themselves.

Legend: N nodes, J joints of a skin.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError
from mrhubo.fast.plain.human import norm
from mrhubo.fast.rotations import orthonormal, quaternion_to_matrix
from mrhubo.files.regular import naming
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.scene.convert import body_motion
from mrhubo.motion.readers.scene.gltf_file import DAMAGED, MAGIC, GltfFile, entries, inner, read_gltf_file, whole
from mrhubo.motion.readers.scene.gltf_moves import Places, find_animations, with_axes
from mrhubo.motion.readers.scene.nodes import (
    MAX_NODES,
    Node,
    Rest,
    Scene,
    affine,
    in_world,
    may_be_joints,
    parents_first,
)
from mrhubo.motion.readers.scene.rests import OWN, bound_rests
from mrhubo.motion.readers.tree.anatomy import ROLES

_KEYS = re.compile(
    r'"(asset|nodes|scenes|meshes|animations|buffers|bufferViews|accessors|byteLength|componentType|children|rotation'
    r'|translation|matrix|channels|sampler|target)"\s*+:|"uri"\s*+:\s*+"(data):application/(?:octet-stream|gltf-buffer)'
)
_SIGNS: tuple[tuple[set[str], set[str]], ...] = (
    ({"asset"}, {"nodes", "scenes", "meshes", "animations", "buffers", "bufferViews", "accessors"}),
    ({"bufferViews"}, {"byteLength"}),
    ({"accessors"}, {"componentType"}),
    ({"buffers"}, {"data"}),
    ({"nodes", "children"}, {"rotation", "translation", "matrix"}),
    ({"animations", "channels", "sampler"}, {"target"}),
)
"""Keys that tell glTF's JSON, all of the first and one of the second: they come in any order, and only those at the
beginning are seen."""
_VRM = ("VRMC_vrm", "VRM", "VRMC_vrm_animation")
_VRM_JOINTS = {
    "hips": "pelvis", "upperChest": "spine3", "UpperLeg": "hip", "LowerLeg": "knee", "Foot": "ankle", "Toes": "foot",
    "Shoulder": "collar", "UpperArm": "shoulder", "LowerArm": "elbow", "Hand": "wrist",
}  # fmt: skip
"""Our joints, by the names of VRM's bones without their sides."""
_UP = "y"
"""As the specification says."""
_SHORTEST = 1e-6
"""Of quaternions that are none to be normalised."""
_LARGEST = 1e9
"""No number of a node is beyond this."""


def is_gltf(content: Content) -> bool:
    """Whether a file begins as a GLB file does, or as glTF's JSON."""
    if content.start.startswith(MAGIC):
        return True
    if content.text is None or not content.text.lstrip().startswith("{"):
        return False
    keys = {key or data for key, data in _KEYS.findall(content.text)}
    return any(all_of <= keys and one_of & keys for all_of, one_of in _SIGNS)


def read_gltf(path: Path, options: ReadOptions) -> Motion:
    """Reads the motion of one body in a glTF file; which node is which joint is found out.

    Raises:
        NoMotion: nothing moves in it.
        UserError: the file is missing, damaged or too large, or no human is found in it.
    """
    file, notes = read_gltf_file(path), []
    if not file.top.get("nodes"):
        raise NoMotion(f"{path}: is a glTF file without nodes, in which nothing can move; export the skeleton with it")

    def scene(every: bool) -> Scene:
        with naming(path):
            return _scene(file, every)

    return body_motion(path, scene, f"{_kind(file)}, animation", options, notes)


def _kind(file: GltfFile) -> str:
    extensions = inner(file.top, "extensions")
    if "VRMC_vrm_animation" in extensions:
        return "VRM animation"
    return "VRM avatar" if any(name in extensions for name in _VRM) else "glTF scene"


def _scene(file: GltfFile, every: bool) -> Scene:
    """What a file holds, of the nodes that may be joints, or of every node."""
    told = entries(file.top, "nodes")
    if len(told) > MAX_NODES:
        raise UserError(f"has {len(told):,} nodes; at most {MAX_NODES:,} are read; export the skeleton alone")
    parents = _parents(told)
    order = parents_first(parents)
    if order is None:
        raise UserError("its nodes hang on each other in a circle, or too deep; export the skeleton alone")
    bones = _bones(file, len(told))
    number = {place: i for i, place in enumerate(order)}
    nodes = [Node(_name(told, place), number.get(parents[place], -1), place in bones) for place in order]
    kept = may_be_joints(nodes, every)
    number = {order[place]: i for i, place in enumerate(kept)}
    order = [order[place] for place in kept]
    nodes = [Node(_name(told, place), number.get(parents[place], -1), place in bones) for place in order]
    places = _places([told[place] for place in order], [f"node {place}" for place in order])
    above = [node.parent for node in nodes]
    rests = [Rest(OWN, in_world(places.local_N34[None], above)[0], may_move=True)]
    bound = bound_rests(places.local_N34, above, _bound(file, number, len(told)), _UP)
    is_vrm = any(name in inner(file.top, "extensions") for name in _VRM)
    rests = [*rests, *bound] if is_vrm else [*bound, *rests]
    return Scene(tuple(nodes), tuple(rests), find_animations(file, places, number), _body(file, number), _UP)


def _body(file: GltfFile, number: dict[int, int]) -> dict[str, int]:
    """Nodes by the names of our joints, as VRM tells them; the places of the nodes by those in the file."""
    found: dict[str, int] = {}
    for name, node in _human_bones(file):
        if node in number:
            found.setdefault(_joint(name), number[node])
    for ours, others in (("spine3", ("chest", "spine")), *((f"{s}_collar", (f"{s}_shoulder",)) for s in SIDES)):
        instead = next((found[other] for other in others if other in found), None)
        if ours not in found and instead is not None:
            found[ours] = instead
    return {joint: place for joint, place in found.items() if joint in ROLES}


def _joint(name: str) -> str:
    """Our name of a bone of VRM's, or its own."""
    side, part = next(((side, name.removeprefix(side)) for side in SIDES if name.startswith(side)), ("", name))
    ours = _VRM_JOINTS.get(part, part)
    return f"{side}_{ours}" if side else ours


def _human_bones(file: GltfFile) -> Iterator[tuple[str, int]]:
    """What VRM calls nodes that are parts of a human."""
    for extension in _VRM:
        told = inner(file.top, "extensions", extension, "humanoid").get("humanBones")
        if isinstance(told, list):
            bones = [(bone.get("bone"), bone) for bone in told if isinstance(bone, dict)]
        else:
            bones = told.items() if isinstance(told, dict) else ()
        for name, bone in bones:
            if isinstance(bone, dict) and bone.get("node", -1) != -1:  # VRM 0 has -1 for those that are not there
                yield str(name), whole(bone, "node", f"a bone of {extension}", len(file.top["nodes"]) - 1)


def _name(told: list[dict[str, Any]], place: int) -> str:
    name = told[place].get("name")
    return name if isinstance(name, str) and name else f"node {place}"


def _parents(told: list[dict[str, Any]]) -> list[int]:
    """The parent of each node; -1 for roots."""
    parents = [-1] * len(told)
    for place, node in enumerate(told):
        for child in _list(node, "children", f"node {place}", len(told)):
            if parents[child] not in (-1, place):
                raise UserError(f"node {child} hangs on two others, {parents[child]} and {place}; {DAMAGED}")
            parents[child] = place
    return parents


def _list(holder: dict[str, Any], key: str, where: str, count: int) -> list[int]:
    """A list of places of nodes, of which there are `count`; empty where it is missing."""
    value = holder.get(key, [])
    if not isinstance(value, list):
        raise UserError(f"'{key}' of {where} is no list; {DAMAGED}")
    return [whole({key: one}, key, where, count - 1) for one in value]


def _bones(file: GltfFile, count: int) -> set[int]:
    """The nodes that the file says are bones: joints of skins, and what VRM names as parts of a human."""
    bones: set[int] = set()
    for i, skin in enumerate(entries(file.top, "skins")):
        bones.update(_list(skin, "joints", f"skin {i}", count))
    return bones | {node for _, node in _human_bones(file)}


def _places(told: list[dict[str, Any]], named: list[str]) -> Places:
    """Where nodes are in their parents when nothing moves them."""
    size = len(told)
    translation_N3, scale_N3 = np.zeros((size, 3)), np.ones((size, 3))
    rotation_N33 = np.repeat(np.eye(3)[None], size, axis=0)
    sheared: dict[int, np.ndarray] = {}
    for place, (node, name) in enumerate(zip(told, named, strict=True)):
        if "matrix" in node:
            matrix_34 = _numbers(node, "matrix", 16, name).reshape(4, 4).T[:3]
            sheared[place] = matrix_34
            sign = -1.0 if np.linalg.det(matrix_34[:, :3]) < 0 else 1.0
            translation_N3[place], scale_N3[place] = matrix_34[:, 3], sign * with_axes(norm(matrix_34[:, :3].T))
            rotation_N33[place] = orthonormal(sign * matrix_34[:, :3])
            continue
        if "translation" in node:
            translation_N3[place] = _numbers(node, "translation", 3, name)
        if "scale" in node:
            scale_N3[place] = with_axes(_numbers(node, "scale", 3, name))
        if "rotation" in node:
            quaternion_4 = _numbers(node, "rotation", 4, name)
            length = float(norm(quaternion_4))
            if length < _SHORTEST:
                raise UserError(f"'rotation' of {name} is 0, which is no rotation; export it again")
            rotation_N33[place] = quaternion_to_matrix(quaternion_4 / length)
    local_N34 = affine(translation_N3, rotation_N33, scale_N3)
    for place, matrix_34 in sheared.items():
        local_N34[place] = matrix_34
    return Places(local_N34, translation_N3, rotation_N33, scale_N3)


def _numbers(node: dict[str, Any], key: str, count: int, where: str) -> np.ndarray:
    """Some numbers of a node."""
    value = node[key]
    good = isinstance(value, list) and len(value) == count
    if good and all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < _LARGEST for x in value):
        return np.array(value, np.float64)
    raise UserError(f"'{key}' of {where} is no list of {count} numbers within {_LARGEST:g}; {DAMAGED}")


def _bound(file: GltfFile, number: dict[int, int], count: int) -> dict[int, np.ndarray]:
    """Where joints (3, 4) are in the axes of the skin with the most of them when that was bound, by place of the nodes
    that are kept; joints of other skins are added where those have them.
    """
    skins = [(_list(skin, "joints", f"skin {i}", count), skin, i) for i, skin in enumerate(entries(file.top, "skins"))]
    found: dict[int, np.ndarray] = {}
    for joints, skin, i in sorted(skins, key=lambda one: -len(one[0])):
        if "inverseBindMatrices" not in skin:
            continue
        inverse_J44 = file.numbers(skin, "inverseBindMatrices", "MAT4", f"skin {i}").reshape(-1, 4, 4).mT
        if len(inverse_J44) < len(joints):
            raise UserError(f"skin {i} has {len(joints)} joints and {len(inverse_J44)} matrices; {DAMAGED}")
        with np.errstate(all="ignore"):
            turn_J33 = inverse_J44[: len(joints), :3, :3].astype(np.float64)
            good_J = np.abs(np.linalg.det(turn_J33)) > 0
            turn_J33 = np.linalg.inv(np.where(good_J[:, None, None], turn_J33, np.eye(3)))
            place_J34 = np.concatenate([turn_J33, -turn_J33 @ inverse_J44[: len(joints), :3, 3:]], axis=-1)
        bound = {
            number[node]: place_34
            for node, place_34, is_good in zip(joints, place_J34, good_J, strict=True)
            if is_good and node in number and np.isfinite(place_34).all()
        }
        shared = next((place for place in bound if place in found), None)
        if shared is not None:  # two skins may have been bound in axes of their own
            way_33 = found[shared][:, :3] @ np.linalg.inv(bound[shared][:, :3])
            way_31 = found[shared][:, 3:] - way_33 @ bound[shared][:, 3:]
            bound = {
                p: way_33 @ place_34 + np.pad(way_31, ((0, 0), (3, 0)))
                for p, place_34 in bound.items()
                if p not in found
            }
        found = bound | found
    return found
