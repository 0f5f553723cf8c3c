"""Writes a motion of our skeleton as a glTF file in the manner of one program or another, for tests of readers.

What the nodes are, how their axes lie and what they are called is that of a BVH file (`tests.motion.bvh_writer`): it is
written, and read as a tree of joints. How that tree becomes nodes, skins and keys is drawn or given here.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import struct
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.bvh_file import read_bvh_file
from mrhubo.motion.readers.tree.hierarchy import JointTree
from tests.motion.bvh_writer import Style, names_of, write_bvh

_COMPONENTS = {"f4": 5126, "i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125}
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
BOUND = {"t": 0.0, "a": 45.0}
"""How far arms hang below the horizontal when a skin is bound [deg]."""


@dataclass
class Manner:
    """How a program writes a tree of joints that moves."""

    armature: bool = False
    """A node above all, in metres and y up, in which the skeleton is in the BVH's unit and world."""
    skin: str | None = "t"
    """The pose in which a skin is bound, of `BOUND`; None: no skin."""
    own: str = "bound"
    """What the nodes are without an animation: `bound`, as the skin, `first`, as in the first frame, `nothing`: none."""
    method: str = "LINEAR"
    turns: str = "f4"
    """The type of rotations' numbers."""
    scales: bool = False
    """Whether there are channels of scale, and a node that is scaled to nothing."""
    matrices: bool = False
    """Nodes that do not move have a `matrix`."""
    drop: bool = False
    """Whether keys that tell nothing are left out."""
    opposite: bool = False
    """Quaternions of some keys have the other sign."""
    sparse: bool = False
    """Rotations are in accessors without a buffer view, of which all is replaced."""
    stride: int = 0
    """Bytes between elements that mean nothing."""
    start: float = 0.0
    """Time of the first key [s]."""
    vrm: str | None = None
    """The extension that names a human's bones."""
    prop: bool = True
    """A camera that moves by itself, which no bone is."""
    scale_of_skin: float = 1.0
    """Unit of the skin, of the world's."""
    extensions: dict[str, Any] = field(default_factory=dict)


class Parts:
    """The JSON of a file, and the bytes that it grows."""

    def __init__(self) -> None:
        self.top: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "mrhubo's tests"},
            "nodes": [], "accessors": [], "bufferViews": [], "animations": [], "skins": [],
        }  # fmt: skip
        self.binary = bytearray()

    def view(self, content: bytes, **more: Any) -> int:
        """The place of a new buffer view."""
        self.binary += bytes(-len(self.binary) % 4)
        self.top["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content), **more}
        )
        self.binary += content
        return len(self.top["bufferViews"]) - 1

    def accessor(self, value_KX: np.ndarray, kind: str = "f4", sparse: bool = False, stride: int = 0) -> int:
        """The place of a new accessor; whole numbers stand for -1 to 1, or 0 to 1."""
        value_KX = value_KX.reshape(len(value_KX), -1)
        is_normalised = kind != "f4"
        if is_normalised:
            value_KX = np.rint(value_KX * np.iinfo(kind).max)
        data_KX = value_KX.astype(f"<{kind}")
        entry: dict[str, Any] = {
            "componentType": _COMPONENTS[kind], "count": len(data_KX), "type": _TYPES[data_KX.shape[1]],
        }  # fmt: skip
        if is_normalised:
            entry["normalized"] = True
        if sparse:
            indices = self.view(np.arange(len(data_KX), dtype="<u2").tobytes())
            entry["sparse"] = {
                "count": len(data_KX),
                "indices": {"bufferView": indices, "componentType": 5123},
                "values": {"bufferView": self.view(data_KX.tobytes())},
            }
        elif stride:
            size = data_KX.shape[1] * data_KX.itemsize
            rows = data_KX.view(np.uint8).reshape(len(data_KX), size)
            padded = np.pad(rows, ((0, 0), (4, stride - 4)), constant_values=255)
            entry |= {"bufferView": self.view(padded.tobytes(), byteStride=size + stride), "byteOffset": 4}
        else:
            entry["bufferView"] = self.view(data_KX.tobytes())
        self.top["accessors"].append(entry)
        return len(self.top["accessors"]) - 1

    def glb(self) -> bytes:
        """As a single binary file."""
        top = {**self.top, "buffers": [{"byteLength": len(self.binary)}]}
        return glb(json.dumps(top).encode(), bytes(self.binary))

    def gltf(self, uri: str | None = None) -> bytes:
        """As JSON, the buffer of which is a file of that name, or in it."""
        uri = uri or "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        return json.dumps({**self.top, "buffers": [{"byteLength": len(self.binary), "uri": uri}]}).encode()


def glb(text: bytes, binary: bytes) -> bytes:
    """A binary file of two chunks."""
    chunks = b""
    for kind, content, pad in ((b"JSON", text, b" "), (b"BIN\0", binary, b"\0")):
        content += pad * (-len(content) % 4)
        chunks += struct.pack("<I4s", len(content), kind) + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_gltf(motion: Motion, style: Style, manner: Manner, name: str | None = "dance") -> Parts:
    """A motion as nodes, a skin and an animation."""
    parts = Parts()
    add_body(parts, motion, style, manner, name)
    return parts


def add_body(parts: Parts, motion: Motion, style: Style, manner: Manner, name: str | None) -> None:
    """Adds a body and its motion to a file."""
    rng = np.random.default_rng(style.seed)
    tree = _tree(motion, style)
    assert motion.root_position_T3 is not None
    at_rest = dataclasses.replace(
        motion,
        local_TJ33=_arms_down(BOUND[manner.skin or "t"])[None].repeat(2, 1, 1, 1),
        root_rotation_T33=torch.eye(3, dtype=torch.float64)[None].repeat(2, 1, 1),
        root_position_T3=torch.tensor([[0.0, 0.95, 0.0]] * 2, dtype=torch.float64),
    )
    bound = _local(_tree(at_rest, style))[:, 0]
    local = _local(tree)
    joints, first = len(tree.joints), len(parts.top["nodes"])
    to_world = np.eye(4)
    if manner.armature:
        to_world[:3, :3] = style.world.T * style.unit
        joints_at = first + 1
        quaternion = Rotation.from_matrix(style.world.T).as_quat()
        parts.top["nodes"].append({
            "name": "Armature", "scale": [style.unit] * 3, "rotation": quaternion.tolist(),
            "children": [joints_at + place for place in tree.roots],
        })  # fmt: skip
    else:
        joints_at = first
    own = {"bound": bound, "first": local[:, 0], "nothing": np.repeat(np.eye(4)[None], joints, 0)}[manner.own]
    steady = [bool(np.abs(local[j] - local[j, :1]).max() < 1e-9) for j in range(joints)]
    for place, joint in enumerate(tree.joints):
        node: dict[str, Any] = {"name": joint.name}
        if children := tree.children[place]:
            node["children"] = [joints_at + child for child in children]
        at = own[place] if not steady[place] else local[place, 0]
        if manner.matrices and steady[place]:
            node["matrix"] = at.T.ravel().tolist()
        elif manner.own != "nothing" or steady[place]:
            node |= {"translation": at[:3, 3].tolist(), "rotation": Rotation.from_matrix(at[:3, :3]).as_quat().tolist()}
        parts.top["nodes"].append(node)
    if manner.skin is not None:
        _add_skin(parts, tree, bound, to_world, joints_at, manner)
    if manner.vrm is not None:
        _add_human(parts, tree, style, joints_at, manner.vrm)
    time_T = manner.start + np.arange(len(tree)) / motion.frame_rate
    animation: dict[str, Any] = {"channels": [], "samplers": []}
    animation |= {"name": name} if name is not None else {}

    def move(node: int, path: str, value_TX: np.ndarray, kind: str = "f4") -> None:
        keep_T = _needed(value_TX) if manner.drop else np.ones(len(value_TX), bool)
        key_KX, key_K = value_TX[keep_T], time_T[keep_T]
        if manner.method == "CUBICSPLINE":
            slope_KX = np.gradient(key_KX, key_K, axis=0) if len(key_K) > 1 else 0 * key_KX
            key_KX = np.stack([slope_KX, key_KX, slope_KX], axis=1).reshape(-1, key_KX.shape[1])
        animation["samplers"].append({
            "input": parts.accessor(key_K), "interpolation": manner.method,
            "output": parts.accessor(key_KX, kind, manner.sparse and path == "rotation", manner.stride),
        })  # fmt: skip
        target = {"node": node, "path": path}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})

    for place in range(joints):
        if steady[place]:
            continue
        quaternion_T4 = Rotation.from_matrix(local[place, :, :3, :3]).as_quat()
        for i in range(1, len(quaternion_T4)):
            quaternion_T4[i] *= -1.0 if quaternion_T4[i] @ quaternion_T4[i - 1] < 0 else 1.0
        if manner.opposite:
            quaternion_T4 *= rng.choice([-1.0, 1.0], len(quaternion_T4))[:, None]
        move(joints_at + place, "rotation", quaternion_T4, manner.turns)
        if np.abs(np.diff(local[place, :, :3, 3], axis=0)).max() > 1e-6 or manner.own == "nothing" or place == 0:
            move(joints_at + place, "translation", local[place, :, :3, 3])
        if manner.scales:
            move(joints_at + place, "scale", np.ones((len(tree), 3)))
    if manner.scales:
        _add_hidden(parts, joints_at)
    if manner.prop:
        parts.top["nodes"].append({"name": "Camera"})
        move(len(parts.top["nodes"]) - 1, "translation", rng.normal(size=(len(tree), 3)))
    parts.top["animations"].append(animation)


def _add_hidden(parts: Parts, root: int) -> None:
    """A bone that is scaled to nothing, as weapons are that are not in use."""
    parts.top["nodes"].append({"name": "weapon", "scale": [0, 0, 0]})
    place = len(parts.top["nodes"]) - 1
    parts.top["nodes"][root].setdefault("children", []).append(place)
    for skin in parts.top["skins"][-1:]:
        skin["joints"].append(place)  # of a matrix of 0, with which the skin's end


def _add_skin(
    parts: Parts, tree: JointTree, bound: np.ndarray, to_world: np.ndarray, joints_at: int, manner: Manner
) -> None:
    world = []
    for place, joint in enumerate(tree.joints):
        world.append((world[joint.parent] if joint.parent >= 0 else to_world) @ bound[place])
    size = np.diag([manner.scale_of_skin] * 3 + [1.0])
    inverse = np.linalg.inv(np.linalg.inv(size) @ np.stack(world))
    skinned = [place for place in range(len(tree.joints)) if not tree.names[place].endswith("end")]
    matrices = np.concatenate([inverse[skinned], np.zeros((1, 4, 4))])  # one more than joints
    parts.top["skins"].append({
        "joints": [joints_at + place for place in skinned],
        "inverseBindMatrices": parts.accessor(matrices.swapaxes(1, 2)),
    })  # fmt: skip


def vrm_name(joint: str) -> str:
    """What VRM calls a joint of ours."""
    side, _, part = joint.rpartition("_")
    return side + {
        "pelvis": "hips", "spine1": "spine", "spine2": "chest", "spine3": "upperChest", "hip": "UpperLeg",
        "knee": "LowerLeg", "ankle": "Foot", "foot": "Toes", "collar": "Shoulder", "shoulder": "UpperArm",
        "elbow": "LowerArm", "wrist": "Hand",
    }.get(part, part)  # fmt: skip


def _add_human(parts: Parts, tree: JointTree, style: Style, joints_at: int, extension: str) -> None:
    """Names a human's bones, as VRM does."""
    names = names_of(style)
    places = {
        vrm_name(joint): joints_at + tree.names.index(name) for joint, name in names.items() if name in tree.names
    }
    if extension == "VRM":
        bones: Any = [{"bone": joint, "node": node} for joint, node in places.items()] + [{"bone": "jaw", "node": -1}]
    else:
        bones = {joint: {"node": node} for joint, node in places.items()}
    parts.top["extensions"] = {extension: {"humanoid": {"humanBones": bones}}}


def _tree(motion: Motion, style: Style) -> JointTree:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.bvh"
        path.write_text(write_bvh(motion, style))
        return read_bvh_file(path)[0]


def _local(tree: JointTree) -> np.ndarray:
    """Where joints are in their parents (N, T, 4, 4)."""
    pose = tree.pose(slice(None))
    world = np.zeros((len(tree.joints), len(tree), 4, 4))
    for place in range(len(tree.joints)):
        world[place, :, :3, :3], world[place, :, :3, 3], world[place, :, 3, 3] = (
            pose.matrix[place],
            pose.point[place],
            1,
        )
    return np.stack(
        [
            np.linalg.inv(world[joint.parent]) @ world[place] if joint.parent >= 0 else world[place]
            for place, joint in enumerate(tree.joints)
        ]
    )


def _needed(value_TX: np.ndarray) -> np.ndarray:
    """Which keys (T,) say what the straight line between those beside them does not."""
    same_T = (np.abs(np.diff(value_TX, axis=0)) < 1e-7).all(axis=1)
    return ~(np.concatenate([[False], same_T]) & np.concatenate([same_T, [False]]))


def _arms_down(angle_deg: float) -> torch.Tensor:
    """Local rotations (J, 3, 3) of who stands with arms so far below the horizontal."""
    local = torch.eye(3, dtype=torch.float64)[None].repeat(len(POSED_JOINT_NAMES), 1, 1)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        turn = Rotation.from_euler("z", sign * angle_deg, degrees=True).as_matrix()
        local[POSED_JOINT_NAMES.index(f"{side}_shoulder")] = torch.from_numpy(turn)
    return local
