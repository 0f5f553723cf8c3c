"""Encode, mean, decode: error of the shipped body prior on every motion of a folder.

python benchmarks/prior.py [FOLDER]          default: the evaluation motions
"""

from __future__ import annotations

import sys
from pathlib import Path

import torch
from common import print_header, print_table

from mrhubo.body import BodyPrior, Skeleton
from mrhubo.body.measures import reconstruction
from mrhubo.locations import default_motions
from mrhubo.motion import find_motions, read_folder


def main(argv: list[str]) -> None:
    """Prints the table."""
    print_header()
    prior, skeleton = BodyPrior.open(), Skeleton()
    rows, means = [], []
    for motion in read_folder(find_motions([Path(argv[0])] if argv else default_motions())):
        with torch.no_grad():
            joints_mm, angles_deg = reconstruction(prior, skeleton, motion.pose_TJ6)
            phi = prior.reconstruction_error(motion.pose_TJ6).mean()
        means.append([float(joints_mm.mean()), float(angles_deg.mean())])
        rows.append([motion.name, str(len(joints_mm)), *[f"{m:.2f}" for m in means[-1]], f"{phi:.5f}"])
    mean = torch.tensor(means).mean(0)
    rows.append(["mean over clips", "", f"{mean[0]:.2f}", f"{mean[1]:.2f}", ""])
    print_table(["clip", "frames", "joints [mm]", "rotations [deg]", "phi"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
