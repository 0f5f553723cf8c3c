"""Whether a retargeter's confidence means something: on motions as they are, re-shared, noisy, and with broken arms.

    python benchmarks/confidence.py PACKAGE [--motions FOLDER] [--frames 200] [--picture FILE.png] [--calibrate]

PACKAGE is the folder of a trained retargeter. Of every motion in FOLDER (default: those that measure a fit) the middle
frames are retargeted as they are and spoilt in known ways; the error of an answer is its limbs' mean angle to those of
the person as he stood, whatever was done to the input. A frame is bad where that exceeds the 90th percentile of the
clean frames. With --calibrate the weights are found anew and printed, instead of those that the package has.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table

from mrhubo.motion import Motion, find_motions, read_folder, reshare
from mrhubo.reference import angle_between
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.calibration import calibrate
from mrhubo.retargeter.confidence import GOOD_DEG
from mrhubo.retargeter.spoiling import bent_backwards, dislocated, shaken
from mrhubo.runtime.locations import default_motions
from mrhubo.view import save_png
from mrhubo.view.reliability import reliability_curve, reliability_sheet, roc_area

NOISE_DEG = (5.0, 10.0, 20.0)
SEED = 1
"""Other draws than those of the calibration."""


def versions(motion: Motion, retargeter: Retargeter, number: int) -> dict[str, Motion]:
    """A motion as it is, and spoilt."""
    generator = torch.Generator().manual_seed(1_000 * SEED + number)
    local_TJ33, parts = motion.local_TJ33, retargeter.body_map.keypoints.parts
    angle_T = 30 + 60 * torch.rand(len(motion), generator=generator)
    one = dislocated(local_TJ33[:1], parts, 0.7, 120.0, generator)
    # The same joints, turned by as much in all frames: nothing shakes.
    turned_TJ33 = (one @ local_TJ33[:1].mT) @ local_TJ33
    found = {
        "clean": local_TJ33,
        "re-shared": reshare(motion, number).local_TJ33,
        **{f"noise of {deg:g} deg": shaken(local_TJ33, deg, generator) for deg in NOISE_DEG},
        "elbows backwards": bent_backwards(local_TJ33, angle_T, parts),
        "dislocated": turned_TJ33,
    }
    return {name: dataclasses.replace(motion, local_TJ33=pose) for name, pose in found.items()}


def measure(retargeter: Retargeter, motions: list[Motion], rated: bool) -> dict[str, dict[str, np.ndarray]]:
    """By what was done, of all frames: confidence (T,) and of branches (T, C), error (T, C) [deg]; `rated`: whether the
    frame rate is told.
    """
    parts: dict[str, list[dict[str, np.ndarray]]] = {}
    for number, motion in enumerate(motions):
        human_TD3 = retargeter.body_map.human_directions(motion.local_TJ33)
        for name, spoilt in versions(motion, retargeter, number).items():
            result = retargeter(spoilt if rated else spoilt.local_TJ33)
            robot_TD3 = retargeter.body_map.robot_directions(retargeter.body_map.robot.forward(result.q))
            error_TD = torch.rad2deg(angle_between(robot_TD3, human_TD3))
            error_TC = torch.stack([error_TD[:, list(b.columns)].mean(dim=1) for b in retargeter.branches], dim=1)
            found = {"frame": result.confidence, "branch": result.branch_confidence, "error": error_TC}
            parts.setdefault(name, []).append({key: value.numpy().astype(float) for key, value in found.items()})
    return {name: {key: np.concatenate([p[key] for p in of]) for key in of[0]} for name, of in parts.items()}


def main(argv: list[str]) -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description="Whether a retargeter's confidence means something.")
    parser.add_argument("package", type=Path, help="folder of a trained retargeter")
    parser.add_argument("--motions", type=Path, help="folder of motions (default: those that measure a fit)")
    parser.add_argument(
        "--frames", type=int, default=200, help="of each motion, from its middle (default: %(default)s)"
    )
    parser.add_argument("--picture", type=Path, help="where to draw reliability and ROC curves, .png")
    parser.add_argument("--calibrate", action="store_true", help="find the weights anew")
    given = parser.parse_args(argv)
    retargeter = Retargeter.load(given.package)
    print_header()
    if given.calibrate:
        retargeter.confidence = calibrate(retargeter)
        print(f"{retargeter.confidence}\n")
    motions = []
    for motion in read_folder(given.motions or find_motions(default_motions())):
        first = max(0, (len(motion) - given.frames) // 2)
        motions.append(dataclasses.replace(motion, local_TJ33=motion.local_TJ33[first : first + given.frames]))
    promised, told_apart, rows = {}, {}, []
    for way, rated in (("with frame rate", True), ("without", False)):
        found = measure(retargeter, motions, rated)
        limit = float(np.quantile(found["clean"]["error"].mean(axis=1), 0.9))
        for name, of in found.items():
            error_T = of["error"].mean(axis=1)
            low, middle = np.quantile(of["frame"], (0.1, 0.5))
            good = float((of["error"] < GOOD_DEG).all(axis=1).mean())
            scores = np.concatenate((found["clean"]["frame"], of["frame"]))
            spoilt = np.arange(len(scores)) >= len(found["clean"]["frame"])
            area = f"{roc_area(scores, spoilt):.3f}" if name != "clean" else "-"
            cells = [way, name, f"{error_T.mean():.1f}", f"{(error_T > limit).mean():.0%}", f"{good:.0%}"]
            rows.append([*cells, f"{of['frame'].mean():.2f}", f"{middle:.2f}", f"{low:.2f}", area])
        whole = {key: np.concatenate([of[key] for of in found.values()]) for key in ("frame", "branch", "error")}
        promised[way] = (whole["branch"].ravel(), (whole["error"] < GOOD_DEG).ravel())
        told_apart[f"error beyond {limit:.1f} deg, {way}"] = (whole["frame"], whole["error"].mean(axis=1) > limit)
        both = [found[name]["frame"] for name in ("clean", "re-shared", "elbows backwards")]
        backwards = np.arange(sum(map(len, both))) >= len(both[0]) + len(both[1])
        told_apart[f"elbows backwards, {way}"] = (np.concatenate(both), backwards)
    print_table(
        ["", "input", "error [deg]", "bad", "good", "confidence", "median", "lowest tenth", "ROC area to clean"], rows
    )
    print()
    print_table(["told apart by confidence", "ROC area"], [[n, f"{roc_area(*x):.3f}"] for n, x in told_apart.items()])
    print()
    curves = [(way, *row) for way, x in promised.items() for row in zip(*reliability_curve(*x), strict=True)]
    print_table(
        ["branches of all frames", "confidence", f"within {GOOD_DEG:g} deg", "count"],
        [[way, f"{mean:.2f}", f"{share:.2f}", f"{count:,}"] for way, mean, share, count in curves],
    )
    if given.picture:
        print(f"\npicture: {save_png(reliability_sheet(promised, told_apart), given.picture)}")


if __name__ == "__main__":
    main(sys.argv[1:])
