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
from mrhubo.files.atomic import atomic_path
from mrhubo.files.cache import user_cache
from mrhubo.files.regular import open_regular
from mrhubo.retargeter.calibration import calibrate
from mrhubo.retargeter.confidence import ConfidenceModel
from mrhubo.retargeter.package import Retargeter

_LONGEST = 10_000
"""Bytes of a file that is one of ours."""


def calibrated(retargeter: Retargeter) -> ConfidenceModel:
    """As `calibrate`; of a robot that it was asked for before, what it found then."""
    try:
        folder = user_cache()
    except UserError:  # a user without a home
        return calibrate(retargeter)
    path = folder / f"confidence-{_checksum(retargeter)}.json"
    with contextlib.suppress(OSError, UserError, UnicodeDecodeError), open_regular(path) as file:
        return ConfidenceModel.from_json(file.read(_LONGEST).decode())
    found = calibrate(retargeter)
    with contextlib.suppress(OSError, UserError), atomic_path(path) as half:
        half.write_text(found.to_json(), encoding="utf-8")
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
