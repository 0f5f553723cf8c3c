"""Batches of pairs for the training, drawn by the filter; tensors stay in memory, no Python per sample.

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

from mrhubo.pairing.filter import PairFilter

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
    """The training loader over a table of pairs and its filter."""

    def __init__(
        self,
        table: PairTable,
        pair_filter: PairFilter,
        batch_size: int,
        steps: int,
        seed: int,
        share: tuple[int, int] = (0, 1),
    ) -> None:
        """`steps` is the length of an epoch in batches, `share` this process's (rank, number of ranks)."""
        super().__init__()
        self.table, self.filter = table, pair_filter
        self.sampler = BernoulliBatches(pair_filter, batch_size, steps, seed, share)

    def setup(self, stage: str) -> None:
        """Moves the table to the training's device, so that no batch has to travel."""
        if self.trainer is not None:
            self.table = self.table.to(self.trainer.strategy.root_device)

    def train_dataloader(self) -> DataLoader[Batch]:
        """Ready batches: features (B, F), R (B, M, 6), q (B, N)."""
        return DataLoader(self.table, sampler=self.sampler, batch_size=None)
