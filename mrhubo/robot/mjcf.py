"""MuJoCo's models (MJCF) as URDF: links, joints, limits, and the shapes of links; MuJoCo itself reads them.

What has no meaning for a robot's kinematics is left out: actuators but for the ranges of positions, sensors, tendons,
contacts, lights, the floor. Meshes are named by their files and not loaded. Reference for elements and attributes:
https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError, first_line, listed, shortened
from mrhubo.lazy import import_optional
from mrhubo.robot.mjcf_bodies import Converted, UrdfWriter

_TINY = 1e-3
"""Size [m] of the sphere that stands for a mesh until its place is known."""
_HEAD = 1 << 20
"""Bytes in which the root element begins."""
_TURN, _FEWEST = 6.5, 4
"""A turn [rad], with some room, and how many joints a model must limit to tell the unit by it."""
_GROWING = ("replicate", "composite", "flexcomp", "flex", "plugin")
"""Elements that make many of one, or run somebody's library."""


def is_mjcf(path: Path) -> bool:
    """Whether a file is a MuJoCo model: its root element is <mujoco>."""
    if not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = io.BytesIO(file.read(_HEAD))  # of a file, lxml would take the name, which may not be UTF-8
        _, root = next(etree.iterparse(head, events=("start",), resolve_entities=False, no_network=True))
    except (OSError, StopIteration, etree.XMLSyntaxError):
        return False
    return root.tag == "mujoco"


def urdf_of_mjcf(path: Path, beside: Path) -> Converted:
    """A MuJoCo model as a URDF.

    Args:
        path: the model.
        beside: the folder that the URDF will lie in: meshes are named relative to it.

    Raises:
        UserError: MuJoCo is not installed or refuses the model, or there is no joint in it.
    """
    mujoco = import_optional(
        "mujoco", f"{path}: is a MuJoCo model, and MuJoCo is not installed: pip install 'mrhubo[mjcf]', or name a URDF"
    )
    _refuse_growing(path)
    mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log file where the user happens to be
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        ranges, notes = _commanded(spec, mujoco), []
        if spec.compiler.degree and _in_radians(spec, mujoco):
            spec.compiler.degree = False
            notes.append("limits are taken for radians, as no joint could move by as many degrees; "
                         'say so in the model: <compiler angle="radian"/>')  # fmt: skip
        meshes = _without_meshes(spec, path, beside, mujoco)
        model = spec.compile()
    except UserError:
        raise
    except Exception as error:  # ValueError and mujoco.FatalError, whose types differ between versions
        raise UserError(f"{path}: MuJoCo refuses the model: {shortened(first_line(error), 300)}") from error
    finally:
        mujoco.set_mju_user_warning(None)
    weighed = {body.id for body in spec.bodies if body.explicitinertial}
    open_ended = {model.joint(joint).name for joint in range(model.njnt) if not model.jnt_limited[joint]}
    ranges = {joint: limits for joint, limits in ranges.items() if joint in open_ended}
    if ranges:
        notes.append(f"joints without limits have their position actuators' ranges: {listed(ranges)}")
    return UrdfWriter(path, model, meshes, weighed, ranges, notes).converted()


def _in_radians(spec: Any, mujoco: Any) -> bool:
    """Whether all limits of joints that turn are within a turn in radians, where a model is read in degrees."""
    limits = [joint.range for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE and any(joint.range)]
    return len(limits) >= _FEWEST and max(float(abs(end)) for range_2 in limits for end in range_2) < _TURN


def _commanded(spec: Any, mujoco: Any) -> dict[str, tuple[float, float]]:
    """The positions [rad, m] to which actuators can send joints, by joint: many models limit these alone."""
    found: dict[str, tuple[float, float]] = {}
    for actuator in spec.actuators:
        gain, (offset, back, *_) = float(actuator.gainprm[0]), actuator.biasprm
        servo = actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE and gain > 0 and back == -gain and offset == 0
        low, high = sorted(float(end) / (actuator.gear[0] or 1.0) for end in actuator.ctrlrange)
        limited = actuator.ctrllimited != mujoco.mjtLimited.mjLIMITED_FALSE and low < high
        if servo and limited and actuator.trntype == mujoco.mjtTrn.mjTRN_JOINT:
            found[actuator.target] = (low, high)
    return found


def _refuse_growing(path: Path) -> None:
    """A stranger's file must not make a million bodies of one line, nor load libraries."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    try:
        if path.stat().st_size > 50_000_000:
            raise UserError(f"{path} has more than 50,000,000 bytes, which is the most that is read")
        root = etree.fromstring(path.read_bytes(), parser)
    except (OSError, etree.XMLSyntaxError) as error:
        raise UserError(f"{path} is no well-formed XML: {first_line(error)}") from error
    for tag in _GROWING:
        if root.find(f".//{tag}") is not None:
            raise UserError(f"{path}: has a <{tag}>, which no robot's links and joints need; take it out")


def _without_meshes(spec: Any, path: Path, beside: Path, mujoco: Any) -> dict[str, tuple[str, str]]:
    """Puts a tiny sphere in the place of every mesh, so that no file of meshes and pictures is needed; MuJoCo then
    works out its place. Returns file and scale by the name of the geom.
    """
    files = {mesh.name or Path(mesh.file).stem: mesh for mesh in spec.meshes}
    folder, found = Path(spec.modelfiledir or path.parent), {}
    for number, geom in enumerate(list(spec.geoms)):
        if not geom.meshname:
            continue
        mesh = files.get(geom.meshname)
        geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, [_TINY, 0, 0]
        geom.name, geom.meshname, geom.material = geom.name or f"mesh-{number}", "", ""
        if mesh is not None and mesh.file:
            place = folder / (spec.meshdir or "") / mesh.file
            scale = " ".join(f"{float(factor):.9g}" for factor in mesh.scale)
            found[geom.name] = os.path.relpath(place, beside), scale
    for geom in list(spec.geoms):
        geom.material = ""
        if geom.type == mujoco.mjtGeom.mjGEOM_HFIELD:  # ground that somebody walks on
            spec.delete(geom)
    for equality in list(spec.equalities):
        if equality.type == mujoco.mjtEq.mjEQ_TENDON:
            spec.delete(equality)
    for kind in ("skins", "keys", "sensors", "actuators", "tendons", "pairs", "excludes", "hfields", "materials",
                 "meshes", "textures", "cameras", "lights"):  # fmt: skip
        for element in list(getattr(spec, kind, ())):
            spec.delete(element)
    spec.compiler.boundmass, spec.compiler.boundinertia, spec.compiler.balanceinertia = 1e-6, 1e-9, True
    return found
