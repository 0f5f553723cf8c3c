"""Writes a motion of our skeleton as a BVH file in the manner of one maker or another, for tests of readers.

A bone's axes at all angles 0, the order of its angles, names, unit, the axis that is up, joints between ours, the order
of children, and what else makers do differently are drawn or given.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import JOINT_NAMES, PARENTS, Skeleton
from mrhubo.motion.motion import Motion

NAMES = {
    "mixamo": ("mixamorig:{}", "mixamorig:Hips Spine Spine1 Spine2 Neck Head Shoulder Arm ForeArm Hand UpLeg Leg Foot ToeBase",
               "Left{}", "Right{}"),
    "xsens": ("{}", "Hips Chest Chest2 Chest4 Neck Head Collar Shoulder Elbow Wrist Hip Knee Ankle Toe", "Left{}", "Right{}"),
    "soma": ("{}", "Hips Spine1 Spine2 Chest Neck1 Head Shoulder Arm ForeArm Hand Leg Shin Foot ToeBase", "Left{}", "Right{}"),
    "daz": ("{}", "hip abdomen abdomen2 chest neck head Collar Shldr ForeArm Hand Thigh Shin Foot Toe", "l{}", "r{}"),
    "biped": ("Bip01 {}", "Pelvis Spine Spine1 Spine2 Neck Head Clavicle UpperArm Forearm Hand Thigh Calf Foot Toe0",
              "L {}", "R {}"),
    "blender": ("{}", "hips spine spine.001 chest neck head shoulder upper_arm forearm hand thigh shin foot toe", "{}.L", "{}.R"),
    "bandai": ("{}", "Hips Spine Spine1 Chest Neck Head Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot Toes",
               "{}_L", "{}_R"),
    "acclaim": ("{}", "root lowerback upperback thorax lowerneck head clavicle humerus radius hand femur tibia foot toes",
                "l{}", "r{}"),
    "nameless": ("bone_{}", "", "", ""),
}  # fmt: skip
_PAIRED = ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
_MIDDLE = ("pelvis", "spine1", "spine2", "spine3", "neck", "head")
_INDEX = {name: i for i, name in enumerate(JOINT_NAMES)}
_Node = tuple[str | None, int, np.ndarray]
"""The parent's key, the joint of ours that turns a node, and its place in that joint's frame at rest."""


@dataclass
class Style:
    """How a maker writes."""

    names: str = "mixamo"
    order: str | dict[str, str] = "ZXY"
    """Of the angles, the outermost first; of all joints or by ours."""
    unit: float = 0.01
    """Metres."""
    world: np.ndarray = field(default_factory=lambda: np.eye(3))
    """From our world to the file's."""
    axes: str = "world"
    """How bones lie at all angles 0: "world" as at rest, "bone" each along its own x axis, "random" turned anyhow,
    "hanging" as at rest but for the arms, which hang."""
    collars: bool = True
    """Whether there are joints of the collars."""
    toes: bool = True
    extra_root: bool = False
    rolls: bool = False
    """Joints in the middle of upper arms and thighs that turn nothing."""
    lower_rolls: bool = False
    """Such joints in the middle of forearms and shins."""
    copies: bool = False
    """Limbs three times in the same place, as rigs have them for forward and inverse kinematics."""
    ends: bool = True
    """Whether bones of feet have an end."""
    doubled: bool = False
    """Joints of length 0 before hips and shoulders."""
    positions: bool = False
    """Position channels on every joint."""
    t_pose_first: bool = False
    swapped_names: bool = False
    fingers: bool = True
    prop: bool = False
    """A stick in the right hand."""
    biped: bool = False
    """3ds Max's habit: collars hang on the neck, thighs on the spine, and move against them."""
    twists: bool = False
    """Ends of bones on upper arms, forearms and thighs, as skins need them."""
    cloth: bool = False
    """A long skirt and long hair, of chains of joints alike, as avatars have them."""
    seed: int = 0
    """Of the order of children and of random axes."""


def names_of(style: Style) -> dict[str, str]:
    """The file's name of each of our joints."""
    form, words, left, right = NAMES[style.names]
    if not words:
        return {
            joint: form.format(place)
            for place, joint in enumerate(np.random.default_rng(style.seed).permutation(JOINT_NAMES))
        }
    words = [word.split(":")[-1] for word in words.split()]
    if style.swapped_names:
        left, right = right, left
    found = {joint: form.format(word) for joint, word in zip(_MIDDLE, words[:6], strict=True)}
    for joint, word in zip(_PAIRED, words[6:], strict=True):
        found |= {f"left_{joint}": form.format(left.format(word)), f"right_{joint}": form.format(right.format(word))}
    return found


def _nodes(style: Style, offsets: list[np.ndarray]) -> dict[str, _Node]:
    """Joints and ends of bones, parents first; ends have a star at the end of their keys."""
    nodes: dict[str, _Node] = {}
    if style.extra_root:
        nodes["extra"] = (None, -1, np.zeros(3))
    for joint, name in enumerate(JOINT_NAMES):
        kind = name.partition("_")[2] or name
        if (kind == "collar" and not style.collars) or (kind == "foot" and not style.toes):
            continue
        parent = JOINT_NAMES[PARENTS[joint]] if joint else ("extra" if style.extra_root else None)
        if kind == "shoulder" and not style.collars:
            parent = "spine3"
        if style.biped and (kind == "collar" or (kind == "shoulder" and not style.collars)):
            parent = "neck"
        if style.biped and kind == "hip":
            parent = "spine1"
        if (kind in ("knee", "elbow") and style.rolls) or (kind in ("wrist", "ankle") and style.lower_rolls):
            assert parent is not None
            roll = f"{parent}_roll"
            nodes[roll] = (parent, _INDEX[parent], offsets[joint] / 2)
            parent = roll
        carrier = parent
        if kind in ("hip", "shoulder") and style.doubled:
            assert parent is not None
            nodes[f"{name}_base"] = (parent, _INDEX[parent], offsets[joint])
            parent = f"{name}_base"
        nodes[name] = (parent, joint, offsets[joint])
        if style.copies and kind in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist"):
            for copy, held in (("copy", parent), ("spare", carrier)):
                above = f"{JOINT_NAMES[PARENTS[joint]]}_{copy}"
                nodes[f"{name}_{copy}"] = (above if above in nodes else held, joint, offsets[joint])
    for side, sign in (("left", 1), ("right", -1)):
        if style.fingers:
            for finger, way in (
                ("Thumb", (0.03, -0.01, 0.03)),
                ("Index", (0.09, 0, 0.03)),
                ("Ring", (0.085, 0, -0.02)),
            ):
                nodes[f"{side}{finger}"] = (f"{side}_wrist", _INDEX[f"{side}_wrist"], np.array(way) * [sign, 1, 1])
                nodes[f"{side}{finger}*"] = (f"{side}{finger}", _INDEX[f"{side}_wrist"], np.array([0.04 * sign, 0, 0]))
        else:
            nodes[f"{side}hand*"] = (f"{side}_wrist", _INDEX[f"{side}_wrist"], np.array([0.1 * sign, 0, 0]))
        end = f"{side}_foot" if style.toes else f"{side}_ankle"
        if style.ends:
            nodes[f"{side}toe*"] = (end, _INDEX[end], np.array([0.0, -0.015, 0.07]))
        for joint, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee")):
            if style.twists:
                row = _INDEX[f"{side}_{joint}"]
                nodes[f"{side}{joint}Twist*"] = (f"{side}_{joint}", row, 0.5 * offsets[_INDEX[f"{side}_{end}"]])
    if style.cloth:
        for kind, base, count, links in (("skirt", "pelvis", 6, 4), ("hair", "head", 4, 4)):
            for chain, angle in enumerate(np.linspace(0, 2 * np.pi, count, endpoint=False)):
                way = np.array([np.cos(angle), 0.0, np.sin(angle)])
                for link in range(links):
                    parent = f"{kind}{chain}_{link - 1}" if link else base
                    offset = way * (0.15 if link else 0.1) * 0.3 + [0.0, -0.22, 0.0] if link else way * 0.1
                    nodes[f"{kind}{chain}_{link}"] = (parent, _INDEX[base], np.array(offset))
                nodes[f"{kind}{chain}*"] = (f"{kind}{chain}_{links - 1}", _INDEX[base], np.array([0.0, -0.22, 0.0]))
    if style.prop:
        nodes["stick*"] = ("right_wrist", _INDEX["right_wrist"], np.array([0.0, 0.0, 1.2]))
    nodes["head*"] = ("head", _INDEX["head"], np.array([0.0, 0.18, 0.0]))
    return nodes


def _axes(
    style: Style, nodes: dict[str, _Node], children: dict[str | None, list[str]], rng: np.random.Generator
) -> dict[str, Rotation]:
    """How each node's axes lie at rest in our world when all angles are 0."""
    frame: dict[str, Rotation] = {}
    to_our_world = Rotation.from_matrix(style.world).inv()
    for key in nodes:
        if style.axes in ("world", "hanging") or key == "extra":
            arm = any(part in key for part in ("shoulder", "elbow", "wrist", "Thumb", "Index", "Ring", "hand"))
            hangs = style.axes == "hanging" and arm and not key.endswith("_base")
            turn = Rotation.from_euler("z", (90.0 if key.startswith("left") else -90.0) * hangs, degrees=True)
            frame[key] = turn * to_our_world
        elif style.axes == "random":
            frame[key] = Rotation.from_quat(rng.normal(size=4))
        else:  # x along the bone to the first child
            inner = next((child for child in children.get(key, []) if np.linalg.norm(nodes[child][2]) > 1e-6), None)
            way = np.array([0.0, 1.0, 0.0]) if inner is None else nodes[inner][2] / np.linalg.norm(nodes[inner][2])
            frame[key] = Rotation.align_vectors([way], [[1.0, 0, 0]])[0]
    return frame


def write_bvh(motion: Motion, style: Style) -> str:
    """The file's text."""
    rng = np.random.default_rng(style.seed)
    names, offsets = names_of(style), [np.zeros(3), *Skeleton().offsets_J3.double().numpy()]
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    local = [motion.root_rotation_T33, *motion.local_TJ33.unbind(1)]
    turns = [Rotation.from_matrix(x.double().numpy()) for x in local]
    world: list[Rotation] = []
    for joint, parent in enumerate(PARENTS):
        world.append(turns[joint] if parent < 0 else world[parent] * turns[joint])
    place_T3 = motion.root_position_T3.double().numpy()
    if style.t_pose_first:
        world = [Rotation.concatenate([Rotation.identity(), turn]) for turn in world]
        place_T3 = np.concatenate([[[1.0, 0.9, 2.0]], place_T3])
    to_file = Rotation.from_matrix(style.world)
    nodes = _nodes(style, offsets)

    def points(key: str) -> np.ndarray:
        """Where a node is in our world."""
        parent, joint, offset = nodes[key]
        if parent is None or key == "pelvis":
            return place_T3 if key == "pelvis" or not style.extra_root else np.zeros_like(place_T3)
        assert parent is not None
        # all nodes between two joints of ours hang on the upper one
        if style.biped and parent in ("neck", "spine1") and key not in ("head", "spine2"):
            parent = "spine3" if parent == "neck" else "pelvis"
        key = key.removesuffix("_copy").removesuffix("_spare")
        carrier = nodes[parent][1] if key in _INDEX or key.endswith(("_roll", "_base")) else joint
        base = points(parent)
        if key in _INDEX and (parent.endswith("_base")):
            return base
        if key in _INDEX and parent.endswith("_roll"):
            offset = offset / 2
        if parent == "spine3" and not style.collars and "_shoulder" in key:
            offset = offset + offsets[_INDEX[key.removesuffix("_base").replace("shoulder", "collar")]]
        return base + world[carrier].apply(offset) if carrier >= 0 else base + offset

    children: dict[str | None, list[str]] = {}
    for key in nodes:
        children.setdefault(nodes[key][0], []).append(key)
    frame = _axes(style, nodes, children, rng)
    frames = len(place_T3)
    lines, columns = ["HIERARCHY"], []
    turned = {key: to_file * (Rotation.identity(frames) if joint < 0 else world[joint]) * frame[key]
              for key, (_, joint, _) in nodes.items()}  # fmt: skip

    def write(key: str, depth: int) -> None:
        parent = nodes[key][0]
        pad = "  " * depth
        here = to_file.apply(points(key)) / style.unit
        if parent is None:
            offset_T3, relative = here, turned[key]
        else:
            above = to_file.apply(points(parent)) / style.unit
            offset_T3, relative = turned[parent].inv().apply(here - above), turned[parent].inv() * turned[key]
        if key.endswith("*"):
            lines.extend([f"{pad}End Site", f"{pad}{{", f"{pad}  OFFSET {_text(offset_T3[-1])}", f"{pad}}}"])
            return
        lines.extend([f"{pad}{'ROOT' if parent is None else 'JOINT'} {names.get(key, key)}", f"{pad}{{"])
        lines.append(f"{pad}  OFFSET {_text(np.zeros(3) if parent is None else offset_T3[-1])}")
        order = style.order if isinstance(style.order, str) else style.order.get(key, "ZXY")
        moves = parent is None or style.positions or key == "pelvis"
        channels = [f"{axis}position" for axis in "XYZ"] * moves + [f"{axis}rotation" for axis in order]
        lines.append(f"{pad}  CHANNELS {len(channels)} {' '.join(channels)}")
        if moves:
            columns.append(offset_T3)
        columns.append(relative.as_euler(order, degrees=True))
        for child in rng.permutation(children.get(key, [])).tolist():
            write(child, depth + 1)
        lines.append(f"{pad}}}")

    with warnings.catch_warnings(action="ignore"):  # gimbal lock
        write("extra" if style.extra_root else "pelvis", 0)
    lines += ["MOTION", f"Frames: {frames}", f"Frame Time: {1 / motion.frame_rate:.9g}"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in np.concatenate(columns, axis=1)]
    return "\n".join(lines) + "\n"


def _text(offset_3: np.ndarray) -> str:
    return " ".join(f"{x:.7f}" for x in offset_3)
