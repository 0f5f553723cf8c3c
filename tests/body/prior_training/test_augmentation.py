"""What the prior's training adds to its data."""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, POSED_JOINT_NAMES, BodyPrior, Skeleton, anatomy
from mrhubo.body.prior_training.augmentation import add_missing_motion, add_noise


def poses(count: int) -> Tensor:
    prior = BodyPrior.open()
    drawn = prior.decode(0.5 * torch.randn(count, prior.latent, generator=torch.Generator().manual_seed(0)))
    still = [POSED_JOINT_NAMES.index(f"{s}_{p}") for s in ("left", "right") for p in ("wrist", "collar", "foot")]
    return drawn.index_copy(1, torch.tensor(still), rotation.matrix_to_sixd(torch.eye(3).expand(count, 6, 3, 3)))


def test_missing_motion_turns_only_what_the_data_lacks_and_stays_human() -> None:
    torch.manual_seed(0)
    before = poses(4_000)
    after = add_missing_motion(before, 0.5)
    changed = ((after - before).abs().amax(-1) > 1e-5).float().mean(0)
    for name, share in zip(POSED_JOINT_NAMES, changed.tolist(), strict=True):
        if name.endswith(("wrist", "collar", "foot", "ankle", "shoulder")):
            assert 0.4 < share < 0.6, name
        else:
            assert share == 0, name
    excess = anatomy.excess(rotation.sixd_to_matrix(after))
    for part in ("wrist", "collar", "foot"):
        joints = [POSED_JOINT_NAMES.index(f"{side}_{part}") for side in ("left", "right")]
        assert float(torch.rad2deg(excess[:, joints]).max()) < 2


def test_a_shrug_moves_the_shoulder_and_not_the_arms_direction() -> None:
    torch.manual_seed(0)
    skeleton, before = Skeleton(), poses(500)
    after = add_missing_motion(before, 1.0)
    a, b = (skeleton.keypoints(rotation.sixd_to_matrix(p)) for p in (before, after))
    for side in ("left", "right"):
        shoulder, elbow = (KEYPOINT_NAMES.index(f"{side}_{part}") for part in ("shoulder", "elbow"))
        torch.testing.assert_close(a[:, elbow] - a[:, shoulder], b[:, elbow] - b[:, shoulder], atol=1e-5, rtol=0)
        moved = (a[:, shoulder] - b[:, shoulder]).norm(dim=-1)
        assert 0.01 < float(moved.mean()) and float(moved.max()) < 0.1


def test_noise_comes_to_a_share_of_the_poses() -> None:
    torch.manual_seed(0)
    before = poses(4_000)
    after = add_noise(before, 0.3)
    angle = rotation.geodesic_distance(rotation.sixd_to_matrix(before), rotation.sixd_to_matrix(after))
    turned = torch.rad2deg(angle) > 0.1
    count = turned.sum(1)
    assert 0.27 < float((count > 0).float().mean()) < 0.33
    one, many = count == 1, count > 15
    assert bool(((count == 0) | one | many).all()) and 0.4 < float(one.sum() / (count > 0).sum()) < 0.6
    assert float(torch.rad2deg(angle[many]).max()) < 41 and float(torch.rad2deg(angle[one]).max()) < 121
    assert torch.equal(add_noise(before, 0.0), before)
