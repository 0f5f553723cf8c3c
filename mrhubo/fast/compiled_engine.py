"""The compiled form of the run-time path.

Legend: B frames, J = 21 posed joints, D directions, M measured ones, N joints, X branches.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.fast.answers import CHUNK, NO_ROTATION, Answers
from mrhubo.fast.description import Description
from mrhubo.fast.kept import is_kept, note_kept
from mrhubo.fast.plain import judging, networks, steps
from mrhubo.fast.plain.avoidance import Avoidance
from mrhubo.fast.plain.steps import Model
from mrhubo.fast.poses import NOT_FINITE
from mrhubo.fast.rotations import SKEW
from mrhubo.fast.together.avoiding import GivingWay
from mrhubo.fast.together.banded import Banded, Solve
from mrhubo.fast.together.problem import Problem, make_problem

if TYPE_CHECKING:
    from mrhubo.fast.compiled.motion_kernels import MotionKernels

FEW = 32
"""Up to so many frames, the compiled form goes through networks frame by frame; beyond, matrices are quicker."""


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
        self._unnoted = True
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
        return None if found < 0 else (found // 2, NO_ROTATION if found % 2 else NOT_FINITE)

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
        if len(target_BD3) <= FEW:
            self._kernels.networks(self._tables, local_BJ33, target_BD3, found_BN)
            return found_BN
        for rows in steps.chunks(len(target_BD3), CHUNK):
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

    @cached_property
    def _motion_kernels(self) -> MotionKernels:
        from mrhubo.fast.compiled.motion_kernels import make_motion_kernels

        return make_motion_kernels()

    @cached_property
    def problem(self) -> Problem:
        """As `Engine.problem`."""
        blocks = len(self.description.cost.cell_CU)
        return make_problem(self.description, self._models(self._motion_kernels.quadratic, blocks), self._factor)

    @cached_property
    def giving_way(self) -> GivingWay:
        """As `Engine.giving_way`."""
        together = Avoidance(self.description).description
        problem = make_problem(together, self._models(self._motion_kernels.whole, 1), self._factor)

        def close(q_BN: np.ndarray) -> np.ndarray:
            close_B = np.empty(len(q_BN), np.bool_)
            self._shared(len(q_BN), lambda rows: self._motion_kernels.close(self._tables, q_BN[rows], close_B[rows]))
            return close_B

        return GivingWay(problem, close, self.avoid)

    def _models(self, kernel: Callable[..., object], blocks: int) -> steps.Quadratic:
        """Costs and Gauss-Newton models by a compiled function."""

        def quadratic(_: Description, q_BN: np.ndarray, target_BD3: np.ndarray) -> Model:
            frames, joints = q_BN.shape
            q_BN, target_BD3 = np.ascontiguousarray(q_BN), np.ascontiguousarray(target_BD3)
            found = np.empty((frames, blocks)), np.empty((frames, joints)), np.empty((frames, joints, joints))
            self._shared(
                frames,
                lambda rows: kernel(self._tables, q_BN[rows], target_BD3[rows], *(part[rows] for part in found)),
            )
            return Model(*found)

        return quadratic

    def _factor(self, system: Banded) -> Solve:
        """Solves systems of whole motions by compiled functions."""
        frames, joints = system.diagonal_TM.shape
        coupling_KTM = np.zeros((len(system.couplings_TM), frames, joints))
        for lag, coupling_TM in enumerate(system.couplings_TM, start=1):
            coupling_KTM[lag - 1, : frames - lag] = coupling_TM
        lower_RW = np.empty((frames * joints, len(coupling_KTM) * joints + 1))
        # In one order of memory: for each other one, numba compiles anew.
        within_TMM, diagonal_TM = np.ascontiguousarray(system.within_TMM), np.ascontiguousarray(system.diagonal_TM)
        self._motion_kernels.factor(within_TMM, diagonal_TM, coupling_KTM, lower_RW)

        def solve(right_TM: np.ndarray) -> np.ndarray:
            found_R = right_TM.flatten()
            self._motion_kernels.solve(lower_RW, found_R)
            return found_R.reshape(right_TM.shape)

        return solve

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """As `Engine.answer`."""
        d, frames = self.description, len(q_BN)
        found = Answers.empty(d, frames)
        found.q_BN[:] = q_BN
        if frames <= FEW:
            self._retarget(self._all, (polish, avoid), slice(0, frames), found.q_BN, target_BD3, None, shake_BX, found)
            return found
        for chunk in steps.chunks(frames, CHUNK):
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
        if self._unnoted and "problem" in self.__dict__:
            self._note()
        return found

    def _note(self) -> None:
        """Notes that all that motions need is compiled, once it is."""
        self._unnoted = False
        if not is_kept():
            nobody_0N, nothing_0D3 = np.zeros((0, len(self.description.cost.lower_N))), np.zeros((0, 1, 3))
            self.giving_way.problem.quadratic(nobody_0N, nothing_0D3)
            self.giving_way.close(nobody_0N)
            self.avoid(nobody_0N, nothing_0D3)
            note_kept(kernel.stats.cache_path for kernel in (*self._kernels, *self._motion_kernels))

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
        if frames <= FEW or self._threads == 1:
            work(slice(0, frames))
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads, "mrhubo")
        ends = [round(k * frames / self._threads) for k in range(self._threads + 1)]
        list(self._pool.map(work, [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]))
