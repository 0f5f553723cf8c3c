"""Pairs of robot and human pose, shard by shard: forward, from random robot poses (algorithm 1 of MR.HuBo), and
reverse, from human poses of the prior.

Forward pairs never hold a human pose that the robot cannot reach. Reverse pairs do, as the reference retargeter answers
any pose; no human motion is needed for them either.

Legend: B pairs of a shard, N robot joints, K keypoints, J = 21 human joints, Z latent numbers.
"""

from __future__ import annotations

from functools import cached_property

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import poses_at_once, solve_quasi_newton
from mrhubo.config import PairsConfig
from mrhubo.pairing.amortiser import Amortiser, train_amortiser
from mrhubo.pairing.lbfgs import solve_lbfgs
from mrhubo.pairing.store import PairStore
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, align_pose
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.threads import use_threads

_STARTS = 4
"""Starts of the reference retargeter for a reverse pair: 12 take twice as long, for a cost that is 0.3% lower."""


class PairGenerator:
    """Makes shards for one robot, prior and pairing config; everything is on the prior's device."""

    def __init__(self, body_map: BodyMap, prior: BodyPrior, settings: PairsConfig) -> None:
        self.body_map, self.robot, self.prior, self.settings = body_map, body_map.robot, prior, settings
        self.problem = LatentProblem(
            prior.decoder, body_map.skeleton, body_map.keypoint_indices, settings.w_data, settings.w_prior
        )
        self.amortiser: Amortiser | None = None

    @property
    def device(self) -> torch.device:
        """Where the pairs are made."""
        return self.prior.device

    @torch.no_grad()
    def draw_targets(self, count: int, generator: torch.Generator) -> Tensor:
        """Target keypoints (count, K, 3) [m] of fresh random robot poses."""
        return self.body_map.targets(self.robot.forward(self.robot.sample(count, generator)))

    def prepare(self, store: PairStore, report: Reporter = SILENT) -> None:
        """Reads or trains the amortised solver, if the config's solver uses one."""
        if self.settings.solver == "paper" or not store.counts["forward"]:
            return
        settings, header = self.settings, {**store.header, "what": "amortiser"}
        with use_threads():
            self.amortiser = train_amortiser(
                self.problem,
                self.draw_targets,
                settings.amortiser_steps,
                settings.seed,
                store.amortiser_path,
                header,
                report,
            )

    def solve(self, target_BK3: Tensor) -> Tensor:
        """Latents (B, Z) for target keypoints (B, K, 3) [m], by the config's solver."""
        if self.settings.solver == "paper":
            return solve_lbfgs(self.problem, target_BK3)
        if self.amortiser is None:
            raise RuntimeError("call prepare() before solve()")
        with torch.no_grad():
            start = torch.cat([self.amortiser(part) for part in target_BK3.split(poses_at_once(self.device))])
        if self.settings.solver == "fast":
            return start
        steps, metric_ZZ = self.settings.fine_steps, self.amortiser.metric_ZZ
        return solve_quasi_newton(self.problem, start, target_BK3, steps, metric_ZZ=metric_ZZ)

    @cached_property
    def reference(self) -> OptimizationRetargeter:
        """Answers the human poses of reverse pairs."""
        return OptimizationRetargeter(self.body_map, starts=_STARTS)

    def shard(self, direction: str, index: int) -> dict[str, Tensor]:
        """The pairs of one shard, `forward` or `reverse`: what `PairStore.read` names, on the CPU.

        On a CPU always with one thread, so that the bytes do not depend on how many cores or processes there are; more
        cores are used by more processes (`mrhubo.pairing.workers`).
        """
        with use_threads(1):
            # Forward shards count upwards from 0, reverse ones downwards from -1.
            seed = _shard_seed(self.settings.seed, index if direction == "forward" else -1 - index)
            generator = torch.Generator().manual_seed(seed)
            z_BZ, q_BN = self._draw(direction, generator)
            with torch.no_grad():
                poses = self.robot.forward(q_BN)
                upright = direction == "reverse"
                target_BK3 = (self.body_map.upright_keypoints if upright else self.body_map.targets)(poses)
                orientation_BM6 = self.robot.moving_orientations(poses)
            if z_BZ is None:
                z_BZ = self.solve(target_BK3)
            size = poses_at_once(self.device)
            directions = self.body_map.robot_directions(poses).split(size)
            chunks = zip(z_BZ.split(size), target_BK3.split(size), directions, strict=True)
            parts = [self._measure(z, target, limbs, direction) for z, target, limbs in chunks]
            found = {name: torch.cat([part[name] for part in parts]) for name in parts[0]}
            return {name: tensor.cpu() for name, tensor in {"q": q_BN, "R": orientation_BM6, **found}.items()}

    @torch.no_grad()
    def _draw(self, direction: str, generator: torch.Generator) -> tuple[Tensor | None, Tensor]:
        """Latents (B, Z), which forward pairs have yet to be given, and joint angles (B, N)."""
        count = self.settings.shard_size
        if direction == "forward":
            return None, self.robot.sample(count, generator)
        z_BZ = self.settings.reverse_spread * torch.randn(count, self.prior.latent, generator=generator)
        z_BZ = z_BZ.to(self.device)
        poses = [self.prior.decode_matrices(part) for part in z_BZ.split(poses_at_once(self.device))]
        return z_BZ, self.reference.solve_frames(torch.cat(poses))[0]

    @torch.no_grad()
    def _measure(self, z_BZ: Tensor, target_BK3: Tensor, direction_BD3: Tensor, direction: str) -> dict[str, Tensor]:
        """Human poses of latents, and how good they are; the measures are those of the latents, before alignment."""
        matrices = self.prior.decode_matrices(z_BZ)
        found_BJ6 = pose_BJ6 = rotation.matrix_to_sixd(matrices)
        if direction == "forward":
            points_BK3 = self.body_map.skeleton.keypoints(matrices)[:, self.body_map.keypoint_indices]
            if self.settings.align:
                pose_BJ6 = rotation.matrix_to_sixd(align_pose(self.body_map, matrices, direction_BD3))
        else:  # the prior's humans bend their backs; only what the robot has is compared, on an upright human
            points_BK3 = self.body_map.human_keypoints(self.body_map.human_directions(matrices))
        distance_BK = (points_BK3 - target_BK3).norm(dim=-1)
        prior_B = z_BZ.square().sum(-1)
        return {
            "H": pose_BJ6,
            "phi": self.prior.reconstruction_error(found_BJ6),
            "cost": self.problem.w_data * distance_BK.square().sum(1) + self.problem.w_prior * prior_B,
            "residual_m": distance_BK.mean(dim=1),
            "z_norm": prior_B.sqrt(),
        }


def _shard_seed(seed: int, index: int) -> int:
    """Different for every (seed, index), and away from the small seeds that other draws use."""
    return (seed * 0x9E3779B97F4A7C15 + index * 0xBF58476D1CE4E5B9 + 0x94D049BB133111EB) % 2**63
