"""The confidence of a retargeter that nothing was trained for: found once for a robot, and kept in the user's cache.

To find it takes longer than all else that such a retargeter needs. It depends on the robot, on networks that are the
same for every robot, and on this program, so it is kept under a checksum of these.
"""

from __future__ import annotations

import contextlib
import itertools
from functools import cache
from pathlib import Path

import torch
import xxhash
from torch import Tensor

import mrhubo
from mrhubo.errors import UserError
from mrhubo.files.cache import keep_text, kept_text
from mrhubo.retargeter.calibration import calibrate
from mrhubo.retargeter.confidence import ConfidenceModel
from mrhubo.retargeter.package import Retargeter

_LONGEST = 10_000
"""Bytes of a file that is one of ours."""


def calibrated(retargeter: Retargeter) -> ConfidenceModel:
    """As `calibrate`; of a robot that it was asked for before, what it found then."""
    name = f"confidence-{_checksum(retargeter)}.json"
    if (told := kept_text(name, _LONGEST)) is not None:
        with contextlib.suppress(UserError):
            return ConfidenceModel.from_json(told)
    found = calibrate(retargeter)
    keep_text(name, found.to_json())
    return found


def _checksum(retargeter: Retargeter) -> str:
    """Of all that a confidence depends on."""
    body_map, digest = retargeter.body_map, xxhash.xxh3_128(_sources())
    robot, network = body_map.robot, retargeter.network
    told = (torch.__version__, type(network).__name__, robot.description.kinematics, robot.links, robot.joint_names)
    digest.update(repr((*told, body_map.direction_names, body_map.keypoints.root_follows)).encode())
    for module in (network, body_map, retargeter.prior):
        for name, tensor in itertools.chain(module.named_parameters(), module.named_buffers()):
            digest.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode() + _bytes(tensor))
    return digest.hexdigest()


def _bytes(tensor: Tensor) -> bytes:
    return tensor.detach().cpu().contiguous().numpy().tobytes()


@cache
def _sources() -> bytes:
    """A checksum of the program."""
    digest, home = xxhash.xxh3_128(), Path(mrhubo.__file__).parent
    for path in sorted(home.rglob("*.py")):
        digest.update(f"{path.relative_to(home)} ".encode() + path.read_bytes())
    return digest.digest()
