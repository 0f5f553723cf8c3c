"""Writes motions as FBX files, binary and text, in the manner of one maker or another, for tests of readers.

A motion is written as BVH first (`tests.motion.bvh_writer`), whose joints become nodes: with axes of their own, turned
before and after their own angles, about pivots, and under a node that scales them.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.bvh_file import read_bvh_file
from mrhubo.motion.readers.scene.fbx_file import BINARY
from mrhubo.motion.readers.tree.hierarchy import JointTree
from tests.motion.bvh_writer import Style, write_bvh

SECOND = 46_186_158_000
_ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx")
_AXES = ("X", "Y", "Z")
Rec = tuple[str, list[Any], list[Any]]
"""Name, values and records inside; arrays are NumPy's."""


@dataclass
class Manner:
    """How a maker writes."""

    is_text: bool = False
    version: int = 7400
    packed: bool = True
    own_axes: bool = False
    """Nodes have axes of their own, as of bones along x, and not the world's at rest."""
    turns: bool = False
    """Nodes are turned before and after their own angles."""
    pivots: bool = False
    orders: bool = False
    """Each node turns in an order of its own."""
    scale: float = 1.0
    """Of a node above the skeleton, by which its lengths are divided."""
    skin: bool = True
    """Whether a skin is bound to it, in the motion's first frame, which is then left out."""
    bind_poses: bool = False
    """The same told by a record of poses, and not by the skin."""
    bones: bool = True
    """Whether nodes are called bones."""
    kind: str = "user"
    """How curves go from key to key: user, auto, line, constant."""
    weighted: bool = False
    """Whether tangents have lengths of their own."""
    rate: float | None = None
    """Keys a second, where it is not the motion's: every so many frames."""
    time_mode: tuple[int, float] = (14, 24.0)
    seed: int = 0


def record(name: str, *values: Any, inside: Sequence[Rec] = ()) -> Rec:
    """A record."""
    return name, list(values), list(inside)


def properties(**values: tuple[str, list[Any]]) -> Rec:
    """Properties by name, with spaces for underlines: a kind, and numbers."""
    rows = [record("P", key.replace("_", " "), kind, "", "A", *numbers) for key, (kind, numbers) in values.items()]
    return record("Properties70", inside=rows)


def write_fbx(
    motion: Motion, style: Style, manner: Manner, path: Path, takes: Sequence[str] = ("Take 001",), people: int = 1
) -> None:
    """Writes a file; of several takes each has half the frames of that before, and several people do the same."""
    text = path.with_suffix(".bvh_to_fbx")
    text.write_text(write_bvh(motion, style))
    tree, rates, _ = read_bvh_file(text)
    text.unlink()
    path.write_bytes(to_bytes(_file(tree, rates[0], manner, takes, people), manner))


def to_bytes(records: list[Rec], manner: Manner) -> bytes:
    """Records as a file has them."""
    if manner.version < 7000:
        records = _aged(records)
    if manner.is_text:
        head = f"; FBX {manner.version / 1000:.1f}.0 project file\n; ----------------\n\n"
        return (head + "".join(_text(row, 0) for row in records)).encode()
    content = bytearray(BINARY + b"\x1a\0" + struct.pack("<I", manner.version))
    for row in records:
        content += _binary(row, len(content), manner)
    return bytes(content) + bytes(25 if manner.version >= 7500 else 13) + bytes(200)


def _file(tree: JointTree, rate: float, manner: Manner, takes: Sequence[str], people: int) -> list[Rec]:
    objects: list[Rec] = []
    links: list[Rec] = []
    tracks: list[tuple[int, str, np.ndarray]] = []
    for person in range(people):
        tracks += _body(tree, manner, person, objects, links)
    every = 1 if manner.rate is None else round(rate / manner.rate)
    for take, name in enumerate(takes):
        short = [(number, what, value_T3[: max(2, len(value_T3) >> take)]) for number, what, value_T3 in tracks]
        _animate(manner, name, 1_000_000 * (take + 1), short, rate, every, objects, links)
    for row in objects:
        if row[0] == "Model":
            row[1][1] = _name(manner, row[1][1], "Model")
    settings = properties(
        UpAxis=("int", [1]), TimeMode=("enum", [manner.time_mode[0]]), CustomFrameRate=("double", [manner.time_mode[1]])
    )
    return [
        record("FBXHeaderExtension", inside=[record("FBXHeaderVersion", 1003), record("FBXVersion", manner.version)]),
        record("GlobalSettings", inside=[record("Version", 1000), settings]),
        record("Definitions", inside=[record("Version", 100)]),
        record("Objects", inside=objects),
        record("Connections", inside=links),
    ]


def _aged(records: list[Rec]) -> list[Rec]:
    """Records of version 7 as version 6 has them: with names for numbers, and keys in lists."""
    inside = {name: rows for name, _, rows in records}
    names, objects, takes = {}, [], []
    by_number = {row[1][0]: row for row in inside["Objects"]}
    links = [row[1] for row in inside["Connections"]]
    for kind, values, _ in inside["Objects"]:
        names[values[0]] = values[1] if kind == "Model" else f"{kind}::{values[0]}"
    for kind, values, rows in inside["Objects"]:
        if kind.startswith("Animation"):
            continue
        told = []
        for row in rows:
            if row[0] == "Properties70":
                kept = [record("Property", *p[1][:2], "A", *p[1][4:]) for p in row[2]]
                told.append(record("Properties60", inside=kept))
            elif row[0] == "PoseNode":
                told.append(record("PoseNode", inside=[record("Node", names[row[2][0][1][0]]), _listed(row[2][1])]))
            else:
                told.append(_listed(row))
        objects.append((kind, [names[values[0]], *values[2:]], told))
    up = record("Property", "UpAxis", "int", "", 1)
    objects.append(record("GlobalSettings", inside=[record("Properties60", inside=[up])]))
    for number, (kind, values, _) in by_number.items():
        if kind != "AnimationStack":
            continue
        layer = next(link[1] for link in links if link[2] == number)
        moving: dict[str, list[Rec]] = {}
        for three in [link[1] for link in links if link[2] == layer]:
            _, _, owner, what = next(link for link in links if link[0] == "OP" and link[1] == three)
            axes = [
                record("Channel", link[3][2:], inside=_keys(by_number[link[1]]))
                for link in links
                if link[0] == "OP" and link[2] == three
            ]
            moving.setdefault(names[owner], []).append(record("Channel", what[4], inside=axes))
        models = [
            record("Model", name, inside=[record("Channel", "Transform", inside=rows)]) for name, rows in moving.items()
        ]
        name = values[1].split("\0")[0].split("::")[-1]
        takes.append(record("Take", name, inside=[record("FileName", f"{name}.tak"), *models]))
    told = [record("Connect", link[0], names[link[1]], names.get(link[2], "Model::Scene")) for link in links
            if link[0] == "OO" and not by_number[link[1]][0].startswith("Animation")]  # fmt: skip
    return [
        record("FBXHeaderExtension", inside=[record("FBXVersion", 6100)]),
        record("Objects", inside=objects),
        record("Connections", inside=told),
        record("Takes", inside=takes),
    ]


def _listed(row: Rec) -> Rec:
    return row[0], row[1][0].tolist() if len(row[1]) and isinstance(row[1][0], np.ndarray) else row[1], row[2]


def _keys(curve: Rec) -> list[Rec]:
    """The keys of a curve of version 7 in one list."""
    told = {name: values[0] for name, values, _ in curve[2]}
    data_K4 = told["KeyAttrDataFloat"].reshape(-1, 4)
    flags = np.resize(told["KeyAttrFlags"], len(told["KeyTime"]))
    words: list[Any] = []
    for key, (tick, value) in enumerate(zip(told["KeyTime"].tolist(), told["KeyValueFloat"].tolist(), strict=True)):
        words += [tick, value]
        if flags[key] & 0x2:
            words += ["C", "s"]
        elif flags[key] & 0x4:
            words.append("L")
        elif flags[key] & 0x400:
            bits = int(data_K4[key, 2].view(np.uint32))
            lengths = ["a", (bits & 0xFFFF) / 1e4, (bits >> 16) / 1e4] if flags[key] & 0x1000000 else ["n"]
            words += ["U", "s", *data_K4[key, :2].tolist(), *lengths]
        else:
            words += ["U", "a", "n"]
    listed: Rec = "Key", [_Letter(word) if isinstance(word, str) else word for word in words], []
    return [record("Default", 0.0), record("KeyVer", 4005), record("KeyCount", len(flags)), listed]


class _Letter(str):
    """A letter without quotes, which binary files have as a byte."""


def _body(
    tree: JointTree, manner: Manner, person: int, objects: list[Rec], links: list[Rec]
) -> list[tuple[int, str, np.ndarray]]:
    """Adds a skeleton, and gives what of its nodes moves how."""
    rng = np.random.default_rng(manner.seed)
    first = 100_000 * person
    pose = tree.pose(slice(None))
    count = len(tree.joints)
    axes = [Rotation.from_quat(rng.normal(size=4)) if manner.own_axes else Rotation.identity() for _ in range(count)]
    turn = [Rotation.from_matrix(pose.matrix[i]) * axes[i] for i in range(count)]
    point = [pose.point[i] / manner.scale for i in range(count)]
    objects.append(_model(first + 1, "Armature", "Null", properties(Lcl_Scaling=("Lcl Scaling", [manner.scale] * 3))))
    links.append(record("C", "OO", first + 1, 0))
    skinned = manner.skin or manner.bind_poses
    kept = slice(1 if skinned else 0, None)
    tracks: list[tuple[int, str, np.ndarray]] = []
    bound: list[tuple[int, np.ndarray]] = []
    for place, joint in enumerate(tree.joints):
        parent = joint.parent
        above = turn[parent] if parent >= 0 else Rotation.identity(len(tree))
        base_T3 = point[parent] if parent >= 0 else np.zeros((len(tree), 3))
        local = above.inv() * turn[place]
        move_T3 = above.inv().apply(point[place] - base_T3)
        before, after = (Rotation.from_quat(rng.normal(size=4)) if manner.turns else Rotation.identity() for _ in "ab")
        pivot_3, offset_3 = (rng.normal(size=3) if manner.pivots else np.zeros(3) for _ in "ab")
        order = int(rng.integers(6)) if manner.orders else 0
        own = before.inv() * local * after
        angle_T3 = own.as_euler(_ORDERS[order], degrees=True)[:, [_ORDERS[order].index(axis) for axis in "xyz"]]
        angle_T3 = np.degrees(np.unwrap(np.radians(angle_T3), axis=0))
        move_T3 = move_T3 - offset_3 - pivot_3 + local.apply(pivot_3)
        number = first + 100 + place
        told: dict[str, tuple[str, list[Any]]] = {
            "RotationOrder": ("enum", [order]),
            "RotationActive": ("bool", [1]),
            "InheritType": ("enum", [1]),
            "Lcl_Translation": ("Lcl Translation", move_T3[0].tolist()),
            "Lcl_Rotation": ("Lcl Rotation", angle_T3[0].tolist()),
        }
        if manner.turns:
            told["PreRotation"] = ("Vector3D", before.as_euler("xyz", degrees=True).tolist())
            told["PostRotation"] = ("Vector3D", after.as_euler("xyz", degrees=True).tolist())
        if manner.pivots:
            told["RotationPivot"] = ("Vector3D", pivot_3.tolist())
            told["RotationOffset"] = ("Vector3D", offset_3.tolist())
        objects.append(_model(number, joint.name, "LimbNode" if manner.bones else "Null", properties(**told)))
        links.append(record("C", "OO", number, first + (100 + parent if parent >= 0 else 1)))
        tracks.append((number, "Lcl Rotation", angle_T3[kept]))
        if np.ptp(move_T3, axis=0).max() > 1e-6:
            tracks.append((number, "Lcl Translation", move_T3[kept]))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = manner.scale * turn[place][0].as_matrix(), manner.scale * point[place][0]
        bound.append((number, matrix.T.reshape(-1)))
    if manner.bind_poses:
        rows = [record("PoseNode", inside=[record("Node", n), record("Matrix", m)]) for n, m in bound]
        objects.append(record("Pose", first + 2, _name(manner, "BIND_POSES", "Pose"), "BindPose", inside=rows))
    elif manner.skin:
        objects.append(record("Deformer", first + 3, _name(manner, "", "Deformer"), "Skin"))
        for number, matrix_16 in bound:
            inside = [record("TransformLink", matrix_16)]
            objects.append(
                record("Deformer", number + 10_000, _name(manner, "", "SubDeformer"), "Cluster", inside=inside)
            )
            links += [record("C", "OO", number + 10_000, first + 3), record("C", "OO", number, number + 10_000)]
    return tracks


def _animate(
    manner: Manner,
    name: str,
    first: int,
    tracks: list[tuple[int, str, np.ndarray]],
    rate: float,
    every: int,
    objects: list[Rec],
    links: list[Rec],
) -> None:
    """Adds an animation of one layer."""
    last = round((max(len(value_T3) for _, _, value_T3 in tracks) - 1) / rate * SECOND)
    span = properties(LocalStart=("KTime", [0]), LocalStop=("KTime", [last]))
    objects.append(record("AnimationStack", first, _name(manner, name, "AnimStack"), "", inside=[span]))
    objects.append(record("AnimationLayer", first + 1, _name(manner, "BaseLayer", "AnimLayer"), ""))
    links += [record("C", "OO", first, 0), record("C", "OO", first + 1, first)]
    number = first + 2
    for owner, what, value_T3 in tracks:
        three = number
        letter = what[4:5]
        defaults = {f"d|{axis}": ("Number", [float(value_T3[0, i])]) for i, axis in enumerate(_AXES)}
        objects.append(
            record(
                "AnimationCurveNode", three, _name(manner, letter, "AnimCurveNode"), "", inside=[properties(**defaults)]
            )
        )
        links += [record("C", "OO", three, first + 1), record("C", "OP", three, owner, what)]
        number += 1
        for i, axis in enumerate(_AXES):
            objects.append(_curve(manner, number, value_T3[::every, i], rate / every))
            links.append(record("C", "OP", number, three, f"d|{axis}"))
            number += 1


def _curve(manner: Manner, number: int, value_K: np.ndarray, rate: float) -> Rec:
    tick_K = np.round(np.arange(len(value_K)) / rate * SECOND).astype(np.int64)
    flags = {"user": 0x408, "auto": 0x108, "line": 0x4, "constant": 0x2}[manner.kind]
    if manner.kind == "user":  # every key with slopes of its own
        slope_K = np.gradient(value_K, 1 / rate) if len(value_K) > 1 else np.zeros(1)
        data_K4 = np.zeros((len(value_K), 4))
        data_K4[:, 0], data_K4[:-1, 1] = slope_K, slope_K[1:]
        if manner.weighted:  # two lengths in units of 1e-4, in the bits of a float
            flags |= 0x3000000
            length_K2 = np.random.default_rng(number).integers(1_000, 6_000, (len(value_K), 2))
            data_K4 = data_K4.astype(np.float32)
            data_K4[:, 2] = (length_K2 @ [1, 1 << 16]).astype(np.uint32).view(np.float32)
        kinds, counts, data = np.full(len(value_K), flags), np.ones(len(value_K)), data_K4.reshape(-1)
    else:
        kinds, counts, data = np.array([flags]), np.array([len(value_K)]), np.zeros(4)
    inside = [
        record("Default", float(value_K[0])),
        record("KeyVer", 4008),
        record("KeyTime", tick_K),
        record("KeyValueFloat", value_K.astype(np.float32)),
        record("KeyAttrFlags", kinds.astype(np.int32)),
        record("KeyAttrDataFloat", data.astype(np.float32)),
        record("KeyAttrRefCount", counts.astype(np.int32)),
    ]
    return record("AnimationCurve", number, _name(manner, "", "AnimCurve"), "", inside=inside)


def _model(number: int, name: str, kind: str, told: Rec) -> Rec:
    return record("Model", number, name, kind, inside=[record("Version", 232), told])


def _name(manner: Manner, name: str, kind: str) -> str:
    return f"{kind}::{name}" if manner.is_text else f"{name}\0\1{kind}"


def _text(row: Rec, depth: int) -> str:
    name, values, inside = row
    pad = "\t" * depth
    if len(values) == 1 and isinstance(values[0], np.ndarray):
        numbers = ",".join(str(x) if values[0].dtype.kind == "i" else f"{x:.9g}" for x in values[0].tolist())
        return f"{pad}{name}: *{len(values[0])} {{\n{pad}\ta: {numbers}\n{pad}}} \n"
    words = ", ".join(
        f'"{value}"' if isinstance(value, str) and not isinstance(value, _Letter) else f"{value}" for value in values
    )
    lines = f"{pad}{name}: {words}"
    if not inside:
        return f"{lines}\n"
    return f"{lines} {{\n" + "".join(_text(child, depth + 1) for child in inside) + f"{pad}}}\n"


def _binary(row: Rec, start: int, manner: Manner) -> bytes:
    name, values, inside = row
    wide = manner.version >= 7500
    head = "<QQQB" if wide else "<IIIB"
    told = b"".join(_value(value, manner) for value in values)
    content = bytearray()
    place = start + struct.calcsize(head) + len(name) + len(told)
    for child in inside:
        content += _binary(child, place + len(content), manner)
    if inside:
        content += bytes(25 if wide else 13)
    return struct.pack(head, place + len(content), len(values), len(told), len(name)) + name.encode() + told + content


def _value(value: Any, manner: Manner) -> bytes:
    if isinstance(value, np.ndarray):
        kind = {"int64": b"l", "int32": b"i", "float32": b"f", "float64": b"d"}[str(value.dtype)]
        content = value.tobytes()
        packed = zlib.compress(content) if manner.packed else content
        return kind + struct.pack("<III", len(value), int(manner.packed), len(packed)) + packed
    if isinstance(value, _Letter):
        return b"C" + value.encode()
    if isinstance(value, bool):
        return b"C" + struct.pack("<?", value)
    if isinstance(value, int):
        return b"L" + struct.pack("<q", value) if value > 2**20 else b"I" + struct.pack("<i", value)
    if isinstance(value, float):
        return b"D" + struct.pack("<d", value)
    return b"S" + struct.pack("<I", len(value.encode())) + value.encode()
