"""How good a body prior is: reconstruction, denoising, detection of implausible poses, samples, latent IK.

Every measure takes poses that the prior has not seen and a seed; the same poses and seed give the same numbers.

Legend: B batch, J = 21 posed joints, K keypoints, Z latent numbers.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.joints import hinge_axis
from mrhubo.body.latent import LatentProblem
from mrhubo.body.prior import BodyPrior
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, LEG_JOINTS, POSED_JOINT_NAMES, Skeleton

IK_KEYPOINTS = (
    *("left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist"),
    *("left_index", "right_index", "left_thumb", "right_thumb", "head", "left_eye", "right_eye"),
)
"""The 13 keypoints of the latent inverse kinematics; the pelvis is the origin and so is given too."""
NOISE_DEG = (5.0, 15.0, 30.0)
_BEND_DEG = (30.0, 90.0)
_HINGES = ("left_knee", "right_knee", "left_elbow", "right_elbow")
_LIMBS = [
    [POSED_JOINT_NAMES.index(f"{side}_{part}") for part in parts]
    for side in ("left", "right")
    for parts in (("collar", "shoulder"), ("elbow", "wrist"), ("hip", "knee", "ankle", "foot"))
]
_TRUNK_RADIUS = 0.10


def reconstruction(prior: BodyPrior, skeleton: Skeleton, pose_BJ6: Tensor) -> tuple[Tensor, Tensor]:
    """Encode-mean-decode error: joints (B, 22) [mm] and rotations (B, 21) [deg]."""
    target, found = rotation.sixd_to_matrix(pose_BJ6), prior.decode_matrices(prior.encode(pose_BJ6))
    return pose_distance(skeleton, target, found)


def pose_distance(skeleton: Skeleton, a_BJ33: Tensor, b_BJ33: Tensor) -> tuple[Tensor, Tensor]:
    """Distance of the joints (B, 22) [mm] and angle of the rotations (B, 21) [deg] between local rotations."""
    joints = len(JOINT_NAMES)
    distance = skeleton.keypoints(a_BJ33)[:, :joints] - skeleton.keypoints(b_BJ33)[:, :joints]
    return 1000 * distance.norm(dim=-1), torch.rad2deg(rotation.geodesic_distance(a_BJ33, b_BJ33))


def turn_joints(pose_BJ6: Tensor, angle_BJ: Tensor, generator: torch.Generator | None = None) -> Tensor:
    """Poses whose every joint is turned by the given angle [rad] about an axis drawn uniformly from the sphere."""
    axis = rotation.random_axes(*angle_BJ.shape, generator=generator)
    turn = rotation.axis_angle_to_matrix(axis.to(pose_BJ6) * angle_BJ[..., None])
    return rotation.matrix_to_sixd(rotation.sixd_to_matrix(pose_BJ6) @ turn)


def bend_backwards(pose_BJ6: Tensor, generator: torch.Generator) -> Tensor:
    """Poses with one elbow or knee, drawn at random, bent the wrong way by 30 to 90 degrees (uniform)."""
    batch = len(pose_BJ6)
    which = torch.randint(len(_HINGES), (batch,), generator=generator)
    low, high = _BEND_DEG
    angle = -torch.deg2rad(low + (high - low) * torch.rand(batch, generator=generator))
    joint = torch.tensor([POSED_JOINT_NAMES.index(name) for name in _HINGES])[which]
    axis = torch.tensor([hinge_axis(name) for name in _HINGES])[which]
    bent = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(axis * angle[:, None]))
    result = pose_BJ6.clone()
    result[torch.arange(batch), joint] = bent.to(pose_BJ6)
    return result


def random_rotations(count: int, generator: torch.Generator) -> Tensor:
    """Poses (count, 21, 6) whose every joint has a rotation drawn uniformly from SO(3)."""
    quaternion = torch.randn(count, len(POSED_JOINT_NAMES), 4, generator=generator)
    return rotation.matrix_to_sixd(rotation.quaternion_to_matrix(quaternion))


def arms_through_body(skeleton: Skeleton, pose_BJ6: Tensor, generator: torch.Generator) -> Tensor:
    """Poses with others' limbs: arms, forearms and legs each from another pose; those whose forearm pierces the trunk.

    The trunk is a capsule of 10 cm around pelvis, spine and neck. Few combinations pierce it, so each pose is tried
    several times; the number that comes back varies.
    """
    found = []
    for _ in range(8):
        grafted = pose_BJ6.clone()
        for limb in _LIMBS:
            other = torch.randperm(len(pose_BJ6), generator=generator).to(pose_BJ6.device)
            grafted[:, limb] = pose_BJ6[other][:, limb]
        found.append(grafted[_forearm_in_trunk(skeleton, grafted)])
    return torch.cat(found)


def _forearm_in_trunk(skeleton: Skeleton, pose_BJ6: Tensor) -> Tensor:
    points = skeleton.keypoints(rotation.sixd_to_matrix(pose_BJ6))
    at = {name: points[:, KEYPOINT_NAMES.index(name)] for name in KEYPOINT_NAMES[:22]}
    steps = torch.linspace(0, 1, 8, device=points.device)[:, None]
    trunk = torch.cat([at[a][:, None] * (1 - steps) + at[b][:, None] * steps for a, b in _TRUNK], dim=1)
    forearms = torch.cat(
        [at[f"{s}_elbow"][:, None] * (1 - steps) + at[f"{s}_wrist"][:, None] * steps for s in ("left", "right")], dim=1
    )
    return torch.cdist(forearms, trunk).flatten(1).amin(dim=1) < _TRUNK_RADIUS


_TRUNK = (("pelvis", "spine2"), ("spine2", "neck"))


def roc_area(score_of_good: Tensor, score_of_bad: Tensor) -> float:
    """Area under the ROC curve: probability that a bad one scores higher than a good one (ties count half)."""
    good = score_of_good.double().sort().values
    below = torch.searchsorted(good, score_of_bad.double(), right=False)
    up_to = torch.searchsorted(good, score_of_bad.double(), right=True)
    return float((below + up_to).double().mean() / (2 * len(good)))


def detection(prior: BodyPrior, skeleton: Skeleton, pose_BJ6: Tensor, seed: int = 0) -> dict[str, float]:
    """ROC areas of phi between real poses and broken ones; see the functions above. No grafted one, no such area."""
    generator = torch.Generator().manual_seed(seed)
    real = prior.reconstruction_error(pose_BJ6)
    broken = {
        "bent": bend_backwards(pose_BJ6, generator),
        "random": random_rotations(len(pose_BJ6), generator).to(pose_BJ6),
        "grafted": arms_through_body(skeleton, pose_BJ6, generator),
    }
    return {f"roc_{name}": roc_area(real, prior.reconstruction_error(bad)) for name, bad in broken.items() if len(bad)}


def denoising(prior: BodyPrior, skeleton: Skeleton, pose_BJ6: Tensor, seed: int = 0) -> dict[str, float]:
    """Mean joint distance [mm] and angle [deg] to the clean pose, before and after, for noise on every joint."""
    generator = torch.Generator().manual_seed(seed)
    clean, values = rotation.sixd_to_matrix(pose_BJ6), {}
    for noise in NOISE_DEG:
        angle = torch.deg2rad(torch.full(pose_BJ6.shape[:2], noise, device=pose_BJ6.device))
        noisy = turn_joints(pose_BJ6, angle, generator)
        for word, matrices in (
            ("before", rotation.sixd_to_matrix(noisy)),
            ("after", prior.decode_matrices(prior.encode(noisy))),
        ):
            distance, degrees = pose_distance(skeleton, clean, matrices)
            values[f"noise{noise:.0f}_{word}_mm"] = float(distance.mean())
            values[f"noise{noise:.0f}_{word}_deg"] = float(degrees.mean())
    return values


def latent_ik(prior: BodyPrior, skeleton: Skeleton, pose_BJ6: Tensor) -> dict[str, float]:
    """Mean distance [mm] of the 13 given keypoints, and of all joints above the hips, after latent IK.

    `ik_zero_keypoint_mm` is what the search gives from z = 0: the more it is above the other, the harder the
    prior is to search.
    """
    target = skeleton.keypoints(rotation.sixd_to_matrix(pose_BJ6))
    given = [KEYPOINT_NAMES.index(name) for name in IK_KEYPOINTS]
    problem = LatentProblem(prior.decoder, skeleton, given)
    nothing = torch.zeros(len(pose_BJ6), prior.latent, device=pose_BJ6.device)
    found = []
    for start in (nearest_samples(problem, target[:, given]), nothing):
        z = solve_quasi_newton(problem, start, target[:, given], steps=150, tolerance=1e-4)
        found.append(1000 * (skeleton.keypoints(prior.decode_matrices(z)) - target).norm(dim=-1))
    return {
        "ik_keypoint_mm": float(found[0][:, given].mean()),
        "ik_upper_body_mm": float(found[0][:, _UPPER_BODY].mean()),
        "ik_zero_keypoint_mm": float(found[1][:, given].mean()),
    }


_UPPER_BODY = [i for i, name in enumerate(JOINT_NAMES) if i and name not in LEG_JOINTS]


def samples(
    prior: BodyPrior, skeleton: Skeleton, training_BJ6: Tensor | None, count: int = 2_000, seed: int = 0
) -> dict[str, float]:
    """Of poses drawn from N(0, I): share inside anatomical ranges, mean joint distance to the nearest training pose.

    Args:
        prior: the prior.
        skeleton: gives the joints.
        training_BJ6: training poses (or a large sample of them) to look for the nearest in; None leaves that out.
        count: how many to draw.
        seed: of the draw.
    """
    z = torch.randn(count, prior.latent, generator=torch.Generator().manual_seed(seed))
    drawn = prior.decode(z.to(prior.device))
    values = {"samples_inside": float(anatomy.inside(drawn).float().mean())}
    if training_BJ6 is not None:
        values["samples_nearest_mm"] = float(nearest_mm(skeleton, drawn, training_BJ6).mean())
    return values


def nearest_mm(skeleton: Skeleton, pose_BJ6: Tensor, training_BJ6: Tensor) -> Tensor:
    """Mean distance of the 22 joints [mm] of each pose to its nearest among the training poses: (B,).

    Nearest in the root mean square over joints, of which the mean over joints is then given.
    """
    joints = len(JOINT_NAMES)
    points, training = (
        torch.cat([skeleton.keypoints(rotation.sixd_to_matrix(part))[:, :joints] for part in poses.split(16_384)])
        for poses in (pose_BJ6, training_BJ6)
    )
    best = torch.cat([torch.cdist(part, training.flatten(1)).argmin(dim=1) for part in points.flatten(1).split(1_024)])
    return 1000 * (points - training[best]).norm(dim=-1).mean(dim=1)


@torch.no_grad()
def measure(prior: BodyPrior, pose_BJ6: Tensor, training_BJ6: Tensor | None = None, seed: int = 0) -> dict[str, float]:
    """All measures on unseen poses (B, 21, 6): names with their unit, in the order of the model card.

    Args:
        prior: the prior.
        pose_BJ6: poses it was not trained on; up to 500 of them, evenly spaced, go through latent IK.
        training_BJ6: training poses to measure samples against; None leaves the distance out.
        seed: of all draws.
    """
    skeleton = Skeleton().to(pose_BJ6.device)
    joints_mm, angles_deg = reconstruction(prior, skeleton, pose_BJ6)
    values = {
        "joint_mm": float(joints_mm.mean()),
        "joint_mm_worst": worst_percent(joints_mm.mean(dim=1)),
        "geodesic_deg": float(angles_deg.mean()),
        "geodesic_deg_worst": worst_percent(angles_deg.mean(dim=1)),
    }
    values |= latent_ik(prior, skeleton, pose_BJ6[:: max(1, len(pose_BJ6) // 500)])
    values |= detection(prior, skeleton, pose_BJ6, seed)
    values |= samples(prior, skeleton, training_BJ6, seed=seed)
    return values | denoising(prior, skeleton, pose_BJ6, seed)


def worst_percent(values_B: Tensor) -> float:
    """Mean of the largest hundredth (at least one) of the values."""
    return float(values_B.flatten().topk(max(1, values_B.numel() // 100)).values.mean())
