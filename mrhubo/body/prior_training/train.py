"""How the shipped body prior is trained: `python -m mrhubo.prior --config conf/prior.yaml`.

Loss per pose H, decoded as H^ from a latent z drawn from the posterior q, with chordal distances of the 21 rotations
and distances of all keypoints [m], both by a pseudo-Huber loss rho:

    L = sum_j rho(|R_j - R^_j|_F) + w_position * sum_k rho(|p_k - p^_k|) + w_kl * KL(q(z|H) || N(0, I))
        + w_latent * SW(z, N(0, I)) + w_anatomy * excess(decode(N(0, I)))^2 + w_columns * |A'A - I|^2

SW, the sliced Wasserstein distance of the batch's latents, makes N(0, I) what the poses look like in the latent space,
so that samples are poses; the excess over anatomical ranges keeps samples possible; the last term, the orthonormality
penalty of the six raw numbers of a joint as a matrix A (3, 2), keeps Gram-Schmidt away from its singularities, which
stop second-order solvers. Every batch is mirrored at random; some poses are seen
with noise and asked for without. Clips are held out whole. Legend: B batch, Z latent, J = 21 joints.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import lightning
import torch
from torch import Tensor
from torch.utils.data import DataLoader

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.prior import BodyPrior
from mrhubo.body.prior_training.augmentation import add_missing_motion, add_noise, stand_at_rest
from mrhubo.body.prior_training.losses import orthonormality_penalty, pseudo_huber, sliced_wasserstein
from mrhubo.body.prior_training.measures import measure, reconstruction
from mrhubo.body.prior_training.poses import PoseDataset, RandomBatches, load_training_poses, plausible_frames
from mrhubo.body.skeleton import Skeleton, mirror_pose
from mrhubo.callbacks import Checkpoints, TrainingProgress
from mrhubo.callbacks.small_training import small_trainer, tracked
from mrhubo.config import PriorConfig, fingerprint, to_plain, without_paths
from mrhubo.errors import UserError
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.run_logger import RunLogger
from mrhubo.runtime.trainer import quiet_lightning, run_trainer, stop_at, with_schedule
from mrhubo.runtime.workspace import Workspace

_MEASURED_TRAINING, _MEASURED_HELD_OUT = 50_000, 5_000
"""Poses that the final measures take from the training clips and from those held out."""

_SHOWN = {"val/joint_mm": "held-out joints mm", "val/geodesic_deg": "deg"}
_EXPERIMENT = "body-prior"
_EPOCH = 1_000
"""Steps between validations and checkpoints."""
_ROTATION_DELTA, _POSITION_DELTA = 0.02, 0.002
"""Of the pseudo-Huber losses: rotations as a Frobenius norm, positions in metres."""
_MARGIN = math.radians(5.0)
"""Samples are kept this far inside the anatomical ranges [rad]."""


class PriorTraining(lightning.LightningModule):
    """Loss, validation and optimiser of the body prior."""

    def __init__(self, config: PriorConfig) -> None:
        super().__init__()
        self.config = config
        self.save_hyperparameters(to_plain(config))
        self.prior = BodyPrior(config.hidden, config.latent, config.activation, config.encoder_hidden)
        self.skeleton = Skeleton()

    def on_train_batch_start(self, *_: Any) -> None:
        """Draws of a step depend on (seed, step) alone, so that a resumed training goes on exactly."""
        torch.manual_seed(self.config.seed * 1_000_003 + self.trainer.global_step)

    def training_step(self, pose_BJ6: Tensor, _: int) -> Tensor:
        """One batch of poses (B, 21, 6)."""
        flip = torch.rand(len(pose_BJ6), 1, 1, device=pose_BJ6.device) < 0.5
        pose_BJ6 = torch.where(flip, mirror_pose(pose_BJ6), pose_BJ6)
        pose_BJ6 = add_missing_motion(pose_BJ6, self.config.missing_share)
        pose_BJ6 = stand_at_rest(pose_BJ6, self.config.rest_share)
        seen_BJ6 = add_noise(pose_BJ6, self.config.noise_share)
        mean, log_std = self.prior.posterior(seen_BJ6)
        z_BZ = mean + log_std.exp() * torch.randn_like(mean)
        raw_BJ6 = self.prior.decoder(torch.cat((z_BZ, torch.randn_like(z_BZ[: len(z_BZ) // 4]))))
        decoded = rotation.sixd_to_matrix(raw_BJ6)
        matrices, drawn = decoded[: len(z_BZ)], decoded[len(z_BZ) :]
        anatomy_cost = anatomy.excess(drawn, margin=_MARGIN).square().sum(dim=(1, 2)).mean()
        columns = orthonormality_penalty(raw_BJ6).sum(dim=1).mean()
        latent = sliced_wasserstein(z_BZ)
        target = rotation.sixd_to_matrix(pose_BJ6)
        rotations = pseudo_huber((matrices - target).flatten(2), _ROTATION_DELTA).sum(dim=1).mean()
        distance = self.skeleton.keypoints(matrices) - self.skeleton.keypoints(target)
        positions = pseudo_huber(distance, _POSITION_DELTA).sum(dim=1).mean()
        kl = 0.5 * (mean.square() + (2 * log_std).exp() - 1 - 2 * log_std).sum(-1).mean()
        loss = (
            rotations
            + self.config.w_position * positions
            + self.config.w_kl * kl
            + self.config.w_latent * latent
            + self.config.w_anatomy * anatomy_cost
            + self.config.w_columns * columns
        )
        parts = {"rotation": rotations, "position_m": positions, "kl": kl, "latent": latent}
        parts |= {"loss": loss, "anatomy_rad2": anatomy_cost, "columns": columns}
        self.log_dict({f"train/{name}": value for name, value in parts.items()})
        return loss

    def on_train_batch_end(self, *_: Any) -> None:
        """Stops at the last step, also within an epoch."""
        stop_at(self.config.steps, self.trainer)

    def validation_step(self, pose_BJ6: Tensor, _: int) -> None:
        """Encode, take the mean, decode: distance of the 22 joints and angle of the 21 rotations."""
        error_mm, angle_deg = reconstruction(self.prior, self.skeleton, pose_BJ6)
        values = {"val/joint_mm": error_mm.mean(), "val/geodesic_deg": angle_deg.mean()}
        self.log_dict(values, batch_size=len(pose_BJ6))

    def configure_optimizers(self) -> Any:
        """AdamW, linear warm-up over 2% of the steps, cosine decay to 0."""
        optimizer = torch.optim.AdamW(self.prior.parameters(), self.config.lr, weight_decay=self.config.weight_decay)
        return with_schedule(optimizer, self.config.steps)


@dataclass(frozen=True)
class Split:
    """The plausible frames (F, 21, 6) of the training clips, and of the clips held out, every fourth of them."""

    training: Tensor
    held_out: Tensor
    clips: int
    held_out_clips: list[str]
    dropped_share: float

    @classmethod
    def of(cls, config: PriorConfig, held_out_clips: Collection[str] | None = None) -> Split:
        """Reads the data and draws the clips to hold out, or holds out those of the given names."""
        poses, clips, names = load_training_poses(config.data)
        if held_out_clips is None:
            order = torch.randperm(len(clips), generator=torch.Generator().manual_seed(config.seed)).tolist()
            if unknown := sorted(set(config.held_out_clips) - set(names)):
                raise UserError(f"held_out_clips: {config.data} has no clip '{unknown[0]}'")
            held = set(order[: max(1, round(config.held_out * len(clips)))])
            held |= {i for i, name in enumerate(names) if name in config.held_out_clips}
        else:
            held = {i for i, name in enumerate(names) if name in held_out_clips}
        parts = [[poses[clips[i]] for i in range(len(clips)) if (i in held) == wanted] for wanted in (False, True)]
        training, held_out = (pose[plausible_frames(pose, config.max_excess_deg)] for pose in map(torch.cat, parts))
        if not len(training) or not len(held_out):
            raise UserError(f"max_excess_deg: {config.max_excess_deg:g} leaves no frame to train or to validate on")
        share = 1 - (len(training) + len(held_out)) / len(poses)
        return cls(training, held_out[::4], len(clips), [names[i] for i in sorted(held)], share)

    def training_sample(self, seed: int) -> Tensor:
        """Training poses to measure samples against."""
        order = torch.randperm(len(self.training), generator=torch.Generator().manual_seed(seed))
        return self.training[order[:_MEASURED_TRAINING]]

    def held_out_sample(self) -> Tensor:
        """Held-out poses for the measures, evenly spaced."""
        return self.held_out[:: max(1, len(self.held_out) // _MEASURED_HELD_OUT)]


def train(config: PriorConfig, report: Reporter = SILENT) -> BodyPrior:
    """Trains, measures, saves the weights with their card, and returns the prior."""
    lightning.seed_everything(config.seed, verbose=False)
    split, module = Split.of(config), PriorTraining(config)
    key = fingerprint({k: v for k, v in to_plain(config).items() if k not in ("output", "tracking_dir")})
    with Workspace(config.tracking_dir / "fits", "prior", key) as workspace, quiet_lightning():
        with tracked(config, workspace, _EXPERIMENT) as logger:
            _fit(module, split, workspace, report, logger)
            prior = module.prior.cpu().requires_grad_(False).eval()
            if not all(bool(torch.isfinite(weights).all()) for weights in prior.state_dict().values()):
                raise UserError(f"the training came to NaN; a lower lr than {config.lr:g} helps")
            measures = measure(prior, split.held_out_sample(), split.training_sample(config.seed), config.seed)
            logger.log_metrics({f"held_out/{name}": value for name, value in measures.items()}, config.steps)
            prior.save(config.output, _card(config, split, measures))
        workspace.finish()
    return prior


def _fit(module: PriorTraining, split: Split, workspace: Workspace, report: Reporter, logger: RunLogger) -> None:
    """Lightning's trainer, from the last checkpoint if there is one."""
    config = module.config
    epoch = min(_EPOCH, config.steps)
    saver = Checkpoints(workspace.checkpoints, "val/joint_mm")
    progress = TrainingProgress(config.steps, _SHOWN, report)
    trainer = small_trainer(config.steps, epoch, logger, 100, "auto", progress, saver)
    batches = RandomBatches(len(split.training), config.batch_size, epoch, config.seed)
    in_order = [torch.arange(a, min(a + 4_096, len(split.held_out))) for a in range(0, len(split.held_out), 4_096)]
    run_trainer(
        trainer,
        module,
        workspace.last_checkpoint(),
        DataLoader(PoseDataset(split.training), sampler=batches, batch_size=None),
        DataLoader(PoseDataset(split.held_out), sampler=in_order, batch_size=None),
    )


def _card(config: PriorConfig, split: Split, measures: dict[str, float]) -> dict[str, Any]:
    """What the weights' header says of them."""
    held = len(split.held_out_clips)
    return {
        "name": "mrhubo open body prior",
        "data": "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu), mirrored; free for all uses",
        "credit": "The data used in this project was obtained from mocap.cs.cmu.edu. "
        "The database was created with funding from NSF EIA-0196217.",
        "licence": "Apache-2.0",
        "split": f"by clip: {split.clips - held} for training, {held} held out; the evaluation clips are in neither",
        "dropped": f"{100 * split.dropped_share:.1f}% of the frames, as a joint was more than "
        f"{config.max_excess_deg:g} degrees outside its anatomical range (defects of the recording)",
        "held_out_clips": split.held_out_clips,
        "measures_on_held_out_clips": {name: round(value, 4) for name, value in measures.items()},
        "training": without_paths(config),
        "known_defects": "wrist flexion, collars and toes do not move in the data: plausible angles were added at "
        "random, so the prior allows them and knows nothing of how they go with the arm or the step; the elbows are "
        "pure hinges and all twist of the forearm is in the wrists, so poses of other sources, which share these "
        "turns out differently, have a larger phi",
    }
