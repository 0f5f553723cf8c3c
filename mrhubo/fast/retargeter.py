"""A trained retargeter without PyTorch.

    retargeter = mrhubo.load_fast("package")        # or the file runtime.safetensors of one, by itself
    answer = retargeter(pose)                       # joint angles of one frame or of many, with confidence, in NumPy

It answers as `Retargeter` does, with the same numbers: each frame on its own, or a motion as a whole.

Legend: T frames, J = 21 posed joints, D directions, N joints, X branches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.answers import Answers, Engine
from mrhubo.fast.description import Description
from mrhubo.fast.engines import FORMS, make_engine
from mrhubo.fast.plain import judging
from mrhubo.fast.poses import checked_polish, read_poses, refuse, to_array
from mrhubo.fast.together.motion import join_frames
from mrhubo.robot_motion import FollowingJoint, RobotFacts, RobotMotion

POLISH = 10
"""Steps of optimisation that `retarget` makes after the networks, at most, unless told otherwise. On CMU's clips and
NAO, 0.36% of the arms have not converged after ten; five leave 0.84%, forty 0.32%, which need another start."""


class FastRetargeter:
    """A retargeter in NumPy's arrays; several threads may use it at a time."""

    def __init__(self, description: Description, form: str | None = None) -> None:
        """Prepares the form that shall answer.

        Args:
            description: the retargeter's arrays.
            form: "compiled" (needs numba), or "numpy"; None: compiled where numba is installed. The first use of the
                compiled form ever takes half a minute or more, for compiling; what it made is kept for the next.

        Raises:
            UserError: there is no such form, or numba is missing.
        """
        self.description = description
        self.engine: Engine = make_engine(description, form)
        self._collision_known = description.settings.collision_known and bool(len(description.capsules.pair_Y2))
        self._made: dict[str, Any] = {
            "joint_names": self.joint_names, "branch_names": self.branch_names,
            "direction_names": tuple(description.settings.direction_names[d] for d in description.trust.measured),
            "robot": self.facts, "root_position": None, "root_quaternion_wxyz": None,
        }  # fmt: skip

    @classmethod
    def load(cls, path: Path | str, form: str | None = None) -> FastRetargeter:
        """Reads the folder of a package, or its file `runtime.safetensors` alone.

        Raises:
            UserError: it is missing, damaged, or of another version; or `form` is wrong.
        """
        return cls(Description.read(Path(path)), form)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints of the output, in order."""
        return self.description.settings.joint_names

    @property
    def branch_names(self) -> tuple[str, ...]:
        """Parts of the robot that have a confidence each."""
        return self.description.settings.branch_names

    @cached_property
    def facts(self) -> RobotFacts:
        """What files of the robot's motion tell of it."""
        settings, cost = self.description.settings, self.description.cost
        others = tuple(FollowingJoint(**other) for other in settings.facts["others"])
        on_base = {link: tuple(place) for link, place in settings.facts.get("on_base", {}).items()}
        limits = (cost.lower_N, cost.upper_N, cost.velocity_N)
        return RobotFacts(
            settings.robot, settings.facts["made_by"], settings.facts["checksum"], *limits, others, on_base
        )

    def __call__(
        self,
        motion: Any,
        polish: int = POLISH,
        frame_rate: float | None = None,
        together: bool | None = None,
        avoid_collisions: bool = True,
    ) -> RobotMotion:
        """Joint angles of human poses, with their confidence.

        Args:
            motion: a `Motion`, or an array of local rotations of SMPL's joints 1..21: matrices (..., 21, 3, 3),
                axis-angle [rad] (..., 63) or 6D (..., 21, 6). The answer has its leading axes, none for a single pose.
            polish: steps of optimisation after the networks at most; 0: none.
            frame_rate: frames per second of an array of motions (the last leading axis is the time): confidence then
                knows how much they shake. A `Motion` has its own.
            together: all frames of a motion become one smooth motion, in which no joint turns faster than it can
                (`mrhubo.retargeter.clip`), and not each frame on its own; None: where the frame rate is known.
            avoid_collisions: frames in which the robot would touch itself give way, if there are steps at all.

        Raises:
            UserError: the array has another shape, or holds what is no rotation (says in which frame); `polish` is
                negative, or the frame rate not positive, or missing and needed.
        """
        polish = checked_polish(polish)
        poses = read_poses(motion, frame_rate, self.description.settings.own_rest)
        rate = poses.frame_rate
        if together and rate is None:
            raise UserError("together=True needs the frame rate: frame_rate=..., or a Motion, which has its own")
        target_TD3, q_TN = self.engine.look(poses.local_TJ33, poses.shape)
        avoid = bool(polish) and avoid_collisions
        if rate is not None and together is not False:
            q_TN = self.engine.polish(q_TN, target_TD3, polish, False)
            q_TN, polish = self._join(q_TN, target_TD3, poses.shape, rate, avoid), 0
        found = self.engine.answer(q_TN, target_TD3, polish, avoid, self._shake(target_TD3, poses.shape, rate))
        return self.told(found, poses.shape, rate, poses.name, poses.source)

    def predict(self, motion: Any, polish: int = 0, avoid_collisions: bool = True) -> np.ndarray:
        """Joint angles (..., N) [rad] alone, as `__call__` has them; without steps, in a fifth of the time."""
        polish = checked_polish(polish)
        poses = read_poses(motion, None, self.description.settings.own_rest)
        target_TD3, network_TN = self.engine.look(poses.local_TJ33, poses.shape)
        q_TN = self.engine.polish(network_TN, target_TD3, polish, avoid_collisions)
        return q_TN.reshape(*poses.shape, q_TN.shape[1])

    def imitate(self, directions: Any, polish: int = POLISH, avoid_collisions: bool = True) -> RobotMotion:
        """The answer to directions (..., D, 3) in place of poses: unit vectors in human axes (x left, y up, z forward)
        of the part that each is seen from, in the order of `description.settings.direction_names`; the length of a bend
        axis is how much it counts, 0 to 1.

        Raises:
            UserError: the networks see rotations, the array has another shape, or holds NaN or infinite numbers or a
                limb's direction that is no unit vector.
        """
        polish = checked_polish(polish)
        settings, cost = self.description.settings, self.description.cost
        if settings.features != "directions":
            raise UserError("this retargeter's networks see rotations, not directions; give it poses")
        given_XD3 = to_array(directions)
        if given_XD3.dtype.kind not in "fiu" or given_XD3.shape[-2:] != (len(cost.weight_D), 3):
            raise UserError(
                f"directions must be numbers of the shape (..., {len(cost.weight_D)}, 3), found {given_XD3.dtype} of"
                f" shape {given_XD3.shape}"
            )
        target_XD3 = given_XD3.astype(np.float64)
        length_XD = np.sqrt((target_XD3**2).sum(-1))
        full_XD = np.where(cost.partial_D > 0, length_XD < 1 + 1e-3, np.abs(length_XD - 1) < 1e-3)
        if not full_XD.all():  # nor NaN
            raise UserError("directions hold one that is no unit vector, or a bend axis longer than 1")
        shape = target_XD3.shape[:-2]
        target_TD3 = np.ascontiguousarray(target_XD3.reshape(math.prod(shape), *target_XD3.shape[-2:]))
        nobody_TJ33 = np.zeros((len(target_TD3), 21, 3, 3), np.float32)
        q_TN = self.engine.network(nobody_TJ33, target_TD3)
        return self.told(self.engine.answer(q_TN, target_TD3, polish, avoid_collisions, None), shape, None)

    def directions(self, motion: Any) -> np.ndarray:
        """Directions (..., D, 3) of human poses, as `imitate` takes them."""
        poses = read_poses(motion, None, self.description.settings.own_rest)
        refuse(self.engine.wrong(poses.local_TJ33), poses.shape)
        found_TD3 = self.engine.directions(poses.local_TJ33)
        return found_TD3.reshape(*poses.shape, *found_TD3.shape[1:])

    def _join(
        self, q_TN: np.ndarray, target_TD3: np.ndarray, shape: tuple[int, ...], frame_rate: float, avoid: bool
    ) -> np.ndarray:
        """Answers (T, N) [rad] of motions, each made smooth, float32."""
        joined_TN, ways = q_TN.copy(), (self.engine.problem, self.engine.giving_way if avoid else None)
        for rows in _clips(len(q_TN), shape):
            own_TN = q_TN[rows].astype(np.float64)
            joined_TN[rows] = join_frames(self.description, *ways, own_TN, target_TD3[rows], frame_rate)
        return joined_TN

    def _shake(self, target_TD3: np.ndarray, shape: tuple[int, ...], frame_rate: float | None) -> np.ndarray | None:
        """How much each branch shakes (T, X) [degrees]; None where no frame rate is known."""
        if frame_rate is None:
            return None
        shake_TD, constants = np.zeros(target_TD3.shape[:2]), self.description.settings.constants
        for rows in _clips(len(target_TD3), shape):
            shake_TD[rows] = judging.shake(target_TD3[rows], frame_rate, constants)
        return np.degrees(judging.of_branches(shake_TD, self.description.trust.column_XD))

    def told(
        self,
        found: Answers,
        shape: tuple[int, ...],
        frame_rate: float | None,
        name: str = "",
        source: str = "",
        stands: Mapping[str, Any] | None = None,
    ) -> RobotMotion:
        """A form's answers, with the leading axes of the poses and what is known of motion and retargeter; `stands`:
        fields that tell of the floor.
        """
        trust_TX = found.trust_BX
        confidence_T = trust_TX.min(axis=1) if trust_TX.shape[1] else np.zeros_like(found.phi_B)
        return RobotMotion.trusted(
            q=found.q_BN.reshape(*shape, found.q_BN.shape[1]),
            confidence=confidence_T.reshape(shape),
            branch_confidence=trust_TX.reshape(*shape, trust_TX.shape[1]),
            direction_error_deg=found.error_BM.reshape(*shape, found.error_BM.shape[1]),
            phi=found.phi_B.reshape(shape),
            collision=found.collision_B.reshape(shape) if self._collision_known else None,
            frame_rate=frame_rate,
            name=name,
            source=source,
            **{**self._made, **(stands or {})},
        )


def _clips(frames: int, shape: tuple[int, ...]) -> list[slice]:
    """Which of some frames are one motion: those of the last leading axis."""
    length = max(1, shape[-1] if shape else 1)
    return [slice(first, first + length) for first in range(0, frames, length)]


__all__ = ["FORMS", "POLISH", "FastRetargeter"]
