"""Where a robot's base is in each frame, for files whose first columns are a free joint's.

The URDF's base is its root link; a MuJoCo model's free joint may move another link that is fixed to it, as the torso is
to a frame on the floor.

Legend: T frames. Quaternions have w first.
"""

from __future__ import annotations

import numpy as np

from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.order import ORIGIN, UPRIGHT, JointOrder

W_LAST, W_FIRST = [1, 2, 3, 0], [3, 0, 1, 2]
"""Where w comes last or first, of a quaternion that has it the other way."""
_SAME = 1e-6
"""Links that are as near to each other [m, of 1] are in one place."""


def base_of(motion: RobotMotion, order: JointOrder | None) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Place (T, 3) [m] and rotation (T, 4), w first, of the base of a motion with one leading axis, or of the link that
    the free joint of the order's model moves; where the motion has none, those of the model or the origin. With what
    had to be done or assumed, a sentence each.
    """
    order = order or JointOrder(())
    if motion.root_position is not None and motion.root_quaternion_wxyz is not None:
        place_T3, turn_T4, fixed = motion.root_position, motion.root_quaternion_wxyz, motion.robot.on_base
        if order.free_joint is None or not fixed:
            return place_T3, turn_T4, ()
        body, moves = order.free_body, f"the free joint of {order.source} moves '{order.free_body}'"
        if body not in fixed:
            base = next(iter(fixed))
            strange = f"{moves}, which is not fixed to '{base}' in the URDF: where '{base}' is, is written"
            return place_T3, turn_T4, (strange,)
        at_3, turned_4 = np.split(np.array(fixed[body]), [3])
        if np.abs(at_3).max() < _SAME and np.abs(turned_4 - UPRIGHT).max() < _SAME:
            return place_T3, turn_T4, ()
        far = f"{moves}, {np.linalg.norm(at_3):.3g} m from the base of the URDF, to which it is fixed: it is written"
        place_T3 = place_T3 + _rotated(turn_T4, at_3)
        return place_T3.astype(np.float32), _product(turn_T4, turned_4).astype(np.float32), (far,)
    place, turn = (np.array(given, np.float32) for given in (order.position, order.quaternion_wxyz))
    where = "at the origin, upright" if (order.position, order.quaternion_wxyz) == (ORIGIN, UPRIGHT) else (
        f"where {order.source} has it"
    )  # fmt: skip
    note = f"the motion tells nothing of the base, which stays {where}"
    return np.tile(place, (motion.frames, 1)), np.tile(turn, (motion.frames, 1)), (note,)


def _rotated(turn_T4: np.ndarray, vector_3: np.ndarray) -> np.ndarray:
    """A vector turned by quaternions: v + 2 w (u x v) + 2 u x (u x v)."""
    w_T1, u_T3 = turn_T4[:, :1].astype(np.float64), turn_T4[:, 1:].astype(np.float64)
    across_T3 = np.cross(u_T3, vector_3)
    return vector_3 + 2 * (w_T1 * across_T3 + np.cross(u_T3, across_T3))


def _product(one_T4: np.ndarray, other_4: np.ndarray) -> np.ndarray:
    """Hamilton's product."""
    w_T1, u_T3 = one_T4[:, :1].astype(np.float64), one_T4[:, 1:].astype(np.float64)
    w, u_3 = other_4[0], other_4[1:]
    return np.concatenate([w_T1 * w - u_T3 @ u_3[:, None], w_T1 * u_3 + w * u_T3 + np.cross(u_T3, u_3)], axis=1)
