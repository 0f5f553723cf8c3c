"""How the shipped body prior is trained: `python -m mrhubo.body.training --config conf/prior.yaml`.

Loss per pose, with squared chordal distances of the 21 rotations and squared distances of all keypoints [m^2]:

    L = sum_j |R_j - R^_j|_F^2 + w_position * sum_k |p_k - p^_k|^2 + w_kl * KL(q(z|H) || N(0, I))

Every batch is mirrored at random. The CMU data has no wrist flexion, so plausible wrist angles are added at random.
Clips are held out whole. Legend: B batch, F frames, J = 21 joints.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.measures import measure, reconstruction, turn_joints
from mrhubo.body.prior import ACTIVATIONS, SHIPPED_WEIGHTS, BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES, Skeleton, mirror_pose
from mrhubo.config import bounded, choice, fingerprint, parse_arguments, run_command, to_plain
from mrhubo.errors import UserError
from mrhubo.tracking import git_commit, open_logger, resumable_run
from mrhubo.workspace import Workspace

_WRISTS = [POSED_JOINT_NAMES.index("left_wrist"), POSED_JOINT_NAMES.index("right_wrist")]
_ROTATION_KNEE, _POSITION_KNEE = 0.02, 0.002
_MARGIN = math.radians(3.0)
"""Samples are kept this far inside the anatomical ranges [rad]."""
_KNOWN, _UNSEEN = 50_000, 5_000
"""Poses that the final measures take from the training clips and from those held out."""
_WRIST_STD_DEG = (30.0, 12.0)
_WRIST_LIMIT_DEG = (75.0, 28.0)


@dataclass
class PriorConfig:
    """Training of the body prior."""

    data: Path
    """File of training poses: `poses` (F, 66) axis-angle, root first; `clip_starts`, one more than clips;
    `clip_ids`."""
    output: Path = SHIPPED_WEIGHTS
    """Where the weights go (.safetensors)."""
    steps: int = bounded(30_000, 1, 100_000_000)
    """Optimiser steps."""
    batch_size: int = bounded(1_024, 2, 1_000_000)
    """Poses per step."""
    lr: float = bounded(1e-3, 1e-9, 1.0)
    """Peak learning rate of AdamW; cosine decay to 0."""
    weight_decay: float = bounded(1e-4, 0.0, 1.0)
    """Weight decay of AdamW."""
    hidden: int = bounded(512, 8, 65_536)
    """Width of the decoder's two hidden layers."""
    encoder_hidden: int = bounded(512, 8, 65_536)
    """Width of the encoder's two hidden layers."""
    latent: int = bounded(32, 1, 1_024)
    """Size of the latent."""
    activation: str = choice("silu", *ACTIVATIONS)
    """Activation of the hidden layers; second-order solvers need a smooth one."""
    w_position: float = bounded(50.0, 0.0)
    """Weight of the squared keypoint distances, 1/m^2."""
    w_kl: float = bounded(5e-4, 0.0)
    """Weight of the Kullback-Leibler divergence from N(0, I)."""
    w_latent: float = bounded(0.0, 0.0)
    """Weight of the sliced Wasserstein distance between the batch's latents and N(0, I)."""
    w_anatomy: float = bounded(0.0, 0.0)
    """Weight of the squared excess [rad^2] over anatomical ranges of poses decoded from N(0, I)."""
    w_columns: float = bounded(0.0, 0.0)
    """Weight that keeps the six raw numbers of every joint near two orthogonal unit vectors."""
    noise_share: float = bounded(0.0, 0.0, 1.0)
    """Share of the poses that the encoder sees with noise, and the decoder has to give clean."""
    max_excess_deg: float = bounded(20.0, 0.0)
    """Frames with a joint further outside its anatomical range than this are dropped."""
    wrist_share: float = bounded(0.5, 0.0, 1.0)
    """Share of the poses that get random wrist flexion and deviation."""
    held_out: float = bounded(0.05, 0.001, 0.5)
    """Share of the clips held out for validation."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of weights, split and draws."""
    tracking_dir: Path = field(default_factory=lambda: Path("mlruns"))
    """Folder of the MLflow database."""


def load_training_poses(path: Path) -> tuple[Tensor, list[slice], list[str]]:
    """Poses (F, 21, 6) float32, the frames of each clip, and the clips' names.

    Raises:
        UserError: the file is missing, damaged, or holds other arrays than expected.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            poses, starts, names = archive["poses"], archive["clip_starts"], archive["clip_ids"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise UserError(f"data: {path} cannot be read as training poses: {error}") from error
    if poses.ndim != 2 or poses.shape[1] != 66 or len(starts) != len(names) + 1 or starts[-1] != len(poses):
        raise UserError(f"data: {path}: expected poses (F, 66) and clip_starts up to F, found poses {poses.shape}")
    if not np.isfinite(poses).all():
        raise UserError(f"data: {path}: poses holds NaN or infinite numbers")
    sixd = torch.empty(len(poses), len(POSED_JOINT_NAMES), 6)
    for start in range(0, len(poses), 50_000):
        block = torch.from_numpy(poses[start : start + 50_000, 3:].astype(np.float32)).unflatten(-1, (-1, 3))
        sixd[start : start + 50_000] = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(block))
    return sixd, [slice(int(a), int(b)) for a, b in zip(starts[:-1], starts[1:], strict=True)], [str(n) for n in names]


def random_wrists(pose_BJ6: Tensor, share: float) -> Tensor:
    """Turns the wrists of a random share of the poses by plausible flexion (about z) and deviation (about y)."""
    count = len(pose_BJ6)
    std = torch.deg2rad(pose_BJ6.new_tensor(_WRIST_STD_DEG))
    limit = torch.deg2rad(pose_BJ6.new_tensor(_WRIST_LIMIT_DEG))
    angles = (torch.randn(count, 2, 2, device=pose_BJ6.device) * std).clamp(-limit, limit)
    angles = angles * (torch.rand(count, 2, 1, device=pose_BJ6.device) < share)
    flexion, deviation = angles.unbind(-1)
    turn = rotation.axis_angle_to_matrix(torch.stack((torch.zeros_like(flexion), deviation, flexion), dim=-1))
    wrists = rotation.matrix_to_sixd(rotation.sixd_to_matrix(pose_BJ6[:, _WRISTS]) @ turn)
    return pose_BJ6.index_copy(1, torch.tensor(_WRISTS, device=pose_BJ6.device), wrists)


def add_noise(pose_BJ6: Tensor, share: float) -> Tensor:
    """Turns joints of a random share of the poses about random axes.

    Half of them at every joint, by up to 40 degrees, the same angle for all joints; the others at one joint, by up to
    120 degrees.
    """
    batch, device = len(pose_BJ6), pose_BJ6.device
    everywhere = torch.rand(batch, 1, device=device) * 40.0
    one = torch.nn.functional.one_hot(torch.randint(len(POSED_JOINT_NAMES), (batch,)), len(POSED_JOINT_NAMES))
    single = torch.rand(batch, 1, device=device) * 120.0 * one.to(device)
    angle = torch.where(torch.rand(batch, 1, device=device) < 0.5, everywhere, single)
    noisy = torch.rand(batch, device=device) < share
    turned = turn_joints(pose_BJ6[noisy], torch.deg2rad(angle[noisy]))
    return pose_BJ6.index_put((noisy.nonzero()[:, 0],), turned)


def _length(x: Tensor, knee: float) -> Tensor:
    """Euclidean length of the last axis, quadratic below the knee: the mean error counts, not the mean square."""
    return (x.square().sum(-1) + knee * knee).sqrt() - knee


def sliced_wasserstein(z_BZ: Tensor, slices: int = 64) -> Tensor:
    """Squared sliced Wasserstein-2 distance between the latents (B, Z) and N(0, I), over random directions.

    Source: Kolouri et al., "Sliced Wasserstein Auto-Encoders" (ICLR 2019).
    """
    batch, latent = z_BZ.shape
    direction = torch.nn.functional.normalize(torch.randn(latent, slices, device=z_BZ.device), dim=0)
    level = (torch.arange(batch, device=z_BZ.device) + 0.5) / batch
    expected = math.sqrt(2.0) * torch.erfinv(2 * level - 1)
    return ((z_BZ @ direction).sort(dim=0).values - expected[:, None]).square().mean()


def column_defect(raw_BJ6: Tensor) -> Tensor:
    """How far the six raw numbers of each joint are from two orthogonal unit vectors: (B, 21), 0 if they are.

    Where a raw vector shrinks to nothing or both become parallel, Gram-Schmidt has a singularity, and second-order
    latent inverse kinematics gets stuck beside it.
    """
    first, second = raw_BJ6[..., :3], raw_BJ6[..., 3:]
    a, b, ab = first.square().sum(-1), second.square().sum(-1), (first * second).sum(-1)
    return (a - 1).square() + (b - 1).square() + 2 * ab.square()


class PriorTraining(lightning.LightningModule):
    """Loss, validation and optimiser of the body prior."""

    def __init__(self, config: PriorConfig) -> None:
        super().__init__()
        self.config = config
        self.save_hyperparameters(to_plain(config))
        self.prior = BodyPrior(config.hidden, config.latent, config.activation, config.encoder_hidden)
        self.skeleton = Skeleton()

    def on_train_epoch_start(self) -> None:
        """Draws of an epoch depend on (seed, epoch) alone, so that a resumed training goes on exactly."""
        torch.manual_seed(self.config.seed * 1_000_003 + self.current_epoch)

    def training_step(self, pose_BJ6: Tensor, _: int) -> Tensor:
        """One batch of poses (B, 21, 6)."""
        flip = torch.rand(len(pose_BJ6), 1, 1, device=pose_BJ6.device) < 0.5
        pose_BJ6 = torch.where(flip, mirror_pose(pose_BJ6), pose_BJ6)
        pose_BJ6 = random_wrists(pose_BJ6, self.config.wrist_share)
        seen_BJ6 = add_noise(pose_BJ6, self.config.noise_share)
        mean, log_std = self.prior.posterior(seen_BJ6)
        z_BZ = mean + log_std.exp() * torch.randn_like(mean)
        raw_BJ6 = self.prior.decode_raw(torch.cat((z_BZ, torch.randn_like(z_BZ[: len(z_BZ) // 4]))))
        decoded = rotation.sixd_to_matrix(raw_BJ6)
        matrices, drawn = decoded[: len(z_BZ)], decoded[len(z_BZ) :]
        anatomy_cost = anatomy.excess(drawn, margin=_MARGIN).square().sum(dim=(1, 2)).mean()
        columns = column_defect(raw_BJ6).sum(dim=1).mean()
        latent = sliced_wasserstein(z_BZ)
        target = rotation.sixd_to_matrix(pose_BJ6)
        rotations = _length((matrices - target).flatten(2), _ROTATION_KNEE).sum(dim=1).mean()
        distance = self.skeleton.keypoints(matrices) - self.skeleton.keypoints(target)
        positions = _length(distance, _POSITION_KNEE).sum(dim=1).mean()
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
        if self.trainer.global_step >= self.config.steps:
            self.trainer.should_stop = True

    def validation_step(self, pose_BJ6: Tensor, _: int) -> None:
        """Encode, take the mean, decode: distance of the 22 joints and angle of the 21 rotations."""
        error_mm, angle_deg = reconstruction(self.prior, self.skeleton, pose_BJ6)
        values = {"val/joint_mm": error_mm.mean(), "val/geodesic_deg": angle_deg.mean()}
        self.log_dict(values, batch_size=len(pose_BJ6), prog_bar=True)

    def configure_optimizers(self) -> Any:
        """AdamW, linear warm-up over 2% of the steps, cosine decay to 0."""
        optimizer = torch.optim.AdamW(self.prior.parameters(), self.config.lr, weight_decay=self.config.weight_decay)
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": cosine_schedule(optimizer, self.config.steps), "interval": "step"},
        }


def cosine_schedule(optimizer: torch.optim.Optimizer, steps: int) -> torch.optim.lr_scheduler.LambdaLR:
    """Learning-rate factor: linear warm-up over 2% of the steps, then cosine decay to 0 at the last."""
    warm_up = max(1, steps // 50)
    return torch.optim.lr_scheduler.LambdaLR(
        optimizer, lambda s: min((s + 1) / warm_up, 0.5 + 0.5 * math.cos(math.pi * min(1.0, s / steps)))
    )


def _sound(pose_FJ6: Tensor, limit: float) -> Tensor:
    """Which frames (F,) have no joint further than `limit` [rad] outside its anatomical range."""
    chunks = (anatomy.excess(rotation.sixd_to_matrix(chunk)) for chunk in pose_FJ6.split(32_768))
    return torch.cat([(chunk <= limit).flatten(1).all(dim=1) for chunk in chunks])


def _differing(config: PriorConfig) -> dict[str, Any]:
    """Settings other than paths that differ from the defaults."""
    defaults = to_plain(PriorConfig(data=config.data))
    return {k: v for k, v in to_plain(config).items() if v != defaults[k] and not isinstance(getattr(config, k), Path)}


class _Rows(Dataset[Tensor]):
    """A table of poses, indexed by whole batches of row numbers."""

    def __init__(self, rows: Tensor) -> None:
        self.rows = rows

    def __getitem__(self, index: Tensor) -> Tensor:
        return self.rows[index]

    def __len__(self) -> int:
        return len(self.rows)


class _RandomBatches(Sampler[Tensor]):
    """Batches of random rows; each epoch of the given length draws anew from (seed, epoch)."""

    def __init__(self, rows: int, batch_size: int, length: int, seed: int) -> None:
        self.rows, self.batch_size, self.length, self.seed, self.epoch = rows, batch_size, length, seed, 0

    def set_epoch(self, epoch: int) -> None:
        self.epoch = epoch

    def __len__(self) -> int:
        return self.length

    def __iter__(self) -> Iterator[Tensor]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        for _ in range(self.length):
            yield torch.randint(self.rows, (self.batch_size,), generator=generator)


def train(config: PriorConfig) -> BodyPrior:
    """Trains, saves the weights with their card, and returns the prior."""
    lightning.seed_everything(config.seed, verbose=False)
    poses, clips, names = load_training_poses(config.data)
    order = torch.randperm(len(clips), generator=torch.Generator().manual_seed(config.seed)).tolist()
    held = set(order[: max(1, round(config.held_out * len(clips)))])
    kept = torch.cat([poses[clips[i]] for i in range(len(clips)) if i not in held])
    kept = kept[_sound(kept, math.radians(config.max_excess_deg))]
    held_out = torch.cat([poses[clips[i]][::4] for i in sorted(held)])
    del poses
    module = PriorTraining(config)
    settings = to_plain(config)
    key = fingerprint({k: v for k, v in settings.items() if k not in ("output", "tracking_dir")})
    with Workspace(config.tracking_dir / "fits", "prior", key) as workspace:
        tags = {"git_commit": git_commit(Path(__file__).parent)}
        run_id = resumable_run(config.tracking_dir, None, workspace.run_id)
        name = ", ".join(f"{k}={v}" for k, v in _differing(config).items()) or "defaults"
        logger = open_logger(config.tracking_dir, "body-prior", name, tags, run_id=run_id)
        workspace.start(str(logger.run_id))
        trainer = lightning.Trainer(
            max_epochs=-(-config.steps // min(1_000, config.steps)),  # max_steps would break exact resumption
            logger=logger,
            log_every_n_steps=100,
            accelerator="auto",
            devices=1,
            gradient_clip_val=1.0,
            enable_model_summary=False,
            num_sanity_val_steps=0,
            callbacks=[
                ModelCheckpoint(workspace.checkpoints, save_last=True, save_top_k=1, save_on_train_epoch_end=True)
            ],
        )
        batches = _RandomBatches(len(kept), config.batch_size, min(1_000, config.steps), config.seed)
        in_order = [torch.arange(a, min(a + 4_096, len(held_out))) for a in range(0, len(held_out), 4_096)]
        trainer.fit(
            module,
            DataLoader(_Rows(kept), sampler=batches, batch_size=None),
            DataLoader(_Rows(held_out), sampler=in_order, batch_size=None),
            ckpt_path=workspace.last_checkpoint(),
            weights_only=True,
        )
        prior = module.prior.cpu().requires_grad_(False).eval()
        known = kept[torch.randperm(len(kept), generator=torch.Generator().manual_seed(config.seed))[:_KNOWN]]
        measures = measure(prior, held_out[:: max(1, len(held_out) // _UNSEEN)], known, config.seed)
        logger.log_metrics({f"held_out/{name}": value for name, value in measures.items()}, config.steps)
        workspace.finish()
    card = {
        "name": "mrhubo open body prior",
        "data": "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu), mirrored; free for all uses",
        "credit": "The data used in this project was obtained from mocap.cs.cmu.edu. "
        "The database was created with funding from NSF EIA-0196217.",
        "licence": "Apache-2.0",
        "split": f"by clip: {len(clips) - len(held)} for training, {len(held)} held out; "
        "the evaluation clips are in neither",
        "held_out_clips": [names[i] for i in sorted(held)],
        "measures_on_held_out_clips": {name: round(value, 4) for name, value in measures.items()},
        "training": {k: v for k, v in settings.items() if not isinstance(getattr(config, k), Path)},
        "known_defects": "the data has no wrist flexion (random plausible wrist angles were added), no collar motion, "
        "and rigid feet",
    }
    prior.save(config.output, card)
    return prior


def main(argv: list[str]) -> None:
    """`python -m mrhubo.body.training --config conf/prior.yaml [key=value ...]`."""
    config, _ = parse_arguments(argv, "mrhubo.body.training", "Trains the open body prior.", PriorConfig)
    if not config.data.is_file():
        raise UserError(f"data: {config.data} does not exist; name a file of training poses (docs/prior.md says which)")
    train(config)
    print(f"body prior: {config.output}")


if __name__ == "__main__":
    run_command(main)
