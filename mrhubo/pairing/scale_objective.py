"""How well a scale factor theta turns robot poses into the human poses that they were made for.

For pairs (q, H) of the reference retargeter, the distance between g_theta(q), the human pose that pairing would give q,
and H. Figuera, Park, Ahn: MR.HuBo, IROS 2024, section III-D: the mean geodesic distance of the arm joints' rotations.
Where the network reads directions, poses are compared by those of arms and hands instead: collars and spine can make up
for a shoulder, so that what is near in local rotations may be far as seen from the chest.

Legend: C scale factors, P pairs, K keypoints, J = 21 human joints, Z latent numbers.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, poses_at_once, solve_quasi_newton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import ManualScaleConfig, PairsConfig
from mrhubo.reference import angle_between
from mrhubo.robot import BodyMap, ManualScale
from mrhubo.runtime.threads import use_threads


class ScaleFactorObjective:
    """Measures scale factors on a set of pairs, many at once."""

    def __init__(
        self, body_map: BodyMap, prior: BodyPrior, settings: PairsConfig, q_PN: Tensor, local_PJ33: Tensor, frame: str
    ) -> None:
        """Robot poses (P, N) [rad], the human poses (P, 21, 3, 3) that they imitate, and `model.input_frame`."""
        self.body_map, self.prior, self.settings, self.local_PJ33 = body_map, prior, settings, local_PJ33
        self.frame = frame
        self._poses = body_map.robot.forward(q_PN)
        arms = {part.joint for part in body_map.keypoints.parts if part.region in ("arm", "hand")}
        names = [name for name in body_map.input_joints() if name in arms]
        self.arm_joints = [POSED_JOINT_NAMES.index(name) for name in names]
        """Positions of the joints that count, for a network that reads rotations."""
        self.arm_directions = [i for i in body_map.measured if body_map.directions[i].part.joint in arms]
        """Positions of the directions that count, for one that reads directions."""

    @torch.no_grad()
    def human_poses(self, configs: Sequence[ManualScaleConfig]) -> Tensor:
        """g_theta(q): human poses (C, P, 21, 3, 3), solved from the nearest of 4,096 samples of the prior."""
        scales = [ManualScale(config) for config in configs]
        targets = []
        for scale in scales:
            scale.prepare(self.body_map.robot)
            targets.append(scale.targets(self._poses))
        target_BK3 = torch.cat(targets)
        problem = LatentProblem(
            self.prior.decoder,
            self.body_map.skeleton,
            scales[0].keypoint_indices,
            self.settings.w_data,
            self.settings.w_prior,
        )
        start_BZ = nearest_samples(problem, target_BK3)
        z_BZ = solve_quasi_newton(problem, start_BZ, target_BK3, self.settings.fine_steps)
        local_BJ33 = torch.cat([self.prior.decode_matrices(part) for part in z_BZ.split(poses_at_once(z_BZ.device))])
        return local_BJ33.unflatten(0, (len(configs), -1))

    @torch.no_grad()
    def distances(self, local_CPJ33: Tensor) -> Tensor:
        """Distance (C, P) [rad] of human poses to those that the robot poses imitate."""
        if self.frame == "local":
            found, wanted = (
                rotation.orthonormal(x)[..., self.arm_joints, :, :] for x in (local_CPJ33, self.local_PJ33)
            )
            return rotation.geodesic_distance(found, wanted.expand_as(found)).mean(dim=-1)
        found, wanted = (
            self.body_map.human_directions(x.flatten(0, -4)).unflatten(0, x.shape[:-3])[..., self.arm_directions, :]
            for x in (local_CPJ33, self.local_PJ33)
        )
        return angle_between(found, wanted.expand_as(found)).mean(dim=-1)

    def measure(self, configs: Sequence[ManualScaleConfig]) -> Tensor:
        """Mean distance (C,) [rad] of scale factors over the pairs."""
        with use_threads():
            return self.distances(self.human_poses(configs)).mean(dim=1)
