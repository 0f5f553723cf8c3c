"""The two forms of the run-time path behind one set of methods.

Legend: B frames, J = 21 posed joints, D directions, M measured ones, N joints, X branches.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.description import Description
from mrhubo.fast.plain import collision, human, judging, networks, robot, steps
from mrhubo.fast.plain.avoidance import Avoidance
from mrhubo.fast.poses import NOT_FINITE

FORMS = ("compiled", "numpy")
_NO_ROTATION = "a matrix that is no rotation"
SKEW = 1e-2
"""How far R^T R may be from the identity, as for `mrhubo.motion.read_poses`."""
_CHUNK = 2_048
"""Frames that are worked on at a time."""
_FEW = 32
"""Up to so many frames, the compiled form goes through networks frame by frame; beyond, matrices are quicker."""


@dataclass(frozen=True)
class Answers:
    """What `mrhubo.robot_motion.RobotMotion` says of each frame (B)."""

    q_BN: np.ndarray
    error_BM: np.ndarray
    phi_B: np.ndarray
    collision_B: np.ndarray
    trust_BX: np.ndarray

    @classmethod
    def empty(cls, description: Description, frames: int) -> Answers:
        """Room for the answers to some frames."""
        trust = description.trust
        shapes = (len(description.cost.lower_N),), (len(trust.measured),), ()
        q_BN, error_BM, phi_B = (np.zeros((frames, *shape), np.float32) for shape in shapes)
        return cls(
            q_BN, error_BM, phi_B, np.zeros(frames, np.bool_), np.zeros((frames, len(trust.column_XD)), np.float32)
        )


class Engine(Protocol):
    """A form of the run-time path. Poses are local rotations (B, 21, 3, 3), float32."""

    description: Description

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """The first frame that holds no rotations, and what it holds; None: all are good."""
        ...

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """Directions (B, D, 3) of poses, float64."""
        ...

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """Joint angles (B, N) [rad] of the networks, float32."""
        ...

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """Joint angles (B, N) [rad] after steps of optimisation, float32; `avoid`: if there are any, then after steps
        away from self-collision.
        """
        ...

    def avoid(self, q_BN: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """Joint angles (B, N) [rad] after steps away from self-collision, float64."""
        ...

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `mrhubo.fast.plain.steps.follow`: joint angles (B, N) [rad] and costs of blocks (B, C), float64."""
        ...

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """After steps as `polish` makes them, with all that is told of them; shaking of branches in degrees, where
        known.
        """
        ...


class NumpyEngine:
    """The form in NumPy."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self.avoid = Avoidance(description)
        """As `Engine.avoid`."""

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """As `Engine.wrong`."""
        infinite_B = ~np.isfinite(local_BJ33).all(axis=(1, 2, 3))
        if infinite_B.any():
            return int(infinite_B.argmax()), NOT_FINITE
        off_BJ33 = np.abs(local_BJ33.swapaxes(-1, -2) @ local_BJ33 - np.eye(3, dtype=np.float32))
        third_BJ3 = human.cross(local_BJ33[..., 0], local_BJ33[..., 1])
        mirrored_B = ((third_BJ3 * local_BJ33[..., 2]).sum(-1) < 0).any(axis=1)
        wrong_B = mirrored_B | (off_BJ33 > SKEW).any(axis=(1, 2, 3))
        return (int(wrong_B.argmax()), _NO_ROTATION) if wrong_B.any() else None

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """As `Engine.directions`."""
        return human.directions_of(self.description.human, self.description.settings.constants, local_BJ33)

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """As `Engine.network`."""
        return networks.joint_angles(self.description, networks.features_of(self.description, local_BJ33, target_BD3))

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """As `Engine.polish`."""
        if not polish or not len(q_BN):
            return q_BN
        found_BN = steps.polish(self.description, q_BN.astype(np.float64), target_BD3, polish)
        return (self.avoid(found_BN, target_BD3) if avoid else found_BN).astype(np.float32)

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.follow`."""
        return steps.follow(self.description, q_BN, target_BD3, pull_B, lower_BN, upper_BN)

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """As `Engine.answer`."""
        d, found = self.description, Answers.empty(self.description, len(q_BN))
        for rows in _chunks(len(q_BN)):
            target, trust = target_BD3[rows], d.trust
            found.q_BN[rows] = self.polish(q_BN[rows], target, polish, avoid)
            placed = robot.place(d.kinematics, found.q_BN[rows].astype(np.float64))
            own_BD3 = robot.seen(d.human.seen_D, placed.view_BV33, placed.direction_BD3)
            angle_BD = np.degrees(judging.angle_between(own_BD3, target))
            found.error_BM[rows] = angle_BD[:, trust.measured]
            found.collision_B[rows] = collision.collides(d.capsules, placed.rotation_BL33, placed.position_BL3)
            if not len(trust.column_XD):
                continue
            local_BT33 = judging.read_pose(d.reading, d.settings.constants, target)
            error_BT, excess_BT = judging.reconstruction_error(d, local_BT33), judging.excess(d.reading, local_BT33)
            miss_BX = judging.of_branches(angle_BD, trust.column_XD)
            phi_BX = judging.of_branches(error_BT, trust.slot_XT)
            excess_BX = np.degrees((excess_BT[:, None] * trust.slot_XT).max(axis=-1))
            shaken = None if shake_BX is None else shake_BX[rows]
            found.trust_BX[rows] = judging.confidence(d, miss_BX, phi_BX, excess_BX, shaken)
            found.phi_B[rows] = phi_BX.max(axis=1)
        return found


class CompiledEngine:
    """The compiled form: frames go to threads, which share nothing; products of large matrices stay NumPy's."""

    def __init__(self, description: Description) -> None:
        from mrhubo.fast.compiled import kernels, tables
        from mrhubo.fast.compiled.networks import ACTIVATIONS

        self.description = description
        self._tables = tuple(tables.pack(description))
        self._kernels = kernels.make_kernels()
        self._steps, self._all, self._without_prior = kernels.STEPS, kernels.ALL, kernels.WITHOUT_PRIOR
        self._activation = ACTIVATIONS[description.settings.activation]
        self._layers = networks.Activations(self._activate(ACTIVATIONS["gelu"]), self._activate(self._activation))
        self._threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        self._pool: ThreadPoolExecutor | None = None
        self._nothing = np.zeros((0, 0), np.float32), np.zeros((0, len(description.trust.column_XD)))

    def _activate(self, kind: int) -> Callable[[np.ndarray], np.ndarray]:
        def activated(x_X: np.ndarray) -> np.ndarray:
            found_X = np.empty_like(x_X)
            self._kernels.activate(kind, x_X.reshape(-1), found_X.reshape(-1))
            return found_X

        return activated

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """As `Engine.wrong`."""
        found = self._kernels.wrong(local_BJ33, SKEW)
        return None if found < 0 else (found // 2, _NO_ROTATION if found % 2 else NOT_FINITE)

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """As `Engine.directions`."""
        found_BD3 = np.empty((len(local_BJ33), len(self.description.cost.weight_D), 3))
        self._shared(
            len(local_BJ33), lambda rows: self._kernels.directions(self._tables, local_BJ33[rows], found_BD3[rows])
        )
        return found_BD3

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """As `Engine.network`."""
        found_BN = np.empty((len(target_BD3), len(self.description.cost.lower_N)), np.float32)
        if len(target_BD3) <= _FEW:
            self._kernels.networks(self._tables, local_BJ33, target_BD3, found_BN)
            return found_BN
        for rows in _chunks(len(target_BD3)):
            features_BF = networks.features_of(self.description, local_BJ33[rows], target_BD3[rows])
            found_BN[rows] = networks.joint_angles(self.description, features_BF, self._layers.gelu)
        return found_BN

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """As `Engine.polish`."""
        found = Answers.empty(self.description, 0)
        q_BN = q_BN.copy()
        if polish:
            self._shared(
                len(q_BN),
                lambda rows: self._retarget(self._steps, (polish, avoid), rows, q_BN, target_BD3, None, None, found),
            )
        return q_BN

    def avoid(self, q_BN: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """As `Engine.avoid`."""
        q_BN = q_BN.copy()
        self._shared(len(q_BN), lambda rows: self._kernels.avoid(self._tables, target_BD3[rows], q_BN[rows]))
        return q_BN

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.follow`."""
        q_BN, cost_BC = q_BN.copy(), np.empty((len(q_BN), len(self.description.cost.cell_CU)))
        self._kernels.follow(self._tables, target_BD3, pull_B, lower_BN, upper_BN, q_BN, cost_BC)
        return q_BN, cost_BC

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """As `Engine.answer`."""
        d, frames = self.description, len(q_BN)
        found = Answers.empty(d, frames)
        found.q_BN[:] = q_BN
        if frames <= _FEW:
            self._retarget(self._all, (polish, avoid), slice(0, frames), found.q_BN, target_BD3, None, shake_BX, found)
            return found
        for chunk in _chunks(frames):
            part = Answers(*(getattr(found, name)[chunk] for name in Answers.__dataclass_fields__))
            target, shaken = target_BD3[chunk], None if shake_BX is None else shake_BX[chunk]
            six_BF = np.empty((len(target), 6 * len(d.reading.joint_T)), np.float32)

            def run(what: int, six_BF: np.ndarray, part: Answers = part, target: np.ndarray = target,
                    shaken: np.ndarray | None = shaken) -> None:  # fmt: skip
                self._shared(
                    len(target),
                    lambda rows: self._retarget(what, (polish, avoid), rows, part.q_BN, target, six_BF, shaken, part),
                )

            run(self._steps, six_BF)
            run(self._without_prior, judging.reconstruct(d, six_BF, self._layers.prior))
        return found

    def _retarget(
        self, what: int, steps: tuple[int, bool], rows: slice, q_BN: np.ndarray, target_BD3: np.ndarray,
        six_BF: np.ndarray | None, shake_BX: np.ndarray | None, into: Answers,
    ) -> None:  # fmt: skip
        six, shaken = (
            none if given is None else given[rows]
            for none, given in zip(self._nothing, (six_BF, shake_BX), strict=True)
        )
        self._kernels.retarget(
            self._tables, self._activation, *steps, what, target_BD3[rows], q_BN[rows], six, shaken,
            into.error_BM[rows], into.phi_B[rows], into.collision_B[rows], into.trust_BX[rows],
        )  # fmt: skip

    def _shared(self, frames: int, work: Callable[[slice], object]) -> None:
        """Does the work on all frames, in threads where there are many."""
        if frames <= _FEW or self._threads == 1:
            work(slice(0, frames))
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads, "mrhubo")
        ends = [round(k * frames / self._threads) for k in range(self._threads + 1)]
        list(self._pool.map(work, [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]))


def _chunks(frames: int) -> list[slice]:
    return [slice(start, start + _CHUNK) for start in range(0, frames, _CHUNK)]


def forms_here() -> tuple[str, ...]:
    """The forms that this machine can run, the quicker one first."""
    return FORMS if importlib.util.find_spec("numba") else FORMS[1:]


def make_engine(description: Description, form: str | None) -> Engine:
    """The form of a name; None: compiled where numba is installed.

    Raises:
        UserError: there is no such form, or it needs numba, which is not installed.
    """
    if form not in (None, *FORMS):
        raise UserError(f"form must be one of {', '.join(FORMS)}, found {form!r}")
    here = forms_here()
    form = form or here[0]
    if form not in here:
        raise UserError("form='compiled' needs numba: pip install 'mrhubo[fast]'")
    return CompiledEngine(description) if form == "compiled" else NumpyEngine(description)
