"""How far the networks of a package are from the optimiser, with its speed limits and without them.

    python benchmarks/imitation.py PACKAGE [--motions FOLDER]

PACKAGE is the folder of a trained retargeter; the motions are those that measure a fit (default), or a folder's, but
for those of validation. The networks answer each frame by itself, and know of no speed. The reference retargeter keeps
the URDF's speed limits, so that the errors of a fit's table hold how far these hold it back, on a robot whose joints
are slower than people. So the networks are also compared with the reference without these limits, and with each frame's
own optimum, to which steps of optimisation lead from the networks' answer.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path

import torch
from common import mean_of, print_header, print_table
from torch import Tensor

from mrhubo.evaluation import Clip, load_motions, score_clip
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.retargeter import Retargeter
from mrhubo.robot import BodyMap

_STEPS = 20
_ENDLESS = 1e6
"""Speed [rad/s] that no joint reaches."""


def main(argv: list[str] | None = None) -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="How far the networks of a package are from the optimiser.")
    parser.add_argument("package", type=Path, help="folder of a trained retargeter")
    parser.add_argument("--motions", type=Path, help="folder of motions (default: those of a fit)")
    given = parser.parse_args(argv)
    print_header()
    retargeter = Retargeter.load(given.package)
    body_map, robot = retargeter.body_map, retargeter.body_map.robot
    config = copy.deepcopy(retargeter.config)
    assert config is not None  # a package has one
    if given.motions is not None:
        config.evaluation.motions = [given.motions]
    motions = load_motions(config, body_map.skeleton, split=False).test
    answers = [retargeter.predict(motion.local_TJ33) for motion in motions]
    free = copy.deepcopy(body_map)
    free.robot.velocity_N.fill_(_ENDLESS)

    def reference(of: BodyMap) -> list[Tensor]:
        optimiser = OptimizationRetargeter(of, smoothness=config.evaluation.smoothness)
        return [optimiser(motion).q for motion in motions]

    def optimum(motion: Motion) -> Tensor:
        return retargeter.predict(motion.local_TJ33, _STEPS, avoid_collisions=False)

    goals = {
        "the reference": reference(body_map),
        "the reference without speed limits": reference(free),
        "each frame's own optimum": [optimum(motion) for motion in motions],
    }
    rows = []
    for name, goal in goals.items():
        clips = [Clip(motion, torch.as_tensor(q_TN)) for motion, q_TN in zip(motions, goal, strict=True)]
        scores = [
            score_clip(clip, q_TN, robot, config.robot.key_links) for clip, q_TN in zip(clips, answers, strict=True)
        ]
        rows.append([name, f"{mean_of(scores, 'joint_rad'):.4f}", f"{mean_of(scores, 'link_cm'):.3f}"])
    print(f"{robot.name}, {len(motions)} motions, {sum(map(len, motions)):,} frames; means over motions\n")
    print_table(["the networks' distance to", "joint [rad]", "link [cm]"], rows)


if __name__ == "__main__":
    main()
