"""How the universal network is trained: `python -m mrhubo.universal --config conf/universal.yaml`.

The loss is that of `loss`, on random chains.

Legend: B problems, N joints, K hypotheses.
"""

from __future__ import annotations

from typing import Any

import lightning
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from mrhubo.body.prior_training.poses import RandomBatches
from mrhubo.callbacks import Checkpoints, TrainingProgress
from mrhubo.callbacks.small_training import small_trainer, tracked
from mrhubo.config import UniversalConfig, fingerprint, to_plain, without_paths
from mrhubo.errors import UserError
from mrhubo.files.atomic import checksum_file
from mrhubo.reference import angle_between
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.run_logger import RunLogger
from mrhubo.runtime.trainer import quiet_lightning, run_trainer, stop_at, with_schedule
from mrhubo.runtime.workspace import Workspace
from mrhubo.universal.iterations import unroll
from mrhubo.universal.learning.loss import BETAS, loss
from mrhubo.universal.learning.problems import Lessons, load_lessons
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.weights import open_network, save_network

_EXPERIMENT = "universal"
_EPOCH = 250
"""Steps between validations and checkpoints."""
_SHOWN = {"val/limb_excess_deg": "held-out limbs' excess deg"}
_LIMBS = [0, 2]
"""Slots that hold limbs."""


class UniversalTraining(lightning.LightningModule):
    """Loss, validation and optimiser of the universal network."""

    def __init__(self, config: UniversalConfig, learnt: Lessons, held_out: Lessons) -> None:
        super().__init__()
        self.config, self.learnt, self.held_out = config, learnt, held_out
        self.save_hyperparameters(to_plain(config))
        self.network = _begin(config)

    def training_step(self, rows_B: Tensor, _: int) -> Tensor:
        """One batch of problems, by their numbers (B,)."""
        lessons = self.learnt.rows(rows_B)
        value = loss(self.network, lessons.problem, lessons.q_BN)
        if (self.trainer.global_step + 1) % 50 == 0:
            self.log("train/loss", value.detach())
        return value

    def on_train_batch_end(self, *_: Any) -> None:
        """Stops at the last step, also within an epoch."""
        stop_at(self.config.steps, self.trainer)

    def validation_step(self, rows_B: Tensor, _: int) -> None:
        """How much farther limbs are from the human than in the best known answer."""
        self.log_dict(measure(self.network, self.held_out.rows(rows_B)), batch_size=len(rows_B))

    def configure_optimizers(self) -> Any:
        """AdamW, linear warm-up over 2% of the steps, cosine decay to 0."""
        settings = self.config
        optimizer = torch.optim.AdamW(
            self.network.parameters(), settings.lr, betas=BETAS, weight_decay=settings.weight_decay
        )
        return with_schedule(optimizer, settings.steps)


def _begin(config: UniversalConfig) -> UniversalNetwork:
    """Random weights, or those to go on from.

    Raises:
        UserError: these are missing, damaged or of another size.
    """
    sizes = (config.width, config.attention_heads, config.hypotheses)
    if config.start is None:
        return UniversalNetwork(*sizes)
    network = open_network(config.start)
    if (found := (network.width, network.heads, network.hypotheses)) != sizes:
        raise UserError(
            f"start: {config.start} has width, attention_heads and hypotheses {found}; the config says {sizes}"
        )
    return network.requires_grad_(True).train()


@torch.no_grad()
def measure(network: UniversalNetwork, lessons: Lessons) -> dict[str, Tensor]:
    """Limbs' angle to the target less that of the best known answer [deg], mean and 99th percentile, and the share of
    problems that end in another valley, by 0.01 or more of the cost.
    """
    trace = unroll(network, lessons.problem)
    arms_B = lessons.chains.filled_BS[:, 0] > 0
    limbs, bests = (_limb_deg(lessons, q_BN)[arms_B] for q_BN in (trace.q_BN, lessons.q_BN))
    return {
        "val/limb_excess_deg": (limbs - bests).mean(),
        "val/limb_excess_p99_deg": (limbs - bests).quantile(0.99),
        "val/elsewhere_share": (trace.cost_B > lessons.cost_B + 0.01).float().mean(),
    }


def _limb_deg(lessons: Lessons, q_BN: Tensor) -> Tensor:
    direction_BS3 = lessons.chains.local(q_BN).direction_BS3
    return torch.rad2deg(angle_between(direction_BS3, lessons.target_BS3))[:, _LIMBS].mean(1)


class _Rows(Dataset[Tensor]):
    """Numbers of problems, by whole batches."""

    def __init__(self, rows: int) -> None:
        self.rows = rows

    def __getitem__(self, index: Tensor) -> Tensor:
        return index

    def __len__(self) -> int:
        return self.rows


def train(config: UniversalConfig, report: Reporter = SILENT) -> UniversalNetwork:
    """Makes the problems, trains, measures, saves the weights with their card, and returns the network."""
    if config.width % config.attention_heads:
        raise UserError(f"width: {config.width} is no multiple of attention_heads, {config.attention_heads}")
    settings = {k: v for k, v in to_plain(config).items() if k not in ("output", "tracking_dir", "start")}
    _begin(config)  # refuses what cannot be gone on from before problems are made
    key = fingerprint(settings | ({} if config.start is None else {"start": checksum_file(config.start)}))
    with Workspace(config.tracking_dir / "fits", "universal", key) as workspace, quiet_lightning():
        lessons = load_lessons(config, config.tracking_dir / "universal_problems", report)
        lightning.seed_everything(config.seed, verbose=False)  # whether problems had to be made or not
        module = UniversalTraining(config, *lessons)
        with tracked(config, workspace, _EXPERIMENT) as logger:
            _fit(module, workspace, report, logger)
            network = module.network.cpu().requires_grad_(False).eval()
            if not all(bool(weights.isfinite().all()) for weights in network.state_dict().values()):
                raise UserError(f"the training came to NaN; a lower lr than {config.lr:g} helps")
            measures = {name: float(value) for name, value in measure(network, module.held_out).items()}
            logger.log_metrics({f"held_out/{n.partition('/')[2]}": v for n, v in measures.items()}, config.steps)
            save_network(network, config.output, card(config, measures))
        workspace.finish()
    return network


def _fit(module: UniversalTraining, workspace: Workspace, report: Reporter, logger: RunLogger) -> None:
    """Lightning's trainer, from the last checkpoint if there is one."""
    config, epoch = module.config, min(_EPOCH, module.config.steps)
    saver = Checkpoints(workspace.checkpoints, "val/limb_excess_deg")
    progress = TrainingProgress(config.steps, _SHOWN, report)
    trainer = small_trainer(config.steps, epoch, logger, 50, "cpu", progress, saver)
    batches = RandomBatches(len(module.learnt), config.batch_size, epoch, config.seed)
    rows = [torch.arange(len(module.held_out))]
    run_trainer(
        trainer,
        module,
        workspace.last_checkpoint(),
        DataLoader(_Rows(len(module.learnt)), sampler=batches, batch_size=None),
        DataLoader(_Rows(len(module.held_out)), sampler=rows, batch_size=None),
    )


def card(config: UniversalConfig, measures: dict[str, float]) -> dict[str, Any]:
    """What the weights' header says of them."""
    return {
        "name": "mrhubo universal network",
        "data": "random chains of joints, made up; targets: what they reach, and poses of the open body prior",
        "teacher": "the best of eight starts of Levenberg-Marquardt on the reference retargeter's cost",
        "licence": "Apache-2.0",
        "measures_on_held_out_chains": {name.partition("/")[2]: round(value, 4) for name, value in measures.items()},
        "training": without_paths(config),
    }
