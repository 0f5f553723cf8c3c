"""A robot with legs in a live session: what is sent, and where its soles are by that."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from mrhubo.body import BodyPrior
from mrhubo.config.live import LiveConfig
from mrhubo.fast import FastRetargeter
from mrhubo.fast.plain.robot import place
from mrhubo.fast.plain.soles import turned_points
from mrhubo.fast.rotations import matrix_to_axis_angle, quaternion_to_matrix
from mrhubo.live.body import Root, SeenPose
from mrhubo.live.messages import Content, Heartbeat, Message
from mrhubo.live.output import Output
from mrhubo.live.pilot import Pilot
from mrhubo.live.robot import LiveRobot
from mrhubo.motion import Motion
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.nearest import NearestJoints
from tests.reference.walkers import walker


def make_legged(folder: Path, root: str = "pelvis", thick: bool = False) -> FastRetargeter:
    """A robot of two legs and arms with a waist, hung up at its pelvis or chest, answered by the optimiser, and by a
    confidence that knows nothing. `thick` as for `write_urdf`.
    """
    body_map = walker(folder, root, thick=thick)
    torch.manual_seed(1)
    prior = BodyPrior(hidden=20).eval()
    return FastRetargeter(Retargeter(NearestJoints(body_map), body_map, prior, None, phi_threshold=0.01).describe())


@dataclass
class Sent:
    """What was sent (T)."""

    outputs: list[Output]
    q_TN: np.ndarray
    place_T3: np.ndarray
    turn_T33: np.ndarray
    point_TH3: np.ndarray
    """Ends of soles in the world [m]."""
    lowest_T: np.ndarray
    """Height of what is lowest of the robot [m]."""
    contact_TR: np.ndarray

    @classmethod
    def of(cls, robot: LiveRobot, outputs: list[Output]) -> Sent:
        assert robot.standing is not None and robot.standing.legs is not None
        legs, bases = robot.standing.legs, [output.standing for output in outputs]
        placed = place(robot.standing.kinematics, np.array([output.q_N for output in outputs]))
        place_T3 = np.array([base.base.position_3 for base in bases if base is not None])
        wxyz_T4 = np.array([base.base.quaternion_wxyz_4 for base in bases if base is not None])
        turn_T33 = quaternion_to_matrix(wxyz_T4[:, [1, 2, 3, 0]])
        point_TH3, ball_TJ3 = (
            turned_points(placed, *of) @ turn_T33.mT + place_T3[:, None]
            for of in ((legs.body_H, legs.point_H3), (legs.ball_body_J, legs.ball_J3))
        )
        lowest_T = (ball_TJ3[..., 2] - legs.radius_J).min(axis=1)
        contact_TR = np.array([list(base.contact.values()) for base in bases if base is not None])
        return cls(outputs, placed_q(outputs), place_T3, turn_T33, point_TH3, lowest_T, contact_TR)

    def speed(self, rate: float = 60.0) -> tuple[np.ndarray, np.ndarray]:
        """How fast the base goes [m/s] and turns [rad/s] between two outputs."""
        turned_T3 = matrix_to_axis_angle(self.turn_T33[1:] @ self.turn_T33[:-1].mT)
        return tuple(np.linalg.norm(d, axis=1) * rate for d in (np.diff(self.place_T3, axis=0), turned_T3))  # pyright: ignore


def placed_q(outputs: Sequence[Output]) -> np.ndarray:
    return np.array([output.q_N for output in outputs])


def poses_of(motion: Motion) -> list[SeenPose]:
    """The frames of a motion, with their roots."""
    arrays = motion.arrays
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    return [
        SeenPose(pose, np.ones(21), Root(turn.astype(float), at.astype(float)))
        for pose, turn, at in zip(arrays.local_TJ33, arrays.root_rotation_T33, arrays.root_position_T3, strict=True)
    ]


def drive(
    retargeter: FastRetargeter,
    frames: Iterable[Content | None],
    config: LiveConfig | None = None,
    held: Callable[[int], bool] = lambda frame: True,
    after: int = 0,
) -> tuple[Pilot, Sent]:
    """A session in which a frame comes in each period, and the button is held or not; then silence for some periods."""
    config = config or LiveConfig()
    robot = LiveRobot.of_retargeter(retargeter, config)
    pilot, outputs = Pilot(robot, config, False), []
    for number, content in enumerate([*frames, *[None] * after]):
        now = 50.0 + number / config.rate
        if content is not None:
            pilot.inbox.offer(Message("f", number, now, content), "a", now)
            pilot.inbox.offer(Message("h", number, now, Heartbeat(held(number))), "b", now)
        outputs.append(pilot.tick(now))
    return pilot, Sent.of(robot, outputs)
