"""Batches: exact size, the filter obeyed, the same after a resume."""

from __future__ import annotations

import torch

from mrhubo.fitting.datamodule import BernoulliBatches, PairTable, batches_of
from mrhubo.pairing import make_filter


def test_batches_have_the_exact_size_and_obey_the_filter() -> None:
    phi = torch.rand(1000, generator=torch.Generator().manual_seed(0))
    chosen = make_filter(phi, "linear", 0.5)
    sampler = BernoulliBatches(chosen, 300, 20, seed=1)
    batches = list(sampler)
    assert len(batches) == len(sampler) == 20 and all(len(b) == 300 for b in batches)
    drawn = torch.cat(batches)
    assert bool((chosen.probability_P[drawn] > 0).all())
    assert float(phi[drawn].mean()) < float(phi[phi <= chosen.threshold].mean())


def test_a_batch_larger_than_the_dataset_is_filled() -> None:
    sampler = BernoulliBatches(make_filter(torch.rand(10), "none", 1.0), 64, 2, seed=0)
    assert [len(b) for b in sampler] == [64, 64]


def test_an_epoch_depends_on_seed_and_epoch_alone() -> None:
    chosen = make_filter(torch.rand(500, generator=torch.Generator().manual_seed(0)), "linear", 1.0)
    first, second = BernoulliBatches(chosen, 100, 5, seed=3), BernoulliBatches(chosen, 100, 5, seed=3)
    list(first)
    first.set_epoch(7)
    second.set_epoch(7)
    assert torch.equal(torch.stack(list(first)), torch.stack(list(second)))
    second.set_epoch(8)
    assert not torch.equal(torch.stack(list(first)), torch.stack(list(second)))


def test_rows_stay_together() -> None:
    count = 200
    number = torch.arange(count, dtype=torch.float32)
    table = PairTable(
        number[:, None].expand(-1, 4), number[:, None, None].expand(-1, 2, 6), number[:, None].expand(-1, 2)
    )
    loader = batches_of(table, make_filter(torch.rand(count), "none", 1.0), 32, 3, 0)
    for features, links, joints in loader:
        assert features.shape == (32, 4) and links.shape == (32, 2, 6) and joints.shape == (32, 2)
        assert torch.equal(features[:, 0], joints[:, 1]) and torch.equal(links[:, 1, 5], joints[:, 0])


def test_ranks_share_out_the_batches_of_a_single_process() -> None:
    pair_filter = make_filter(torch.rand(500, generator=torch.Generator().manual_seed(3)), "linear", 1.0)
    alone = list(BernoulliBatches(pair_filter, 96, 7, seed=1))
    shares = [list(BernoulliBatches(pair_filter, 96, 7, seed=1, share=(rank, 3))) for rank in range(3)]
    for step, whole in enumerate(alone):
        parts = [share[step] for share in shares]
        assert [len(part) for part in parts] == [32, 32, 32]
        assert torch.equal(torch.cat(parts).sort().values, whole.sort().values), "nothing twice, nothing lost"
