"""The training: equal seeds give equal weights, also after an interruption; the best answers are good ones."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
import torch

from mrhubo.config import UniversalConfig
from mrhubo.errors import UserError
from mrhubo.files.storage import read_tensors
from mrhubo.universal.learning import problems, random_chains, training
from mrhubo.universal.learning.targets import HumanTargets
from mrhubo.universal.newton import minimise

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problems, "SHARD", 64)
    monkeypatch.setattr(problems, "HELD_OUT", 1)
    monkeypatch.setattr(training, "_EPOCH", 2)


def config(folder: Path) -> UniversalConfig:
    return UniversalConfig(
        output=folder / "w.safetensors", tracking_dir=folder / "mlruns", problems=64, steps=4, batch_size=8, width=8,
        hypotheses=4, poses=200, legs_share=0.3, waists_share=0.1,
    )  # fmt: skip


def test_equal_seeds_equal_weights_also_when_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = config(tmp_path)
    for name in ("fits", "universal_problems"):
        (tmp_path / "mlruns" / name).mkdir(parents=True)
    training.train(settings)
    one, _ = read_tensors(settings.output)
    settings.output.unlink()
    whole = training.UniversalTraining.training_step

    def stops(self: training.UniversalTraining, rows_B: torch.Tensor, batch: int) -> torch.Tensor:
        if self.trainer.global_step == 3:
            raise KeyboardInterrupt
        return whole(self, rows_B, batch)

    with monkeypatch.context() as patch:
        patch.setattr(training.UniversalTraining, "training_step", stops)
        with pytest.raises(KeyboardInterrupt):
            training.train(settings)
    assert not settings.output.exists()
    steps: list[int] = []

    def told(self: training.UniversalTraining, rows_B: torch.Tensor, batch: int) -> torch.Tensor:
        steps.append(self.trainer.global_step)
        return whole(self, rows_B, batch)

    monkeypatch.setattr(training.UniversalTraining, "training_step", told)
    training.train(settings)
    assert steps == [2, 3], "it goes on from the checkpoint"
    two, _ = read_tensors(settings.output)
    assert all(torch.equal(one[name], two[name]) for name in one)
    on = dataclasses.replace(settings, start=settings.output, output=tmp_path / "on.safetensors", lr=1e-6, steps=2)
    three = training.train(on).state_dict()
    assert all(torch.allclose(two[name], three[name], atol=1e-4) for name in two), "it goes on from what was learnt"
    with pytest.raises(UserError, match="has width, attention_heads and hypotheses"):
        training.train(dataclasses.replace(on, width=16))


def test_a_shard_depends_on_settings_and_number(tmp_path: Path) -> None:
    settings = config(tmp_path)
    humans = HumanTargets(settings.poses, settings.seed)
    one, same, other = (problems.make_shard(settings, humans, number) for number in (5, 5, 6))
    assert torch.equal(one.q_BN, same.q_BN) and not torch.equal(one.target_BS3, other.target_BS3)
    cost_B = one.problem.at(one.q_BN).model.cost_B
    torch.testing.assert_close(cost_B, one.cost_B)
    _, middle_B = minimise(one.problem, one.problem.bounds.middle_BN, 30)
    assert bool((one.cost_B < middle_B + 0.01).float().mean() > 0.97), "rarely is the middle's valley better"


@pytest.mark.parametrize("kind", random_chains.KINDS)
def test_people_ask_of_each_kind_what_its_chains_have(kind: str) -> None:
    """Directions are unit, of right limbs as of left ones, and near what a chain reaches that stands as a person."""
    generator, number = torch.Generator().manual_seed(0), {kind: 400}
    chains = random_chains.random_chains(number, generator)
    target_BS3 = HumanTargets(300, seed=1).draw(number, generator)
    outer, limb = target_BS3[:, 3:], chains.filled_BS[0, 0] > 0
    torch.testing.assert_close(outer.norm(dim=-1), torch.ones(400, 2), atol=1e-4, rtol=0)
    assert bool((target_BS3[:, 0].norm(dim=-1) > 0).all()) == bool(limb)
    mean_S3 = torch.nn.functional.normalize(target_BS3.mean(0), dim=-1)
    rest_S3 = torch.nn.functional.normalize(chains.end_BS3[:, 3:].mean(0), dim=-1)
    if kind != "arms":  # whose hands point anywhere
        assert bool(((mean_S3[3:] * rest_S3).sum(-1) > 0.9).all())
    if kind == "legs":  # a left thigh swings to the left
        assert float(mean_S3[0, 0]) > 0 and float(mean_S3[0, 1]) < -0.8
