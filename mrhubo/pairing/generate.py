"""Algorithm 1 of MR.HuBo: random robot poses to pairs of robot and human pose, shard by shard.

Legend: B pairs of a shard, N robot joints, K keypoints, J = 21 human joints, Z latent numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.body.inverse import solve_levenberg_marquardt
from mrhubo.body.latent import LatentProblem
from mrhubo.config import PairsConfig
from mrhubo.pairing.amortiser import Amortiser, train_amortiser
from mrhubo.pairing.inverse import solve_lbfgs
from mrhubo.pairing.store import PairStore
from mrhubo.robot import BodyMap


@dataclass(frozen=True)
class PairingReport:
    """How the pairs came about."""

    made: int
    """Pairs made now; the others were there already."""
    seconds: float
    """Time that took, the amortised solver's training included."""


class PairGenerator:
    """Makes shards for one robot, prior and pairing config; everything is on the prior's device."""

    def __init__(self, body_map: BodyMap, prior: BodyPrior, settings: PairsConfig) -> None:
        self.body_map, self.robot, self.prior, self.settings = body_map, body_map.robot, prior, settings
        self.problem = LatentProblem(
            prior, body_map.skeleton, body_map.keypoint_indices, settings.w_data, settings.w_prior
        )
        self.amortiser: Amortiser | None = None

    def draw_targets(self, count: int, generator: torch.Generator) -> Tensor:
        """Target keypoints (count, K, 3) [m] of fresh random robot poses."""
        with torch.no_grad():
            return self.body_map.targets(self.robot.forward(self.robot.sample(count, generator)))

    def prepare(self, store: PairStore, progress: Callable[[int, float], None]) -> None:
        """Reads or trains the amortised solver, if the config's solver uses one."""
        if self.settings.solver == "paper":
            return
        settings, header = self.settings, {**store.header, "what": "amortiser"}
        self.amortiser = train_amortiser(
            self.problem,
            self.draw_targets,
            settings.amortiser_steps,
            settings.seed,
            store.amortiser_path,
            header,
            progress,
        )

    def solve(self, target_BK3: Tensor) -> Tensor:
        """Latents (B, Z) for target keypoints (B, K, 3) [m], by the config's solver."""
        if self.settings.solver == "paper":
            return solve_lbfgs(self.problem, target_BK3)
        if self.amortiser is None:
            raise RuntimeError("call prepare() before solve()")
        with torch.no_grad():
            start = self.amortiser(target_BK3)
        if self.settings.solver == "fast":
            return start
        return solve_levenberg_marquardt(self.problem, start, target_BK3, self.settings.lm_steps)

    def shard(self, index: int) -> dict[str, Tensor]:
        """The pairs of one shard: what `PairStore.read` names, on the CPU."""
        generator = torch.Generator().manual_seed(_shard_seed(self.settings.seed, index))
        q_BN = self.robot.sample(self.settings.shard_size, generator)
        with torch.no_grad():
            poses = self.robot.forward(q_BN)
            target_BK3 = self.body_map.targets(poses)
        z_BZ = self.solve(target_BK3)
        with torch.no_grad():
            pose_BJ6 = self.prior.decode(z_BZ)
            distance_BK = (self.problem.keypoints_of(z_BZ) - target_BK3).norm(dim=-1)
            tensors = {
                "q": q_BN,
                "R": self.robot.moving_orientations(poses),
                "H": pose_BJ6,
                "phi": self.prior.reconstruction_error(pose_BJ6),
                "cost": self.problem.cost(z_BZ, target_BK3),
                "residual_m": distance_BK.mean(dim=1),
                "z_norm": z_BZ.norm(dim=-1),
            }
        return {name: tensor.cpu() for name, tensor in tensors.items()}


def _shard_seed(seed: int, index: int) -> int:
    """Different for every (seed, index), and away from the small seeds that other draws use."""
    return (seed * 0x9E3779B97F4A7C15 + index * 0xBF58476D1CE4E5B9 + 0x94D049BB133111EB) % 2**63


def generate_pairs(
    generator: PairGenerator,
    store: PairStore,
    amortiser_progress: Callable[[int, float], None] = lambda step, cost: None,
    shard_progress: Callable[[int, int], None] = lambda done, total: None,
) -> PairingReport:
    """Makes the shards that are missing, damaged or foreign; those that are whole stay.

    Args:
        generator: makes the pairs.
        store: where they go.
        amortiser_progress: called with (step, mean cost).
        shard_progress: called with (shards done, all shards) before the first and after each shard.
    """
    start = time.perf_counter()
    missing = store.missing()
    if missing:
        generator.prepare(store, amortiser_progress)
    shard_progress(store.shards - len(missing), store.shards)  # only now, so that the rate is that of the pairs
    for number, index in enumerate(missing):
        store.write(index, generator.shard(index))
        shard_progress(store.shards - len(missing) + number + 1, store.shards)
    return PairingReport(len(missing) * store.shard_size, time.perf_counter() - start)
