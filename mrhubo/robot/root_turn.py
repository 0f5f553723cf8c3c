"""How a robot's base is turned where its waist cannot do what a person's back does (`robot.root_follows`).

The base of a robot with feet is turned as the person's pelvis is. So the chest of a robot without a waist stays upright
where the person's back bends. What the waist cannot do, the base may do:

    W = what the waist can do of S, the turn of the person's chest against the pelvis;  G = S W^T

With `chest`, the robot's pelvis is turned as the person's and by G further: its chest is then turned in the world as
the person's. With `between` it goes half of that way in SO(3). Directions of legs are seen from the pelvis, so they are
turned back by G, and point in the world as the person's do.

W is the nearest to S, in the directions by which the optimiser knows a chest, that the waist's joints reach inside
their limits. It depends on the pose alone, not on how fast the waist is, so that networks, whole motions and streams
all ask for the same.

Legend: B batch, J = 21 posed human joints, W joints of the waist.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES
from mrhubo.body.turns import JointTurns
from mrhubo.errors import UserError, unknown_name
from mrhubo.fast.plain.root_turn import SETTLED_RAD, SWEEPS
from mrhubo.frames import human_axes
from mrhubo.robot.keypoints import Keypoints
from mrhubo.robot.model import Robot
from mrhubo.robot.parts import CHEST, PELVIS, BodyPart

SHARES = {"pelvis": 0.0, "chest": 1.0, "between": 0.5}
"""Of what the waist cannot do, how much the base does."""
_SEEN = [1, 2]
"""Columns of a chest's axes by whose directions the optimiser knows it: up and forward."""


class RootTurn(nn.Module):
    """G, for one robot."""

    axis_W3: Tensor
    limit_W2: Tensor
    rest_33: Tensor

    def __init__(self, robot: Robot, keypoints: Keypoints) -> None:
        """Looks the waist's joints up.

        Raises:
            UserError: the robot has no feet, so that its base stays where it is, or no chest.
        """
        super().__init__()
        if not keypoints.standing:
            raise UserError(
                f"robot.root_follows: '{robot.name}' has no feet, so its base stays where it is; take the entry out"
            )
        if CHEST.name not in keypoints.ends:
            raise UserError("robot.root_follows: robot.keypoints names no chest that the root could follow")
        self.share = SHARES[keypoints.root_follows]
        self._turns = JointTurns([JOINT_NAMES.index(part.joint) for part in (PELVIS, CHEST)])
        for name, tensor in _waist(robot, keypoints).items():
            self.register_buffer(name, tensor.to(robot.lower_N), persistent=False)

    def forward(self, local_BJ33: Tensor) -> Tensor:
        """G (B, 3, 3) of human poses, local rotations (B, 21, 3, 3): as columns, the axes from which legs are seen, in
        the human axes of the person's pelvis.
        """
        chest_B33 = self._turns(local_BJ33)[:, 1].double()
        turn_B33 = chest_B33 @ self.reached(chest_B33).mT
        return (turn_B33 if self.share == 1 else half_way(turn_B33)).to(local_BJ33.dtype)

    def reached(self, chest_B33: Tensor) -> Tensor:
        """W (B, 3, 3): what the waist can do of turns of a chest (B, 3, 3), float64."""
        axes, rest_33 = self.axis_W3.double(), self.rest_33.double()
        limits = self.limit_W2.double().tolist()
        angles = [chest_B33.new_zeros(len(chest_B33)).clamp(*limit) for limit in limits]
        turns = [_about(*pair) for pair in zip(axes, angles, strict=True)]
        for _ in range(SWEEPS if limits else 0):
            moved = 0.0
            for w, (axis_3, limit) in enumerate(zip(axes, limits, strict=True)):
                inner_B33, outer_B33 = (_product(part, chest_B33) for part in (turns[:w], turns[w + 1 :]))
                angle_B = _best_angle(axis_3, limit, outer_B33 @ rest_33, inner_B33.mT @ chest_B33)
                moved = max(moved, float((angle_B - angles[w]).abs().max()))
                angles[w], turns[w] = angle_B, _about(axis_3, angle_B)
            if moved < SETTLED_RAD:
                break
        return _product(turns, chest_B33) @ rest_33


def make_root_turn(robot: Robot, keypoints: Keypoints) -> RootTurn | None:
    """What turns the base further than the person's pelvis; None: nothing does.

    Raises:
        UserError: as for `RootTurn`, or `keypoints.root_follows` is no word for it.
    """
    if keypoints.root_follows not in SHARES:
        raise UserError(f"robot.root_follows: {unknown_name('part', keypoints.root_follows, SHARES)}")
    return RootTurn(robot, keypoints) if SHARES[keypoints.root_follows] else None


def is_turned_back(part: BodyPart) -> bool:
    """Whether directions of a part are turned back by G: those that are seen from the pelvis, but for the chest's."""
    return part.seen_from == PELVIS.name and part.name != CHEST.name


def half_way(turn_B33: Tensor) -> Tensor:
    """Turns (B, 3, 3) about the same axes by half the angles."""
    return rotation.axis_angle_to_matrix(rotation.matrix_to_axis_angle(turn_B33) / 2)


def _waist(robot: Robot, keypoints: Keypoints) -> dict[str, Tensor]:
    """The joints between pelvis and chest, from the pelvis upwards: axes (W, 3) in the human axes of the pelvis at
    home, ranges (W, 2) [rad] from there, and the chest's axes (3, 3) there. What mimics another counts as if it were
    free.
    """
    poses, home_N = robot.forward(robot.home()[None]), robot.home()
    links = [keypoints.ends[part.name].link for part in (PELVIS, CHEST)]
    turn_of = {link: poses.rotation_BL33[0, robot.link_index(link)].double() for link in robot.links}
    pelvis_33, chest_33 = (
        turn_of[link] @ human_axes(keypoints.ends[part.name].axes_23).to(turn_of[link])
        for link, part in zip(links, (PELVIS, CHEST), strict=True)
    )
    down, up = (robot.description.joints_above(link) for link in links)
    path = [(joint, -1.0) for joint in down if joint not in up]
    path += [(joint, 1.0) for joint in reversed(up) if joint not in down]
    axes, limits = [torch.zeros(0, 3).to(pelvis_33)], [torch.zeros(0, 2).to(pelvis_33)]
    for joint, sense in path:
        if not joint.rotary or joint.name not in robot.driven_joints:
            continue
        drive_N = robot.drive_DN[robot.driven_joints.index(joint.name)]
        ratio, n = float(drive_N.sum()) * sense, int(drive_N.abs().argmax())
        ends_2 = ratio * (torch.stack((robot.lower_N[n], robot.upper_N[n])) - home_N[n]).double()
        axes.append((pelvis_33.mT @ turn_of[joint.child] @ torch.from_numpy(joint.axis_3).to(pelvis_33))[None])
        limits.append(ends_2.sort().values[None])
    return {"axis_W3": torch.cat(axes), "limit_W2": torch.cat(limits), "rest_33": pelvis_33.mT @ chest_33}


def _about(axis_3: Tensor, angle_B: Tensor) -> Tensor:
    return rotation.axis_angle_to_matrix(angle_B[:, None] * axis_3)


def _product(turns: list[Tensor], like_B33: Tensor) -> Tensor:
    found_B33 = torch.eye(3).to(like_B33).expand_as(like_B33)
    for turn_B33 in turns:
        found_B33 = found_B33 @ turn_B33
    return found_B33


def _best_angle(axis_3: Tensor, limit: list[float], outer_B33: Tensor, wanted_B33: Tensor) -> Tensor:
    """The angle (B,) inside a range by which columns of one matrix, turned about an axis, come nearest to another's."""
    from_B3X, to_B3X = outer_B33[..., _SEEN], wanted_B33[..., _SEEN]
    sine_B = axis_3 @ torch.linalg.cross(from_B3X, to_B3X, dim=1).sum(-1).mT
    along_BX = (axis_3 @ from_B3X) * (axis_3 @ to_B3X)
    angle_B = torch.atan2(sine_B, (from_B3X * to_B3X).sum((1, 2)) - along_BX.sum(-1))
    low, high = limit
    nearer_B = torch.where((high - angle_B).cos() >= (low - angle_B).cos(), high, low)
    return torch.where((angle_B >= low) & (angle_B <= high), angle_B, nearer_B)
