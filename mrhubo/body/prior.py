"""The human body prior: a variational autoencoder over the local rotations of SMPL's 21 body joints.

It says what a human pose is: decoding any latent near the origin gives a plausible pose, and encoding, then decoding
the
mean, pulls an implausible pose back to a plausible one; how far it had to be pulled is the reconstruction error phi.
After Pavlakos et al., "Expressive Body Capture" (CVPR 2019), VPoser; ours is trained on the CMU database, see
`mrhubo.body.training`.

Legend: B batch, J = 21 joints, Z = 32 latent numbers. Poses are 6D (two columns), so H is (B, 21, 6).
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.storage import read_tensors, write_tensors

SHIPPED_WEIGHTS = Path(__file__).parent / "weights" / "open_prior.safetensors"
_SCHEMA = "mrhubo.body_prior/1"
_JOINTS = len(POSED_JOINT_NAMES)


class BodyPrior(nn.Module):
    """The VAE. Every layer is smooth (SiLU), which second-order latent inverse kinematics needs."""

    metadata: dict[str, str]
    identity_F: Tensor

    def __init__(self, hidden: int = 512, latent: int = 32) -> None:
        super().__init__()
        self.hidden, self.latent = hidden, latent
        self.encoder = nn.Sequential(
            nn.Linear(_JOINTS * 6, hidden),
            nn.SiLU(),
            nn.Linear(hidden, hidden),
            nn.SiLU(),
            nn.Linear(hidden, 2 * latent),
        )
        self.decoder = nn.Sequential(
            nn.Linear(latent, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU(), nn.Linear(hidden, _JOINTS * 6)
        )
        identity = torch.tensor([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).repeat(_JOINTS)
        self.register_buffer("identity_F", identity, persistent=False)
        self.metadata = {}

    @classmethod
    def open(cls, path: Path | str | None = None) -> BodyPrior:
        """The shipped prior, or the one in `path`, in evaluation mode and without gradients of its weights.

        Raises:
            UserError: the file is missing, damaged, or no body prior of mrhubo.
        """
        path = Path(path) if path is not None else SHIPPED_WEIGHTS
        tensors, metadata = read_tensors(path)
        if metadata.get("schema") != _SCHEMA:
            raise UserError(
                f"{path}: schema is '{metadata.get('schema')}', expected '{_SCHEMA}' (a body prior of mrhubo)"
            )
        try:
            prior = cls(hidden=int(metadata["hidden"]), latent=int(metadata["latent"]))
            prior.load_state_dict(tensors)
        except (KeyError, ValueError, RuntimeError) as error:
            raise UserError(f"{path}: is no body prior that this version reads: {error}") from error
        prior.metadata = metadata
        return prior.requires_grad_(False).eval()

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Writes weights and model card (a JSON object in the header) atomically."""
        metadata = {"schema": _SCHEMA, "hidden": str(self.hidden), "latent": str(self.latent), "card": json.dumps(card)}
        write_tensors(path, self.state_dict(), metadata)

    def posterior(self, pose_BJ6: Tensor) -> tuple[Tensor, Tensor]:
        """Mean (B, Z) and logarithm of the standard deviation (B, Z) of the latent, for poses (B, 21, 6)."""
        mean_BZ, log_std_BZ = self.encoder(pose_BJ6.flatten(1) - self.identity_F).chunk(2, dim=-1)
        return mean_BZ, log_std_BZ.clamp(-8.0, 4.0)

    def encode(self, pose_BJ6: Tensor) -> Tensor:
        """Mean latent (B, Z) of poses (B, 21, 6)."""
        return self.posterior(pose_BJ6)[0]

    def decode_matrices(self, z_BZ: Tensor) -> Tensor:
        """Local rotation matrices (B, 21, 3, 3) of latents (B, Z)."""
        return rotation.sixd_to_matrix((self.decoder(z_BZ) + self.identity_F).unflatten(-1, (_JOINTS, 6)))

    def decode(self, z_BZ: Tensor) -> Tensor:
        """Poses (B, 21, 6), proper rotations, of latents (B, Z)."""
        return rotation.matrix_to_sixd(self.decode_matrices(z_BZ))

    def denoise(self, pose_BJ6: Tensor) -> Tensor:
        """The nearest plausible poses H~ (B, 21, 6): decode the mean latent."""
        return self.decode(self.encode(pose_BJ6))

    def reconstruction_error(self, pose_BJ6: Tensor) -> Tensor:
        """phi (B,): mean squared error of the 126 6D numbers between H and H~."""
        return (self.denoise(pose_BJ6) - pose_BJ6).square().mean(dim=(1, 2))


@lru_cache(maxsize=4)
def open_prior(path: Path | None = None) -> BodyPrior:
    """`BodyPrior.open`, read once per process."""
    return BodyPrior.open(path)
