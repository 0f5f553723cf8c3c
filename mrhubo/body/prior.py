"""The human body prior: a variational autoencoder over the local rotations of SMPL's 21 body joints.

It says what a human pose is: decoding any latent near the origin gives a plausible pose, and encoding, then decoding
the mean, pulls an implausible pose back to a plausible one; how far it was pulled is its reconstruction error phi.
After Pavlakos et al., "Expressive Body Capture" (CVPR 2019), VPoser; ours is trained on the CMU database, see
`mrhubo.body.prior_training`.

Legend: B batch, J = 21 joints, Z = 32 latent numbers. Poses are 6D (two columns), so H is (B, 21, 6).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.decoder import Decoder, mlp_layers
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import SHIPPED_PRIOR
from mrhubo.errors import UserError, shortened
from mrhubo.files.storage import checksum_tensors, read_tensors, write_tensors

_JOINTS = len(POSED_JOINT_NAMES)


class BodyPrior(nn.Module):
    """The VAE. Every layer is smooth (SiLU), which second-order latent inverse kinematics needs."""

    schema = "mrhubo.body_prior/1"
    """Of the files that `save` writes and `open` reads."""
    metadata: dict[str, str]

    def __init__(
        self, hidden: int = 512, latent: int = 32, activation: str = "silu", encoder_hidden: int | None = None
    ) -> None:
        super().__init__()
        self.hidden, self.latent, self.activation = hidden, latent, activation
        self.encoder_hidden = encoder_hidden or hidden
        self.encoder = nn.Sequential(*mlp_layers(_JOINTS * 6, self.encoder_hidden, 2 * latent, activation))
        self.decoder = Decoder(latent, hidden, activation)
        self.metadata = {}

    @classmethod
    def open(cls, path: Path | str | None = None) -> Self:
        """The shipped prior, or the one in `path`, in evaluation mode and without gradients of its weights.

        Raises:
            UserError: the file is missing, damaged, or no body prior of mrhubo.
        """
        path = Path(path) if path is not None else SHIPPED_PRIOR
        tensors, metadata = read_tensors(path)
        if metadata.get("schema") != cls.schema:
            raise UserError(
                f"{path}: schema is '{metadata.get('schema')}', expected '{cls.schema}' (a body prior of mrhubo)"
            )
        try:
            sizes = int(metadata["hidden"]), int(metadata["latent"])
            encoder_hidden = int(metadata.get("encoder_hidden", sizes[0]))
            _check_sizes(tensors, *sizes, encoder_hidden)
            prior = cls(*sizes, metadata.get("activation", "silu"), encoder_hidden)
            prior.load_state_dict(tensors)
        except (KeyError, ValueError, RuntimeError) as error:
            said = shortened(" ".join(str(error).split()), 300)
            raise UserError(f"{path}: is no body prior that this version reads: {said}") from error
        if not all(bool(tensor.isfinite().all()) for tensor in prior.state_dict().values()):
            raise UserError(f"{path}: its weights hold NaN or infinite numbers")
        prior.metadata = metadata
        return prior.requires_grad_(False).eval()

    def save(self, path: Path, card: dict[str, Any] | None = None) -> None:
        """Writes weights and model card (a JSON object in the header; by default the one it was read with)."""
        metadata = {
            "schema": self.schema,
            "hidden": str(self.hidden),
            "latent": str(self.latent),
            "activation": self.activation,
            "encoder_hidden": str(self.encoder_hidden),
            "card": self.metadata.get("card", "{}") if card is None else json.dumps(card),
        }
        write_tensors(path, self.state_dict(), metadata)

    @property
    def checksum(self) -> str:
        """xxh3 of kind and weights, 16 hex digits: the same prior, whatever file it came from."""
        return checksum_tensors(self.state_dict(), {"schema": self.schema, "activation": self.activation})

    @property
    def device(self) -> torch.device:
        """Where its weights are."""
        return self.decoder.identity_F.device

    def posterior(self, pose_BJ6: Tensor) -> tuple[Tensor, Tensor]:
        """Mean (B, Z) and logarithm of the standard deviation (B, Z) of the latent, for poses (B, 21, 6)."""
        mean_BZ, log_std_BZ = self.encoder(pose_BJ6.flatten(1) - self.decoder.identity_F).chunk(2, dim=-1)
        return mean_BZ, log_std_BZ.clamp(-8.0, 4.0)

    def encode(self, pose_BJ6: Tensor) -> Tensor:
        """Mean latent (B, Z) of poses (B, 21, 6)."""
        return self.posterior(pose_BJ6)[0]

    def decode_matrices(self, z_BZ: Tensor) -> Tensor:
        """Local rotation matrices (B, 21, 3, 3) of latents (B, Z)."""
        return rotation.sixd_to_matrix(self.decoder(z_BZ))

    def decode(self, z_BZ: Tensor) -> Tensor:
        """Poses (B, 21, 6), proper rotations, of latents (B, Z)."""
        return rotation.matrix_to_sixd(self.decode_matrices(z_BZ))

    def denoise(self, pose_BJ6: Tensor) -> Tensor:
        """The nearest plausible poses H~ (B, 21, 6): decode the mean latent."""
        return self.decode(self.encode(pose_BJ6))

    def reconstruction_error(self, pose_BJ6: Tensor) -> Tensor:
        """phi (B,): mean squared error of the 126 6D numbers between H and H~."""
        return (self.denoise(pose_BJ6) - pose_BJ6).square().mean(dim=(1, 2))


def _check_sizes(tensors: Mapping[str, Tensor], hidden: int, latent: int, encoder_hidden: int) -> None:
    """Refuses a header that claims a larger network than there are weights of, before that is made."""
    weights = sum(tensor.numel() for tensor in tensors.values())
    widest = max(hidden, encoder_hidden)
    if min(hidden, latent, encoder_hidden) < 1 or widest * max(widest, latent) > weights:
        raise ValueError(f"{weights:,} weights are not those of {hidden} hidden units and {latent} latent numbers")
