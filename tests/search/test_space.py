"""Search spaces: what is accepted, what is refused, and that nothing outside is ever drawn."""

from __future__ import annotations

import re
from pathlib import Path

import optuna
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.config import SweepConfig, load_config
from mrhubo.errors import UserError
from mrhubo.search import read_space

ROOT = Path(__file__).resolve().parents[2]


def check(text: str) -> object:
    return load_config(ROOT / "conf" / "nao.yaml", [text])


def draw(entry: object, key: str, seed: int) -> str:
    (dimension,) = read_space({key: entry}, check)
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=seed))
    return dimension.draw(study.ask()).partition("=")[2]


@pytest.mark.parametrize("name", ["network", "filter"])
def test_the_shipped_sweeps_are_good(root: Path, name: str) -> None:
    settings = load_config(root / "conf" / "sweeps" / f"{name}.yaml", [], SweepConfig)
    assert settings.name == name and read_space(settings.space, check)


def test_the_example_of_the_docs_is_good(root: Path, tmp_path: Path) -> None:
    (text,) = re.findall(r"```yaml\n(.*?)```", (root / "docs" / "sweeps.md").read_text(), re.S)
    (tmp_path / "mine.yaml").write_text(text)
    settings = load_config(tmp_path / "mine.yaml", [], SweepConfig)
    assert len(read_space(settings.space, check)) == 3 and settings.fixed == {"trainer.max_steps": 2000}


def test_the_scale_factors_sweep_is_for_the_papers_configs(root: Path) -> None:
    settings = load_config(root / "conf" / "sweeps" / "scale_factor.yaml", [], SweepConfig)
    paper = root / "conf" / "paper" / "coman.yaml"
    assert len(read_space(settings.space, lambda text: load_config(paper, [text]))) == 3
    with pytest.raises(UserError, match=r"robot\.manual"):
        read_space(settings.space, check)


@given(low=st.floats(1e-6, 1.0), factor=st.floats(1.01, 9.0), log=st.booleans(), seed=st.integers(0, 1000))
def test_a_range_is_kept(low: float, factor: float, log: bool, seed: int) -> None:
    value = float(draw({"low": low, "high": low * factor, "log": log}, "trainer.lr", seed))
    assert low <= value <= low * factor


def test_whole_numbers_and_choices() -> None:
    assert {draw({"low": 1, "high": 3}, "model.layers", seed) for seed in range(30)} == {"1", "2", "3"}
    assert {draw(["linear", "none"], "pairs.filter", seed) for seed in range(20)} == {"linear", "none"}
    assert {draw([True, False], "model.detach_student", seed) for seed in range(20)} == {"true", "false"}
    joints = [["left_shoulder"], ["left_shoulder", "left_elbow"]]
    assert draw(joints, "model.input_joints", 0).startswith('["left_shoulder"')


@pytest.mark.parametrize(
    ("space", "words"),
    [
        ({}, "empty"),
        ({"trainer.lrr": [1, 2]}, "'trainer.lrr' .*'trainer.lr'"),
        ({"trainer": [1, 2]}, "'trainer' does not exist"),
        ({"trainer.lr": {"low": 0.0, "high": 0.1}}, "space.trainer.lr: .*from 1e-09"),
        ({"trainer.lr": {"low": 0.1, "high": 100}}, "space.trainer.lr: .*to 10"),
        ({"trainer.lr": {"low": 0.1, "high": 0.1}}, "low must be below high"),
        ({"trainer.lr": {"low": "a", "high": 0.1}}, "low must be a number, found 'a'"),
        ({"trainer.lr": {"low": 0.1, "hihg": 0.2}}, "'space.trainer.lr.hihg' .*'space.trainer.lr.high'"),
        ({"trainer.lr": {"low": 0.1, "high": 0.2, "logg": True}}, "logg' .*log'"),
        ({"pairs.filter_k": {"low": 0, "high": 1, "log": True}}, "starts above 0"),
        ({"model.layers": {"low": 1.5, "high": 2}}, "whole numbers"),
        ({"model.layers": {"low": True, "high": 2}}, "low must be a number, found True"),
        ({"model.layers": 3}, "found 3"),
        ({"model.layers": [3]}, "two values"),
        ({"pairs.filter": ["linear", "hrad"]}, "space.pairs.filter: .*'hrad'"),
        ({"pairs.filter": {"low": 1, "high": 2}}, "no number"),
        ({"evaluation.smoothness": [0.1, 0.2]}, "cannot vary: trials are compared by it"),
        ({"tracking.run_name": ["a", "b"]}, "cannot vary"),
    ],
)
def test_what_cannot_be_searched_is_named(space: dict, words: str) -> None:
    with pytest.raises(UserError, match=words):
        read_space(space, check)
