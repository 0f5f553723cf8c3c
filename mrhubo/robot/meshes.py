"""The meshes of a URDF's links: read where their files are, and passed over where they are not.

A file may come from anywhere: its kind, its size and the number of its triangles are bounded, and no further file that
it names (materials, textures) is opened. Legend: V vertices, F triangles.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
import yourdfpy

from mrhubo.errors import UserError
from mrhubo.files.regular import check_regular, read_regular
from mrhubo.robot.shapes import ROBOT_COLOR, Color, visual_colors

_KINDS = ("stl", "obj", "ply", "dae")
_MOST_BYTES = 50_000_000
MOST_TRIANGLES = 2_000_000
"""Of one mesh, and of all that a robot has; the last one may go beyond."""
_MOST_METRES = 1e3
_MOST_FOLDERS = 12
"""Of a mesh's name, from its end, that are looked for above a URDF."""


@dataclass(frozen=True)
class LinkMesh:
    """A mesh of a link, in the link's frame."""

    link: str
    vertices_V3: np.ndarray
    """Metres."""
    faces_F3: np.ndarray
    """Numbers of vertices."""
    color: Color = ROBOT_COLOR
    """RGB, 0..1: of the element's material; what colours the file itself has are not read."""


def read_meshes(urdf: yourdfpy.URDF, path: Path, without: Collection[str] = ()) -> list[LinkMesh]:
    """The meshes of every link's visual elements, or, where these have none to be read, of its collision elements.

    Args:
        urdf: what yourdfpy has made of the robot.
        path: its file: meshes are looked for beside it, and in the folders above it.
        without: links whose meshes are not wanted.
    """
    found: list[LinkMesh] = []
    triangles, colors_of = 0, visual_colors(urdf)
    for link in urdf.robot.links:
        for elements in (link.visuals, link.collisions):
            meshes = [] if link.name in without else list(_meshes(link.name, elements, colors_of[link.name], path))
            if meshes:
                found += meshes
                triangles += sum(len(mesh.faces_F3) for mesh in meshes)
                break
        if triangles > MOST_TRIANGLES:
            break
    return found


def _meshes(
    link: str,
    elements: list[yourdfpy.urdf.Visual] | list[yourdfpy.urdf.Collision],
    colors: list[Color | None],
    path: Path,
) -> Iterator[LinkMesh]:
    named = next((color for color in colors if color is not None), ROBOT_COLOR)
    for number, element in enumerate(elements):
        mesh = None if element.geometry is None else element.geometry.mesh
        if mesh is None or (found := read_mesh(str(mesh.filename), path, scale_of(mesh))) is None:
            continue
        place_44 = np.eye(4) if element.origin is None else np.asarray(element.origin, float)
        color = (colors[number] if isinstance(element, yourdfpy.urdf.Visual) else None) or named
        yield LinkMesh(link, found[0] @ place_44[:3, :3].T + place_44[:3, 3], found[1], color)


def scale_of(mesh: yourdfpy.urdf.Mesh) -> np.ndarray:
    """How much larger (3,) a URDF wants a mesh than its file has it."""
    return np.ones(3) if mesh.scale is None else np.broadcast_to(np.asarray(mesh.scale, float), (3,))


def read_mesh(name: str, path: Path, scale_3: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (V, 3) [m] and triangles (F, 3) of the mesh that the URDF `path` names; None where it cannot be used."""
    file = find_mesh(name, path)
    found = None if file is None else _read(file)
    if found is None:
        return None
    vertices_V3 = found[0] * scale_3
    usable = np.isfinite(vertices_V3).all() and np.abs(vertices_V3).max() < _MOST_METRES
    return (vertices_V3, found[1]) if usable else None


def find_mesh(name: str, path: Path) -> Path | None:
    """The file that a URDF names as a mesh; None where it is not to be found.

    Args:
        name: `meshes/arm.stl`, `package://PACKAGE/...`, or `file://...`. What is not where the name says, from the URDF
            on, is looked for by as much of the name's end as any folder above the URDF has: a package, or a folder of
            somebody else's machine, may have been copied anywhere.
        path: the URDF.
    """
    rest = name.rpartition("://")[2].replace("\\", "/")
    parts = [part for part in rest.split("/") if part not in ("", ".", "..")][-_MOST_FOLDERS:]
    tails = ("/".join(parts[first:]) for first in range(len(parts)))
    places = (folder / tail for tail in tails for folder in path.absolute().parents)
    return next((place for place in chain([path.parent / rest], places) if _is_file(place)), None)


def _is_file(place: Path) -> bool:
    try:
        return place.is_file()
    except OSError:  # a name that no file can have
        return False


def _read(file: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (V, 3) and triangles (F, 3) of a file; None where it cannot be used."""
    kind = file.suffix.lower().removeprefix(".")
    if kind not in _KINDS:
        return None
    import trimesh

    log, level = logging.getLogger("trimesh"), logging.getLogger("trimesh").level
    log.setLevel(logging.CRITICAL)
    try:
        if check_regular(file) > _MOST_BYTES:
            return None
        loaded = trimesh.load_mesh(io.BytesIO(read_regular(file)), file_type=kind, process=False, skip_materials=True)
        vertices_V3, faces_F3 = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, int)
    except UserError:
        return None
    except Exception:  # whatever a parser makes of a damaged file: looks are not worth a word
        return None
    finally:
        log.setLevel(level)
    usable = vertices_V3.ndim == 2 and faces_F3.ndim == 2 and 0 < len(faces_F3) <= MOST_TRIANGLES
    return (vertices_V3, faces_F3) if usable and 0 <= faces_F3.min() and faces_F3.max() < len(vertices_V3) else None
