"""Branches that are trained side by side learn what they learn in one thread."""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from torch.utils.data import DataLoader

from mrhubo.config import load_config
from mrhubo.fitting.branch_threads import branches_in_threads
from mrhubo.fitting.datamodule import Batch, PairTable, batches_of
from mrhubo.fitting.module import RetargetModule
from mrhubo.pairing import make_filter
from mrhubo.retargeter import RetargetNetwork, build_network
from mrhubo.robot import build_body_map
from mrhubo.runtime.trainer import quiet_lightning, run_trainer


@pytest.fixture
def two_threads() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(threads)


def module_of(root: Path, robot: str, *settings: str) -> RetargetModule:
    small = ["model.hidden=12", "trainer.max_steps=12", "trainer.batch_size=16"]
    config = load_config(root / "conf" / f"{robot}.yaml", [*small, *settings])
    torch.manual_seed(0)
    network = build_network(config, build_body_map(config.robot))
    assert isinstance(network, RetargetNetwork)
    return RetargetModule(network, config.trainer)


def pairs_for(module: RetargetModule) -> DataLoader[Batch]:
    generator = torch.Generator().manual_seed(0)
    joints = len(module.network.limited.lower_N)
    shapes = (module.network.features.size,), (joints, 6), (joints,)
    table = PairTable(*(torch.randn(64, *shape, generator=generator) for shape in shapes))
    return batches_of(table, make_filter(torch.rand(64, generator=generator), "linear", 1.0), 16, 12, 0)


class Seen(Callback):
    """Which threads worked on gradients."""

    def __init__(self) -> None:
        self.threads: set[int] = set()

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        for weights in pl_module.parameters():
            weights.register_hook(lambda _: self.threads.add(threading.get_ident()))


def train(module: RetargetModule) -> Seen:
    seen = Seen()
    with quiet_lightning():
        trainer = Trainer(
            max_epochs=1, accelerator="cpu", logger=False, enable_progress_bar=False, enable_model_summary=False,
            enable_checkpointing=False, callbacks=[seen],
        )  # fmt: skip
        run_trainer(trainer, module, None, pairs_for(module))
    return seen


@pytest.mark.parametrize("robot", ["nao", "reachy"])
@pytest.mark.parametrize(
    "settings", [[], ["trainer.loss=mse", "model.detach_student=true"], ["model.stages=1", "model.bound_output=clamp"]]
)
@pytest.mark.usefixtures("two_threads")
def test_the_same_is_learnt(root: Path, robot: str, settings: list[str]) -> None:
    one = module_of(root, robot, *settings)
    other, before = copy.deepcopy(one), copy.deepcopy(one.state_dict())
    assert len(train(one).threads) == 1
    with branches_in_threads(other):
        assert len(train(other).threads) == 2
    assert other.branch_threads is None and torch.get_num_threads() == 2
    learnt, also = one.state_dict(), other.state_dict()
    assert learnt.keys() == also.keys() == before.keys(), "a checkpoint fits both"
    for name, weights in learnt.items():
        torch.testing.assert_close(also[name], weights, rtol=1e-4, atol=1e-5)
    assert max(float((weights - before[name]).abs().max()) for name, weights in learnt.items()) > 0.01


@pytest.mark.usefixtures("two_threads")
def test_losses_are_those_of_the_whole_network(root: Path) -> None:
    module = module_of(root, "coman")
    batch = next(iter(pairs_for(module)))
    wanted = module.losses(*batch)
    with branches_in_threads(module):
        assert module.branch_threads is not None
        found = module.branch_threads.losses(*batch)
    assert found.keys() == wanted.keys()
    for name, loss in wanted.items():
        torch.testing.assert_close(found[name], loss.detach())


@pytest.mark.usefixtures("two_threads")
def test_one_branch_or_one_thread_stays_as_it_is(root: Path) -> None:
    with branches_in_threads(whole := module_of(root, "nao", "model.branches=false")):
        assert whole.branch_threads is None
    torch.set_num_threads(1)
    with branches_in_threads(alone := module_of(root, "nao")):
        assert alone.branch_threads is None


@pytest.mark.usefixtures("two_threads")
def test_what_fails_in_a_thread_is_told(root: Path) -> None:
    module = module_of(root, "nao")
    with pytest.raises(RuntimeError, match="must match the size"), branches_in_threads(module):
        assert module.branch_threads is not None
        features, R, q = next(iter(pairs_for(module)))
        module.branch_threads.losses(features[:5], R, q)
    assert module.branch_threads is None and torch.get_num_threads() == 2
