"""The measures themselves: against plain computations, and on priors whose answers are known."""

from __future__ import annotations

import pytest
import torch
from sklearn.metrics import roc_auc_score
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import POSED_JOINT_NAMES, BodyPrior, Skeleton, anatomy
from mrhubo.body.prior_training import measures


@pytest.fixture(scope="module")
def prior() -> BodyPrior:
    return BodyPrior.open()


@pytest.fixture(scope="module")
def poses(prior: BodyPrior) -> Tensor:
    return prior.decode(0.7 * torch.randn(300, prior.latent, generator=torch.Generator().manual_seed(0)))


def test_roc_area_is_that_of_scikit_learn() -> None:
    generator = torch.Generator().manual_seed(0)
    good = torch.randn(200, generator=generator).round(decimals=1)
    bad = (torch.randn(150, generator=generator) + 1).round(decimals=1)
    labels = torch.cat((torch.zeros(200), torch.ones(150)))
    expected = roc_auc_score(labels, torch.cat((good, bad)))
    assert measures.roc_area(good, bad) == pytest.approx(expected, abs=1e-9)
    assert measures.roc_area(good, good) == pytest.approx(0.5)


def test_noise_turns_every_joint_by_the_given_angle(poses: Tensor) -> None:
    angle = torch.rand(300, 21, generator=torch.Generator().manual_seed(1))
    noisy = measures.turn_joints(poses, angle, torch.Generator().manual_seed(2))
    found = rotation.geodesic_distance(rotation.sixd_to_matrix(noisy), rotation.sixd_to_matrix(poses))
    torch.testing.assert_close(found, angle, atol=1e-3, rtol=0)
    again = measures.turn_joints(poses, angle, torch.Generator().manual_seed(2))
    torch.testing.assert_close(again, noisy)


def test_bending_backwards_leaves_the_ranges_at_one_hinge(poses: Tensor) -> None:
    bent = measures.bend_backwards(poses, torch.Generator().manual_seed(0))
    changed = (bent - poses).abs().amax(-1) > 1e-4
    assert bool((changed.sum(1) == 1).all())
    assert {POSED_JOINT_NAMES[j] for j in changed.nonzero()[:, 1].tolist()} == set(measures._HINGES)
    excess = torch.rad2deg(anatomy.excess(rotation.sixd_to_matrix(bent)))[changed].amax(-1)
    assert 18 < float(excess.min()) and float(excess.max()) < 82


def test_grafted_arms_pierce_the_trunk(poses: Tensor) -> None:
    skeleton = Skeleton()
    grafted = measures.arms_through_body(skeleton, poses, torch.Generator().manual_seed(0))
    assert len(grafted) > 0
    points = skeleton.keypoints(rotation.sixd_to_matrix(grafted))
    along = torch.linspace(0, 1, 50)[:, None]
    pelvis, spine, neck = points[:, 0], points[:, 6], points[:, 12]
    nearest = []
    for elbow, wrist in ((18, 20), (19, 21)):
        forearm = points[:, elbow, None] * (1 - along) + points[:, wrist, None] * along
        for a, b in ((pelvis, spine), (spine, neck)):
            trunk = a[:, None] * (1 - along) + b[:, None] * along
            nearest.append(torch.cdist(forearm, trunk).flatten(1).amin(1))
    assert float(torch.stack(nearest).amin(0).max()) < 0.1


def test_nearest_finds_the_pose_itself(poses: Tensor) -> None:
    skeleton = Skeleton()
    assert float(measures.nearest_mm(skeleton, poses[:20], poses).max()) < 0.01
    expected = measures.pose_distance(
        skeleton, rotation.sixd_to_matrix(poses[:1]), rotation.sixd_to_matrix(poses[1:2])
    )[0].mean()
    torch.testing.assert_close(measures.nearest_mm(skeleton, poses[:1], poses[1:2])[0], expected)


def test_worst_percent_is_the_mean_of_the_top_hundredth() -> None:
    assert measures.worst_percent(torch.arange(1000.0)) == pytest.approx(994.5)
    assert measures.worst_percent(torch.arange(7.0)) == 6


def test_all_measures_come_finite_and_repeat(prior: BodyPrior, poses: Tensor) -> None:
    found = measures.measure(prior, poses[:30], poses)
    assert found == measures.measure(prior, poses[:30], poses)
    assert all(torch.isfinite(torch.tensor(v)) for v in found.values())
    assert found["joint_mm"] <= found["joint_mm_worst"] and 0 <= found["samples_inside"] <= 1
    assert found["noise5_before_deg"] == pytest.approx(5, abs=0.01)
    assert "samples_nearest_mm" not in measures.measure(prior, poses[:5])


def test_a_prior_that_knows_nothing_is_found_out(poses: Tensor) -> None:
    torch.manual_seed(0)
    ignorant = BodyPrior().requires_grad_(False).eval()
    found = measures.measure(ignorant, poses[:30])
    assert found["joint_mm"] > 50 and found["noise30_after_deg"] > 15
