"""Files of meshes: found, and read within bounds, where they are there.

A file may come from anywhere: its kind, its size and the number of its triangles are bounded, and no further file that
it names (materials, textures) is opened. Legend: V vertices, F triangles.
"""

from __future__ import annotations

import io
import logging
import math
import re
from itertools import chain
from pathlib import Path

import numpy as np
import yourdfpy

from mrhubo.errors import UserError
from mrhubo.files.regular import check_regular, read_regular

_KINDS = ("stl", "obj", "ply", "dae")
_MOST_BYTES = 50_000_000
MOST_TRIANGLES = 2_000_000
"""Of one mesh, and of all that a robot has; the last one may go beyond."""
_MOST_METRES = 1e3
_MOST_FOLDERS = 12
"""Of a mesh's name, from its end, that are looked for above a URDF."""
_HEAD = 100_000
"""Bytes from the beginning of a COLLADA file in which its unit and its axes are told."""
_UNIT = re.compile(rb"""<unit\b[^>]*\bmeter\s*=\s*["']([^"']+)""")
_Y_UP = re.compile(rb"<up_axis>\s*Y_UP")
UPRIGHT_33 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Turns y up to z up."""


def mesh_of(element: yourdfpy.urdf.Visual | yourdfpy.urdf.Collision) -> yourdfpy.urdf.Mesh | None:
    """The mesh that an element of a link is; None where it is another shape, or none."""
    return None if element.geometry is None else element.geometry.mesh


def scale_of(mesh: yourdfpy.urdf.Mesh) -> np.ndarray:
    """How much larger (3,) a URDF wants a mesh than its file has it."""
    return np.ones(3) if mesh.scale is None else np.broadcast_to(np.asarray(mesh.scale, float), (3,))


def read_mesh(
    name: str, path: Path, scale_3: np.ndarray, upright: bool = False
) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (V, 3) [m] and triangles (F, 3) of the mesh that the URDF `path` names; None where it cannot be used.
    `upright`: whether a COLLADA file whose y is up is turned, so that its z is (`mrhubo.robot.mesh_axes`).
    """
    file = find_mesh(name, path)
    found = None if file is None else _read(file, upright)
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
            somebody else's machine, may have been copied anywhere. The file's own name alone counts beside the URDF:
            farther away it may be another robot's.
        path: the URDF.
    """
    rest = name.rpartition("://")[2].replace("\\", "/")
    parts = [part for part in rest.split("/") if part not in ("", ".", "..")][-_MOST_FOLDERS:]
    tails = ("/".join(parts[first:]) for first in range(len(parts) - 1))
    places = (folder / tail for tail in tails for folder in path.absolute().parents)
    beside = (path.parent / name for name in parts[-1:])
    return next((place for place in chain([path.parent / rest], places, beside) if _is_file(place)), None)


def _is_file(place: Path) -> bool:
    try:
        return place.is_file()
    except OSError:  # a name that no file can have
        return False


def is_y_up(name: str, path: Path) -> bool:
    """Whether the mesh that the URDF `path` names is a COLLADA file that says that its y is up."""
    file = find_mesh(name, path) if name.lower().endswith(".dae") else None
    if file is None:
        return False
    try:
        check_regular(file)
        with file.open("rb") as opened:
            return _Y_UP.search(opened.read(_HEAD)) is not None
    except (OSError, UserError):
        return False


def _read(file: Path, upright: bool) -> tuple[np.ndarray, np.ndarray] | None:
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
        content = read_regular(file)
        loaded = trimesh.load_mesh(io.BytesIO(content), file_type=kind, process=False, skip_materials=True)
        vertices_V3, faces_F3 = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, int)
        if kind == "dae":
            vertices_V3 = vertices_V3 * _metres_of(content[:_HEAD])
            if upright and _Y_UP.search(content[:_HEAD]):
                vertices_V3 = vertices_V3 @ UPRIGHT_33.T
    except UserError:
        return None
    except Exception:  # whatever a parser makes of a damaged file: looks are not worth a word
        return None
    finally:
        log.setLevel(level)
    usable = vertices_V3.ndim == 2 and faces_F3.ndim == 2 and 0 < len(faces_F3) <= MOST_TRIANGLES
    return (vertices_V3, faces_F3) if usable and 0 <= faces_F3.min() and faces_F3.max() < len(vertices_V3) else None


def _metres_of(head: bytes) -> float:
    """Metres of the unit of a COLLADA file, by its beginning."""
    told = _UNIT.search(head)
    try:
        metres = float(told.group(1)) if told else 1.0
    except ValueError:
        return 1.0
    return metres if math.isfinite(metres) and metres > 0.0 else 1.0
