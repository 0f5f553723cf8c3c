"""Who kneels, crawls, lies or stands on the hands: how far a robot would be in the floor, and what keeps it out of it.

    python benchmarks/on_the_floor.py [--robots nao,coman] [--postures "all fours,plank" | all] [--rate 30]

Of each posture a motion of 5 seconds is made: standing, one second to get there, one second there, and back. A table a
robot, two rows a posture, as the optimiser answers, and as it would if nothing but soles kept out of the floor: how far
hands, knees, trunk or head are under it, planted soles above it, how far arms point from the person's while it lies
there, the fastest joint by its limit, CPU time. Robots are shipped as conf/ROBOT-whole-body.yaml.
"""

from __future__ import annotations

import sys
import time
import warnings
from math import pi
from unittest import mock

import numpy as np
import torch
from common import print_header, print_table, read_options
from scipy.interpolate import CubicSpline

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.body.skeleton import KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.errors import InputWarning
from mrhubo.evaluation.whole_body import score_whole_body
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.standing import LowBody
from mrhubo.robot import Robot

Turns = dict[str, tuple[float, float, float]]

_DOWN: Turns = {"shoulder": (0, 0, -1.3)}
_AHEAD: Turns = {"shoulder": (0, -1.5, 0)}
_SHIN: Turns = {"knee": (1.5, 0, 0), "ankle": (0.6, 0, 0)}
POSTURES: dict[str, tuple[tuple[float, float, float], Turns]] = {
    "kneels": ((0, 0, 0), {**_DOWN, **_SHIN}),
    "sits on the heels": ((0, 0, 0), {**_DOWN, "hip": (-0.9, 0, 0), "knee": (2.4, 0, 0), "ankle": (0.6, 0, 0)}),
    "all fours": ((1.45, 0, 0), {**_AHEAD, **_SHIN, "hip": (-1.45, 0, 0)}),
    "plank": ((1.25, 0, 0), {**_AHEAD, "ankle": (-0.2, 0, 0)}),
    "on the back": ((-pi / 2, 0, 0), _DOWN),
    "on the belly": ((pi / 2, 0, 0), {**_DOWN, "ankle": (0.8, 0, 0)}),
    "on the side": ((0, 0, pi / 2), _DOWN),
    "sits": ((0, 0, 0), {**_DOWN, "hip": (-1.5, 0, 0)}),
    "on the hands": ((pi, 0, 0), {"shoulder": (0, 0, 1.4)}),
}
"""How a person's root is turned, and joints of both sides, or the left one's; axis-angle [rad]."""
_FLESH_M = {"pelvis": 0.1, "hip": 0.1, "knee": 0.055, "ankle": 0.05, "spine": 0.1, "neck": 0.08, "head": 0.09,
            "shoulder": 0.07, "elbow": 0.045, "heel": 0.0, "toe": 0.0, "foot": 0.0}  # fmt: skip
"""How far a person's skin is from a joint, about."""
_SKIN_M = 0.03
_MOMENTS_S = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def main(argv: list[str]) -> None:
    """Prints a table a robot."""
    options, rest = read_options(argv, robots="nao,coman", postures="all", rate="30")
    if rest:
        sys.exit(f"{rest[0]}: is unknown")
    names = list(POSTURES) if options["postures"] == "all" else options["postures"].split(",")
    torch.set_num_threads(1)
    print_header()
    columns = ["posture", "arms", "in the floor [cm]", "soles float [cm]", "arms off [deg]", "speed", "ms a frame"]
    for name in options["robots"].split(","):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)  # collision meshes that are not there
            retargeter = OptimizationRetargeter(Robot.from_config(f"conf/{name}-whole-body.yaml"))
        rows = []
        for posture in names:
            motion = person(posture, float(options["rate"]))
            rows.append([posture, "bends and is lifted", *_measure(retargeter, motion, True)])
            rows.append(["", "neither", *_measure(retargeter, motion, False)])
        print(f"## {name}\n")
        print_table(columns, rows)
        print()


def person(posture: str, rate: float) -> Motion:
    """Somebody who stands, takes a posture, and stands again."""
    (root_3, turns), joints = POSTURES[posture], len(POSED_JOINT_NAMES)
    keys = np.zeros((2, 1 + joints, 3))
    keys[1, 0] = root_3
    for row, some in enumerate((_DOWN, turns)):
        for joint, (x, y, z) in some.items():
            for side, sign in (("left", 1), ("right", -1)):
                keys[row, 1 + POSED_JOINT_NAMES.index(f"{side}_{joint}")] = x, sign * y, sign * z
    moments_T = np.arange(round(_MOMENTS_S[-1] * rate) + 1) / rate
    turn_TJ3 = CubicSpline(_MOMENTS_S, keys[[0, 0, 1, 1, 0, 0]], bc_type="clamped")(moments_T)
    turn_TJ33 = rotation.axis_angle_to_matrix(torch.from_numpy(turn_TJ3).float())
    place_TK3 = Skeleton().keypoints(turn_TJ33[:, 1:]) @ turn_TJ33[:, 0].mT
    skin_K = torch.tensor([next((m for part, m in _FLESH_M.items() if part in n), _SKIN_M) for n in KEYPOINT_NAMES])
    up_T = -(place_TK3[..., 1] - skin_K).amin(dim=1)
    place_T3 = torch.stack((0 * up_T, up_T, 0 * up_T), dim=1)
    return Motion(posture, turn_TJ33[:, 1:], rate, root_rotation_T33=turn_TJ33[:, 0], root_position_T3=place_T3)


def _measure(retargeter: OptimizationRetargeter, motion: Motion, keeps_out: bool) -> list[str]:
    started, near = time.process_time(), LowBody.near
    with mock.patch.object(LowBody, "near", near if keeps_out else lambda *_: False):
        found = retargeter(motion)
    spent = time.process_time() - started
    assert found.root_position is not None and found.root_quaternion_wxyz is not None
    base_T33 = rotation.wxyz_to_matrix(found.root_quaternion_wxyz)
    score = score_whole_body(retargeter.body_map, motion, found.q, found.root_position, base_T33)
    arms = [i for i, name in enumerate(found.direction_names) if name.endswith(("elbow", "wrist"))]
    there = slice(round(2 * motion.frame_rate), round(3 * motion.frame_rate))
    return [
        f"{score.body_sunk_max_cm:.1f}",
        f"{score.floating_max_cm:.1f}",
        f"{float(found.direction_error_deg[there][:, arms].mean()):.1f}",
        f"{score.speed_max:.2f}",
        f"{1000 * spent / len(motion):.1f}",
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
