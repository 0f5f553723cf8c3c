"""Problems to learn from: random chains, each with a target and the best answer that is found from several starts.

They are made in shards, each of which depends on (settings, number) alone, so that a run that was killed goes on where
it stopped. No motion of a person or a robot is needed, and nobody's labels: the answers are the optimiser's own.

Legend: B problems, N joints, S slots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import torch
from torch import Tensor

from mrhubo.config import UniversalConfig, fingerprint
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.universal.chains import Chains
from mrhubo.universal.learning.random_chains import numbers, random_chains
from mrhubo.universal.learning.targets import HumanTargets, random_targets
from mrhubo.universal.newton import search
from mrhubo.universal.problem import Problem

SHARD = 1024
HELD_OUT = 2
"""Shards that are measured on and not learnt from; their numbers follow those of the others."""
_SCHEMA = "mrhubo.universal_problems/2"


@dataclass(frozen=True)
class Lessons:
    """Chains with canonical senses of turn, what is asked of them, and the best that is known."""

    chains: Chains
    target_BS3: Tensor
    q_BN: Tensor
    """The best angles [rad],"""
    cost_B: Tensor
    """and their cost."""

    def __len__(self) -> int:
        return len(self.chains)

    def rows(self, rows: Tensor) -> Lessons:
        """Some of them."""
        return Lessons(self.chains.rows(rows), self.target_BS3[rows], self.q_BN[rows], self.cost_B[rows])

    @property
    def problem(self) -> Problem:
        """What is to be solved."""
        return Problem.of_chains(self.chains, self.target_BS3)

    @classmethod
    def joined(cls, parts: Sequence[Lessons]) -> Lessons:
        """All of several."""
        chains = Chains(*(torch.cat([getattr(part.chains, f.name) for part in parts]) for f in fields(Chains)))
        return cls(chains, *(torch.cat([getattr(part, name) for part in parts]) for name in _NAMES))

    def tensors(self) -> dict[str, Tensor]:
        """All of it, by name."""
        found = {f"chains.{f.name}": getattr(self.chains, f.name) for f in fields(Chains)}
        return found | {name: getattr(self, name) for name in _NAMES}

    @classmethod
    def of(cls, tensors: dict[str, Tensor]) -> Lessons:
        """What `tensors` gave."""
        chains = Chains(*(tensors[f"chains.{f.name}"] for f in fields(Chains)))
        return cls(chains, *(tensors[name] for name in _NAMES))


_NAMES = ("target_BS3", "q_BN", "cost_B")


def make_shard(config: UniversalConfig, humans: HumanTargets, number: int) -> Lessons:
    """The shard of that number."""
    generator = torch.Generator().manual_seed(config.seed * 1_000_003 + number)
    each = numbers(SHARD, {"heads": config.heads_share, "legs": config.legs_share, "waists": config.waists_share})
    chains = random_chains(each, generator).canonical()
    target_BS3 = random_targets(chains, each, humans, generator, config.human_share)
    return Lessons(chains, target_BS3, *search(Problem.of_chains(chains, target_BS3), generator))


def load_lessons(config: UniversalConfig, folder: Path, report: Reporter = SILENT) -> tuple[Lessons, Lessons]:
    """Those to learn from, and those held out; shards that lie in the folder are used again, the others are made."""
    shards = -(-config.problems // SHARD)
    settings = ("heads_share", "legs_share", "waists_share", "human_share", "poses", "seed")
    header = {"schema": _SCHEMA, "settings": fingerprint({name: getattr(config, name) for name in settings})}
    humans: HumanTargets | None = None
    found = []
    with report.step("problems", shards + HELD_OUT, "shards") as progress:
        for number in range(shards + HELD_OUT):
            path = folder / f"problems-{header['settings']}-{number:05d}.safetensors"
            try:
                tensors, told = read_tensors(path)
                lessons = Lessons.of(tensors) if told == header else None
            except (DamagedFile, KeyError):
                lessons = None
            if lessons is None:
                humans = humans or HumanTargets(config.poses, config.seed)
                lessons = make_shard(config, humans, number)
                write_tensors(path, lessons.tensors(), header)
            found.append(lessons)
            progress.update(number + 1)
    return Lessons.joined(found[:shards]), Lessons.joined(found[shards:])
