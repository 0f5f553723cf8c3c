"""Meshes are read where they are, in the link's frame, and passed over wherever anything about them is wrong."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.exchange.dae import export_collada

from mrhubo.robot import mesh_files, meshes
from mrhubo.robot.mesh_files import find_mesh
from mrhubo.robot.meshes import read_meshes
from mrhubo.robot.urdf import describe

LINK = '<robot name="x"><link name="a"><visual><origin xyz="0 0 1" rpy="0 0 1.5707963"/><geometry>{}</geometry></visual></link></robot>'


def read(folder: Path, name: str = "meshes/box.stl", scale: str = 'scale="0.001 0.002 0.001"') -> list[meshes.LinkMesh]:
    path = folder / "my.urdf"
    path.write_text(LINK.format(f'<mesh filename="{name}" {scale}/>'))
    return read_meshes(describe(path))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "robot" / "meshes").mkdir(parents=True)
    for kind in ("stl", "obj", "ply"):
        trimesh.creation.box((100.0, 200.0, 300.0)).export(tmp_path / "robot" / "meshes" / f"box.{kind}")
    return tmp_path / "robot"


@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
def test_vertices_are_scaled_and_placed(folder: Path, kind: str) -> None:
    (mesh,) = read(folder, f"meshes/box.{kind}")
    assert mesh.link == "a" and len(mesh.faces_F3) == 12
    # 0.1 x 0.4 x 0.3 m, turned by a quarter about z, then raised by 1 m
    assert np.allclose(mesh.vertices_V3.min(axis=0), [-0.2, -0.05, 0.85], atol=1e-6)
    assert np.allclose(mesh.vertices_V3.max(axis=0), [0.2, 0.05, 1.15], atol=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "robots/robot/meshes/box.stl",  # from a folder above, as a program that is started there takes it
        "file:///home/somebody/ws/src/robot/meshes/box.stl",
        "/home/somebody/ws/src/other/meshes/box.stl",
        "C:\\ws\\robot\\meshes\\box.stl",
        "model://robot/meshes/box.stl",
        "package:///meshes/box.stl",
        "../../elsewhere/meshes/box.stl",
    ],
)
def test_a_mesh_is_found_by_the_end_of_its_name(folder: Path, name: str) -> None:
    deep = folder / "urdf" / "my.urdf"
    deep.parent.mkdir()
    found = find_mesh(name, deep)
    assert found is not None and found.samefile(folder / "meshes" / "box.stl")


def test_more_of_a_name_counts_more_than_a_nearer_folder(folder: Path) -> None:
    near = folder / "urdf" / "box.stl"
    near.parent.mkdir()
    near.write_bytes(b"")
    found = find_mesh("package://any/meshes/box.stl", near.with_name("my.urdf"))
    assert found is not None and found.samefile(folder / "meshes" / "box.stl")


def test_a_files_own_name_counts_beside_the_urdf_alone(folder: Path) -> None:
    (folder / "box.stl").write_bytes(b"")
    deep = folder / "urdf" / "my.urdf"
    deep.parent.mkdir()
    assert find_mesh("package://any/visual/box.stl", deep) is None
    beside = deep.with_name("box.stl")
    beside.write_bytes(b"")
    found = find_mesh("package://any/visual/box.stl", deep)
    assert found is not None and found.samefile(beside)


def test_packages_are_looked_for_above_the_urdf(folder: Path) -> None:
    place = folder / "meshes" / "box.stl"
    deep = folder / "urdf" / "more" / "my.urdf"
    deep.parent.mkdir(parents=True)
    for name in (
        "package://robot/meshes/box.stl", "package://any/meshes/box.stl", "../../meshes/box.stl", f"file://{place}",
    ):  # fmt: skip
        found = find_mesh(name, deep)
        assert found is not None and found.samefile(place), name
    for name in ("package://robot/meshes/none.stl", "", "package://", "a\0b", "x" * 5000, "."):
        assert find_mesh(name, deep) is None


@pytest.mark.parametrize("content", [b"", b"solid x", b"\x00" * 84, b"junk" * 100, b"\xff" * 200])
@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "dae"])
def test_damaged_files_are_passed_over(folder: Path, kind: str, content: bytes) -> None:
    (folder / f"bad.{kind}").write_bytes(content)
    assert read(folder, f"bad.{kind}") == []


def test_what_is_too_large_or_of_another_kind_is_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "box.glb").write_bytes(b"glTF")
    assert read(folder, "box.glb") == read(folder, "none.stl") == []
    assert read(folder, scale='scale="1e6 1e6 1e6"') == []
    monkeypatch.setattr(mesh_files, "_MOST_BYTES", 10)
    assert read(folder) == []


def test_materials_are_not_opened(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "box.obj").write_text("mtllib looks.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "looks.mtl").write_text("newmtl a\nmap_Kd picture.png\n")
    opened: list[str] = []
    real = io.open
    monkeypatch.setattr(
        io, "open", lambda file, *rest, **more: (opened.append(str(file)), real(file, *rest, **more))[1]
    )
    assert len(read(folder, "box.obj", "")) == 1
    assert not any("looks.mtl" in name or "picture" in name for name in opened)


def collada(file: Path, mesh: trimesh.Trimesh, asset: str) -> None:
    """Writes a mesh with a unit and axes of our own."""
    text = export_collada(mesh).decode()
    start, end = text.index("<asset"), text.index("</asset>")
    file.write_text(f"{text[:start]}<asset>{asset}{text[end:]}")


@pytest.mark.parametrize(
    ("unit", "size"), [("0.0254", 2.54), ("1", 100.0), ("0", 100.0), ("nan", 100.0), ("a", 100.0), (None, 100.0)]
)
def test_the_unit_of_a_collada_file_counts(folder: Path, unit: str | None, size: float) -> None:
    """By ROS, too: what is no length is a metre."""
    told = "" if unit is None else f'<unit name="inch" meter="{unit}"/>'
    collada(folder / "box.dae", trimesh.creation.box((100.0, 200.0, 300.0)), told + "<up_axis>Z_UP</up_axis>")
    (mesh,) = read(folder, "box.dae", "")
    assert np.allclose(np.ptp(mesh.vertices_V3, axis=0), [2 * size, size, 3 * size], rtol=1e-5)


@pytest.mark.parametrize("meant", [False, True])
@pytest.mark.parametrize("collides", [False, True])
def test_meshes_with_y_up_lie_around_their_joints(tmp_path: Path, meant: bool, collides: bool) -> None:
    """Whether the author's program turns them or not. An arm of three links, each a rod along its z from joint to
    joint, drawn along y where it is turned.
    """
    rod = trimesh.creation.cylinder(0.03, 0.3)
    rod.apply_translation([0.0, 0.0, -0.15])
    if meant:
        rod.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    collada(tmp_path / "rod.dae", rod, "<up_axis>Y_UP</up_axis>")
    word = "collision" if collides else "visual"
    links = [f"<link name='l{i}'><{word}><geometry><mesh filename='rod.dae'/></geometry></{word}></link>" for i in range(4)]  # fmt: skip
    joints = [
        f"<joint name='j{i}' type='revolute'><parent link='l{i}'/><child link='l{i + 1}'/><origin xyz='0 0 -0.3'/>"
        "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
        for i in range(3)
    ]
    path = tmp_path / "arm.urdf"
    path.write_text(f"<robot name='arm'>{''.join(links + joints)}</robot>")
    description = describe(path)
    found = read_meshes(description)
    assert len(found) == 4
    for mesh in found:
        assert np.allclose(mesh.vertices_V3.min(axis=0), [-0.03, -0.03, -0.3], atol=1e-3)
        assert np.allclose(mesh.vertices_V3.max(axis=0), [0.03, 0.03, 0.0], atol=1e-3)
    if collides:
        assert all(abs(shape.origin_44[2, 3] + 0.15) < 0.02 for shape in description.solids.shapes)
