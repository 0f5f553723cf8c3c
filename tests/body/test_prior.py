"""The shipped prior: what it must be able to do, and what its file is refused for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior, Skeleton, mirror_pose
from mrhubo.body.prior_training.measures import measure, reconstruction
from mrhubo.config import SHIPPED_PRIOR
from mrhubo.errors import UserError
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.motion import read_folder


@pytest.fixture(scope="module")
def prior() -> BodyPrior:
    return BodyPrior.open()


def test_decoded_poses_are_rotations(prior: BodyPrior) -> None:
    matrices = prior.decode_matrices(torch.randn(50, prior.latent, generator=torch.Generator().manual_seed(0)))
    torch.testing.assert_close(matrices @ matrices.mT, torch.eye(3).expand(50, 21, 3, 3), atol=1e-5, rtol=0)
    assert bool((torch.linalg.det(matrices) > 0.99).all())


def test_samples_are_plausible_and_random_rotations_are_not(prior: BodyPrior) -> None:
    generator = torch.Generator().manual_seed(0)
    sampled = prior.decode(torch.randn(500, prior.latent, generator=generator))
    noise = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(2 * torch.randn(500, 21, 3, generator=generator)))
    assert float(prior.reconstruction_error(sampled).quantile(0.99)) < float(prior.reconstruction_error(noise).min())


def test_denoising_moves_towards_the_clean_pose(prior: BodyPrior) -> None:
    generator = torch.Generator().manual_seed(0)
    clean = prior.decode(0.7 * torch.randn(200, prior.latent, generator=generator))
    tremble = rotation.axis_angle_to_matrix(0.25 * torch.randn(200, 21, 3, generator=generator))
    noisy = rotation.matrix_to_sixd(rotation.sixd_to_matrix(clean) @ tremble)
    before, after = ((x - clean).square().mean() for x in (noisy, prior.denoise(noisy)))
    assert float(after) < 0.6 * float(before)


def test_mirrored_poses_are_as_plausible(prior: BodyPrior, external_dir: Path) -> None:
    pose = torch.cat(
        [
            rotation.matrix_to_sixd(motion.local_TJ33[::10])
            for motion in read_folder(external_dir / "cmu" / "evaluation")
        ]
    )
    one, other = prior.reconstruction_error(pose).median(), prior.reconstruction_error(mirror_pose(pose)).median()
    assert 0.5 < float(one / other) < 2


def test_it_is_as_good_on_the_evaluation_clips_as_the_card_says(prior: BodyPrior, external_dir: Path) -> None:
    motions = read_folder(external_dir / "cmu" / "evaluation")
    means = {
        m.name: float(reconstruction(prior, Skeleton(), rotation.matrix_to_sixd(m.local_TJ33[::5]))[0].mean())
        for m in motions
    }
    assert sum(means.values()) / len(means) < 4
    assert max(mean for name, mean in means.items() if name != "54_16") < 6
    found = measure(prior, torch.cat([rotation.matrix_to_sixd(motion.local_TJ33[::40]) for motion in motions]))
    assert found["ik_keypoint_mm"] < 5
    assert found["roc_bent"] > 0.97 and found["roc_random"] > 0.999
    assert found["samples_inside"] > 0.99
    assert found["noise15_after_mm"] < 0.7 * found["noise15_before_mm"]
    assert found["noise30_after_deg"] < 12


def test_the_card_says_data_licence_and_split(prior: BodyPrior) -> None:
    card = json.loads(prior.metadata["card"])
    assert (
        "mocap.cs.cmu.edu" in card["data"] and card["licence"] == "Apache-2.0" and "NSF EIA-0196217" in card["credit"]
    )
    evaluation = {"13_28", "54_16", "02_05", "13_08", "13_15", "13_18", "13_21", "15_08", "26_02", "55_16", "56_02"}
    assert not evaluation & set(card["held_out_clips"])


def test_files_that_are_no_prior_are_refused(tmp_path: Path) -> None:
    tensors, metadata = read_tensors(SHIPPED_PRIOR)
    path = tmp_path / "prior.safetensors"
    with pytest.raises(UserError, match="cannot be read"):
        BodyPrior.open(path)
    write_tensors(path, tensors, {**metadata, "schema": "other/1"})
    with pytest.raises(UserError, match="schema is 'other/1'"):
        BodyPrior.open(path)
    write_tensors(path, tensors, {**metadata, "hidden": "64"})
    with pytest.raises(UserError, match="no body prior that this version reads"):
        BodyPrior.open(path)
    write_tensors(path, {k: v for k, v in tensors.items() if "encoder.0" not in k}, metadata)
    with pytest.raises(UserError, match="no body prior that this version reads"):
        BodyPrior.open(path)
    for size in ("hidden", "latent", "encoder_hidden"):  # a network of that size would take terabytes
        for number in ("1000000", "-1", "0", "many", "9" * 5_000):
            write_tensors(path, tensors, {**metadata, size: number})
            with pytest.raises(UserError, match="no body prior that this version reads"):
                BodyPrior.open(path)
    for value in (torch.nan, 1e300):
        write_tensors(path, {**tensors, "decoder.0.bias": tensors["decoder.0.bias"].double() + value}, metadata)
        with pytest.raises(UserError, match="its weights hold NaN or infinite numbers"):
            BodyPrior.open(path)
