"""Collision meshes that are there count, others leave a gap, and a package's URDF needs none of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from mrhubo.robot import SelfCollision, solid_shapes
from mrhubo.robot.model import Robot
from mrhubo.robot.solid_urdf import urdf_without_meshes
from mrhubo.robot.urdf import describe

MESH = "<collision><origin xyz='{x} 0 0' rpy='0 1.2 0.3'/><geometry><mesh filename='{name}.stl' scale='0.001 0.001 0.001'/></geometry></collision>"
LIMIT = "<limit lower='-3' upper='3' effort='1' velocity='1'/><axis xyz='0 0 1'/>"


def folded(folder: Path, name: str = "rod", more: str = "") -> Robot:
    """A trunk, an upper arm, and a forearm that can reach the trunk; trunk and forearm are meshes."""
    path = folder / "toy.urdf"
    path.write_text(
        f"""<robot name="toy"><link name="trunk">{MESH.format(x=0, name="box")}</link><link name="upper"/>
        <link name="fore">{MESH.format(x=0.2, name=name)}{more}</link>
        <joint name="shoulder" type="revolute"><parent link="trunk"/><child link="upper"/>{LIMIT}</joint>
        <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/>{LIMIT}
        </joint></robot>"""
    )
    return Robot(path, ["shoulder", "elbow"])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    trimesh.creation.box((100.0, 150.0, 200.0)).export(tmp_path / "box.stl")
    trimesh.creation.cylinder(30.0, 100.0).export(tmp_path / "rod.stl")
    return tmp_path


STRAIGHT, FOLDED = [0.5, 0.0], [0.5, 2.9]


def test_meshes_touch(folder: Path) -> None:
    shapes = SelfCollision(folded(folder))
    assert shapes.known and shapes.why_unknown() is None and not shapes.uncovered
    assert shapes.collides(torch.tensor([STRAIGHT, FOLDED])).tolist() == [False, True]


@pytest.mark.parametrize("content", [None, b"", b"junk" * 50])
def test_a_mesh_that_is_not_there_leaves_a_gap(folder: Path, content: bytes | None) -> None:
    if content is not None:
        (folder / "bad.stl").write_bytes(content)
    shapes = SelfCollision(folded(folder, "bad"))
    assert shapes.unknown == ("fore",) and not shapes.known
    assert shapes.touches(torch.tensor([FOLDED])) is None and "fore" in str(shapes.why_unknown())
    beside = "<collision><origin xyz='0.2 0 0'/><geometry><sphere radius='0.03'/></geometry></collision>"
    assert SelfCollision(folded(folder, "bad", beside)).unknown == ("fore",)  # a part of a link is not the link


def test_no_more_than_so_many_meshes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solid_shapes, "_MOST_MESHES", 1)
    assert SelfCollision(folded(folder)).unknown == ("fore",)
    assert SelfCollision(folded(folder, "box")).known  # the same mesh again is no other


def test_a_packages_urdf_needs_no_meshes(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    robot = folded(folder)
    alone = tmp_path_factory.mktemp("package") / "robot.urdf"
    alone.write_bytes(urdf_without_meshes(robot.description))
    other = Robot(alone, robot.joint_names)
    assert other.description.kinematics == robot.description.kinematics and not other.description.solids.gaps
    q_BN = robot.sample(500, torch.Generator().manual_seed(0))
    one, two = (SelfCollision(each).near(q_BN, 0.05) for each in (robot, other))
    assert torch.equal(one.row_X, two.row_X) and torch.allclose(one.distance_X, two.distance_X, atol=1e-6)


def test_a_gap_stays_one_in_a_packages_urdf(folder: Path) -> None:
    robot = folded(folder, "none")
    alone = folder / "other" / "robot.urdf"
    alone.parent.mkdir()
    alone.write_bytes(urdf_without_meshes(robot.description))
    assert describe(alone).solids.gaps == {"fore"}


def test_what_overlaps_at_home_is_meant_to(folder: Path) -> None:
    """A ball around the whole arm touches the trunk wherever it is, and is not looked at; the forearm's own mesh is."""
    around = "<collision><origin xyz='-0.2 0 0'/><geometry><sphere radius='0.1'/></geometry></collision>"
    shapes = SelfCollision(folded(folder, more=around))
    assert not bool(shapes.collides(shapes.robot.home()[None]))


HAND = """<link name="hand"><visual><origin xyz="0.1 0 0"/><geometry>{looks}</geometry></visual>{more}</link>
<joint name="wrist" type="{kind}"><parent link="fore"/><child link="hand"/><origin xyz="0.2 0 0"/>{limit}</joint></robot>"""


def with_hand(folder: Path, looks: str, kind: str = "fixed", more: str = "", fore: str | None = None) -> Robot:
    path = folded(folder).urdf
    told = path.read_text() if fore is None else path.read_text().replace(MESH.format(x=0.2, name="rod"), fore)
    limit = "" if kind == "fixed" else LIMIT
    path.write_text(told.replace("</robot>", HAND.format(looks=looks, kind=kind, limit=limit, more=more)))
    return Robot(path, ["shoulder", "elbow"])


@pytest.mark.parametrize(
    ("looks", "kinds"),
    [
        ("<mesh filename='box.stl' scale='0.001 0.001 0.001'/>", {"capsule", "sphere"}),
        ("<box size='0.1 0.15 0.2'/>", {"box"}),
    ],
)
def test_hands_that_are_seen_and_collide_with_nothing_count(folder: Path, looks: str, kinds: set[str]) -> None:
    robot = with_hand(folder, looks)
    shapes = [shape for shape in robot.description.solids.shapes if shape.link == "hand"]
    assert len(shapes) == 1 and shapes[0].kind in kinds
    assert np.allclose(shapes[0].origin_44[:3, 3], [0.1, 0.0, 0.0], atol=0.01)
    assert "hand" in {name for pair in SelfCollision(robot).pairs for name in pair}


@pytest.mark.parametrize(
    "told",
    [
        {"kind": "revolute"},  # what moves by itself may be left out on purpose
        {"more": "<collision><geometry><sphere radius='0.01'/></geometry></collision>"},
        {"fore": ""},  # nor is it known of the forearm
    ],
)
def test_what_else_is_seen_does_not_count(folder: Path, told: dict[str, str]) -> None:
    robot = with_hand(folder, "<mesh filename='box.stl' scale='0.001 0.001 0.001'/>", **told)
    found = [shape for shape in robot.description.solids.shapes if shape.link == "hand"]
    assert len(found) == ("more" in told) and all(shape.kind == "sphere" for shape in found)


def test_a_hand_whose_mesh_is_not_there_leaves_no_gap(folder: Path) -> None:
    shapes = SelfCollision(with_hand(folder, "<mesh filename='none.stl'/>"))
    assert shapes.known and not shapes.uncovered


@pytest.mark.parametrize("meshes", [True, False])
def test_what_is_nearly_always_beside_a_hull_is_not_compared_with_it(tmp_path: Path, meshes: bool) -> None:
    """A wrist that reaches into a forearm, two joints on: hulls are closed, and known to some millimetres alone. Simple
    shapes are what they are.
    """

    def ball(radius: float, x: float = 0.0) -> str:
        trimesh.creation.icosphere(3, radius).export(tmp_path / f"{radius}.stl")
        shape = f"<mesh filename='{radius}.stl'/>" if meshes else f"<sphere radius='{radius}'/>"
        return f"<collision><origin xyz='{x} 0 0'/><geometry>{shape}</geometry></collision>"

    path = tmp_path / "toy.urdf"
    path.write_text(
        f"""<robot name="toy"><link name="fore">{ball(0.05)}</link><link name="twist"/>
        <link name="wrist">{ball(0.03)}{ball(0.06, 1.0)}</link>
        <joint name="a" type="revolute"><parent link="fore"/><child link="twist"/><origin xyz="0.082 0 0"/>{LIMIT}</joint>
        <joint name="b" type="revolute"><parent link="twist"/><child link="wrist"/>{LIMIT}</joint></robot>"""
    )
    shapes = SelfCollision(Robot(path, ["a", "b"]))
    assert (shapes.pairs == ()) == meshes and len(shapes.pairs) == (0 if meshes else 2)
