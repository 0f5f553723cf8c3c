"""The settings of a sweep: which keys of a config to vary, and how to search."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mrhubo.config.fields import bounded, choice, left_out


@dataclass
class SpaceRange:
    """A range of numbers that a sweep draws from."""

    low: int | float
    """Least value."""
    high: int | float
    """Greatest value."""
    log: bool = left_out(False)
    """Whether values are drawn on a logarithmic scale."""


SpaceEntry = list[Any] | SpaceRange
"""An entry of `space`: a list of choices, or a range."""


@dataclass
class SweepConfig:
    """A search over settings of a fit; the validation clips decide."""

    name: str
    """Short name of the sweep; the study and its runs are named after it."""
    space: dict[str, SpaceEntry]
    """What varies, by key of the config: `trainer.lr: {low: 0.0003, high: 0.01, log: true}` for a range,
    `model.layers: {low: 1, high: 4}` for whole numbers, `pairs.filter: [linear, hard, none]` for a choice."""
    fixed: dict[str, Any] = field(default_factory=dict)
    """Settings of all trials, by key; the best config has them too."""
    trials: int = bounded(30, 1, 1_000_000)
    """Trials, over all processes that work on the study and all starts of the command."""
    minutes: float | None = field(default=None, metadata={"low": 0.0, "high": None})
    """After so long no process starts another trial; default: no limit."""
    sampler: str = choice("tpe", "tpe", "random", "cmaes")
    """Who draws the trials: `tpe` (tree-structured Parzen estimator), `random`, or `cmaes` (numbers only; choices are
    drawn at random)."""
    pruner: str = choice("median", "median", "halving", "none")
    """Which trials stop early on their validation link error: `median` = those worse than the median of the others at
    the same step, `halving` = all but the best quarter, at 1, 4, 16 ... validations, `none`."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of the sampler. The trials depend on it and, with several processes, on who comes first."""
    storage: str | None = None
    """Database of the study, as an SQLAlchemy URL: postgresql://USER:PASSWORD@HOST/NAME or mysql+pymysql://... for
    several machines; default: SQLite, `studies.db` in `tracking.dir`."""
