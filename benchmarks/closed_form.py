"""Seven-joint arms in closed form, from the directions of upper arm, forearm and hand: a rival of the benchmarks.

Written from the idea of SEW-Mimic (C. Kong et al., "A Closed-Form Geometric Retargeting Solver for Upper Body Humanoid
Robot Teleoperation", 2026, arXiv 2602.01632): shoulder, elbow and wrist give the directions of a person's upper arm and
forearm; the first two joints bring the robot's upper arm there, the next two its forearm, the last three its hand. The
formulas are the subproblems of Paden and Kahan (R. Murray, Z. Li, S. Sastry, "A Mathematical Introduction to Robotic
Manipulation", 1994, section 3.3). No code of the authors' is in it, nor was it compared with theirs. What the papers
leave open is ours: where no angle reaches a direction, those of the smallest angle to it are taken; angles outside the
limits are clamped, and what follows is solved for the clamped ones; of the up to eight solutions, that is taken whose
limbs and hand are nearest to the person's. The upper arm is taken to lie along the third joint's axis; where it does
not, as on COMAN, the answer is off by the angle between them (up to 7 degrees).

Legend: B frames, D directions, N joints, 7 joints of an arm, X = 8 B: frames in all eight ways.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import torch

from mrhubo.robot import BodyMap
from mrhubo.robot.keypoints import Axis
from mrhubo.robot.parts import LimbPart, OrientedPart
from mrhubo.rotation import matrix_to_axis_angle

_JOINTS = 7
_ALIGNED_DEG = 15.0
"""An upper arm that lies farther from its own turning axis is not brought to a direction by two joints."""
_PARALLEL = 0.9
"""Cosine of the angle between two axes above which they do not reach two directions of freedom."""
_WEIGHTS = np.array([1.0, 1.0, 0.5, 0.5])
"""Of the squared errors of limbs and of a hand's directions, as in `mrhubo.robot.parts`."""
_WAYS = np.array(list(itertools.product((1.0, -1.0), repeat=3)))


class NoClosedForm(ValueError):
    """Why a robot's arms have none."""


@dataclass(frozen=True)
class _Arm:
    """One arm with all joints at 0, in the base frame."""

    joints: list[int]
    """Positions in q, from the shoulder outwards."""
    columns: list[int]
    """Of upper arm, forearm, and the hand's two directions."""
    axis_73: np.ndarray
    rest_43: np.ndarray
    """Where these four point."""
    lower_7: np.ndarray
    upper_7: np.ndarray


class ClosedForm:
    """A robot's arms in closed form; joints of other parts stay at home."""

    def __init__(self, body_map: BodyMap) -> None:
        """Reads the axes from the robot's kinematics.

        Raises:
            NoClosedForm: an arm has not seven joints of which three make a shoulder, one an elbow and three a wrist.
        """
        robot = body_map.robot
        self._home_N = robot.home().double().numpy()
        with torch.no_grad():
            views_B33 = body_map.shared.view_robot(robot.forward(torch.stack((robot.lower_N, robot.upper_N)))).views[0]
            zero = robot.forward(torch.zeros(1, len(robot.joint_names)))
            self._rest_D3 = body_map.shared.view_robot(zero).direction_BD3[0].double().numpy()
        if not torch.allclose(views_B33[0], views_B33[1], atol=1e-5):
            raise NoClosedForm("joints turn the chest")
        self._view_33 = views_B33[0].double().numpy()
        hands = [part for part in body_map.keypoints.parts if isinstance(part, OrientedPart) and part.hangs_on]
        limbs = {part.name: part for part in body_map.keypoints.parts if isinstance(part, LimbPart)}
        self.arms = [self._arm(body_map, limbs, part) for part in hands if part.hangs_on in limbs]
        if not self.arms:
            raise NoClosedForm("no arm has a hand")

    def _arm(self, body_map: BodyMap, limbs: dict[str, LimbPart], hand: OrientedPart) -> _Arm:
        robot, names = body_map.robot, body_map.direction_names
        forearm = limbs[hand.hangs_on or ""]
        upper = limbs[forearm.hangs_on or ""]
        columns = [names.index(name) for name in (*upper.direction_names, *forearm.direction_names)]
        columns += [names.index(name) for name in hand.direction_names]
        link = next(d.link for d in body_map.directions if isinstance(d, Axis) and d.part is hand)
        chain = [joint.name for joint in reversed(robot.description.joints_above(link))]
        joints = [robot.joint_names.index(name) for name in chain if name in robot.joint_names]
        if len(joints) != _JOINTS:
            raise NoClosedForm(f"{hand.name} hangs on {len(joints)} joints, not on {_JOINTS}")
        with torch.no_grad():
            turned = robot.forward(torch.cat((torch.zeros(1, len(robot.joint_names)), torch.eye(len(self._home_N)))))
        rotation_B33 = turned.rotation_BL33[:, robot.link_index(link)].double()
        axes_N3 = matrix_to_axis_angle(rotation_B33[1:] @ rotation_B33[0].T).numpy()  # each joint by one radian
        arm = _Arm(
            joints,
            columns,
            axes_N3[joints] @ self._view_33,
            self._rest_D3[columns],
            robot.lower_N.double().numpy()[joints],
            robot.upper_N.double().numpy()[joints],
        )
        if not np.allclose(np.linalg.norm(arm.axis_73, axis=1), 1.0, atol=1e-3):
            raise NoClosedForm(f"the joints of {hand.name} do not turn it one for one")
        if any(abs(arm.axis_73[first] @ arm.axis_73[first + 1]) > _PARALLEL for first in (0, 2, 4)):
            raise NoClosedForm(f"joints of {hand.name} that follow each other turn about the same axis")
        cosine = abs(arm.rest_43[0] @ arm.axis_73[2])
        if cosine < np.cos(np.radians(_ALIGNED_DEG)):
            raise NoClosedForm(f"the third joint of {hand.name} does not turn the upper arm about itself")
        return arm

    def of_directions(self, direction_D3: np.ndarray) -> np.ndarray:
        """Joint angles (N,) or (B, N) [rad] for a human's directions (D, 3) or (B, D, 3)."""
        direction_BD3 = np.reshape(direction_D3, (-1, *direction_D3.shape[-2:])).astype(float)
        q_BN = np.tile(self._home_N, (len(direction_BD3), 1))
        for arm in self.arms:
            q_BN[:, arm.joints] = _solve(arm, direction_BD3[:, arm.columns])
        return q_BN[0] if direction_D3.ndim == 2 else q_BN


def _solve(arm: _Arm, target_B43: np.ndarray) -> np.ndarray:
    """Angles (B, 7) of an arm, inside the limits, for the directions of upper arm, forearm, fingers and thumb.

    All eight ways (two of the upper arm, two of the forearm, two of the hand) of all frames are one batch, X = 8 B.
    """
    ways, frames = len(_WAYS), len(target_B43)
    sign_X3, target_X43 = np.repeat(_WAYS, frames, axis=0), np.tile(target_B43, (ways, 1, 1))
    q_X7, turn_X33, answers = np.zeros((len(target_X43), _JOINTS)), np.eye(3)[None], []
    # The upper arm by joints 1 and 2, the forearm by 3 and 4.
    for stage, first in enumerate((0, 2)):
        wanted_X3 = _turned(turn_X33.swapaxes(1, 2), target_X43[:, stage])
        turn_X33 = turn_X33 @ _pair(arm, q_X7, first, arm.rest_43[stage], wanted_X3, sign_X3[:, stage])
        answers.append(_turned(turn_X33, arm.rest_43[stage]))
    # The last joint's axis by joints 5 and 6, then the rest of the hand's turn by 7.
    hand_X33 = turn_X33.swapaxes(1, 2) @ _frame(target_X43[:, 2:]) @ _frame(arm.rest_43[None, 2:]).swapaxes(1, 2)
    last_3 = arm.axis_73[6]
    wrist_X33 = _pair(arm, q_X7, 4, last_3, _turned(hand_X33, last_3), sign_X3[:, 2])
    across_3 = np.cross(last_3, np.eye(3)[np.abs(last_3).argmin()])
    wanted_X3 = _turned(wrist_X33.swapaxes(1, 2) @ hand_X33, across_3)
    turn_X33 = turn_X33 @ wrist_X33 @ _put(arm, q_X7, 6, _angle(last_3, across_3, wanted_X3))
    answers += [_turned(turn_X33, axis_3) for axis_3 in arm.rest_43[2:]]
    error_X4 = np.square(np.stack(answers, axis=1) - target_X43).sum(axis=2)
    cost_X = error_X4 @ _WEIGHTS + 1e-6 * np.square(q_X7).sum(axis=1)
    best_B = cost_X.reshape(ways, frames).argmin(axis=0)
    return q_X7.reshape(ways, frames, _JOINTS)[best_B, np.arange(frames)]


def _pair(
    arm: _Arm, q_X7: np.ndarray, first: int, from_3: np.ndarray, to_X3: np.ndarray, sign_X: np.ndarray
) -> np.ndarray:
    """Sets two joints so that they turn a vector to others (X, 3): subproblem 2, of whose two solutions `sign_X` (1 or
    -1) chooses. Gives the turn of both (X, 3, 3).
    """
    a, b = arm.axis_73[first], arm.axis_73[first + 1]
    between, normal_3 = a @ b, np.cross(a, b)
    alpha_X = (to_X3 @ a - between * (b @ from_3)) / (1 - between**2)
    beta_X = (b @ from_3 - between * (to_X3 @ a)) / (1 - between**2)
    square_X = (1 - alpha_X**2 - beta_X**2 - 2 * alpha_X * beta_X * between) / (normal_3 @ normal_3)
    along_X = sign_X * np.sqrt(np.maximum(square_X, 0))
    middle_X3 = alpha_X[:, None] * a + beta_X[:, None] * b + along_X[:, None] * normal_3
    inner_X33 = _put(arm, q_X7, first + 1, _angle(b, from_3, middle_X3))
    # The middle itself, where it is reached and the limits allow it.
    outer_X33 = _put(arm, q_X7, first, _angle(a, _turned(inner_X33, from_3), to_X3))
    return outer_X33 @ inner_X33


def _put(arm: _Arm, q_X7: np.ndarray, joint: int, angle_X: np.ndarray) -> np.ndarray:
    """Sets a joint, by full turns into the limits or to the nearer one; gives its rotation (X, 3, 3), by Rodrigues'
    formula.
    """
    middle = 0.5 * (arm.lower_7[joint] + arm.upper_7[joint])
    near_X = middle + (angle_X - middle + np.pi) % (2 * np.pi) - np.pi
    q_X7[:, joint] = np.clip(near_X, arm.lower_7[joint], arm.upper_7[joint])
    sine_X11, cosine_X11 = (f(q_X7[:, joint])[:, None, None] for f in (np.sin, np.cos))
    skew_33 = _skew(arm.axis_73[joint])
    return np.eye(3) + sine_X11 * skew_33 + (1 - cosine_X11) * (skew_33 @ skew_33)


def _angle(axis_3: np.ndarray, from_3: np.ndarray, to_X3: np.ndarray) -> np.ndarray:
    """The turns (X,) about an axis that bring vectors (3,) or (X, 3) nearest to others: subproblem 1; 0 along it."""
    sine_X = np.sum((from_3 @ _skew(axis_3).T) * to_X3, axis=-1)
    return np.arctan2(sine_X, np.sum(from_3 * to_X3, axis=-1) - (from_3 @ axis_3) * (to_X3 @ axis_3))


def _skew(axis_3: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) of the cross product with an axis."""
    x, y, z = axis_3
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _turned(turn_X33: np.ndarray, vector_3: np.ndarray) -> np.ndarray:
    """Vectors (3,) or (X, 3) after rotations."""
    return (turn_X33 @ vector_3[..., None])[..., 0]


def _frame(pair_B23: np.ndarray) -> np.ndarray:
    """Rotations (B, 3, 3) whose columns are two orthogonal directions and their normal."""
    return np.stack((pair_B23[:, 0], pair_B23[:, 1], np.cross(pair_B23[:, 0], pair_B23[:, 1])), axis=2)
