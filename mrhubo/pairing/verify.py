"""Whether the shards on disk are what they should be, and what their pairs are like.

Legend: P pairs, N robot joints, M robot links.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.files.arrays import DamagedFile
from mrhubo.pairing.filter import make_filter
from mrhubo.pairing.store import MEASURES, PairStore
from mrhubo.robot import Robot
from mrhubo.runtime.progress import SILENT, Reporter

_TOLERANCE = 1e-4
SOURCES = {"robot poses": False, "human poses": True}
"""Where pairs start, in words, and whether those are the reverse ones."""
_MOST_SHARDS = 1_000
"""A summary of more shards reads that many, evenly spread."""


@torch.no_grad()
def check_shard(store: PairStore, robot: Robot, index: int) -> str | None:
    """What is wrong with a shard, in one sentence, or None: checksum, header, shapes, finite numbers, joint limits,
    link orientations that are the forward kinematics of the joint angles, human poses that are rotations.
    """
    path = store.path(index)
    if not path.exists():
        return f"{path}: is missing"
    try:
        pairs = store.read(index)
    except DamagedFile as error:
        return str(error)
    q_PN = pairs["q"]
    outside = ((q_PN < robot.lower_N) | (q_PN > robot.upper_N)).any(1)
    if bool(outside.any()):
        return f"{path}: {int(outside.sum())} pairs leave the joint limits"
    expected = torch.cat([robot.moving_orientations(robot.forward(part)) for part in q_PN.split(4_096)])
    if float((expected - pairs["R"]).abs().max()) > _TOLERANCE:
        return f"{path}: the link orientations are not those of the joint angles"
    proper = rotation.matrix_to_sixd(rotation.sixd_to_matrix(pairs["H"]))
    if float((proper - pairs["H"]).abs().max()) > _TOLERANCE:
        return f"{path}: holds human poses that are no rotations"
    if any(float(pairs[name].min()) < 0 for name in MEASURES):
        return f"{path}: holds negative errors"
    return None


def verify(store: PairStore, robot: Robot, report: Reporter = SILENT) -> list[str]:
    """What is wrong with the store's shards, a sentence each."""
    problems: list[str] = []
    with report.step("verify", store.shards, "shards") as progress:
        progress.update(0, "0 bad")
        for index in range(store.shards):
            problem = check_shard(store, robot, index)
            if problem is not None:
                problems.append(problem)
            progress.update(index + 1, f"{len(problems)} bad")
    return problems


@dataclass(frozen=True)
class PairSummary:
    """The pairs of a store in numbers; with very many shards, of a part of them."""

    count: int
    """Pairs that were read."""
    measures: dict[str, dict[str, Tensor]]
    """phi, cost, residual_m and z_norm (P,) of those pairs, by where they start: SOURCES."""
    kept_share: float
    """Share of the pairs from robot poses that the filter lets through; of all pairs if there are none."""
    threshold: float

    def table(self) -> str:
        """Mean, median and 99th percentile of every measure, and what the filter keeps."""
        names = {
            "phi": ("phi (reconstruction error)", 1.0),
            "cost": ("cost of the inverse kinematics", 1.0),
            "residual_m": ("keypoint distance [mm]", 1000.0),
            "z_norm": ("|z|", 1.0),
        }
        lines = []
        for source, measures in self.measures.items():
            count = f"{len(measures['phi']):,}"
            lines.append(f"{count + ' pairs from ' + source:<36}{'mean':>10}{'median':>10}{'99%':>10}")
            for name, (title, unit) in names.items():
                values = unit * measures[name].double().numpy()
                numbers = values.mean(), np.median(values), np.quantile(values, 0.99)
                lines.append(f"  {title:<34}" + "".join(f"{number:>10.3g}" for number in numbers))
        if "robot poses" in self.measures:
            lines.append(f"the filter keeps {self.kept_share:.1%}: phi up to {self.threshold:.3g}")
        return "\n".join(lines)


def summarise(store: PairStore, rule: str, k: float) -> PairSummary:
    """Reads the measures of the store's pairs; `rule` and `k` as for `make_filter`.

    Raises:
        DamagedFile: a shard is missing, or not of this store.
    """
    found = store.read_all_measures(_MOST_SHARDS)
    rows = {source: found["reverse"] == reverse for source, reverse in SOURCES.items()}
    measures = {s: {name: found[name][rows_P] for name in MEASURES} for s, rows_P in rows.items() if bool(rows_P.any())}
    pair_filter = make_filter(next(iter(measures.values()))["phi"], rule, k)
    return PairSummary(len(found["phi"]), measures, pair_filter.kept_share, pair_filter.threshold)
