"""The two forms of the run-time path behind one set of methods, and which of them can be had.

Legend: B frames, J = 21 posed joints, D directions, M measured ones, N joints, X branches.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.answers import CHUNK, NO_ROTATION, Answers, Engine
from mrhubo.fast.compiled_engine import CompiledEngine
from mrhubo.fast.description import Description
from mrhubo.fast.kept import numba_is_there
from mrhubo.fast.plain import collision, human, judging, networks, robot, steps, universal
from mrhubo.fast.plain.avoidance import Avoidance
from mrhubo.fast.plain.ground import PlainGround
from mrhubo.fast.plain.root_turn import turned_back
from mrhubo.fast.poses import NOT_FINITE, refuse
from mrhubo.fast.rotations import are_crooked
from mrhubo.fast.together.avoiding import GivingWay, make_giving_way
from mrhubo.fast.together.banded import halve
from mrhubo.fast.together.problem import Problem, make_problem

FORMS = ("compiled", "numpy")


class NumpyEngine:
    """The form in NumPy."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self._avoidance = Avoidance(description)
        self._branches = description.universal and universal.Branches(description, description.universal)

    def __reduce__(self) -> tuple[type, tuple[Description]]:
        """A copy in another process is made of the same arrays."""
        return type(self), (self.description,)

    kept_in: frozenset[str] = frozenset()
    """As `Engine.kept_in`."""

    def look(self, local_BJ33: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.look`."""
        refuse(self.wrong(local_BJ33), shape)
        target_BD3 = self.directions(local_BJ33)
        return target_BD3, self.network(local_BJ33, target_BD3)

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """As `Engine.wrong`."""
        infinite_B = ~np.isfinite(local_BJ33).all(axis=(1, 2, 3))
        if infinite_B.any():
            return int(infinite_B.argmax()), NOT_FINITE
        wrong_B = are_crooked(local_BJ33).any(axis=1)
        return (int(wrong_B.argmax()), NO_ROTATION) if wrong_B.any() else None

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """As `Engine.directions`."""
        found_BD3 = human.directions_of(self.description.human, self.description.settings.constants, local_BJ33)
        return turned_back(self.description.root, found_BD3, local_BJ33)

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """As `Engine.network`."""
        if self._branches is not None:
            return universal.joint_angles(self._branches, target_BD3)
        if not self.description.post:
            return steps.nearest(self.description, target_BD3)
        return networks.joint_angles(self.description, networks.features_of(self.description, local_BJ33, target_BD3))

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """As `Engine.polish`."""
        if not polish or not len(q_BN):
            return q_BN
        found_BN = steps.polish(self.description, q_BN.astype(np.float64), target_BD3, polish)
        return (self._avoidance(found_BN, target_BD3) if avoid else found_BN).astype(np.float32)

    def avoid(self, q_BN: np.ndarray, target_BD3: np.ndarray, staying: bool = False) -> np.ndarray:
        """As `Engine.avoid`."""
        return self._avoidance(q_BN, target_BD3, staying)

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `Engine.follow`."""
        asked = self.description.asked_by(target_BD3)
        return steps.follow(asked, q_BN, target_BD3, pull_B, lower_BN, upper_BN)

    def minimise(self, q_BN: np.ndarray, target_BX3: np.ndarray, steps_: int) -> np.ndarray:
        """As `Engine.minimise`."""
        return steps.minimise(self.description.asked_by(target_BX3), q_BN, target_BX3, steps_)[0]

    def ground(self, longest_step: float, floor: float | None) -> PlainGround:
        """As `Engine.ground`."""
        return PlainGround(self.description, longest_step, floor)

    @cached_property
    def problem(self) -> Problem:
        """As `Engine.problem`."""
        return make_problem(self.description, steps.quadratic, self._turning, halve)

    def _turning(self, q_BN: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return robot.turning(self.description.kinematics, self.description.human.seen_D, q_BN)

    @cached_property
    def giving_way(self) -> GivingWay:
        """As `Engine.giving_way`."""
        return make_giving_way(self._avoidance, self._turning, halve, self.avoid)

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """As `Engine.answer`."""
        d, found = self.description, Answers.empty(self.description, len(q_BN))
        for rows in steps.chunks(len(q_BN), CHUNK):
            target, trust = target_BD3[rows], d.trust
            found.q_BN[rows] = self.polish(q_BN[rows], target, polish, avoid)
            placed = robot.place(d.kinematics, found.q_BN[rows].astype(np.float64))
            own_BD3 = robot.seen_directions(placed, d.human.seen_D)
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


def forms_here() -> tuple[str, ...]:
    """The forms that this machine can run, the quicker one first."""
    return FORMS if numba_is_there() else FORMS[1:]


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
    engine = CompiledEngine(description) if form == "compiled" else NumpyEngine(description)
    return engine  # pyright: ignore[reportReturnType] (it takes no cached property for a property)
