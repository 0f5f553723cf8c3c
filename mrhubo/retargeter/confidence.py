"""How far to trust a frame: is the human pose a plausible one, and do the robot's limbs point where the human's do.

Legend: T frames, D directions.
"""

from __future__ import annotations

import torch
from torch import Tensor

_AGREEMENT_DEG = 20.0
"""Mean angle between the robot's and the human's directions at which the agreement has fallen to 1/e."""


def confidence(phi_T: Tensor, phi_threshold: float, direction_error_deg_TD: Tensor) -> Tensor:
    """Confidence (T,), 0..1: plausibility of the human pose times agreement of robot and human.

    Args:
        phi_T: reconstruction error of the human poses under the body prior.
        phi_threshold: up to which a pose counts as fully plausible: the threshold of the filter that chose the
            training's pairs.
        direction_error_deg_TD: angle [deg] between the robot's and the human's limb, hand and head directions.
    """
    plausible_T = (phi_threshold / phi_T.clamp_min(1e-12)).clamp(0.0, 1.0)
    agreement_T = torch.exp(-(direction_error_deg_TD.mean(dim=1) / _AGREEMENT_DEG).square())
    return torch.nan_to_num(plausible_T * agreement_T, nan=0.0)  # what cannot be told is not trusted
