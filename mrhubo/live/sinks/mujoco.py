"""The robot in simulation: MuJoCo moves it by position control, under gravity, its base fixed or free.

Gains follow from what each joint has to move: its controller is critically damped, at one frequency for all joints, so
that light and heavy ones follow alike. https://mujoco.readthedocs.io/en/stable/modeling.html#position-servos

Legend: V degrees of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError, first_line, listed, shortened
from mrhubo.files.regular import check_regular
from mrhubo.lazy import import_optional
from mrhubo.live.floating_base import FloatingBase
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.turns import quaternion_of

_FREQUENCY = 10.0
"""Of every joint's controller [Hz]: gravity moves an arm of 0.3 m by half a degree."""
_ARMATURE = 1e-3
"""What each joint's motor adds to its inertia [kg m^2], where the model has none."""
_LEAST_MASS, _LEAST_INERTIA = 1e-3, 1e-6
"""Of links whose URDF has none [kg], [kg m^2]."""
_STEP = 0.002
_MAX_BYTES = 2**28
_ROBOT, _FLOOR = 1, 2
"""Bits of contact: the robot's shapes meet the floor, and not each other."""


class MujocoSink(NamedSink):
    """A simulation that goes on by one period with each output. `model` and `data` are MuJoCo's."""

    def __init__(self, model: Path | None = None, free: bool = False) -> None:
        """A simulation of a URDF or MJCF file.

        Args:
            model: the file; None: the robot's own URDF, where it is known.
            free: whether the base is free, above a floor; else it is fixed.

        Raises:
            UserError: MuJoCo is not installed, or there is no such file.
        """
        if model is not None:
            check_regular(model, _MAX_BYTES)
        self._mujoco = import_optional("mujoco", "--sink mujoco: needs MuJoCo: pip install 'mrhubo[mjcf]'")
        self._file, self._free = model, free
        self.model: Any = None
        self.data: Any = None
        self._loaded: Path | None = None
        """The file that `model` is of, between `check` and `close`."""
        self._actuator: np.ndarray = np.zeros(0, int)
        self._place: np.ndarray = np.zeros(0, int)
        self._others: list[tuple[int, int | None, float, float]] = []
        self._substeps = 1
        self._off: list[float] = [0.0, 0.0, 0.0]
        self._base_off: list[float] = []
        """How far the base has been from where it was told to be [m]: now, and at most; empty: it is fixed."""

    def check(self, joint_names: Sequence[str], urdf: Path | None) -> None:
        """Loads the model.

        Raises:
            UserError: none is known, it cannot be loaded, or lacks one of the robot's joints.
        """
        file = self._file or urdf
        if file is None:
            raise UserError("--sink mujoco: a package does not tell where the robot's model is; write mujoco:MODEL")
        if file != self._loaded:
            self.model, self._loaded = self._read(file), file
        number = self._controllers()
        missing = [name for name in joint_names if name not in number]
        if missing:
            raise UserError(f"{file}: has no joint {listed(missing)}; its joints: {listed(number)}")

    def _read(self, file: Path) -> Any:
        check_regular(file, _MAX_BYTES)
        self._mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log file where the user happens to be
        try:
            return self._load(file)
        except UserError:
            raise
        except Exception as error:  # ValueError and mujoco.FatalError, whose types differ between versions
            raise UserError(f"{file}: MuJoCo cannot load it: {shortened(first_line(error), 200)}") from error
        finally:
            self._mujoco.set_mju_user_warning(None)

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Loads the model, and puts the robot where it starts.

        Raises:
            UserError: as for `check`.
        """
        self.check(robot.joint_names, robot.urdf)
        self._substeps = max(1, round(1.0 / config.rate / _STEP))
        self.model.opt.timestep = 1.0 / config.rate / self._substeps
        self.data = self._mujoco.MjData(self.model)
        self._connect(robot)
        self._stand(robot)

    def _load(self, file: Path) -> Any:
        """The model, with a position controller for each joint that turns or slides."""
        mujoco = self._mujoco
        spec = mujoco.MjSpec.from_file(str(file))
        spec.compiler.fusestatic = False
        spec.compiler.boundmass, spec.compiler.boundinertia = _LEAST_MASS, _LEAST_INERTIA
        _drop_missing_meshes(spec, file)
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        for geom in spec.geoms:
            geom.contype, geom.conaffinity = _ROBOT, _FLOOR
        roots = list(spec.worldbody.bodies)
        has_free = any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints)
        if self._free:
            if not has_free and len(roots) == 1:
                roots[0].add_freejoint()
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1], contype=_FLOOR, conaffinity=_ROBOT
            )
        for joint in list(spec.joints):
            if joint.type == mujoco.mjtJoint.mjJNT_FREE:
                if not self._free:
                    spec.delete(joint)
                continue
            if joint.type == mujoco.mjtJoint.mjJNT_BALL:
                raise UserError(
                    f"{file}: joint '{shortened(joint.name)}' is a ball; joints that turn or slide are driven"
                )
            if not np.any(joint.armature):
                joint.armature = _ARMATURE
            spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_position(
                kp=1.0
            )
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        return spec.compile()

    def _controllers(self) -> dict[str, int]:
        """Each joint's."""
        kind = self._mujoco.mjtObj.mjOBJ_ACTUATOR
        return {self._mujoco.mj_id2name(self.model, kind, i): i for i in range(self.model.nu)}

    def _connect(self, robot: LiveRobot) -> None:
        """Which controller each joint has, and which joints follow another."""
        model, number = self.model, self._controllers()
        joint = model.actuator_trnid[:, 0]
        self._actuator = np.array([number[name] for name in robot.joint_names])
        self._place = model.jnt_qposadr[joint]
        column = {name: i for i, name in enumerate(robot.joint_names)}
        self._others = [
            (number[other.name], column.get(other.joint), other.multiplier, other.offset)
            for other in robot.facts.others
            if other.name in number
        ]

    def _stand(self, robot: LiveRobot) -> None:
        """The robot at home, on the floor, with gains for what its joints have to move."""
        model, data, mujoco = self.model, self.data, self._mujoco
        joint = model.actuator_trnid[:, 0]
        lower, upper = model.jnt_range[joint].T
        limited = model.jnt_limited[joint] > 0
        data.ctrl[:] = np.where(limited, np.clip(0.0, lower, upper), 0.0)
        self._aim(robot.home_N)
        data.qpos[self._place] = data.ctrl
        mujoco.mj_forward(model, data)
        if self._free and model.nq > model.nv:
            if robot.standing is not None:
                data.qpos[:7] = _home(robot)
                mujoco.mj_forward(model, data)
            data.qpos[2] -= _lowest(model, data, mujoco)
            mujoco.mj_forward(model, data)
        inertia_VV = np.zeros((model.nv, model.nv))
        _full_inertia(mujoco, model, data, inertia_VV)
        moved = np.diag(inertia_VV)[model.jnt_dofadr[joint]]
        frequency = 2 * math.pi * _FREQUENCY
        model.actuator_gainprm[:, 0] = frequency**2 * moved
        model.actuator_biasprm[:, 1], model.actuator_biasprm[:, 2] = -(frequency**2) * moved, -2 * frequency * moved

    def _aim(self, q_N: np.ndarray) -> None:
        self.data.ctrl[self._actuator] = q_N
        for actuator, column, multiplier, offset in self._others:
            self.data.ctrl[actuator] = offset + (0.0 if column is None else multiplier * q_N[column])

    def send(self, output: Output) -> None:
        """Goes on by one period.

        Raises:
            UserError: the simulation has become unstable.
        """
        if self.data is None:
            return
        self._aim(output.q_N)
        for _ in range(self._substeps):
            self._mujoco.mj_step(self.model, self.data)
        if not np.isfinite(self.data.qpos).all():
            raise UserError("--sink mujoco: the simulation has become unstable")
        if self._free and output.standing is not None:
            off = float(np.linalg.norm(self.data.qpos[:3] - output.standing.base.position_3))
            self._base_off = [off, max(self._base_off[1] if self._base_off else 0.0, off)]
        off_N = np.abs(self.joints - output.q_N)
        self._off = [self._off[0] + 1, self._off[1] + float(off_N.mean()), max(self._off[2], float(off_N.max()))]

    @property
    def joints(self) -> np.ndarray:
        """Where the robot's joints are in the simulation (N,) [rad]."""
        return self.data.qpos[self._place[self._actuator]].copy()

    def told(self) -> str:
        """How well the simulated robot has followed."""
        count, total, most = self._off
        said = f"mujoco: joints were off by {total / max(count, 1):.4f} rad on average, {most:.4f} at most"
        if self._base_off:
            said += "; the base, which is free, was {1:.3f} m off at most, {0:.3f} in the end".format(*self._base_off)
        return said

    def close(self) -> None:
        """`model` and `data` stay as they are."""
        self._loaded = None


def _drop_missing_meshes(spec: Any, file: Path) -> None:
    """Takes out shapes whose mesh files are not there: they are for looks, and what they collide with is lost too."""
    folder = file.parent / (spec.meshdir or spec.compiler.meshdir or "")
    gone = {mesh.name for mesh in spec.meshes if mesh.file and not (folder / mesh.file).is_file()}
    for geom in list(spec.geoms):
        if geom.meshname in gone:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in gone:
            spec.delete(mesh)


def _home(robot: LiveRobot) -> np.ndarray:
    """Where the base of a robot with legs is at home: position [m], quaternion with w first."""
    assert robot.standing is not None
    base = FloatingBase(robot.standing, robot.home_N, 1.0, 1.0).base
    return np.concatenate((base.place_3, quaternion_of(base.turn_33)))


def _lowest(model: Any, data: Any, mujoco: Any) -> float:
    """Height [m] of the lowest point of the robot's shapes, by their boxes; 0 where there are none."""
    heights = []
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        turn_33, box = data.geom_xmat[geom].reshape(3, 3), model.geom_aabb[geom]
        middle = data.geom_xpos[geom] + turn_33 @ box[:3]
        heights.append(float(middle[2] - np.abs(turn_33[2]) @ box[3:]))
    return min(heights, default=0.0)


def _full_inertia(mujoco: Any, model: Any, data: Any, out_VV: np.ndarray) -> None:
    """MuJoCo 4 changed the order of arguments."""
    if hasattr(data, "qM"):
        mujoco.mj_fullM(model, out_VV, data.qM)
    else:
        mujoco.mj_fullM(model, data, out_VV)
