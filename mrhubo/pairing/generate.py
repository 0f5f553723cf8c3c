"""Pairs of robot and human pose, shard by shard: forward, from random robot poses (algorithm 1 of MR.HuBo), and
reverse, from human poses of the prior and from such as are drawn joint by joint.

The paper searches for a forward pair's human pose by inverse kinematics in the prior's latent space. Where the pose is
then turned until its limbs point as the robot's do, where phi is of those limbs alone, and where the networks see
nothing else either, that search decides nothing: such a pose is put together from the robot's directions (`direct`).

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
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config
from mrhubo.pairing.amortiser import Amortiser, train_amortiser
from mrhubo.pairing.lbfgs import solve_lbfgs
from mrhubo.pairing.random_poses import random_poses
from mrhubo.pairing.settings import pairing_settings
from mrhubo.pairing.store import PairStore
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, align_pose
from mrhubo.robot.plausibility import read_phi, read_pose
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.threads import use_threads

_STARTS = 4
"""Starts of the reference retargeter for a reverse pair: 12 take twice as long, for a cost that is 0.3% lower."""


class PairGenerator:
    """Makes shards for one robot, prior and config; everything is on the prior's device."""

    def __init__(self, body_map: BodyMap, prior: BodyPrior, config: Config) -> None:
        """The robot's body map, the prior, and the config, of which `pairing_settings` are used."""
        settings = pairing_settings(config)
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
        if self.settings.solver in ("paper", "direct") or not store.counts["forward"]:
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
        """Latents (B, Z) for target keypoints (B, K, 3) [m], by the config's solver, one that searches."""
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
            drawn, q_BN = self._draw(direction, generator)
            with torch.no_grad():
                poses = self.robot.forward(q_BN)
                upright = direction == "reverse"
                target_BK3 = (self.body_map.upright_keypoints if upright else self.body_map.targets)(poses)
                orientation_BM6 = self.robot.moving_orientations(poses)
            size = poses_at_once(self.device)
            directions = self.body_map.robot_directions(poses)
            z_BZ, human_BJ33 = drawn or self._human(target_BK3, directions)
            chunks = (x.split(size) for x in (z_BZ, human_BJ33, target_BK3, directions))
            parts = [self._measure(z, h, target, limbs, direction) for z, h, target, limbs in zip(*chunks, strict=True)]
            found = {name: torch.cat([part[name] for part in parts]) for name in parts[0]}
            return {name: tensor.cpu() for name, tensor in {"q": q_BN, "R": orientation_BM6, **found}.items()}

    @torch.no_grad()
    def _draw(self, direction: str, generator: torch.Generator) -> tuple[tuple[Tensor, Tensor] | None, Tensor]:
        """Latents (B, Z) and poses (B, 21, 3, 3), which forward pairs have yet to be given; joint angles (B, N)."""
        settings, count = self.settings, self.settings.shard_size
        if direction == "forward":
            return None, self.robot.sample(count, generator)
        random = round(settings.random_share * count)
        z_BZ = settings.reverse_spread * torch.randn(count - random, self.prior.latent, generator=generator)
        z_BZ, human_BJ33 = self._decoded(z_BZ.to(self.device))
        random_BJ33 = random_poses(self.body_map.keypoints.parts, random, generator).to(self.device)
        z_BZ = torch.cat((z_BZ, self._encoded(random_BJ33)))
        human_BJ33 = torch.cat((human_BJ33, random_BJ33))
        return (z_BZ, human_BJ33), self.reference.solve_frames(human_BJ33)[0]

    @torch.no_grad()
    def _human(self, target_BK3: Tensor, direction_BD3: Tensor) -> tuple[Tensor, Tensor]:
        """Latents (B, Z) and poses (B, 21, 3, 3) of forward pairs, by the config's solver."""
        if self.settings.solver != "direct":
            return self._decoded(self.solve(target_BK3))
        human_BJ33 = read_pose(self.body_map, direction_BD3)
        return self._encoded(human_BJ33), human_BJ33

    def _encoded(self, local_BJ33: Tensor) -> Tensor:
        """The prior's latents (B, Z) of poses (B, 21, 3, 3)."""
        parts = rotation.matrix_to_sixd(local_BJ33).split(poses_at_once(self.device))
        return torch.cat([self.prior.encode(part) for part in parts])

    @torch.no_grad()
    def _decoded(self, z_BZ: Tensor) -> tuple[Tensor, Tensor]:
        """Latents (B, Z), and their poses (B, 21, 3, 3)."""
        parts = [self.prior.decode_matrices(part) for part in z_BZ.split(poses_at_once(self.device))]
        return z_BZ, torch.cat(parts) if parts else z_BZ.new_zeros(0, len(POSED_JOINT_NAMES), 3, 3)

    @torch.no_grad()
    def _measure(
        self, z_BZ: Tensor, matrices: Tensor, target_BK3: Tensor, direction_BD3: Tensor, direction: str
    ) -> dict[str, Tensor]:
        """The pairs' human poses, and how good these are; the measures are those of the poses (B, 21, 3, 3) that are
        given, before alignment.
        """
        found_BJ6 = pose_BJ6 = rotation.matrix_to_sixd(matrices)
        if direction == "forward":
            points_BK3 = self.body_map.skeleton.keypoints(matrices)[:, self.body_map.keypoint_indices]
            if self.settings.align and self.settings.solver != "direct":
                pose_BJ6 = rotation.matrix_to_sixd(align_pose(self.body_map, matrices, direction_BD3))
        else:  # these humans bend their backs; only what the robot has is compared, on an upright human
            points_BK3 = self.body_map.human_keypoints(self.body_map.human_directions(matrices))
        distance_BK = (points_BK3 - target_BK3).norm(dim=-1)
        prior_B = z_BZ.square().sum(-1)
        return {
            "H": pose_BJ6,
            "phi": self._phi(found_BJ6, pose_BJ6),
            "cost": self.problem.w_data * distance_BK.square().sum(1) + self.problem.w_prior * prior_B,
            "residual_m": distance_BK.mean(dim=1),
            "z_norm": prior_B.sqrt(),
        }

    def _phi(self, found_BJ6: Tensor, pose_BJ6: Tensor) -> Tensor:
        """phi (B,) of what inverse kinematics found, or of what the robot reads of the pair's human pose."""
        if self.settings.phi == "all":
            return self.prior.reconstruction_error(found_BJ6)
        human_BD3 = self.body_map.human_directions(rotation.sixd_to_matrix(pose_BJ6))
        return read_phi(self.body_map, self.prior, human_BD3)


def _shard_seed(seed: int, index: int) -> int:
    """Different for every (seed, index), and away from the small seeds that other draws use."""
    return (seed * 0x9E3779B97F4A7C15 + index * 0xBF58476D1CE4E5B9 + 0x94D049BB133111EB) % 2**63
