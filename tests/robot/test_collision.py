"""Distances between capsules against brute force, their derivatives against differences, on toys and on the robots."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.config import RobotConfig, load_config
from mrhubo.errors import InputWarning
from mrhubo.robot import (
    LinkGeometry,
    Robot,
    SelfCollision,
    build_body_map,
    collision,
    link_capsules,
    read_collision_geometry,
)
from mrhubo.robot.capsules import capsules, closest_points
from mrhubo.robot.shapes import Kind
from mrhubo.robot.solid_shapes import SolidShapes
from tests.robot import exact_shapes

ROBOTS = ["nao", "coman", "reachy"]


@functools.cache
def robot_of(root: Path, name: str) -> Robot:
    return build_body_map(load_config(root / "conf" / f"{name}.yaml").robot).robot


def toy(folder: Path, fore: str, middle: str = "", trunk: str = "<sphere radius='0.1'/>") -> Robot:
    """A trunk, an upper arm 0.3 long, a forearm with the given shape in its middle; both joints turn about z."""
    path = folder / "toy.urdf"
    limit = "<limit lower='-3' upper='3' effort='1' velocity='1'/><axis xyz='0 0 1'/>"
    path.write_text(
        f"""<robot name="toy">
        <link name="trunk"><collision><geometry>{trunk}</geometry></collision></link>
        <link name="upper">{middle}</link>
        <link name="fore"><collision><origin xyz="0.2 0 0"/><geometry>{fore}</geometry></collision></link>
        <joint name="shoulder" type="revolute"><parent link="trunk"/><child link="upper"/>
          <origin xyz="0 0 0"/>{limit}</joint>
        <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
          <origin xyz="0.3 0 0"/>{limit}</joint></robot>"""
    )
    return Robot(path, ["shoulder", "elbow"])


points = st.lists(st.floats(-1, 1, width=32), min_size=12, max_size=12)


@given(points, st.integers(0, 3))
def test_closest_points_are_no_farther_than_any_others(numbers: list[float], degenerate: int) -> None:
    a, b = torch.tensor(numbers, dtype=torch.float64).reshape(2, 2, 3)
    if degenerate & 1:
        a = a[:1].expand(2, 3)
    if degenerate & 2:
        b = a + torch.tensor([0.0, 0.3, 0.0])  # parallel
    found_a, found_b = closest_points(a, b)
    along = torch.linspace(0, 1, 41, dtype=torch.float64)[:, None]
    others = torch.cdist(a[0] + along * (a[1] - a[0]), b[0] + along * (b[1] - b[0]))
    assert float((found_a - found_b).norm()) <= float(others.min()) + 1e-4
    for found, ends in ((found_a, a), (found_b, b)):  # on the segment
        assert float((found - ends[0]).norm() + (found - ends[1]).norm()) == pytest.approx(
            float((ends[1] - ends[0]).norm()), abs=1e-6
        )


@pytest.mark.parametrize("name", ROBOTS)
def test_derivatives_equal_differences(root: Path, name: str) -> None:
    robot = robot_of(root, name)
    shapes = SelfCollision(robot)
    q_BN = robot.sample(300, torch.Generator().manual_seed(1))
    near = shapes.near(q_BN, 0.02)
    assert len(near.row_X) > 20
    step, joints = 1e-3, q_BN.shape[1]
    steps_BN = step * torch.cat((-torch.eye(joints), torch.eye(joints)))
    for x in range(0, len(near.row_X), max(1, len(near.row_X) // 15)):
        close = shapes.near(q_BN[near.row_X[x]] + steps_BN, 1.0)
        own_X = close.pair_X == near.pair_X[x]
        assert close.row_X[own_X].sort().values.tolist() == list(range(2 * joints))
        distance_B = torch.empty(2 * joints)
        distance_B[close.row_X[own_X]] = close.distance_X[own_X]
        difference_N = distance_B.reshape(2, joints).diff(dim=0)[0] / (2 * step)
        torch.testing.assert_close(near.jacobian_XN[x], difference_N, atol=2e-3, rtol=0)


@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robots_stand_free_and_all_their_limbs_are_covered(root: Path, name: str) -> None:
    robot = robot_of(root, name)
    shapes = SelfCollision(robot)
    assert not shapes.uncovered and not bool(shapes.collides(robot.home()[None]))
    share = float(shapes.collides(robot.sample(2000, torch.Generator().manual_seed(0))).float().mean())
    assert 0.01 < share < 0.5
    sides = {(a[0].lower(), b[0].lower()) for a, b in shapes.pairs}
    assert ("l", "r") in sides or ("r", "l") in sides  # the arms can meet
    # links far apart in the tree only: never two of one body or of neighbours
    description = robot.description
    for a, b in shapes.pairs:
        moved = [{j.name for j in description.joints_above(x) if j.name in robot.driven_joints} for x in (a, b)]
        assert len(moved[0] ^ moved[1]) >= 2


@pytest.mark.parametrize(
    "fore",
    [
        "<sphere radius='0.05'/>",
        "<cylinder radius='0.05' length='0.1'/>",
        "<box size='0.1 0.1 0.1'/>",
        "<box size='0.3 0.05 0.01'/>",
    ],
)
def test_a_folded_arm_touches_the_trunk(tmp_path: Path, fore: str) -> None:
    shapes = SelfCollision(toy(tmp_path, fore))
    straight, folded = torch.tensor([[0.5, 0.0]]), torch.tensor([[0.5, 2.9]])
    assert not bool(shapes.collides(straight)) and bool(shapes.collides(folded))
    assert shapes.collides(torch.cat((straight, folded, straight))).tolist() == [False, True, False]
    assert set(shapes.pairs) == {("trunk", "fore")}


def test_distance_of_spheres_is_exact(tmp_path: Path) -> None:
    shapes = SelfCollision(toy(tmp_path, "<sphere radius='0.05'/>"))
    near = shapes.near(torch.tensor([[0.7, 0.0], [0.7, torch.pi / 2]]), 1.0)
    expected = [0.5 - 0.15, (0.3**2 + 0.2**2) ** 0.5 - 0.15]
    assert near.distance_X.tolist() == pytest.approx(expected, abs=1e-6)
    assert float(near.jacobian_XN[:, 0].abs().max()) < 1e-6  # the shoulder turns both about the trunk's centre


SHAPES = [("box", (0.1, 0.1, 0.1)), ("box", (0.1, 0.15, 0.3)), ("box", (0.3, 0.05, 0.2)), ("box", (0.04, 0.2, 0.05)),
          ("cylinder", (0.05, 0.3)), ("cylinder", (0.05, 0.07)), ("cylinder", (0.05, 0.04)), ("cylinder", (0.1, 0.05))]  # fmt: skip


def outside(kind: str, size: tuple[float, ...], points_X3: np.ndarray) -> np.ndarray:
    """How far points are outside a box or a cylinder at the origin; negative inside."""
    if kind == "box":
        over = np.abs(points_X3) - np.array(size) / 2
    else:
        round_ = np.hypot(points_X3[:, 0], points_X3[:, 1]) - size[0]
        over = np.stack((round_, np.abs(points_X3[:, 2]) - size[1] / 2), axis=1)
    return np.linalg.norm(np.maximum(over, 0), axis=1) + np.minimum(over.max(axis=1), 0)


@pytest.mark.parametrize(("kind", "size"), SHAPES)
def test_capsules_hug_boxes_and_cylinders(kind: Kind, size: tuple[float, ...]) -> None:
    """They take up as much room, and neither sticks out of the other far."""
    found = capsules(LinkGeometry("link", kind, size, np.eye(4), (0, 0, 0)), np.eye(4))
    assert len(found) <= 3
    half_3 = np.array(size if kind == "box" else (2 * size[0], 2 * size[0], size[1])) / 2
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3)) * (half_3 + 0.03)
    inside = outside(kind, size, points)
    apart = []
    for start_3, end_3, radius in found:
        along_3 = end_3 - start_3
        share = np.clip((points - start_3) @ along_3 / max(along_3 @ along_3, 1e-12), 0, 1)
        apart.append(np.linalg.norm(points - start_3 - share[:, None] * along_3, axis=1) - radius)
    covered = np.min(apart, axis=0)
    assert 0.9 < (covered <= 0).sum() / (inside <= 0).sum() < 1.1
    assert inside[covered <= 0].max() < 0.8 * half_3.min()
    assert covered[inside <= 0].max() < 1.1 * half_3.min()
    assert ((inside <= 0) & (covered > 0)).sum() < 0.25 * (inside <= 0).sum()


@pytest.mark.parametrize(("kind", "size"), [("box", (0.04, 0.09, 0.16)), ("cylinder", (0.07, 0.04)), ("cylinder", (0.03, 0.14))])  # fmt: skip
def test_what_is_reported_is_near_what_is_exact(
    root: Path, kind: Kind, size: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """NAO's arms in other shapes, of which the overlap is known exactly."""
    robot = robot_of(root, "nao")
    places = {s.link: s for s in read_collision_geometry(robot.description.parsed)}
    shapes = [
        dataclasses.replace(places[link], kind=kind, size=size) for link in ("torso", "LForeArm", "RForeArm", "Head")
    ]
    monkeypatch.setitem(robot.description._read, "solids", SolidShapes(tuple(shapes), (), frozenset()))
    monkeypatch.setattr(exact_shapes, "read_collision_geometry", lambda _: shapes)
    found = SelfCollision(robot)
    q_BN = robot.sample(150, torch.Generator().manual_seed(0))
    exact = exact_shapes.collides_exactly(robot, found, q_BN)
    reported = found.collides(q_BN).numpy()
    assert 0.03 < exact.mean() < 0.9
    assert (reported != exact).mean() < 0.08


def test_exact_overlap_of_shapes_that_are_easily_told() -> None:
    def at(x: float) -> np.ndarray:
        pose = np.eye(4)
        pose[0, 3] = x
        return pose

    box = LinkGeometry("a", "box", (0.2, 0.2, 0.2), np.eye(4), (0, 0, 0))
    ball = LinkGeometry("b", "sphere", (0.1,), np.eye(4), (0, 0, 0))
    rod = LinkGeometry("c", "cylinder", (0.1, 0.4), np.eye(4), (0, 0, 0))
    for one, other in itertools.product((box, ball, rod), repeat=2):
        assert exact_shapes.overlap(one, at(0.0), other, at(0.199))
        assert not exact_shapes.overlap(one, at(0.0), other, at(0.201))


def test_no_pose_is_no_special_case(root: Path) -> None:
    shapes = SelfCollision(robot_of(root, "nao"))
    assert shapes.collides(torch.zeros(0, 8)).shape == (0,) and shapes.near(
        torch.zeros(0, 8), 1.0
    ).jacobian_XN.shape == (0, 8)


def test_meshes_are_named_as_not_covered(tmp_path: Path) -> None:
    mesh = "<collision><geometry><mesh filename='a.stl'/></geometry></collision>"
    shapes = SelfCollision(toy(tmp_path, "<sphere radius='0.05'/>", mesh))
    assert shapes.uncovered == shapes.unknown == ("upper",)
    assert SelfCollision(toy(tmp_path, "<sphere radius='0.05'/>")).unknown == ()


def test_a_robot_without_shapes_never_collides(tmp_path: Path) -> None:
    mesh = "<mesh filename='a.stl'/>"
    shapes = SelfCollision(toy(tmp_path, mesh, trunk=mesh))
    assert shapes.pairs == () and not bool(shapes.collides(torch.zeros(3, 2)).any())


def spheres(count: int) -> str:
    """Collision elements in a row along a link."""
    return "".join(
        f"<collision><origin xyz='0.05 0 {-0.2 + 0.3 * i / count:.4f}'/><geometry><sphere radius='0.01'/></geometry></collision>"
        for i in range(count)
    )


def test_many_shapes_are_looked_at_few_poses_at_a_time(
    pair: Callable[..., RobotConfig], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 480 spheres, 230,000 distances a pose; at 1,024 poses that would be a gigabyte."""
    links = ["chest", "head", "l_upper", "l_lower", "l_hand", "r_upper", "r_lower", "r_hand"]
    largest, cdist = [], torch.cdist

    def measured(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        largest.append(a.shape[0] * a.shape[1] * b.shape[1])
        return cdist(a, b)

    monkeypatch.setattr(torch, "cdist", measured)
    edits = [(f'<link name="{link}"/>', f'<link name="{link}">{spheres(60)}</link>') for link in links]
    robot = build_body_map(pair(*edits)).robot
    shapes = SelfCollision(robot)
    assert len(shapes.pairs) > 20_000
    shapes.collides(robot.sample(90, torch.Generator().manual_seed(0)))
    assert max(largest) <= 2**24


@pytest.mark.parametrize("name", ["nao", "reachy"])
def test_how_many_are_looked_at_together_does_not_matter(
    root: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = robot_of(root, name)
    shapes = SelfCollision(robot)
    q_BN = robot.sample(60, torch.Generator().manual_seed(0))
    together, collides = shapes.near(q_BN, 0.02), shapes.collides(q_BN)
    monkeypatch.setattr(collision, "_AT_ONCE", 7 * len(shapes._links) ** 2)
    apart = shapes.near(q_BN, 0.02)
    for field in ("row_X", "pair_X", "distance_X", "jacobian_XN"):
        torch.testing.assert_close(getattr(apart, field), getattr(together, field), atol=1e-6, rtol=0)
    assert torch.equal(shapes.collides(q_BN), collides)


def test_too_many_shapes_are_left_out_and_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_capsules, "_MOST", 20)
    robot = toy(tmp_path, "<sphere radius='0.05'/>", middle=spheres(30))
    with pytest.warns(
        InputWarning, match=r"toy.urdf: has 32 collision shapes, more than 20; those of upper are not looked at"
    ):
        shapes = SelfCollision(robot)
    assert shapes.uncovered == ("upper",) and shapes.pairs == (("trunk", "fore"),)
