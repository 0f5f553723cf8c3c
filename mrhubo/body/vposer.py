"""VPoser v2 (V02_05), for those who have it: the published network, read from its own files, with the open prior's
interface.

Source: Pavlakos et al., "Expressive Body Capture" (CVPR 2019); layer layout as published with version 2.
Its licence forbids commercial use and passing it on: see docs/official-files.md.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import torch
import yaml
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.prior import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.files.checkpoint import read_checkpoint, to_tensor
from mrhubo.files.regular import read_regular

_PREFIX = "vp_model."
_JOINTS = len(POSED_JOINT_NAMES)
_MAX_HIDDEN, _MAX_LATENT = 4_096, 1_024
"""Sizes of the largest network that is made: the weights that are there tell one layer, the others follow."""
_MAX_SETTINGS = 100_000
_BATCH_NORM = ("weight", "bias", "running_mean", "running_var")
# VPoser flattens its 6D row by row, (3, 2) for each joint; ours goes column after column.
_ROWS_TO_COLUMNS = [6 * j + 2 * row + column for j in range(_JOINTS) for column in range(2) for row in range(3)]


class VPoser(BodyPrior):
    """VPoser v2, with the open prior's interface."""

    schema = "mrhubo.vposer/1"

    def __init__(
        self, hidden: int = 512, latent: int = 32, activation: str = "leaky_relu", encoder_hidden: int | None = None
    ) -> None:
        super().__init__(hidden, latent, activation, encoder_hidden)
        self.encoder = nn.Sequential(
            nn.BatchNorm1d(3 * _JOINTS),
            nn.Linear(3 * _JOINTS, hidden),
            nn.LeakyReLU(),
            nn.BatchNorm1d(hidden),
            nn.Dropout(0.1),
            nn.Linear(hidden, hidden),
            nn.Linear(hidden, hidden),
            nn.Linear(hidden, 2 * latent),
        )

    @classmethod
    def open(cls, path: Path | str | None = None) -> VPoser:
        """Reads the folder `V02_05`, or its snapshot (`.ckpt`, `.pt`), or what `save` wrote.

        Nothing in a snapshot is executed.

        Raises:
            UserError: no path is given, a file is missing or damaged, of another version, or has other layers.
        """
        if path is None:
            raise UserError("body.prior_path: is missing; name VPoser's folder V02_05 (docs/official-files.md)")
        path = Path(path)
        if path.suffix == ".safetensors":
            return super().open(path)
        snapshot, settings = _find(path)
        checkpoint, storages = read_checkpoint(snapshot)
        try:
            prior = _convert(checkpoint, storages, settings)
        except UserError as error:
            raise UserError(f"{snapshot}: {error}") from error
        prior.metadata = {"card": '{"name": "VPoser v2", "licence": "non-commercial, may not be passed on"}'}
        return prior.requires_grad_(False).eval()

    def posterior(self, pose_BJ6: Tensor) -> tuple[Tensor, Tensor]:
        """Mean (B, Z) and logarithm of the standard deviation (B, Z) of the latent, for poses (B, 21, 6)."""
        axis_angle = rotation.matrix_to_axis_angle(rotation.sixd_to_matrix(pose_BJ6)).flatten(1)
        mean_BZ, spread_BZ = self.encoder(axis_angle).chunk(2, dim=-1)
        return mean_BZ, nn.functional.softplus(spread_BZ).clamp_min(1e-12).log()


def _find(path: Path) -> tuple[Path, dict[str, Any]]:
    """The snapshot, and the settings beside it (none if there is no YAML)."""
    if not os.path.lexists(path):
        raise UserError(f"{path}: there is no such file or folder; VPoser's is called V02_05")
    if os.path.isdir(path):
        snapshots = sorted(p for p in (path / "snapshots").glob("*") if p.suffix in (".ckpt", ".pt"))
        if not snapshots:
            raise UserError(f"{path}: holds no snapshot; expected snapshots/*.ckpt or *.pt, as in VPoser's V02_05")
        folder, snapshot = path, snapshots[-1]
    else:
        folder, snapshot = path.parent.parent, path
    settings = sorted(folder.glob("*.yaml")) if snapshot.parent.name == "snapshots" else []
    if not settings:
        return snapshot, {}
    content = read_regular(settings[0], _MAX_SETTINGS)
    try:
        return snapshot, dict(yaml.safe_load(content)["model_params"])
    except Exception as error:  # whatever YAML makes of a stranger's bytes
        raise UserError(
            f"{settings[0]}: is no settings file of VPoser v2 (model_params with num_neurons and latentD)"
        ) from error


def _convert(checkpoint: dict[str, Any], storages: dict[str, bytes], settings: dict[str, Any]) -> VPoser:
    """The network with a snapshot's weights."""
    state = checkpoint.get("state_dict", checkpoint)
    if not isinstance(state, dict):
        raise UserError(f"expected a dictionary 'state_dict', found {type(state).__name__}")
    names = {name.removeprefix(_PREFIX): value for name, value in state.items() if isinstance(name, str)}
    if any(name.startswith("bodyprior_") for name in names):
        raise UserError("is VPoser version 1; version 2 (V02_05) is needed")

    def tensor(name: str) -> Tensor:
        if name not in names:
            raise UserError(f"has no '{_PREFIX}{name}', so it is no snapshot of VPoser v2")
        try:
            found = to_tensor(names[name], storages)
        except UserError as error:
            raise UserError(f"'{_PREFIX}{name}': {error}") from error
        if not bool(torch.isfinite(found).all()):
            raise UserError(f"'{_PREFIX}{name}' holds NaN or infinite numbers")
        return found

    first = tensor("decoder_net.0.weight")
    if first.ndim != 2:
        raise UserError(f"'{_PREFIX}decoder_net.0.weight' has shape {tuple(first.shape)}; expected (512, 32)")
    hidden, latent = first.shape
    for key, found, most in (("num_neurons", hidden, _MAX_HIDDEN), ("latentD", latent, _MAX_LATENT)):
        said = settings.get(key, found)
        if said != found:
            said = said if isinstance(said, int | float | str) else type(said).__name__
            raise UserError(f"does not fit its settings: {key} is {said!s:.40} there, {found} in the weights")
        if found > most:
            raise UserError(
                f"has {key} {found}; VPoser v2 has 512 neurons and 32 latent numbers, at most {most} are read"
            )
    prior = VPoser(hidden, latent)
    weights: dict[str, Tensor] = {}
    for ours, theirs, parts in (
        ("encoder.0", "encoder_net.1", _BATCH_NORM),
        ("encoder.1", "encoder_net.2", ("weight", "bias")),
        ("encoder.3", "encoder_net.4", _BATCH_NORM),
        ("encoder.5", "encoder_net.6", ("weight", "bias")),
        ("encoder.6", "encoder_net.7", ("weight", "bias")),
        ("decoder.0", "decoder_net.0", ("weight", "bias")),
        ("decoder.2", "decoder_net.3", ("weight", "bias")),
        ("decoder.4", "decoder_net.5", ("weight", "bias")),
    ):
        weights |= {f"{ours}.{part}": tensor(f"{theirs}.{part}") for part in parts}
    for part in ("weight", "bias"):
        weights[f"encoder.7.{part}"] = torch.cat([tensor(f"encoder_net.8.{head}.{part}") for head in ("mu", "logvar")])
    expected = prior.state_dict()
    for name, value in weights.items():
        if value.shape != expected[name].shape:
            raise UserError(
                f"the layer that becomes '{name}' has shape {tuple(value.shape)}; "
                f"VPoser v2 with {hidden} neurons and {latent} latent numbers has {tuple(expected[name].shape)}"
            )
    weights["decoder.4.weight"] = weights["decoder.4.weight"][_ROWS_TO_COLUMNS]
    weights["decoder.4.bias"] = weights["decoder.4.bias"][_ROWS_TO_COLUMNS] - prior.decoder.identity_F
    prior.load_state_dict({**expected, **weights})
    return prior
