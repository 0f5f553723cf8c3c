"""The compiled form of the run-time path.

Legend: B frames, J = 21 posed joints, D directions, M measured ones, N joints, X branches.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.fast.answers import NO_ROTATION, Answers
from mrhubo.fast.compiled_ground import CompiledGround
from mrhubo.fast.description import Description
from mrhubo.fast.kept import is_kept, note_kept
from mrhubo.fast.plain import steps
from mrhubo.fast.plain.avoidance import Avoidance
from mrhubo.fast.plain.root_turn import turned_back
from mrhubo.fast.plain.steps import Model
from mrhubo.fast.poses import NOT_FINITE, refuse
from mrhubo.fast.rotations import SKEW
from mrhubo.fast.side_by_side import FEW, in_parts
from mrhubo.fast.together.avoiding import GivingWay
from mrhubo.fast.together.banded import Banded, Solve
from mrhubo.fast.together.problem import Problem, make_problem

if TYPE_CHECKING:
    from mrhubo.fast.compiled.ground_kernels import GroundKernels
    from mrhubo.fast.compiled.motion_kernels import MotionKernels


class CompiledEngine:
    """The compiled form: frames go to threads, which share nothing."""

    def __init__(self, description: Description) -> None:
        from mrhubo.fast.compiled import kernels, tables
        from mrhubo.fast.compiled.networks import ACTIVATIONS

        self.description = description
        self._tables = self._standing = tuple(tables.pack(description))
        legs, cost = description.legs, description.cost
        if legs is not None and not (
            np.array_equal(legs.block_N, cost.block_N) and np.array_equal(legs.block_D, cost.block_D)
        ):
            self._standing = tuple(tables.pack(description.standing))
        self._kernels = kernels.make_kernels()
        self._check, self._direct, self._answer = kernels.CHECK, kernels.DIRECT, kernels.ANSWER
        self._activation = ACTIVATIONS[description.settings.activation]
        self._unnoted = True
        self._no_shake = np.zeros((0, len(description.trust.column_XD)))
        self._unroll: Callable[[np.ndarray, np.ndarray], object] | None = None
        if (universal := description.universal) is not None:
            from mrhubo.fast.compiled.universal_features import look_up
            from mrhubo.fast.compiled.universal_kernels import make_universal_kernel
            from mrhubo.fast.compiled.universal_network import lay_out

            self._universal_kernel = make_universal_kernel()
            given = (self._tables, look_up(description, universal), lay_out(universal))
            self._unroll = partial(self._universal_kernel, *given)

    def __reduce__(self) -> tuple[type, tuple[Description]]:
        """A copy in another process is made of the same arrays."""
        return type(self), (self.description,)

    def look(self, local_BJ33: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.look`."""
        target_BD3, q_BN = self._room(local_BJ33)
        if not self.description.post or self.description.root is not None:
            refuse(self._look(self._check | self._direct, local_BJ33, target_BD3, q_BN), shape)
            target_BD3 = turned_back(self.description.root, target_BD3, local_BJ33)
            return target_BD3, self.network(local_BJ33, target_BD3)
        refuse(self._look(self._check | self._direct | self._answer, local_BJ33, target_BD3, q_BN), shape)
        return target_BD3, q_BN

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """As `Engine.wrong`."""
        return self._look(self._check, local_BJ33, *self._room(local_BJ33))

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """As `Engine.directions`."""
        target_BD3, q_BN = self._room(local_BJ33)
        self._look(self._direct, local_BJ33, target_BD3, q_BN)
        return turned_back(self.description.root, target_BD3, local_BJ33)

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """As `Engine.network`."""
        q_BN = self._room(local_BJ33)[1]
        if (unroll := self._unroll) is not None:
            target_BD3 = np.ascontiguousarray(target_BD3)
            in_parts(len(q_BN), lambda rows: unroll(target_BD3[rows], q_BN[rows]))
            return q_BN
        if not self.description.post:
            return self._nearest(np.ascontiguousarray(target_BD3))
        self._look(self._answer, local_BJ33, target_BD3, q_BN)
        return q_BN

    def _room(self, local_BJ33: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Room for directions, and for joint angles."""
        frames, cost = len(local_BJ33), self.description.cost
        return np.empty((frames, len(cost.weight_D), 3)), np.empty((frames, len(cost.lower_N)), np.float32)

    def _look(
        self, what: int, local_BJ33: np.ndarray, target_BD3: np.ndarray, q_BN: np.ndarray
    ) -> tuple[int, str] | None:
        """What of poses is asked for; the first frame that was found to hold no rotations, as `Engine.wrong` has it."""
        if not local_BJ33.flags.writeable:
            local_BJ33 = local_BJ33.copy()  # for arrays of another kind, numba compiles anew

        def part(rows: slice) -> tuple[int, int]:
            local, target, q = local_BJ33[rows], target_BD3[rows], q_BN[rows]
            return rows.start, look(self._tables, SKEW, what, local, target, q)

        look = self._kernels.look
        if len(local_BJ33) <= FEW:
            parts = [(0, look(self._tables, SKEW, what, local_BJ33, target_BD3, q_BN))]
        else:
            parts = in_parts(len(local_BJ33), part)
        for start, found in parts:
            if found >= 0:
                return start + found // 2, NO_ROTATION if found % 2 else NOT_FINITE
        return None

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """As `Engine.polish`."""
        if not polish:
            return q_BN
        found = Answers.empty(self.description, 0)
        q_BN = q_BN.copy()
        self._retarget(polish, avoid, False, q_BN, target_BD3, self._no_shake, found)
        return q_BN

    def avoid(self, q_BN: np.ndarray, target_BD3: np.ndarray, staying: bool = False) -> np.ndarray:
        """As `Engine.avoid`."""
        q_BN, own = q_BN.copy(), self._asked_by(target_BD3)
        in_parts(len(q_BN), lambda rows: self._kernels.avoid(own, target_BD3[rows], q_BN[rows], staying))
        return q_BN

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.follow`."""
        blocks = self.description.asked_by(target_BD3).cost.joints_NC.shape[1]
        q_BN, cost_BC = q_BN.copy(), np.empty((len(q_BN), blocks))
        self._kernels.follow(self._asked_by(target_BD3), target_BD3, pull_B, lower_BN, upper_BN, q_BN, cost_BC)
        return q_BN, cost_BC

    def minimise(self, q_BN: np.ndarray, target_BX3: np.ndarray, steps: int) -> np.ndarray:
        """As `Engine.minimise`."""
        q_BN = q_BN.copy()
        self._ground_kernels.start(self._asked_by(target_BX3), target_BX3, steps, q_BN)
        return q_BN

    def ground(self, longest_step: float, floor: float | None) -> CompiledGround:
        """As `Engine.ground`."""
        legs = self.description.legs
        assert legs is not None, "who has no feet stands on no floor"
        sizes = len(legs.body_H), len(legs.joint_L)
        return CompiledGround(self._standing, self._ground_kernels, *sizes, longest_step, floor)

    def _asked_by(self, target_BX3: np.ndarray) -> tuple[np.ndarray, ...]:
        """The arrays for targets, as `Description.asked_by`."""
        return self._tables if self.description.asked_by(target_BX3) is self.description else self._standing

    def _nearest(self, target_BD3: np.ndarray) -> np.ndarray:
        """As `mrhubo.fast.plain.steps.nearest`."""
        cost, found_BN = self.description.cost, np.empty((len(target_BD3), len(self.description.cost.lower_N)))
        start = self._ground_kernels.start
        in_parts(len(found_BN), lambda rows: start(self._tables, target_BD3[rows], 0, found_BN[rows]))
        return np.clip(found_BN.astype(np.float32), cost.lower_N.astype(np.float32), cost.upper_N.astype(np.float32))

    @cached_property
    def _ground_kernels(self) -> GroundKernels:
        from mrhubo.fast.compiled.ground_kernels import make_ground_kernels

        return make_ground_kernels()

    @cached_property
    def _motion_kernels(self) -> MotionKernels:
        from mrhubo.fast.compiled.motion_kernels import make_motion_kernels

        return make_motion_kernels()

    @cached_property
    def problem(self) -> Problem:
        """As `Engine.problem`."""
        blocks = len(self.description.cost.cell_CU)
        return make_problem(
            self.description, self._models(self._motion_kernels.quadratic, blocks), self._turning, self._factor
        )

    @cached_property
    def giving_way(self) -> GivingWay:
        """As `Engine.giving_way`."""
        together = Avoidance(self.description).description
        problem = make_problem(together, self._models(self._motion_kernels.whole, 1), self._turning, self._factor)

        def close(q_BN: np.ndarray) -> np.ndarray:
            close_B = np.empty(len(q_BN), np.bool_)
            in_parts(len(q_BN), lambda rows: self._motion_kernels.close(self._tables, q_BN[rows], close_B[rows]))
            return close_B

        return GivingWay(problem, close, self.avoid)

    def _models(self, kernel: Callable[..., object], blocks: int) -> steps.Quadratic:
        """Costs and Gauss-Newton models by a compiled function."""

        def quadratic(_: Description, q_BN: np.ndarray, target_BD3: np.ndarray) -> Model:
            frames, joints = q_BN.shape
            q_BN, target_BD3 = np.ascontiguousarray(q_BN), np.ascontiguousarray(target_BD3)
            found = np.empty((frames, blocks)), np.empty((frames, joints)), np.empty((frames, joints, joints))
            in_parts(
                frames,
                lambda rows: kernel(self._tables, q_BN[rows], target_BD3[rows], *(part[rows] for part in found)),
            )
            return Model(*found)

        return quadratic

    def _turning(self, q_BN: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`Directions` by a compiled function."""
        (frames, joints), directions = q_BN.shape, len(self.description.human.seen_D)
        q_BN = np.ascontiguousarray(q_BN)
        found = np.empty((frames, directions, 3)), np.empty((frames, directions, 3, joints))
        in_parts(
            frames, lambda rows: self._motion_kernels.turning(self._tables, q_BN[rows], *(part[rows] for part in found))
        )
        return found

    def _factor(self, system: Banded) -> Solve:
        """Solves systems of whole motions by compiled functions."""
        frames, joints = system.diagonal_TM.shape
        coupling_KTMM = np.empty((len(system.couplings_TMM), frames, joints, joints))
        for lag, coupling_TMM in enumerate(system.couplings_TMM, start=1):
            coupling_KTMM[lag - 1, : frames - lag] = coupling_TMM
        # In one order of memory: for each other one, numba compiles anew.
        within_TMM, diagonal_TM = np.ascontiguousarray(system.within_TMM), np.ascontiguousarray(system.diagonal_TM)
        column_RV = self._motion_kernels.factor(within_TMM, diagonal_TM, coupling_KTMM)

        def solve(right_TM: np.ndarray) -> np.ndarray:
            found_R = right_TM.flatten()
            self._motion_kernels.solve(column_RV, found_R)
            return found_R.reshape(right_TM.shape)

        return solve

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """As `Engine.answer`."""
        found = Answers.empty(self.description, len(q_BN))
        found.q_BN[:] = q_BN
        shaken_BX = self._no_shake if shake_BX is None else shake_BX
        self._retarget(polish, avoid, True, found.q_BN, target_BD3, shaken_BX, found)
        if self._unnoted and "problem" in self.__dict__:
            self._note()
        return found

    def _note(self) -> None:
        """Notes that all that motions need is compiled, once it is."""
        self._unnoted = False
        if not is_kept(self._unroll is not None):
            nobody_0N, nothing_0D3 = np.zeros((0, len(self.description.cost.lower_N))), np.zeros((0, 1, 3))
            self.giving_way.problem.quadratic(nobody_0N, nothing_0D3)
            self.giving_way.problem.directions(nobody_0N)
            self.giving_way.close(nobody_0N)
            self.avoid(nobody_0N, nothing_0D3)
            nowhere_0 = np.zeros(0, np.bool_)
            self._kernels.polish(self._tables, 0, False, nothing_0D3, nobody_0N.astype(np.float32), nowhere_0)
            note_kept(self.kept_in, self._unroll is not None)

    @property
    def kept_in(self) -> set[str]:
        """As `Engine.kept_in`."""
        return {kernel.stats.cache_path for kernel in self._kernels}

    def _retarget(
        self, polish: int, avoid: bool, judge: bool, q_BN: np.ndarray, target_BD3: np.ndarray, shake_BX: np.ndarray,
        into: Answers,
    ) -> None:  # fmt: skip
        together = polish > 0 and len(q_BN) > FEW
        avoid = avoid and polish > 0
        near_B = into.collision_B if judge else np.empty(len(q_BN), np.bool_)
        near_B[:] = True

        def part(rows: slice) -> None:
            if together:
                self._kernels.polish(self._tables, polish, avoid, target_BD3[rows], q_BN[rows], near_B[rows])
            if judge or not together:
                self._kernels.retarget(
                    self._tables, self._activation, 0 if together else polish, avoid and not together, judge,
                    target_BD3[rows], q_BN[rows], shake_BX[rows], into.error_BM[rows], into.phi_B[rows],
                    near_B[rows], into.trust_BX[rows],
                )  # fmt: skip

        in_parts(len(q_BN), part)
