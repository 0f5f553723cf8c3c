"""The experiments that chose the body prior's settings: one change at a time, each a tracked training.

    python benchmarks/prior_experiments.py [--config conf/prior.yaml] [--only NAME,NAME] [--motions FOLDER]
        [steps=3000 batch_size=256 ...]

Weights go to `prior_experiments` in the tracking folder; a variant whose weights are there is not trained again.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import torch
from common import print_header, print_table, read_options
from prior import by_clip, direction_angles

from mrhubo.body import BodyPrior
from mrhubo.body.prior_training.train import train
from mrhubo.config import PriorConfig, fingerprint, load_config, without_paths
from mrhubo.errors import UserError
from mrhubo.motion import Motion, find_motions, read_folder
from mrhubo.rotation import matrix_to_sixd
from mrhubo.runtime.locations import default_motions

VARIANTS = {
    "chosen": [],
    "LeakyReLU in place of SiLU": ["activation=leaky_relu"],
    "latent 32": ["latent=32"],
    "latent 64": ["latent=64"],
    "half of the missing motion": ["missing_share=0.4"],
    "encoder 512 wide": ["encoder_hidden=512"],
    "KL weight / 4": ["w_kl=0.0005"],
    "KL weight x 4": ["w_kl=0.008"],
    "no sliced Wasserstein": ["w_latent=0"],
    "no anatomical ranges": ["w_anatomy=0"],
    "no column penalty": ["w_columns=0"],
    "no noise": ["noise_share=0"],
    "none of these four": ["w_latent=0", "w_anatomy=0", "w_columns=0", "noise_share=0"],
}
COLUMNS = {
    "joint_mm": "held-out [mm]",
    "evaluation_mm": "clips [mm]",
    "ik_keypoint_mm": "IK [mm]",
    "ik_zero_keypoint_mm": "IK from z = 0 [mm]",
    "samples_inside": "samples inside",
    "samples_nearest_mm": "nearest [mm]",
    "roc_bent": "ROC bent",
    "roc_grafted": "ROC grafted",
    "noise30_after_deg": "30° noise [deg]",
    "hand fingers": "fingers [deg]",
    "foot up": "soles [deg]",
}


def measures(config: PriorConfig, clips: list[Motion]) -> dict[str, float]:
    """A variant's measures: those in its card, and the reconstruction of some clips: of joints, mean over clips, and of
    where fingers and soles point, mean over frames.
    """
    config.output = config.tracking_dir / "prior_experiments" / f"{fingerprint(without_paths(config))}.safetensors"
    try:
        prior = BodyPrior.open(config.output)
    except UserError:
        train(config)
        prior = BodyPrior.open(config.output)
    found = dict(json.loads(prior.metadata["card"])["measures_on_held_out_clips"])
    angles = direction_angles(prior, torch.cat([matrix_to_sixd(clip.local_TJ33) for clip in clips]))
    means = {part: float(angle.mean()) for part, angle in angles.items()}
    return {**found, **means, "evaluation_mm": by_clip(prior, clips)[1]}


def main(argv: list[str]) -> None:
    """Prints the table."""
    options, argv = read_options(argv, config="conf/prior.yaml", only=",".join(VARIANTS), motions="")
    folders = [Path(options["motions"])] if options["motions"] else default_motions()
    rows, clips = [], read_folder(find_motions(folders))
    for name in options["only"].split(","):
        config = load_config(Path(options["config"]), [*argv, *VARIANTS[name]], PriorConfig)
        found = measures(config, clips)
        rows.append([name, *(f"{found[key]:.3f}" if key in found else "" for key in COLUMNS)])
    print_header()
    print_table(["variant", *COLUMNS.values()], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
