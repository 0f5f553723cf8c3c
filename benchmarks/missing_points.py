"""What should stand where points of an arm are missing: angles to what was taken away, for each way of filling it in.

    python benchmarks/missing_points.py [--motions FOLDER] [--gaps 5] [--rate 10]

Motions are by default those that measure a fit. Of each motion, elbow and wrist of one arm and then of the other are
taken away for a while, so many times, and for good. Angles are means over frames, of upper arm and forearm, seen from
the chest. Filled in by: the frames before and after; the body prior, frame by frame, from the joints that are left; for
what is never seen, also an arm that hangs, a forearm in line with the upper arm, and the prior's mean directions.

Legend: T frames, G frames in gaps, K keypoints.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.body import KEYPOINT_NAMES, BodyPrior, Skeleton, inverse_kinematics
from mrhubo.body.skeleton import JOINT_NAMES, SIDES
from mrhubo.motion import Motion, find_motions, read_folder, resample
from mrhubo.motion.gaps import fill_directions
from mrhubo.reference import angle_between
from mrhubo.rotation import sixd_to_matrix
from mrhubo.runtime.locations import default_motions

SECONDS = (1, 2, 4, 8)
_JOINTS = ("shoulder", "elbow", "wrist")
_GIVEN = [*(f"{side}_{joint}" for joint in (*_JOINTS, "hip", "knee", "ankle") for side in SIDES), "neck", "head"]


def directions(local_TJ33: Tensor, side: str) -> Tensor:
    """Directions (T, 2, 3) of upper arm and forearm, seen from the chest."""
    point_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(local_TJ33)
    places = [KEYPOINT_NAMES.index(f"{side}_{joint}") for joint in _JOINTS]
    return normalize(point_TK3[:, places].diff(dim=1), dim=-1) @ turn_TJ33[:, JOINT_NAMES.index("spine3")]


def gaps_in(motion: Motion, seconds: float, count: int) -> list[slice]:
    """As many gaps of a length, evenly over a motion; none where it is too short."""
    length = round(seconds * motion.frame_rate)
    last = len(motion) - length - 1
    return [slice(s, s + length) for s in torch.linspace(1, last, count).long().tolist()] if last > count else []


def across(direction_T23: Tensor, gap: slice) -> Tensor:
    """Directions (G, 2, 3) in a gap, from the frames before and after."""
    known_T = np.ones(len(direction_T23), dtype=bool)
    known_T[gap] = False
    bones = direction_T23.numpy().swapaxes(0, 1)
    return torch.from_numpy(np.stack([fill_directions(bone_T3, known_T)[gap] for bone_T3 in bones], axis=1)).float()


def by_prior(prior: BodyPrior, local_TJ33: Tensor, side: str, hidden: Sequence[str]) -> Tensor:
    """Directions (T, 2, 3) by the body prior, where some joints of an arm are hidden."""
    names = [name for name in _GIVEN if name not in {f"{side}_{joint}" for joint in hidden}]
    point_TK3 = Skeleton().keypoints(local_TJ33)
    targets = {name: point_TK3[:, KEYPOINT_NAMES.index(name)] for name in names}
    return directions(sixd_to_matrix(inverse_kinematics(prior, targets)), side)


def row(name: str, found: Sequence[Tensor], true: Sequence[Tensor]) -> list[str]:
    """Mean angles [deg] of upper arm and forearm."""
    error_2 = torch.rad2deg(angle_between(torch.cat(list(found)), torch.cat(list(true)))).mean(dim=0)
    return [name, *(f"{float(error):.1f}" for error in error_2)]


def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, rest = read_options(argv, motions="", gaps="5", rate="10")
    if rest:
        sys.exit("usage: python benchmarks/missing_points.py [--motions FOLDER] [--gaps N] [--rate N]")
    print_header()
    count, rate = int(options["gaps"]), float(options["rate"])
    folder = find_motions([Path(options["motions"])] if options["motions"] else default_motions())
    motions = [resample(motion, rate) for motion in read_folder(folder)]
    prior, rows, hidden_poses, true = BodyPrior.open(), [], [], []
    for seconds in SECONDS:
        filled, away = [], []
        for motion, side in ((motion, side) for motion in motions for side in SIDES):
            direction_T23 = directions(motion.local_TJ33, side)
            for gap in gaps_in(motion, seconds, count):
                filled.append(across(direction_T23, gap))
                away.append(direction_T23[gap])
                if seconds == SECONDS[0]:
                    hidden_poses.append((side, motion.local_TJ33[gap]))
                    true.append(direction_T23[gap])
        if away:
            rows.append(row(f"before and after, {seconds} s", filled, away))
    if not true:
        sys.exit(f"{folder}: no motion is long enough")
    samples_BJ33 = prior.decode_matrices(torch.randn(4_000, prior.latent, generator=torch.Generator().manual_seed(0)))
    mean = {side: normalize(directions(samples_BJ33, side).mean(dim=0), dim=-1) for side in SIDES}
    found = {
        hidden: [by_prior(prior, poses, side, hidden) for side, poses in hidden_poses]
        for hidden in ((), ("elbow", "wrist"), ("wrist",))
    }
    rows += [row("body prior, nothing away", found[()], true), row("body prior", found["elbow", "wrist"], true)]
    rows.append(row("body prior, wrist away", found["wrist",], true))
    down = torch.tensor([0.0, -1.0, 0.0])
    rows.append(row("hanging", [down.expand_as(way) for way in true], true))
    rows.append(row("forearm in line", [way[:, :1].expand_as(way) for way in true], true))
    always = [mean[side].expand_as(way) for (side, _), way in zip(hidden_poses, true, strict=True)]
    rows.append(row("the prior's mean", always, true))
    print(f"{len(motions)} motions of {folder.name}, {sum(map(len, true)):,} frames\n")
    print_table(["filled in by", "upper arm [deg]", "forearm [deg]"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
