"""The pairs of a training as a Lightning data module: made where they are missing, drawn by the filter.

Tensors stay in memory, no Python per sample.

An epoch is a fixed number of optimiser steps. Its batches are cut from Bernoulli draws over the whole dataset, one draw
after another, all from (seed, epoch): the batch size is exact, and a resumed run sees the same batches. Several ranks
make the same draws and share out every batch, so that their pairs are disjoint and the training is the one of a single
process.

Legend: P pairs, B batch, F input features, M robot links, N robot joints.
"""

from __future__ import annotations

from collections.abc import Iterator

import lightning
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from mrhubo.config import Config
from mrhubo.errors import UserError
from mrhubo.fitting.pairs import make_pairs
from mrhubo.fitting.preparation import Prepared, prepare
from mrhubo.pairing import PairFilter, PairingReport, make_filter
from mrhubo.retargeter import PoseFeatures
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.ranks import Ranks

Batch = tuple[Tensor, Tensor, Tensor]


class PairTable(Dataset[Batch]):
    """Input features (P, F), link orientations R (P, M, 6) and joint angles q (P, N), indexed by whole batches."""

    def __init__(self, features_PF: Tensor, R_PM6: Tensor, q_PN: Tensor) -> None:
        self.tensors = (features_PF, R_PM6, q_PN)

    def __len__(self) -> int:
        return len(self.tensors[0])

    def __getitem__(self, index: Tensor) -> Batch:
        features, links, joints = self.tensors
        index = index.to(features.device)
        return features[index], links[index], joints[index]

    def to(self, device: torch.device) -> PairTable:
        """The table on another device."""
        return PairTable(*(tensor.to(device) for tensor in self.tensors))


class BernoulliBatches(Sampler[Tensor]):
    """Index tensors of exactly `batch_size` pairs, `steps` of them an epoch; with `share` (rank, ranks) its part."""

    def __init__(
        self, pair_filter: PairFilter, batch_size: int, steps: int, seed: int, share: tuple[int, int] = (0, 1)
    ) -> None:
        self.filter, self.batch_size, self.steps, self.seed, self.epoch = pair_filter, batch_size, steps, seed, 0
        self.rank, self.ranks = share
        if not bool((pair_filter.probability_P > 0).any()):
            raise ValueError("the filter accepts no pair")

    def set_epoch(self, epoch: int) -> None:
        """Lightning calls this before each epoch, the first after a resume included."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.steps

    def __iter__(self) -> Iterator[Tensor]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        pool = torch.empty(0, dtype=torch.long)
        for _ in range(self.steps):
            while len(pool) < self.batch_size:
                pool = torch.cat((pool, self.filter.draw(generator)))
            batch, pool = pool[: self.batch_size], pool[self.batch_size :]
            yield batch[self.rank :: self.ranks]


class PairData(lightning.LightningDataModule):
    """The pairs of a fit: makes those that are missing, and loads batches of them.

    Lightning calls a data module's `setup` before that of the callbacks. With `robot.scale: search` the scale factor is
    not known then: the callback `ScaleFactorSearch` finds it in its own `setup` and hands it over to `use_config`, and
    only then are pairs made.
    """

    pairs: dict[str, Tensor]
    """What `PairStore.read_all` gives."""
    filter: PairFilter
    pairing: PairingReport
    """How the pairs came about."""
    table: PairTable
    """What is trained on, on the training's device."""

    def __init__(
        self, prepared: Prepared, features: PoseFeatures, report: Reporter = SILENT, ranks: Ranks | None = None
    ) -> None:
        """`features` is what the network sees of a human pose, `ranks` the processes that share pairs and batches."""
        super().__init__()
        self.prepared, self.features, self.report, self.ranks = prepared, features, report, ranks or Ranks()
        self._ready = False

    def setup(self, stage: str) -> None:
        """Makes the pairs, on all ranks together, unless the scale factor is still to be found."""
        if self.prepared.config.robot.scale != "search":
            self._make()

    def use_config(self, config: Config) -> None:
        """Makes the pairs of a config that was not known before: the run's, with the scale factor that was found.

        Raises:
            UserError: anything in it is wrong.
        """
        self.prepared = prepare(config)
        self._make()

    def train_dataloader(self) -> DataLoader[Batch]:
        """Ready batches: features (B, F), R (B, M, 6), q (B, N).

        Raises:
            RuntimeError: the scale factor is to be searched for, and no callback has done so.
        """
        if not self._ready:
            raise RuntimeError("robot.scale: 'search' needs the callback ScaleFactorSearch")
        settings = self.prepared.config.trainer
        steps = min(settings.validate_every, settings.max_steps)
        share = (self.ranks.rank, self.ranks.count)
        return batches_of(self.table, self.filter, settings.batch_size, steps, settings.seed, share)

    def _make(self) -> None:
        self.pairing = make_pairs(self.prepared, self.report, self.ranks)
        self.pairs = self.prepared.store.read_all()
        self.filter = _filter(self.prepared.config, self.pairs)
        with torch.no_grad():
            features = torch.cat([self.features(part) for part in self.pairs["H"].split(16_384)])
            features = self.features.condition(features)
        self.table = PairTable(features, self.pairs["R"], self.pairs["q"])
        if self.trainer is not None:  # so that no batch has to travel
            self.table = self.table.to(self.trainer.strategy.root_device)
        self._ready = True


def batches_of(
    table: PairTable, pair_filter: PairFilter, batch_size: int, steps: int, seed: int, share: tuple[int, int] = (0, 1)
) -> DataLoader[Batch]:
    """Batches of a table as `BernoulliBatches` draws them: features (B, F), R (B, M, 6), q (B, N)."""
    sampler = BernoulliBatches(pair_filter, batch_size, steps, seed, share)
    return DataLoader(table, sampler=sampler, batch_size=None)


def _filter(config: Config, pairs: dict[str, Tensor]) -> PairFilter:
    pair_filter = make_filter(pairs["phi"], config.pairs.filter, config.pairs.filter_k, pairs["reverse"])
    if not bool((pair_filter.probability_P > 0).any()):
        raise UserError(f"pairs.filter_k: {config.pairs.filter_k} drops every pair; raise it")
    return pair_filter
