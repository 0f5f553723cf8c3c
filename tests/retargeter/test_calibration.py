"""Weights of a confidence, found on poses whose answers are known to be good or bad."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.motion import read_motion, reshare
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.retargeter.calibration import calibrate, fit_weights
from mrhubo.retargeter.confidence import SIGNALS
from mrhubo.retargeter.spoiling import bent_backwards, shaken
from mrhubo.robot import build_body_map


@pytest.fixture(scope="module")
def retargeter(root: Path) -> Retargeter:
    """An untrained network: the steps after it find good answers all the same."""
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=16"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    made.confidence = calibrate(made, poses=300)
    return made


def test_weights_that_made_the_labels_are_found() -> None:
    generator = torch.Generator().manual_seed(0)
    signal_XS = torch.rand(20_000, len(SIGNALS), generator=generator) * 3
    weight_S = torch.tensor([1.0, 2.0, 0.0, 0.5])
    good_X = torch.rand(20_000, generator=generator) < torch.sigmoid(3 - signal_XS @ weight_S)
    found = fit_weights(signal_XS, good_X)
    assert found.certain == pytest.approx(3.0, abs=0.2)
    for name, weight in zip(SIGNALS, weight_S.tolist(), strict=True):
        assert getattr(found, name) == pytest.approx(weight, abs=0.15)


def test_no_weight_is_negative() -> None:
    """A signal that goes with what is good counts for nothing."""
    signal_XS = torch.rand(2_000, len(SIGNALS), generator=torch.Generator().manual_seed(0))
    assert min(getattr(fit_weights(signal_XS, signal_XS[:, 0] > 0.5), name) for name in SIGNALS) >= 0.0


def test_the_same_seed_gives_the_same_weights(retargeter: Retargeter) -> None:
    assert calibrate(retargeter, poses=300) == retargeter.confidence


def test_good_frames_are_told_from_bad_ones(root: Path, retargeter: Retargeter) -> None:
    motion = read_motion(root / "data" / "motions" / "conversation.npz")
    local_TJ33, parts = motion.local_TJ33[100:180], retargeter.body_map.keypoints.parts
    generator = torch.Generator().manual_seed(0)
    given = {
        "clean": local_TJ33,
        "re-shared": reshare(motion, 1).local_TJ33[100:180],
        "backwards": bent_backwards(local_TJ33, torch.linspace(30, 90, len(local_TJ33)), parts),
        "noisy": shaken(local_TJ33, 25.0, generator),
    }
    found = {name: retargeter(pose, polish=10, frame_rate=60.0) for name, pose in given.items()}
    confidence = {name: result.confidence for name, result in found.items()}
    good = found["clean"].direction_error_deg.amax(dim=1) < 5
    assert int(good.sum()) > 40
    assert float(confidence["clean"][good].min()) > 0.85
    torch.testing.assert_close(confidence["re-shared"][good], confidence["clean"][good], atol=0.05, rtol=0)
    assert float(confidence["backwards"].quantile(0.9)) < 0.5
    assert float(confidence["noisy"].quantile(0.9)) < 0.5
    still = retargeter(given["noisy"], polish=10)  # no frame rate: nobody can tell
    assert float(still.confidence.median()) > float(confidence["noisy"].median())


def test_branches_are_judged_apart(root: Path, retargeter: Retargeter) -> None:
    """One elbow bent backwards leaves the other arm's confidence as it is."""
    local_TJ33 = read_motion(root / "data" / "motions" / "conversation.npz").local_TJ33[100:160]
    left = [part for part in retargeter.body_map.keypoints.parts if part.name.startswith("left")]
    broken = bent_backwards(local_TJ33, torch.full((60,), 60.0), left)
    whole, found = (retargeter(pose, polish=10) for pose in (local_TJ33, broken))
    assert found.branch_names == ("left_arm", "right_arm")
    torch.testing.assert_close(found.branch_confidence[:, 1], whole.branch_confidence[:, 1], atol=1e-4, rtol=0)
    assert float(found.branch_confidence[:, 0].max()) < 0.5
    torch.testing.assert_close(found.confidence, found.branch_confidence.amin(dim=1))
