"""Whole-body motions as MuJoCo sees them: what the floor and the motors would have to do, and how long a robot stands.

    python benchmarks/physics.py [--robots g1] [--clips 16_15,02_06 | all | FOLDER] [--own wave,stretch] [--rate 60]
        [--balance 0]

Robots are shipped as conf/ROBOT-whole-body.yaml, or the path of a config; their URDFs have to tell masses (`g1`
does; `nao` and `coman` do not, and MuJoCo refuses one of `romeo`'s). `--balance`: `robot.balance`. Two tables a robot:

The optimiser's answers to clips, played as they are. Depth is that of the deepest contact of sole and floor. By inverse
dynamics, the floor has to hold the robot with a force (share of its weight) and at a point (ZMP): `in flight` are
frames in which it would have to pull; `supported`, of the frames in which the robot's own feet are planted, those whose
ZMP is under planted feet or within 2 cm of them. `effort` is the torque that joints need by what the URDF allows (99th
percentile of the frames' highest), with ankles and all. `balanced`, of the frames in which the person stands still,
are those in which the centre of mass is over planted feet.

Motions of the upper body, above legs that stand straight: the robot is free, every joint has a position controller
whose torque is the highest the URDF allows from 0.2 rad on, with damping, and nothing balances. Seconds until its base
is tilted by 45 degrees, of how many.

MuJoCo: `pip install 'mrhubo[mjcf]'`. Accelerations are central differences; https://mujoco.readthedocs.io/en/stable/
computation/index.html#inverse-dynamics.
"""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import torch
from common import print_header, print_table, read_options, whole_body_clips
from scipy.spatial import ConvexHull, QhullError

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.errors import InputWarning, first_line
from mrhubo.lazy import import_optional
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.reference import OptimizationResult, OptimizationRetargeter
from mrhubo.reference.standing import Legs, read_steps
from mrhubo.reference.standing.balance import stillness
from mrhubo.robot import Robot

_OWN = Path("data/motions")
_UPPER_BODY = "wave,pointing,conversation,directing_traffic,bow_and_greet"
_GRAVITY = 9.81
_NEAR_M = 0.02
"""How far from planted soles a ZMP may be."""
_FULL_RAD, _DAMPING_S, _STEP_S = 0.2, 0.1, 0.002
"""From which error on a controller does what its motor can; its damping by its stiffness."""
_EFFORT_NM = 50.0
"""Of joints whose limits the URDF does not tell."""
_FALLEN = math.cos(math.radians(45))


def main(argv: list[str]) -> None:
    """Prints two tables a robot."""
    options, rest = read_options(argv, robots="g1", clips="all", own=_UPPER_BODY, rate="60", balance="0")
    if rest:
        sys.exit(f"{rest[0]}: is unknown")
    mujoco = import_optional("mujoco", "benchmarks/physics.py needs MuJoCo: pip install 'mrhubo[mjcf]'")
    torch.set_num_threads(1)
    print_header()
    for name in options["robots"].split(","):
        config = name if name.endswith(".yaml") else f"conf/{name}-whole-body.yaml"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)  # collision meshes that are not there
            robot = Robot.from_config(config)
            robot.balance = float(options["balance"])
            retargeter = OptimizationRetargeter(robot)
        simulated = Simulated(mujoco, retargeter)
        motions = [resample(read_motion(path), float(options["rate"])) for path in whole_body_clips(options["clips"])]
        rows = [[motion.name, *simulated.played(motion)] for motion in motions]
        print(f"## {Path(name).stem}, {simulated.mass:.1f} kg: clips played as they are\n")
        print_table(["clip", "depth [cm]", "force, median", "force, p99", "in flight", "supported", "effort, p99",
                     "balanced"],
                    [[row[0], *simulated.told(row[1:])] for row in rows]
                    + [["mean", *simulated.told(np.nanmean([row[1:] for row in rows], axis=0))]])  # fmt: skip
        print(f"\n## {Path(name).stem}: standing, with controllers alone\n")
        standing = [
            _standing(read_motion(_OWN / f"{own}.npz"), float(options["rate"])) for own in options["own"].split(",")
        ]
        print_table(
            ["motion", "stands [s]", "of [s]"],
            [
                [motion.name, f"{simulated.stands(motion):.1f}", f"{len(motion) / motion.frame_rate:.1f}"]
                for motion in standing
            ],
        )
        print()


class Simulated:
    """A robot with feet in MuJoCo, free above a floor, with a controller for each joint."""

    def __init__(self, mujoco: Any, retargeter: OptimizationRetargeter) -> None:
        self.mujoco, self.retargeter, self.legs = mujoco, retargeter, Legs(retargeter.body_map)
        robot = retargeter.body_map.robot
        if not self.legs.has_feet:
            sys.exit(f"{robot.urdf}: the robot has no feet that stand")
        if "<inertial" not in Path(robot.urdf).read_text(encoding="utf-8"):
            sys.exit(f"{robot.urdf}: tells no masses, so there is nothing to simulate; g1's does")
        self.model = self._load(Path(robot.urdf))
        self.data = mujoco.MjData(self.model)
        self.mass = float(self.model.body_mass.sum())
        numbers = [mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in robot.joint_names]
        self.place_N, self.speed_N = self.model.jnt_qposadr[numbers], self.model.jnt_dofadr[numbers]
        self.control_N = [
            mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in robot.joint_names
        ]
        effort_N = self.model.jnt_actfrcrange[numbers, 1]
        self.effort_N = np.where(effort_N > 0, effort_N, np.inf)

    def _load(self, urdf: Path) -> Any:
        mujoco = self.mujoco
        mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log file into the current folder
        spec = mujoco.MjSpec.from_file(str(urdf))
        spec.compiler.fusestatic = False
        spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-9
        for geom in [geom for geom in spec.geoms if geom.meshname]:
            spec.delete(geom)  # soles are shapes; meshes are seldom there
        for mesh in list(spec.meshes):
            spec.delete(mesh)
        for geom in spec.geoms:
            geom.contype, geom.conaffinity = 1, 2
        soles = {link for sole in self.legs.soles for link in [sole.link]}
        for body in [body for body in spec.bodies if body.name in soles and not list(body.geoms)]:
            sole = next(sole for sole in self.legs.soles if sole.link == body.name)
            for ball in sole.balls_K4.tolist():
                radius = max(ball[3], 0.002)
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], pos=ball[:3], contype=1,
                              conaffinity=2, mass=0.0)  # fmt: skip
        if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints):
            spec.worldbody.first_body().add_freejoint()
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 0.1], contype=2, conaffinity=1, name="floor"
        )
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        for joint in [joint for joint in spec.joints if joint.type != mujoco.mjtJoint.mjJNT_FREE]:
            most = float(joint.actfrcrange[1]) or _EFFORT_NM
            stiff = most / _FULL_RAD
            actuator = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            actuator.set_to_position(kp=stiff, kv=_DAMPING_S * stiff)
            actuator.forcelimited, actuator.forcerange = True, [-most, most]
        spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, _STEP_S
        try:
            return spec.compile()
        except ValueError as error:
            sys.exit(f"{urdf}: MuJoCo cannot load it: {first_line(error)}")

    def played(self, motion: Motion) -> list[float]:
        """Depth [m], force (median, p99), in flight, supported, effort, balanced."""
        result = self.retargeter(motion)
        place_TQ, rate = self._places(result), motion.frame_rate
        speed_TV = np.zeros((len(place_TQ), self.model.nv))
        for t in range(len(place_TQ)):
            early, late = max(t - 1, 0), min(t + 1, len(place_TQ) - 1)
            seconds = max(late - early, 1) / rate
            self.mujoco.mj_differentiatePos(self.model, speed_TV[t], seconds, place_TQ[early], place_TQ[late])
        turned_TV = np.gradient(speed_TV, 1 / rate, axis=0)
        depth, wrench_T6, effort_T = 0.0, np.zeros((len(place_TQ), 6)), np.zeros(len(place_TQ))
        mass_T3 = np.zeros((len(place_TQ), 3))
        for t in range(1, len(place_TQ) - 1):
            data = self.data
            data.qpos[:], data.qvel[:], data.qacc[:] = place_TQ[t], speed_TV[t], turned_TV[t]
            self.model.opt.disableflags = 0
            self.mujoco.mj_fwdPosition(self.model, data)
            depth = max(depth, -float(data.contact.dist.min(initial=0.0)))
            mass_T3[t] = data.subtree_com[1]
            self.model.opt.disableflags = int(self.mujoco.mjtDisableBit.mjDSBL_CONTACT)
            self.mujoco.mj_inverse(self.model, data)
            wrench_T6[t] = data.qfrc_inverse[:6]
            wrench_T6[t, 3:] = data.xmat[1].reshape(3, 3) @ data.qfrc_inverse[3:6]  # a free joint turns in its own axes
            effort_T[t] = float((np.abs(data.qfrc_inverse[self.speed_N]) / self.effort_N).max())
        inner = slice(1, -1)
        force_T3, torque_T3 = wrench_T6[inner, :3], wrench_T6[inner, 3:]
        share_T = force_T3[:, 2] / (self.mass * _GRAVITY)
        zmp_T2 = _zero_moment(place_TQ[inner, :3], force_T3, torque_T3)
        steps = read_steps(motion, motion.for_skeleton(self.retargeter.body_map.skeleton).local_TJ33, self.legs)
        assert steps is not None
        still_T = stillness(steps)[inner] > 0.5
        return [
            depth,
            float(np.median(share_T)),
            float(np.percentile(share_T, 99)),
            float((share_T < 0).mean()),
            self._supported(result, zmp_T2, inner, _NEAR_M, np.full(len(zmp_T2), True)),
            float(np.percentile(effort_T[inner], 99)),
            self._supported(result, mass_T3[inner, :2], inner, 0.0, still_T),
        ]

    def _places(self, result: OptimizationResult) -> np.ndarray:
        """`qpos` of every frame."""
        assert result.root_position is not None and result.root_quaternion_wxyz is not None
        place_TQ = np.tile(self.model.qpos0, (len(result.q), 1))
        place_TQ[:, :3], place_TQ[:, 3:7] = result.root_position.numpy(), result.root_quaternion_wxyz.numpy()
        place_TQ[:, self.place_N] = result.q.numpy()
        return place_TQ

    def _supported(
        self, result: OptimizationResult, point_T2: np.ndarray, inner: slice, near: float, counts_T: np.ndarray
    ) -> float:
        """Share of the frames with planted feet, of those that count, whose points are over these, or so near [m]."""
        assert result.contact is not None and result.root_position is not None
        assert result.root_quaternion_wxyz is not None
        base_T33 = rotation.wxyz_to_matrix(result.root_quaternion_wxyz)
        poses = self.retargeter.body_map.robot.forward(result.q)
        ball_TK2 = self.legs.on_floor(poses, result.root_position, base_T33).ball_BK3[..., :2].double().numpy()[inner]
        foot_K = np.repeat(np.arange(len(self.legs.soles)), [len(sole.balls_K4) for sole in self.legs.soles])
        planted_TS = result.contact.numpy()[inner]
        found = [
            _off(ball_K2[planted_S[foot_K]], point_2) <= near
            for ball_K2, planted_S, point_2, counts in zip(ball_TK2, planted_TS, point_T2, counts_T, strict=True)
            if planted_S.any() and counts
        ]
        return float(np.mean(found)) if found else float("nan")

    def stands(self, motion: Motion) -> float:
        """Seconds until it has fallen, or the motion is over."""
        mujoco, model, data = self.mujoco, self.model, self.data
        result = self.retargeter(motion)
        place_TQ = self._places(result)
        model.opt.disableflags = 0
        mujoco.mj_resetData(model, data)
        data.qpos[:] = place_TQ[0]
        mujoco.mj_forward(model, data)
        upright_3 = data.xmat[1].reshape(3, 3).T @ [0, 0, 1]
        steps = round(len(place_TQ) / motion.frame_rate / _STEP_S)
        for step in range(steps):
            time = step * _STEP_S * motion.frame_rate
            early = min(int(time), len(place_TQ) - 1)
            late = min(early + 1, len(place_TQ) - 1)
            wanted_N = place_TQ[early, self.place_N] * (1 - time % 1) + place_TQ[late, self.place_N] * (time % 1)
            data.ctrl[self.control_N] = wanted_N
            mujoco.mj_step(model, data)
            if float((data.xmat[1].reshape(3, 3) @ upright_3)[2]) < _FALLEN:
                return step * _STEP_S
        return steps * _STEP_S

    @staticmethod
    def told(values: Any) -> list[str]:
        """What `played` found, as the table has it."""
        depth, median, most, flight, supported, effort, balanced = values
        return [f"{100 * depth:.2f}", f"{median:.2f}", f"{most:.2f}", f"{flight:.1%}", f"{supported:.0%}",
                f"{effort:.2f}", "-" if balanced != balanced else f"{balanced:.0%}"]  # fmt: skip


def _zero_moment(place_T3: np.ndarray, force_T3: np.ndarray, torque_T3: np.ndarray) -> np.ndarray:
    """Where on the floor (T, 2) [m] a force alone does what a force and torque at a place do."""
    up_T = np.where(np.abs(force_T3[:, 2]) < 1e-6, np.nan, force_T3[:, 2])
    x_T = (-torque_T3[:, 1] - place_T3[:, 2] * force_T3[:, 0]) / up_T
    y_T = (torque_T3[:, 0] - place_T3[:, 2] * force_T3[:, 1]) / up_T
    return place_T3[:, :2] + np.stack((x_T, y_T), axis=1)


def _off(ball_K2: np.ndarray, point_2: np.ndarray) -> float:
    """How far [m] a point is outside of the hull of others; infinite where it is nowhere."""
    if not np.isfinite(point_2).all():
        return math.inf
    try:
        planes = ConvexHull(ball_K2).equations
    except QhullError:  # on one line
        return float(np.linalg.norm(ball_K2 - point_2, axis=1).min())
    return float((planes[:, :2] @ point_2 + planes[:, 2]).max())


def _standing(motion: Motion, rate: float) -> Motion:
    """A motion of the upper body above legs that stand straight."""
    motion = resample(motion, rate)
    lowest_T = Skeleton().keypoints(motion.local_TJ33)[..., 1].amin(dim=1)
    place_T3 = torch.zeros(len(motion), 3)
    place_T3[:, 1] = -lowest_T
    return motion.changed(root_rotation_T33=torch.eye(3).repeat(len(motion), 1, 1), root_position_T3=place_T3)


if __name__ == "__main__":
    main(sys.argv[1:])
