"""The URDFs in `data/robots`: well-formed, made of primitives only, and kinematically equal to the robots' originals.

The comparison needs the originals in `data/external/robots`; everything else runs without them. Links are compared at
random angles of every joint, mimic joints included (pytorch-kinematics leaves those free, on both sides alike).
"""

from __future__ import annotations

import functools
import logging
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import pytorch_kinematics as pk
import torch
from yourdfpy import URDF
from yourdfpy.urdf import Joint

ROBOTS = ("nao", "coman", "reachy")
ROOTS = {"nao": "world", "coman": "base_link", "reachy": "pedestal"}
COUNTS = {"nao": (45, 44), "coman": (64, 63), "reachy": (31, 30)}
"""Links and joints."""
CONFIGURATIONS = 1000
TOLERANCE = 1e-5
"""Metres and radians."""

# Arms a little away from the body and elbows a little bent; NAO's arms once forward and once hanging.
NATURAL = {
    "nao-forward": {"LElbowRoll": -0.3, "RElbowRoll": 0.3, "LShoulderRoll": 0.1, "RShoulderRoll": -0.1},
    "nao-hanging": {
        "LShoulderPitch": 1.5,
        "RShoulderPitch": 1.5,
        "LShoulderRoll": 0.15,
        "RShoulderRoll": -0.15,
        "LElbowYaw": -1.2,
        "RElbowYaw": 1.2,
        "LElbowRoll": -0.4,
        "RElbowRoll": 0.4,
    },
    "coman": {"LShLat": 0.1, "RShLat": -0.1, "LElbj": -0.3, "RElbj": -0.3},
    "coman-zero": {},
    "reachy": {"l_shoulder_roll": 0.1, "r_shoulder_roll": -0.1, "l_elbow_pitch": -0.3, "r_elbow_pitch": -0.3},
    "reachy-zero": {},
}


@dataclass
class Capsule:
    """A solid of a link, in the link's frame; a sphere is a capsule whose ends coincide."""

    start: np.ndarray
    end: np.ndarray
    radius: float


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    """yourdfpy repeats at every pose that NAO's fingers mimic a fixed joint; one test below looks at what it says."""
    caplog.set_level(logging.ERROR, logger="yourdfpy.urdf")


def ours(root: Path, name: str) -> Path:
    return root / "data" / "robots" / name / f"{name}.urdf"


@functools.cache
def load(path: Path) -> URDF:
    """The robot of a file; tests share it and may pose it."""
    return URDF.load(str(path), load_meshes=False, build_scene_graph=True)


def pose(robot: URDF, angles: dict[str, float]) -> dict[str, np.ndarray]:
    """Every link's transform in the root at these angles (0 for the joints not named)."""
    values = np.zeros(len(robot.actuated_joint_names))
    for joint, angle in angles.items():
        values[robot.actuated_joint_names.index(joint)] = angle
    robot.update_cfg(values)
    return {link.name: robot.get_transform(link.name) for link in robot.robot.links}


def limits(joint: Joint) -> tuple[float | None, ...] | None:
    """Range, effort and velocity of a joint that moves."""
    if joint.type == "fixed" or joint.limit is None:
        return None
    return joint.limit.lower, joint.limit.upper, joint.limit.effort, joint.limit.velocity


def mimic(joint: Joint) -> tuple[str, float, float] | None:
    return (joint.mimic.joint, joint.mimic.multiplier, joint.mimic.offset) if joint.mimic is not None else None


def link_matrices(path: Path, angles: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    chain = pk.build_chain_from_urdf(path.read_bytes()).to(dtype=torch.float64)
    assert set(chain.get_joint_parameter_names()) == set(angles)
    count = len(next(iter(angles.values())))
    return {n: t.get_matrix().expand(count, 4, 4) for n, t in chain.forward_kinematics(angles).items()}


def rotation_angle(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Angle between rotation matrices; exact near zero, where arccos of the trace is not."""
    return 2 * torch.asin(((a - b).flatten(-2).norm(dim=-1) / 8**0.5).clamp(max=1.0))


def mirrored(name: str) -> str | None:
    """The right-hand counterpart of a left-hand link, None for any other link."""
    if re.match(r"LFinger[12]\d", name):  # both hands carry the same row of fingers, so 1 lies where 2 does
        return "RFinger" + {"1": "2", "2": "1"}[name[7]] + name[8:]
    if foot := re.fullmatch(r"l_foot_(upper|lower)_(left|right)_link", name):  # the corners' sides are the robot's
        return f"r_foot_{foot[1]}_{'left' if foot[2] == 'right' else 'right'}_link"
    for left, right in (("left_", "right_"), ("l_", "r_"), ("L", "R")):
        if name.startswith(left):
            return right + name[len(left) :]
    return None


def capsules(robot: URDF) -> dict[str, list[Capsule]]:
    """The collision geometry by link; every cylinder must be followed by the spheres that close its ends."""
    result: dict[str, list[Capsule]] = {}
    for link in robot.robot.links:
        pending = list(link.collisions)
        while pending:
            first = pending.pop(0)
            if first.geometry.sphere is not None:
                centre = first.origin[:3, 3]
                found = Capsule(centre, centre, first.geometry.sphere.radius)
            else:
                cylinder = first.geometry.cylinder
                half = first.origin[:3, 2] * cylinder.length / 2
                expected = [first.origin[:3, 3] - half, first.origin[:3, 3] + half]
                caps = [pending.pop(0), pending.pop(0)]
                assert all(cap.geometry.sphere.radius == cylinder.radius for cap in caps), link.name
                ends = [cap.origin[:3, 3] for cap in caps]
                gap = min(np.abs(np.stack(ends) - np.stack(e)).max() for e in (expected, expected[::-1]))
                assert gap < 2e-6, f"{link.name}: spheres are {gap} m off the ends of their cylinder"
                found = Capsule(ends[0], ends[1], cylinder.radius)
            result.setdefault(link.name, []).append(found)
    return result


def depth(a: Capsule, b: Capsule, ta: np.ndarray, tb: np.ndarray) -> float:
    """How far two capsules reach into each other, negative where they are apart."""
    points = ta[:3, :3] @ np.linspace(a.start, a.end, 33).T + ta[:3, 3:]
    start, end = (tb[:3, :3] @ p + tb[:3, 3] for p in (b.start, b.end))
    along = end - start
    share = np.clip((points.T - start) @ along / max(along @ along, 1e-12), 0, 1)
    distance = np.linalg.norm(points.T - start - share[:, None] * along, axis=1).min()
    return a.radius + b.radius - distance


def bodies(robot: URDF, solid: set[str]) -> tuple[dict[str, str], dict[str, str | None]]:
    """Each link's body (links fixed to each other are one), and each body's nearest ancestor that has volume."""
    above = {joint.child: joint for joint in robot.robot.joints}

    def body(link: str) -> str:
        while link in above and above[link].type == "fixed":
            link = above[link].parent
        return link

    of = {link.name: body(link.name) for link in robot.robot.links}
    with_volume = {of[link] for link in solid}
    nearest: dict[str, str | None] = {}
    for name in set(of.values()):
        joint = above.get(name)
        while joint is not None and of[joint.parent] not in with_volume:
            joint = above.get(of[joint.parent])
        nearest[name] = of[joint.parent] if joint is not None else None
    return of, nearest


# --- without external data ---


@pytest.mark.parametrize("name", ROBOTS)
def test_is_plain_xml_of_primitives(root: Path, name: str) -> None:
    text = ours(root, name).read_text(encoding="utf-8")
    tree = ET.fromstring(text.encode())
    assert tree.tag == "robot" and tree.get("name") == name
    assert {child.tag for child in tree} == {"material", "link", "joint"}
    shapes = {kind: {g[0].tag for g in tree.iterfind(f"link/{kind}/geometry")} for kind in ("visual", "collision")}
    assert shapes["visual"] <= {"cylinder", "sphere", "box"}
    assert shapes["collision"] <= {"cylinder", "sphere"}
    assert "package:" not in text and "filename" not in text
    assert "SPDX-License-Identifier: Apache-2.0" in text
    used = {m.get("name") for m in tree.iterfind("link/visual/material")}
    assert used == {m.get("name") for m in tree.findall("material")}
    for tag in ("link", "joint"):
        names = [e.get("name") for e in tree.findall(tag)]
        assert len(names) == len(set(names))


@pytest.mark.parametrize("name", ROBOTS)
def test_parses_without_warnings(
    root: Path, name: str, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    with caplog.at_level(logging.WARNING, logger="yourdfpy.urdf"):
        robot = load.__wrapped__(ours(root, name))
    # NAO's hands are fixed here, so what its fingers mimic cannot move: yourdfpy says so, and takes 0
    expected = re.compile(r"Joint '[LR](Finger|Thumb)\d+' is supposed to mimic '[LR]Hand'")
    said = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
    assert not [m for m in said if name != "nao" or not expected.match(m)]
    assert robot.validate()

    capfd.readouterr()
    pk.build_chain_from_urdf(ours(root, name).read_bytes())
    output = capfd.readouterr()
    assert output.out + output.err == ""


@pytest.mark.parametrize("name", ROBOTS)
def test_is_one_tree(root: Path, name: str) -> None:
    robot = load(ours(root, name)).robot
    assert (len(robot.links), len(robot.joints)) == COUNTS[name]
    children = [joint.child for joint in robot.joints]
    assert len(children) == len(set(children))
    assert {link.name for link in robot.links} - set(children) == {ROOTS[name]}
    for joint in robot.joints:
        if joint.type == "revolute":
            assert joint.limit.lower < joint.limit.upper, joint.name
        if joint.type != "fixed":
            assert np.linalg.norm(joint.axis) == pytest.approx(1.0, abs=1e-6), joint.name


@pytest.mark.parametrize("name", ROBOTS)
def test_has_volume(root: Path, name: str) -> None:
    robot = load(ours(root, name)).robot
    visual = {link.name for link in robot.links if link.visuals}
    collision = {link.name for link in robot.links if link.collisions}
    assert visual == collision
    assert len(collision) >= 12
    # every moving link with no volume is one of a cluster of joints: the next link begins where it does, or within 8 cm
    origins = {joint.child: np.linalg.norm(joint.origin[:3, 3]) for joint in robot.joints}
    for joint in robot.joints:
        if joint.type != "fixed" and joint.child not in collision:
            nexts = [j.child for j in robot.joints if j.parent == joint.child and j.type != "fixed"]
            fixed = [j.child for j in robot.joints if j.parent == joint.child and j.type == "fixed"]
            assert nexts or set(fixed) & collision, f"{joint.child} ends the chain without volume"
            assert all(origins[n] < 0.08 for n in nexts), f"{joint.child} spans a segment without volume"


@pytest.mark.parametrize("name", ROBOTS)
def test_left_and_right_mirror_each_other_at_zero(root: Path, name: str) -> None:
    frames = pose(load(ours(root, name)), {})
    pairs = {link: right for link in frames if (right := mirrored(link)) is not None}
    assert len(pairs) >= 10
    on_a_side = {link for link, frame in frames.items() if abs(frame[1, 3]) > 0.01}
    assert on_a_side <= set(pairs) | set(pairs.values())
    for left, right in pairs.items():
        gap = frames[left][:3, 3] * (1, -1, 1) - frames[right][:3, 3]
        assert np.linalg.norm(gap) < 2e-4, f"{left} and {right}"


@pytest.mark.parametrize("name", ROBOTS)
def test_solids_mirror_each_other(root: Path, name: str) -> None:
    robot = load(ours(root, name))
    frames = pose(robot, {})

    def placed(mirror: bool) -> np.ndarray:
        rows = []
        for link, solids in capsules(robot).items():
            for solid in solids:
                ends = [(frames[link] @ [*p, 1.0])[:3] * (1, -1 if mirror else 1, 1) for p in (solid.start, solid.end)]
                rows.append([*(ends[0] + ends[1]) / 2, np.linalg.norm(ends[1] - ends[0]), solid.radius])
        return np.array(rows)

    there, mirror = placed(False), placed(True)
    gaps = np.abs(there[:, None] - mirror[None]).max(axis=2).min(axis=1)
    assert gaps.max() < 2e-4


@pytest.mark.parametrize("case", NATURAL)
def test_nothing_collides_at_a_natural_pose(root: Path, case: str) -> None:
    robot = load(ours(root, case.split("-")[0]))
    frames = pose(robot, NATURAL[case])
    solids = capsules(robot)
    of, nearest = bodies(robot, set(solids))
    overlaps = []
    names = sorted(solids)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            a, b = of[one], of[other]
            if a == b or nearest[a] == b or nearest[b] == a:
                continue
            worst = max(depth(s, t, frames[one], frames[other]) for s in solids[one] for t in solids[other])
            if worst > 0:
                overlaps.append((one, other, round(worst, 4)))
    assert not overlaps


# --- against the originals ---


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_equal_the_original(root: Path, external_dir: Path, name: str) -> None:
    mine = load(ours(root, name)).robot
    original = load(external_dir / "robots" / f"{name}.urdf").robot
    assert {link.name for link in mine.links} == {link.name for link in original.links}
    joints = {joint.name: joint for joint in mine.joints}
    assert set(joints) == {joint.name for joint in original.joints}
    for joint in original.joints:
        own = joints[joint.name]
        assert (own.type, own.parent, own.child) == (joint.type, joint.parent, joint.child), joint.name
        assert limits(own) == limits(joint), joint.name
        assert mimic(own) == mimic(joint), joint.name


@pytest.mark.parametrize("name", ROBOTS)
def test_links_lie_where_the_original_has_them(root: Path, external_dir: Path, name: str) -> None:
    generator = torch.Generator().manual_seed(20240607)
    angles: dict[str, torch.Tensor] = {}
    for joint in load(ours(root, name)).robot.joints:
        if joint.type == "fixed":
            continue
        low, high = (-np.pi, np.pi) if joint.limit is None else (joint.limit.lower, joint.limit.upper)
        random = torch.rand(CONFIGURATIONS, generator=generator, dtype=torch.float64)
        angles[joint.name] = low + (high - low) * random
    mine = link_matrices(ours(root, name), angles)
    original = link_matrices(external_dir / "robots" / f"{name}.urdf", angles)
    assert set(mine) == set(original)
    links = sorted(original)
    here, there = (torch.stack([m[link][:, :3] for link in links]) for m in (mine, original))
    distance = (here[..., 3] - there[..., 3]).norm(dim=-1).amax(dim=1)
    angle = rotation_angle(here[..., :3], there[..., :3]).amax(dim=1)
    off = [
        (n, d, a) for n, d, a in zip(links, distance.tolist(), angle.tolist(), strict=True) if max(d, a) >= TOLERANCE
    ]
    assert not off


@pytest.mark.parametrize("name", ROBOTS)
def test_mimic_moves_as_in_the_original(root: Path, external_dir: Path, name: str) -> None:
    """A few poses in yourdfpy, which does apply mimic (NAO's one pelvis motor)."""
    mine, original = load(ours(root, name)), load(external_dir / "robots" / f"{name}.urdf")
    assert set(mine.actuated_joint_names) == set(original.actuated_joint_names)
    random = np.random.default_rng(3)
    for _ in range(3):
        angles = {n: random.uniform(*_range(mine.joint_map[n])) for n in mine.actuated_joint_names}
        here, there = pose(mine, angles), pose(original, angles)
        for link, frame in there.items():
            assert np.abs(here[link] - frame).max() < TOLERANCE, link


def _range(joint: Joint) -> tuple[float, float]:
    return (-np.pi, np.pi) if joint.limit is None else (joint.limit.lower, joint.limit.upper)
