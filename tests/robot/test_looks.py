"""Of each link what its visual elements show is drawn, and what it collides with only where nothing else is there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mrhubo.robot import Robot
from mrhubo.robot.looks import Looks, read_looks
from mrhubo.robot.urdf import describe
from mrhubo.view.robot import RobotShape

FOOT = """<robot name="x">
<link name="shin">{shin}</link>
<joint name="ankle" type="revolute"><parent link="shin"/><child link="foot"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="foot">
  <visual><geometry><mesh filename="{foot}"/></geometry></visual>
  <collision><origin xyz="0.1 0 0"/><geometry><sphere radius="0.005"/></geometry></collision>
  <collision><origin xyz="-0.1 0 0"/><geometry><sphere radius="0.005"/></geometry></collision>
</link></robot>"""
BONE = '<{0}><geometry><box size="0.1 0.1 0.4"/></geometry></{0}>'
ROD = '<{0}><geometry><mesh filename="rod.stl"/></geometry></{0}>'


def looks(folder: Path, shin: str, foot: str = "foot.stl") -> Looks:
    trimesh.creation.box((0.25, 0.1, 0.05)).export(folder / "foot.stl")
    trimesh.creation.cylinder(0.04, 0.4).export(folder / "rod.stl")
    path = folder / "my.urdf"
    path.write_text(FOOT.format(shin=shin, foot=foot))
    return read_looks(describe(path))


def test_a_foot_is_its_mesh_and_not_the_points_on_which_it_stands(tmp_path: Path) -> None:
    found = looks(tmp_path, BONE.format("visual"))
    assert [mesh.link for mesh in found.meshes] == ["foot"]
    assert [(shape.link, shape.kind) for shape in found.shapes] == [("shin", "box")] and not found.sticks


def test_collision_shapes_stand_for_meshes_that_are_not_there(tmp_path: Path) -> None:
    found = looks(tmp_path, BONE.format("collision"), "none.stl")
    assert found.meshes == [] and [shape.kind for shape in found.shapes] == ["box", "sphere", "sphere"]


def test_meshes_and_shapes_beside_each_other(tmp_path: Path) -> None:
    found = looks(tmp_path, BONE.format("visual") + ROD.format("visual"))
    assert [mesh.link for mesh in found.meshes] == ["shin", "foot"] and [s.link for s in found.shapes] == ["shin"]
    found = looks(tmp_path, ROD.format("visual") + BONE.format("collision"))
    assert [mesh.link for mesh in found.meshes] == ["shin", "foot"] and found.shapes == []


@pytest.mark.parametrize(("foot", "drawn"), [("foot.stl", []), ("none.stl", ["guard"])])
def test_a_box_for_safety_hides_no_hand(tmp_path: Path, foot: str, drawn: list[str]) -> None:
    """A link that only collides, fixed to one that is seen, is not drawn, as no other program draws it."""
    looks(tmp_path, BONE.format("visual"), foot)
    path = tmp_path / "my.urdf"
    guard = """<link name="guard"><collision><geometry><box size="0.3 0.3 0.3"/></geometry></collision></link>
        <joint name="fixed" type="fixed"><parent link="foot"/><child link="guard"/></joint></robot>"""
    path.write_text(path.read_text().replace("</robot>", guard).replace('<sphere radius="0.005"/>', ""))
    found = read_looks(describe(path))
    assert [shape.link for shape in found.shapes if shape.link != "shin"] == drawn
    assert any(shape.link == "guard" for shape in describe(path).solids.shapes)


def test_the_figure_is_as_large_as_its_meshes(tmp_path: Path) -> None:
    looks(tmp_path, ROD.format("visual"))
    shape, ankle_44 = RobotShape(describe(tmp_path / "my.urdf")), np.eye(4)
    ankle_44[:3, 3] = [0.0, 0.0, -0.4]
    bounds = shape.coarser(0.45).solids({"shin": np.eye(4), "foot": ankle_44}).bounds()
    assert np.allclose(bounds, [[-0.125, -0.05, -0.425], [0.125, 0.05, 0.2]], atol=2e-3)
    with pytest.raises(ValueError, match="foot"):
        shape.solids({"shin": np.eye(4)})


def test_shipped_robots_have_what_they_had(root: Path) -> None:
    found = read_looks(Robot.from_config(root / "conf" / "nao.yaml").description)
    assert found.meshes == [] and len(found.shapes) > 30 and found.sticks == {}
