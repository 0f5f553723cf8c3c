"""The measures of the body prior: the shipped one, another of ours, or VPoser.

    python benchmarks/prior.py [--motions FOLDER] [--prior FILE | --vposer V02_05] [--config conf/prior.yaml]
        [--seconds 3]

The first table is on the clips held out of training (needs the training data that the config names), and on the motions
of a folder, by default the evaluation clips; the second is by clip, the third by joint, the fourth by direction, as
networks see them; then the speed of decoding.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import torch
from common import print_header, print_table
from torch import Tensor

from mrhubo.body import POSED_JOINT_NAMES, BodyPrior, Skeleton, VPoser
from mrhubo.body.prior_training.measures import NOISE_DEG, measure, reconstruction
from mrhubo.body.prior_training.train import Split
from mrhubo.body.skeleton import PAIRED_JOINTS, SIDES
from mrhubo.config import PriorConfig, load_config
from mrhubo.errors import UserError
from mrhubo.motion import Motion, find_motions, read_folder
from mrhubo.reference import angle_between
from mrhubo.robot import build_body_map
from mrhubo.rotation import matrix_to_sixd, sixd_to_matrix
from mrhubo.runtime.locations import default_motions

ROWS = {
    "encode, mean, decode: mean joint error [mm]": "joint_mm",
    "- worst 1% of the poses [mm]": "joint_mm_worst",
    "encode, mean, decode: mean rotation error [deg]": "geodesic_deg",
    "- worst 1% of the poses [deg]": "geodesic_deg_worst",
    "latent IK, 13 keypoints: mean keypoint error [mm]": "ik_keypoint_mm",
    "- all joints above the hips [mm]": "ik_upper_body_mm",
    "- started from z = 0 [mm]": "ik_zero_keypoint_mm",
    "ROC area (a): one elbow or knee backwards": "roc_bent",
    "ROC area (b): random rotations": "roc_random",
    "ROC area (c): others' limbs, an arm through the trunk": "roc_grafted",
    "samples of N(0, I) inside anatomical ranges": "samples_inside",
    "- mean joint distance to the nearest training pose [mm]": "samples_nearest_mm",
    **{f"noise of {n:.0f} deg: rotation error after denoising [deg]": f"noise{n:.0f}_after_deg" for n in NOISE_DEG},
    **{f"noise of {n:.0f} deg: joint error before [mm]": f"noise{n:.0f}_before_mm" for n in NOISE_DEG},
    **{f"noise of {n:.0f} deg: joint error after [mm]": f"noise{n:.0f}_after_mm" for n in NOISE_DEG},
}
TARGETS = {"joint_mm": "<= 4", "ik_keypoint_mm": "<= 5", "roc_bent": ">= 0.97", "roc_random": ">= 0.999"}
TARGETS |= {"samples_inside": ">= 0.99"}
DIRECTIONS = Path(__file__).resolve().parent.parent / "conf" / "coman-whole-body.yaml"
"""Of a robot that has all parts of a body but a head."""
NAMES = {"elbow": "upper arm", "wrist": "forearm", "knee": "thigh", "ankle": "shin"}
"""Of limbs, which are called after where they end."""


def training_poses(prior: BodyPrior, config: Path) -> tuple[Tensor, Tensor] | None:
    """Held-out and training poses of the prior's card, those of its own measures; None without the data or the card."""
    held_out_clips = json.loads(prior.metadata["card"]).get("held_out_clips", [])
    try:
        settings = load_config(config, (), PriorConfig)
        split = Split.of(settings, held_out_clips)
    except UserError:
        return None
    return split.held_out_sample(), split.training_sample(settings.seed)


@torch.no_grad()
def by_clip(prior: BodyPrior, motions: list[Motion]) -> tuple[list[list[str]], float]:
    """Reconstruction of every clip, and the joint error's mean over clips."""
    rows, means = [], []
    for motion in motions:
        pose_TJ6 = matrix_to_sixd(motion.local_TJ33)
        joints_mm, angles_deg = reconstruction(prior, Skeleton(), pose_TJ6)
        phi = prior.reconstruction_error(pose_TJ6).mean()
        means.append([float(joints_mm.mean()), float(angles_deg.mean())])
        rows.append([motion.name, str(len(joints_mm)), *[f"{m:.2f}" for m in means[-1]], f"{phi:.5f}"])
    mean = torch.tensor(means).mean(0)
    return [*rows, ["mean over clips", "", f"{mean[0]:.2f}", f"{mean[1]:.2f}", ""]], float(mean[0])


@torch.no_grad()
def by_joint(prior: BodyPrior, columns: list[Tensor]) -> list[list[str]]:
    """Mean rotation error of every joint [deg], left and right together, for each set of poses."""
    errors = [reconstruction(prior, Skeleton(), poses)[1].mean(dim=0) for poses in columns]
    both = {f"{side}_{name}": name for side in SIDES for name in PAIRED_JOINTS}
    parts = [both.get(name, name) for name in POSED_JOINT_NAMES]
    rows = []
    for part in dict.fromkeys(parts):
        joints = [i for i, other in enumerate(parts) if other == part]
        rows.append([part, *(f"{float(error[joints].mean()):.2f}" for error in errors)])
    return rows


@torch.no_grad()
def direction_angles(prior: BodyPrior, pose_BJ6: Tensor) -> dict[str, Tensor]:
    """Angles [deg] between each direction of a whole body before and after, by part; left and right in one."""
    body_map = build_body_map(load_config(DIRECTIONS).robot, Skeleton())
    before, after = (sixd_to_matrix(pose) for pose in (pose_BJ6, prior.denoise(pose_BJ6)))
    angle_BD = torch.rad2deg(angle_between(body_map.human_directions(before), body_map.human_directions(after)))
    found: dict[str, list[Tensor]] = {}
    for name, column in zip(body_map.measured_names, body_map.measured, strict=True):
        part = name.removeprefix(f"{SIDES[0]}_").removeprefix(f"{SIDES[1]}_")
        found.setdefault(NAMES.get(part, part.replace("_", " ")), []).append(angle_BD[:, column])
    return {part: torch.cat(angles) for part, angles in found.items()}


def by_direction(prior: BodyPrior, columns: list[Tensor]) -> list[list[str]]:
    """Mean of each direction's angle [deg], and what 95% stay below, for each set of poses."""
    found = [direction_angles(prior, pose_BJ6) for pose_BJ6 in columns]
    rows = []
    for part in found[0]:
        cells = [angles[part] for angles in found]
        most = [float(cell[:: max(1, len(cell) // 1_000_000)].quantile(0.95)) for cell in cells]
        rows.append([part, *(f"{float(cell.mean()):.1f}, {end:.1f}" for cell, end in zip(cells, most, strict=True))])
    return rows


@torch.no_grad()
def poses_per_second(prior: BodyPrior, seconds: float, batch: int = 2_000) -> tuple[float, float]:
    """Poses decoded, and decoded with all keypoints, per second on one thread: medians."""
    skeleton, z = Skeleton(), torch.randn(batch, prior.latent)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    rates = []
    for work in (lambda: prior.decode_matrices(z), lambda: skeleton.keypoints(prior.decode_matrices(z))):
        work()
        times, end = [], time.perf_counter() + seconds
        while time.perf_counter() < end:
            start = time.perf_counter()
            work()
            times.append(time.perf_counter() - start)
        rates.append(batch / float(torch.tensor(times).median()))
    torch.set_num_threads(threads)
    return rates[0], rates[1]


def main(argv: list[str]) -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--motions", type=Path)
    parser.add_argument("--prior", type=Path)
    parser.add_argument("--vposer", type=Path)
    parser.add_argument("--config", type=Path, default=Path("conf/prior.yaml"))
    parser.add_argument("--seconds", type=float, default=3.0, help="for which each speed is measured")
    given = parser.parse_args(argv)
    print_header()
    prior = VPoser.open(given.vposer) if given.vposer else BodyPrior.open(given.prior)
    folder = find_motions([given.motions] if given.motions else default_motions())
    motions = read_folder(folder)
    clips, mean_mm = by_clip(prior, motions)
    training = training_poses(prior, given.config)
    everything = torch.cat([matrix_to_sixd(motion.local_TJ33) for motion in motions])
    evaluation = measure(prior, everything, training[1] if training else None)
    held_out = measure(prior, *training) if training else {}
    columns = {"held-out clips": held_out, f"{folder.name}, {len(motions)} clips": {**evaluation, "joint_mm": mean_mm}}
    rows = [
        [title, *(f"{values[key]:.4g}" if key in values else "" for values in columns.values()), TARGETS.get(key, "")]
        for title, key in ROWS.items()
    ]
    print_table(["measure", *columns, "target"], rows)
    print()
    print_table(["clip", "frames", "joints [mm]", "rotations [deg]", "phi"], clips)
    print()
    sets = [*([training[0]] if training else []), everything]
    names = [*(["held-out clips [deg]"] if training else []), f"{folder.name} [deg]"]
    print_table(["joint", *names], by_joint(prior, sets))
    print()
    print_table(["direction", *(name.replace("[deg]", "mean, 95% [deg]") for name in names)], by_direction(prior, sets))
    decoded, with_keypoints = poses_per_second(prior, given.seconds)
    print(f"\none thread, batch 2000: {decoded:,.0f} poses/s decoded, {with_keypoints:,.0f} decoded with 36 keypoints")


if __name__ == "__main__":
    main(sys.argv[1:])
