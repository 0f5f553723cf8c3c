"""What an exported file tells of itself, as names and texts."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

import mrhubo
from mrhubo.errors import UserError
from mrhubo.fast import Description, FastRetargeter

if TYPE_CHECKING:
    from torch import Tensor

    from mrhubo.retargeter import Retargeter

_SAME, _WORST, _MOST = 1e-5, 1e-4, 0.999
"""How near to mrhubo's answers those of a file must be [rad]: nearly all numbers, all of them, and what nearly all is.
Networks are float32, and where one is steep, an order of summing shows in the fifth digit."""
_CHECKED = 256
_EQUAL, _RARE = 1e-4, 0.99
"""The same of the network for every robot: nearly all numbers, and what that is. Where two answers cost the same, such
as the twists of a straight arm, rounding chooses between them."""

POSES = (
    "local_rotations (batch, 21, 3, 3): rotation matrices of SMPL's body joints 1..21, each relative to its parent;"
    " x to the body's left, y up, z forward; T-pose at rest"
)
DIRECTIONS = (
    "directions (batch, D, 3): unit vectors, in the order of direction_names, in human axes (x left, y up, z forward)"
    " of the part that each is seen from; an elbow axis counts as much as it is long, 0 to 1"
)


def describe_networks(retargeter: Retargeter, inputs: str = "poses") -> Description:
    """The arrays of a retargeter with networks, for a file that is given `inputs`.

    Raises:
        UserError: it has none, or a file that is given poses would have to know how the robot's base is turned.
    """
    description = retargeter.describe()
    if description.root is not None and inputs == "poses" and description.settings.features == "directions":
        raise UserError(
            "robot.root_follows: legs are seen from a base that is not turned as the person's pelvis, and "
            "exported files do not work that out; export an ONNX file with --input directions, or use mrhubo.load_fast"
        )
    return description


def meaning(description: Description, inputs: str) -> dict[str, str]:
    """Names, limits, units, rate and the definition of input and output."""
    settings, cost = description.settings, description.cost
    return {
        "robot": settings.robot,
        "joint_names": json.dumps(settings.joint_names),
        "lower_rad": json.dumps(cost.lower_N.tolist()),
        "upper_rad": json.dumps(cost.upper_N.tolist()),
        "velocity_rad_s": json.dumps(cost.velocity_N.tolist()),
        "direction_names": json.dumps(settings.direction_names),
        "input": POSES if inputs == "poses" else DIRECTIONS,
        "output": "joint_angles (batch, N): rad, inside the limits, in the order of joint_names",
        "rate": "any: each frame is answered by itself",
        "steps": "none: the networks alone; mrhubo.load_fast makes steps of optimisation after them",
        "network": "its own" if description.universal is None else "the one for every robot, in five iterations",
        "package": settings.facts["checksum"],
        "mrhubo": mrhubo.__version__,
    }


def compared(answer: Callable[[Tensor], np.ndarray], retargeter: Retargeter, description: Description) -> float:
    """How far a file's answers are from mrhubo's at most [rad], on poses of the body prior: from PyTorch's, or, of the
    network for every robot, from those of its iterations in float64, as PyTorch's float32 ends up to 1e-3 away.

    Args:
        answer: gives joint angles (B, N) [rad] of poses (B, 21, 3, 3) by the file.
        retargeter: whose file it is.
        description: the retargeter's arrays.

    Raises:
        UserError: more than they may be.
    """
    import torch

    latent_BZ = torch.randn(_CHECKED, retargeter.prior.latent, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        local_BJ33 = retargeter.prior.decode_matrices(latent_BZ.to(retargeter.device)).cpu()
    if description.universal is None:
        wanted_BN = retargeter.predict(local_BJ33).cpu().numpy()
    else:
        wanted_BN = FastRetargeter(description, "numpy").predict(local_BJ33.numpy())
    off_BN = np.abs(answer(local_BJ33) - wanted_BN)
    same, at_most, most = (_SAME, _WORST, _MOST) if description.universal is None else (_EQUAL, np.inf, _RARE)
    usual, worst = float(np.quantile(off_BN, most)), float(off_BN.max())
    if not (usual <= same and worst <= at_most):
        let = f"{same:g} for nearly all" + (f" and {at_most:g} for the rest" if at_most < np.inf else "")
        raise UserError(
            f"the exported file's answers are up to {worst:.1e} rad from mrhubo's, nearly all within {usual:.1e};"
            f" at most {let} is let through"
        )
    return worst
