"""Markers on the skin of our body, and files that hold them: C3D of three processors, and tables of text."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES, REST_K3

REST = dict(zip(KEYPOINT_NAMES, REST_K3.astype(float), strict=True))
PLUG_IN_GAIT = {
    "front_head": "FHD", "back_head": "BHD", "acromion": "SHO", "lateral_elbow": "ELB", "thumb_wrist": "WRA",
    "little_wrist": "WRB", "hand": "FIN", "front_pelvis": "ASI", "back_pelvis": "PSI", "lateral_knee": "KNE",
    "lateral_ankle": "ANK", "heel": "HEE", "toe": "TOE", "back_neck": "C7", "back_low": "T10", "front_neck": "CLAV",
    "front_low": "STRN", "medial_elbow": "ELBM", "medial_knee": "KNM", "medial_ankle": "MMAL",
}  # fmt: skip


def label_of(place: str) -> str:
    """The label of a place in Vicon's set, with further markers on the inner sides."""
    side, _, name = place.partition("_")
    return side[0].upper() + PLUG_IN_GAIT[name] if side in ("left", "right") else PLUG_IN_GAIT[place]


def markers_on(
    place_TJ3: np.ndarray, world_TJ33: np.ndarray, both_sides: bool = False, build: float = 1.0
) -> dict[str, np.ndarray]:
    """Markers (T, 3) [m] by places, on a body whose joints are at places and turned as given; y up.

    Args:
        place_TJ3: joints of `JOINT_NAMES`.
        world_TJ33: how they are turned.
        both_sides: whether elbows, knees and ankles have a marker on the inner side too.
        build: how wide joints are, 1 of an adult.
    """

    def on(joint: str, offset_3: Sequence[float] | np.ndarray) -> np.ndarray:
        at = JOINT_NAMES.index(joint)
        return place_TJ3[:, at] + world_TJ33[:, at] @ np.asarray(offset_3, float)

    sine, cosine = np.sin(np.radians(11.0)), np.cos(np.radians(11.0))
    level_33 = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    hips_3 = (REST["left_hip"] + REST["right_hip"]) / 2 - REST["pelvis"]
    wide = ((REST["left_hip"] - REST["right_hip"])[0] / 2 - 0.0073) / 0.33
    front_3 = hips_3 - level_33 @ [0, -0.30 * wide - 0.0109, -0.24 * 0.15 - 0.0099]
    found = {
        "back_neck": on("spine3", [0, 0.20, -0.07]), "front_neck": on("spine3", [0, 0.15, 0.075]),
        "back_low": on("spine3", [0, -0.05, -0.10]), "front_low": on("spine3", [0, -0.05, 0.105]),
    }  # fmt: skip
    for side, sign in (("left", 1.0), ("right", -1.0)):
        beside = {
            "front_head": on("head", [sign * 0.07, 0.12, 0.09]), "back_head": on("head", [sign * 0.065, 0.12, -0.09]),
            "acromion": on(f"{side}_collar", REST[f"{side}_shoulder"] - REST[f"{side}_collar"] + [0, 0.063, 0]),
            "front_pelvis": on("pelvis", front_3 + level_33 @ [sign * wide / 2, 0, 0]),
            "back_pelvis": on("pelvis", front_3 + level_33 @ [sign * 0.045, 0, -0.15]),
            "thumb_wrist": on(f"{side}_wrist", [0, 0, 0.03]), "little_wrist": on(f"{side}_wrist", [0, 0, -0.03]),
            "hand": on(f"{side}_wrist", (REST[f"{side}_index"] + REST[f"{side}_pinky"]) / 2 - REST[f"{side}_wrist"]),
            "heel": on(f"{side}_ankle", REST[f"{side}_heel"] - REST[f"{side}_ankle"] + [0, 0.03, 0]),
            "toe": on(f"{side}_ankle", REST[f"{side}_toe"] - REST[f"{side}_ankle"] + [0, 0.03, 0]),
        }  # fmt: skip
        for name, joint, carrier, outward, half in (
            ("elbow", "elbow", "shoulder", [0, 1.0, 0], 0.041),
            ("knee", "knee", "hip", [sign, 0, 0], 0.054),
            ("ankle", "ankle", "knee", [sign, 0, 0], 0.043),
        ):
            upper, lower = JOINT_NAMES.index(f"{side}_{carrier}"), JOINT_NAMES.index(f"{side}_{joint}")
            bone_T3 = place_TJ3[:, lower] - place_TJ3[:, upper]
            way_T3 = world_TJ33[:, upper] @ np.array(outward)
            way_T3 = way_T3 - bone_T3 * ((way_T3 * bone_T3).sum(-1) / (bone_T3**2).sum(-1))[:, None]
            way_T3 *= build * half / np.linalg.norm(way_T3, axis=-1, keepdims=True)
            beside[f"lateral_{name}"] = place_TJ3[:, lower] + way_T3
            if both_sides:
                beside[f"medial_{name}"] = place_TJ3[:, lower] - way_T3
        found |= {f"{side}_{name}": marker_T3 for name, marker_T3 in beside.items()}
    return found


@dataclass(frozen=True)
class Manner:
    """How a C3D file is written."""

    processor: int = 84
    """84: Intel's, 85: DEC's, 86: MIPS's."""
    is_whole: bool = False
    """Whether numbers are whole, in tenths of the unit."""
    analog: int = 6
    """Numbers of analog channels a frame."""
    rate: float = 120.0
    labels_a_parameter: int = 255
    long: bool = False
    """Whether the header's count of frames is full, and a parameter tells it."""


@dataclass(frozen=True)
class Segmented:
    """Segments of a body in a C3D file."""

    names: Sequence[str]
    matrix_TS44: np.ndarray
    """From their axes to the world's; NaN where one is not known."""
    ratio: int = 1
    """Frames of segments for one of points."""
    frames_told: bool = True


def c3d(
    point_TK3: np.ndarray, labels: Sequence[str], how: Manner = Manner(), segmented: Segmented | None = None
) -> bytes:
    """A C3D file of points, NaN where one is not seen, and of segments."""
    order, frames = ">" if how.processor == 86 else "<", len(point_TK3)

    def floating(values: np.ndarray) -> bytes:
        if how.processor != 85:
            return np.asarray(values, f"{order}f4").tobytes()
        half_X2 = (np.asarray(values, "<f4") * np.float32(4)).view("<u2").reshape(-1, 2)
        return np.ascontiguousarray(half_X2[:, ::-1]).tobytes()

    def whole(*values: int) -> bytes:
        return np.asarray(values, "i8").astype(f"{order}u2").tobytes()

    def entry(name: str, group: int, rest: bytes) -> bytes:
        head = struct.pack("bb", len(name), group) + name.encode("latin1")
        return head + whole(2 + len(rest)) + rest

    def parameter(name: str, kind: int, sizes: Sequence[int], data: bytes, group: int = 1) -> bytes:
        return entry(name, group, struct.pack("bb", kind, len(sizes)) + bytes(sizes) + data + b"\0")

    scale = 0.1 if how.is_whole else -1.0
    body = entry("POINT", -1, b"\0") + entry("TRIAL", -2, b"\0") + entry("ROTATION", -3, b"\0")
    body += parameter("USED", 2, [], whole(len(labels)))
    body += parameter("SCALE", 4, [], floating(np.array([scale])))
    body += parameter("RATE", 4, [], floating(np.array([how.rate])))
    body += parameter("UNITS", -1, [2], b"mm")
    size = max(map(len, labels), default=0)
    for number, begin in enumerate(range(0, len(labels), how.labels_a_parameter), start=1):
        some = labels[begin : begin + how.labels_a_parameter]
        text = b"".join(label.encode("latin1").ljust(size) for label in some)
        body += parameter(f"LABELS{number if number > 1 else ''}", -1, [size, len(some)], text)
    if how.long:
        body += parameter("ACTUAL_START_FIELD", 2, [2], whole(1, 0), group=2)
        body += parameter("ACTUAL_END_FIELD", 2, [2], whole(frames % 65_536, frames // 65_536), group=2)
    width = (2 if how.is_whole else 4) * (4 * len(labels) + how.analog)
    of_points = -(-width * frames // 512)  # blocks
    turns = segmented.matrix_TS44 if segmented is not None else np.zeros((0, 0, 4, 4))
    if segmented is not None:
        size, names = max(map(len, segmented.names)), [name.encode("latin1") for name in segmented.names]
        text = b"".join(name.ljust(size) for name in names)
        numbers = {"USED": len(names), "RATIO": segmented.ratio}
        numbers |= {"FRAMES": len(turns)} if segmented.frames_told else {}
        for name, number in numbers.items():
            body += parameter(name, 2, [], whole(number), group=3)
        body += parameter("RATE", 4, [], floating(np.array([segmented.ratio * how.rate])), group=3)
        body += parameter("LABELS", -1, [size, len(names)], text, group=3)
        there = (4 + len(body) + 22) // 512 + 1  # with the parameter that is about to come
        body += parameter("DATA_START", 2, [], whole(2 + there + of_points), group=3)
    blocks = (4 + len(body)) // 512 + 1
    parameters = (bytes([1, 0x50, blocks, how.processor]) + body).ljust(512 * blocks, b"\0")
    header = b"\x02\x50" + whole(len(labels), how.analog, 1, 65_535 if how.long else frames, 10)
    header += floating(np.array([scale])) + whole(2 + blocks, 1) + floating(np.array([how.rate]))
    value_TK4 = np.concatenate([np.nan_to_num(point_TK3), np.where(np.isnan(point_TK3[..., :1]), -1, 0)], axis=-1)
    data = b""
    for value_K4 in value_TK4:
        if how.is_whole:
            data += (np.rint(value_K4 * [10, 10, 10, 1])).astype(f"{order}i2").tobytes() + whole(*[7] * how.analog)
        else:
            data += floating(value_K4.ravel()) + floating(np.full(how.analog, 7.0))
    data = data.ljust(of_points * 512, b"\0")
    columns_TX = np.swapaxes(turns, -1, -2).reshape(*turns.shape[:2], 16)
    sure_TX = np.where(np.isnan(columns_TX[..., :1]), -1.0, 0.9)
    data += floating(np.concatenate((columns_TX, sure_TX), axis=-1).ravel())
    return header.ljust(512, b"\0") + parameters + data.ljust(-(-len(data) // 512) * 512, b"\0")


def qualisys(point_TK3: np.ndarray, labels: Sequence[str], with_time: bool = True) -> str:
    """A table of Qualisys Track Manager at 100 frames a second."""
    text = f"NO_OF_FRAMES\t{len(point_TK3)}\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t{len(labels)}\nFREQUENCY\t100\n"
    text += "NO_OF_ANALOG\t0\nDESCRIPTION\t--\nDATA_INCLUDED\t3D\nMARKER_NAMES\t" + "\t".join(labels) + "\n"
    if with_time:
        text += "Frame\tTime\t" + "\t".join(f"{label} {axis}" for label in labels for axis in "XYZ") + "\n"
    for frame, point_K3 in enumerate(point_TK3):
        words = ["" if np.isnan(x) else f"{x:.3f}" for x in point_K3.ravel()]
        text += "\t".join([f"{frame + 1}", f"{frame / 100:.5f}", *words] if with_time else words) + "\n"
    return text


def vicon(point_TK3: np.ndarray, labels: Sequence[str], person: str = "Ann") -> str:
    """A table of Vicon's Nexus at 100 frames a second, with another part before that of markers."""
    text = "Model Outputs\n100\n,,Ann:LKneeAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n1,0,1,2,3\n\n"
    text += "Trajectories\n100\n,," + ",,,".join(f"{person}:{label}" for label in labels) + ",,\n"
    text += "Frame,Sub Frame," + ",".join("X,Y,Z" for _ in labels) + "\n,," + ",".join(["mm"] * 3 * len(labels)) + "\n"
    for frame, point_K3 in enumerate(point_TK3):
        words = ["" if np.isnan(x) else f"{x:.4f}" for x in point_K3.ravel()]
        text += ",".join([f"{frame + 1}", "0", *words]) + "\n"
    return text
