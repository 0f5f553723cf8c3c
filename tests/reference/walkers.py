"""A robot with two legs, hung up at its pelvis or at its chest; its sole is a box."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from mrhubo.body import Skeleton
from mrhubo.robot import BodyMap, Robot, read_keypoints

ROOTS = ["pelvis", "chest"]
SOLE = (0.05, 0.15, 0.06)
"""How far it reaches backwards, forwards and down from the ankle [m]."""


THICK = {"shin": ("0 0 0", 0.14), "fore": ("0 0 -0.2", 0.08), "chest": ("0.02 0 0.15", 0.15)}
"""Balls of a thick robot: where on their links, and their radii [m]."""


def write_urdf(path: Path, root: str = "pelvis", masses: bool = False, thick: bool = False) -> Path:
    """The robot's URDF, hung up at its pelvis or at its chest: then the waist's joint is above the legs. With masses,
    it carries a load in front of its chest; a thick one has knees, hands and a chest.
    """
    limit = '<limit lower="{}" upper="{}" effort="1" velocity="10"/>'

    def joint(name: str, parent: str, child: str, xyz: str, axis: str, low: float, high: float) -> str:
        return (f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
                f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit.format(low, high)}</joint>')  # fmt: skip

    up = root == "pelvis"
    above, below = ("pelvis", "chest") if up else ("chest", "pelvis")
    rows = [joint("waist", above, below, f"0 0 {0.2 if up else -0.2}", f"0 0 {1 if up else -1}", -1, 1)]
    for side, y in (("l", 1), ("r", -1)):
        rows += [
            joint(f"{side}_hip_yaw", "pelvis", f"{side}_yaw", f"0 {0.08 * y} -0.1", "0 0 1", -0.6, 0.6),
            joint(f"{side}_hip_roll", f"{side}_yaw", f"{side}_roll", "0 0 0", "1 0 0", -0.5, 0.5),
            joint(f"{side}_hip_pitch", f"{side}_roll", f"{side}_thigh", "0 0 0", "0 1 0", -1.6, 0.6),
            joint(f"{side}_knee", f"{side}_thigh", f"{side}_shin", "0 0 -0.3", "0 1 0", 0.05, 2.2),
            joint(f"{side}_ankle", f"{side}_shin", f"{side}_foot", "0 0 -0.3", "0 1 0", -0.9, 0.6),
            joint(f"{side}_shoulder_pitch", "chest", f"{side}_upper", f"0 {0.15 * y} 0.2", "0 1 0", -2, 2),
            joint(f"{side}_shoulder_roll", f"{side}_upper", f"{side}_arm", "0 0 0", "1 0 0", -1.5, 1.5),
            joint(f"{side}_elbow", f"{side}_arm", f"{side}_fore", "0 0 -0.25", "0 1 0", -2, -0.05),
        ]
    links = ["pelvis", "chest", *(f"{s}_{n}" for s in "lr" for n in ("yaw", "roll", "thigh", "shin", "foot", "upper",
                                                                     "arm", "fore"))]  # fmt: skip
    back, ahead, down = SOLE
    box = (f'<collision><origin xyz="{(ahead - back) / 2} 0 {-down / 2}"/><geometry><box size="{ahead + back} 0.08 {down}"/>'
           "</geometry></collision>")  # fmt: skip
    solid = {name: box for name in links if name.endswith("foot")}
    if thick:
        for name, (place, radius) in THICK.items():
            ball = f'<collision><origin xyz="{place}"/><geometry><sphere radius="{radius}"/></geometry></collision>'
            solid |= {link: ball for link in links if link.endswith(name)}
    if masses:
        inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        for name in links:
            place, kilograms = ("0.25 0.05 0.2", 60) if name == "chest" else ("0.02 0 -0.1", 1)
            mass = f'<inertial><origin xyz="{place}"/><mass value="{kilograms}"/>{inertia}</inertial>'
            solid[name] = mass + solid.get(name, "")
    text = "".join(f'<link name="{name}">{solid.get(name, "")}</link>' for name in links)
    path.write_text(f'<robot name="walker">{text}{"".join(rows)}</robot>')
    return path


def entries() -> dict[str, object]:
    """`robot.keypoints` of the robot."""
    found: dict[str, object] = {"pelvis": "pelvis", "chest": "chest"}
    for side, s in (("left", "l"), ("right", "r")):
        found |= {
            f"{side}_hip": f"{s}_thigh", f"{side}_knee": f"{s}_shin", f"{side}_ankle": f"{s}_foot",
            f"{side}_foot": {"link": f"{s}_foot", "forward": [1, 0, 0], "up": [0, 0, 1]},
            f"{side}_shoulder": f"{s}_upper", f"{side}_elbow": f"{s}_fore",
            f"{side}_wrist": {"link": f"{s}_fore", "offset": [0, 0, -0.2]},
        }  # fmt: skip
    return found


def walker(
    folder: Path,
    root: str = "pelvis",
    waist: bool = True,
    follows: str = "pelvis",
    balance: float = 0.0,
    masses: bool = False,
    thick: bool = False,
    **changes: object,
) -> BodyMap:
    """The body map of the robot; without a waist, its chest is the pelvis. `follows`: `robot.root_follows`; `balance`:
    `robot.balance`; `masses` and `thick` as for `write_urdf`. Entries that are None are left out.
    """
    urdf = write_urdf(folder / f"walker_{root}.urdf", root, masses, thick)
    names = [f"{s}_{n}" for s in "lr" for n in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle", "shoulder_pitch",
                                                "shoulder_roll", "elbow")]  # fmt: skip
    given = {**entries(), **({} if waist else {"chest": root, "pelvis": root}), **changes}
    keypoints = read_keypoints({name: entry for name, entry in given.items() if entry is not None})
    keypoints = dataclasses.replace(keypoints, root_follows=follows)
    robot = Robot(urdf, [*(["waist"] if waist else []), *names], keypoints.links, hold={} if waist else {"waist": 0.0})
    robot.balance = balance
    return BodyMap.of(robot, keypoints, Skeleton())
