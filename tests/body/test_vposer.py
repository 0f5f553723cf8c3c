"""VPoser v2's files, in exactly their layout with random numbers, against the published network written out plainly."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path
from typing import Any

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torch import Tensor, nn
from torch.nn import functional as F

from mrhubo import rotation
from mrhubo.body import BodyPrior, Skeleton, VPoser, open_prior
from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import solve_quasi_newton
from mrhubo.config import SHIPPED_PRIOR, BodyConfig
from mrhubo.errors import UserError


class Heads(nn.Module):
    def __init__(self, hidden: int, latent: int) -> None:
        super().__init__()
        self.mu, self.logvar = nn.Linear(hidden, latent), nn.Linear(hidden, latent)


class Published(nn.Module):
    """Layers under their published names; what they compute is written out below, not taken from our code."""

    def __init__(self, hidden: int, latent: int) -> None:
        super().__init__()
        self.encoder_net = nn.Sequential(
            nn.Flatten(), nn.BatchNorm1d(63), nn.Linear(63, hidden), nn.LeakyReLU(), nn.BatchNorm1d(hidden),
            nn.Dropout(0.1), nn.Linear(hidden, hidden), nn.Linear(hidden, hidden), Heads(hidden, latent),
        )  # fmt: skip
        self.decoder_net = nn.Sequential(
            nn.Linear(latent, hidden), nn.LeakyReLU(), nn.Dropout(0.1), nn.Linear(hidden, hidden), nn.LeakyReLU(),
            nn.Linear(hidden, 126),
        )  # fmt: skip

    def encode(self, axis_angle: Tensor) -> tuple[Tensor, Tensor]:
        x = axis_angle
        for layer in list(self.encoder_net)[:-1]:
            x = layer(x)
        heads = self.encoder_net[-1]
        assert isinstance(heads, Heads)
        return heads.mu(x), F.softplus(heads.logvar(x))

    def decode(self, z: Tensor) -> Tensor:
        found = []
        for row in self.decoder_net(z).reshape(-1, 3, 2):
            x = row[:, 0] / row[:, 0].norm()
            y = row[:, 1] - (x @ row[:, 1]) * x
            y = y / y.norm()
            found.append(torch.stack((x, y, torch.linalg.cross(x, y)), dim=1))
        return torch.stack(found).reshape(len(z), 21, 3, 3)


class ModelCheckpoint:
    """Stands in Lightning's checkpoints as a key: a class that the reader must not import."""


ModelCheckpoint.__module__ = "pytorch_lightning.callbacks.model_checkpoint"


def published(hidden: int = 512, latent: int = 32) -> Published:
    torch.manual_seed(0)
    network = Published(hidden, latent).eval()
    for layer in network.modules():
        if isinstance(layer, nn.BatchNorm1d):
            nn.init.normal_(layer.running_mean)
            nn.init.uniform_(layer.running_var, 0.5, 2.0)
            nn.init.normal_(layer.weight, 1.0, 0.2)
            nn.init.normal_(layer.bias, 0.0, 0.2)
    return network.requires_grad_(False)


def write_snapshot(
    folder: Path, network: nn.Module, change: dict[str, Any] | None = None, ending: str = "ckpt"
) -> Path:
    """The folder V02_05, as it is unpacked."""
    (folder / "snapshots").mkdir(parents=True)
    state = {f"vp_model.{k}": v for k, v in network.state_dict().items()}
    state |= {"bm_train.v_template": torch.zeros(10, 3)}
    state = {k: v for k, v in {**state, **(change or {})}.items() if v is not None}
    path = folder / "snapshots" / f"V02_05_epoch=13_val_loss=0.03.{ending}"
    torch.save({"epoch": 13, "state_dict": state, "callbacks": {"x": 1}, "pytorch-lightning_version": "1.1.8"}, path)
    (folder / "V02_05.yaml").write_text(
        "general:\n  expr_id: V02_05\nmodel_params:\n  num_neurons: 512\n  latentD: 32\ntrain_parms:\n  batch_size: 128\n"
    )
    return path


def rewrite_pickle(path: Path, change: Any) -> None:
    """Changes the bytes of the pickle inside a checkpoint."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, change(content) if name.endswith("data.pkl") else content)


@pytest.mark.parametrize("ending", ["ckpt", "pt"])
def test_encoding_and_decoding_equal_the_published_network(tmp_path: Path, ending: str) -> None:
    network = published()
    snapshot = write_snapshot(tmp_path / "V02_05", network, ending=ending)
    generator = torch.Generator().manual_seed(1)
    axis_angle = 0.5 * torch.randn(40, 63, generator=generator)
    z = torch.randn(40, 32, generator=generator)
    pose = rotation.matrix_to_sixd(rotation.axis_angle_to_matrix(axis_angle.unflatten(-1, (21, 3))))
    for path in (tmp_path / "V02_05", snapshot):
        prior = VPoser.open(path)
        mean, log_std = prior.posterior(pose)
        expected_mean, expected_std = network.encode(axis_angle)
        torch.testing.assert_close(mean, expected_mean, atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(log_std.exp(), expected_std, atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(prior.decode_matrices(z), network.decode(z), atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(
            rotation.sixd_to_matrix(prior.denoise(pose)), network.decode(expected_mean), atol=1e-5, rtol=1e-5
        )


def test_the_config_chooses_it_and_a_saved_one_comes_back(tmp_path: Path) -> None:
    write_snapshot(tmp_path / "V02_05", published())
    prior = open_prior(BodyConfig(prior="vposer", prior_path=tmp_path / "V02_05"))
    prior.save(tmp_path / "prior.safetensors")
    again = open_prior(BodyConfig(prior="vposer", prior_path=tmp_path / "prior.safetensors"))
    assert isinstance(again, VPoser) and again.checksum == prior.checksum
    z = torch.randn(5, 32)
    torch.testing.assert_close(again.decode(z), prior.decode(z))
    with pytest.raises(UserError, match="schema is 'mrhubo.vposer/1'"):
        BodyPrior.open(tmp_path / "prior.safetensors")
    with pytest.raises(UserError, match="schema is 'mrhubo.body_prior/1'"):
        open_prior(BodyConfig(prior="vposer", prior_path=SHIPPED_PRIOR))


def test_latent_inverse_kinematics_works_with_its_activation(tmp_path: Path) -> None:
    write_snapshot(tmp_path / "V02_05", published())
    prior, skeleton = VPoser.open(tmp_path / "V02_05"), Skeleton()
    problem = LatentProblem(prior.decoder, skeleton, [18, 19, 20, 21, 15])
    z = torch.randn(4, 32, generator=torch.Generator().manual_seed(0))
    points, jacobian = problem.linearise(z)
    for i in range(len(z)):
        expected = torch.autograd.functional.jacobian(lambda v: problem.keypoints_of(v[None])[0].flatten(), z[i])
        torch.testing.assert_close(jacobian[i], expected, atol=1e-5, rtol=1e-3)
    start = torch.zeros_like(z)
    found = solve_quasi_newton(problem, start, points, 60)
    assert bool((problem.cost(found, points) < problem.cost(start, points)).all())


def test_a_checkpoint_with_foreign_classes_is_read_without_importing_them(tmp_path: Path) -> None:
    path = write_snapshot(tmp_path / "V02_05", published())
    # As PyTorch Lightning 1.1 wrote it: a class as key of "callbacks".
    rewrite_pickle(
        path,
        lambda content: content.replace(
            pickle.dumps("x", 2)[2:-1].rstrip(b"q\x00"),
            b"cpytorch_lightning.callbacks.model_checkpoint\nModelCheckpoint\n",
        ),
    )
    with zipfile.ZipFile(path) as archive:
        inside = next(archive.read(n) for n in archive.namelist() if n.endswith("data.pkl"))
    assert b"ModelCheckpoint" in inside
    with pytest.raises(Exception, match="weights_only|Unsupported|ModelCheckpoint"):
        torch.load(path, weights_only=True)
    z = torch.randn(3, 32)
    torch.testing.assert_close(VPoser.open(path).decode_matrices(z), published().decode(z), atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vp_model.decoder_net.3.weight": None}, "has no 'vp_model.decoder_net.3.weight'"),
        ({"vp_model.encoder_net.8.mu.bias": None}, "has no 'vp_model.encoder_net.8.mu.bias'"),
        ({"vp_model.decoder_net.3.weight": torch.zeros(512, 511)}, "has shape .512, 511."),
        ({"vp_model.decoder_net.0.weight": torch.zeros(512)}, "has shape .512,."),
        ({"vp_model.decoder_net.5.bias": torch.full((126,), float("nan"))}, "holds NaN"),
        ({"vp_model.decoder_net.5.bias": "zeros"}, "expected a tensor, found str"),
        ({"vp_model.bodyprior_enc_fc1.weight": torch.zeros(512, 63)}, "is VPoser version 1"),
    ],
)
def test_snapshots_of_other_layers_are_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = write_snapshot(tmp_path / "V02_05", published(), change)
    with pytest.raises(UserError, match=message) as caught:
        VPoser.open(tmp_path / "V02_05")
    assert str(path) in str(caught.value)


def test_settings_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    write_snapshot(tmp_path / "a", published(hidden=256))
    with pytest.raises(UserError, match="num_neurons is 512 there, 256 in the weights"):
        VPoser.open(tmp_path / "a")
    (tmp_path / "a" / "V02_05.yaml").write_text("model_params: [")
    with pytest.raises(UserError, match="V02_05.yaml: is no settings file"):
        VPoser.open(tmp_path / "a")
    (tmp_path / "a" / "V02_05.yaml").unlink()
    assert VPoser.open(tmp_path / "a").hidden == 256


def test_missing_and_truncated_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="body.prior_path: is missing"):
        open_prior(BodyConfig(prior="vposer"))
    with pytest.raises(UserError, match="no such file or folder"):
        VPoser.open(tmp_path / "V02_05")
    (tmp_path / "V02_05").mkdir()
    with pytest.raises(UserError, match="holds no snapshot"):
        VPoser.open(tmp_path / "V02_05")
    (tmp_path / "V02_05").rmdir()
    path = write_snapshot(tmp_path / "V02_05", published())
    whole = path.read_bytes()
    for share in (0.0, 0.3, 0.9, 0.9999):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(UserError, match="truncated"):
            VPoser.open(path)
    path.write_bytes(pickle.dumps({"state_dict": {}}))
    with pytest.raises(UserError, match="no PyTorch checkpoint"):
        VPoser.open(path)


@given(data=st.data())
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_altered_snapshots_never_do_more_than_name_an_error(tmp_path: Path, data: st.DataObject) -> None:
    folder = tmp_path / "V02_05"
    if not folder.exists():
        write_snapshot(folder, published(8, 4))
        (folder / "V02_05.yaml").unlink()
    path = next((folder / "snapshots").iterdir())
    whole = path.read_bytes()

    def alter(content: bytes) -> bytes:
        altered = bytearray(content)
        for _ in range(data.draw(st.integers(1, 4))):
            altered[data.draw(st.integers(0, len(altered) - 1))] = data.draw(st.integers(0, 255))
        return bytes(altered)

    try:
        rewrite_pickle(path, alter)  # hypothesis may end an example while it draws
        prior = VPoser.open(path)
    except UserError as error:
        assert str(path) in str(error)
    else:
        assert all(bool(value.isfinite().all()) for value in prior.state_dict().values())
    finally:
        path.write_bytes(whole)
