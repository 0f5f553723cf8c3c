"""Whether the files of a package belong together: nothing was edited, exchanged or lost on the way.

The header of the weights holds a checksum of every other file; its own is that of `write_tensors`. What it says of
joints, limits and inputs is compared with what URDF and settings say, too, which is all that there is for packages made
before the checksums came. A checksum notices accidents. Whoever means to deceive can make it anew: it is no signature.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.errors import UserError, shortened
from mrhubo.files.atomic import checksum_file
from mrhubo.files.regular import check_regular
from mrhubo.retargeter.confidence import STANDARD, ConfidenceModel
from mrhubo.robot import Robot

_FILES = "files_xxh3"
_LARGEST_FILE = 2**30
_LARGEST_THRESHOLD = 1e3
"""phi is at most 4, the mean square of differences of unit vectors' components."""
_SAME_RAD = 1e-6
"""How far two limits may differ that are the same: they have been rounded to float32."""
_RENEW = "take the whole package anew from where it was made (its run keeps it as the artifact 'package'), or fit again"


def file_checksums(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """What the header of a package says of its other files."""
    return {_FILES: json.dumps({name: checksum_file(folder / name) for name in names})}


def check_files(folder: Path, names: Iterable[str], metadata: Mapping[str, str]) -> None:
    """Refuses a package whose files are not those that it was made with.

    Raises:
        UserError: a file is missing, no regular file, or another one; says which.
    """
    for name in names:
        check_regular(folder / name, _LARGEST_FILE)
    known = _json(folder, metadata, _FILES) if _FILES in metadata else {}
    if _FILES not in metadata and "urdf_xxh3" in metadata:  # an older package that a fit made
        known = {"robot.urdf": metadata["urdf_xxh3"]}
    if not isinstance(known, dict) or (_FILES in metadata and not set(names) <= set(known)):
        raise UserError(f"{folder}: its header does not tell the checksum of every file; {_RENEW}")
    for name in names:
        if name in known and checksum_file(folder / name) != known[name]:
            raise UserError(
                f"{folder / name}: is not the file that this package was made with: its checksum is another; {_RENEW}"
            )


def check_paths(folder: Path, named: Mapping[str, Path | None]) -> None:
    """Refuses settings that name a file outside the package.

    Args:
        folder: the package's.
        named: what the settings name, by the name of the package's own file.

    Raises:
        UserError: they name another file.
    """
    for name, found in named.items():
        if found is None or Path(found) != Path(os.path.abspath(folder / name)):
            raise UserError(f"{folder}: its settings name '{found}' in place of its own {name}; {_RENEW}")


def check_content(folder: Path, metadata: Mapping[str, str], robot: Robot, inputs: Iterable[str]) -> float:
    """Compares what the header says with what URDF and settings say.

    Args:
        folder: the package's.
        metadata: the header.
        robot: what URDF and settings make.
        inputs: the human joints that the network made of the settings reads.

    Returns:
        the threshold of phi that the header tells.

    Raises:
        UserError: they disagree; says in what.
    """
    names = _json(folder, metadata, "joint_names")
    if names != list(robot.joint_names):
        raise UserError(
            f"{folder}: header and settings name other joints, or in another order: {shortened(names, 300)} and"
            f" {shortened(list(robot.joint_names), 300)}; {_RENEW}"
        )
    for key, limit_N in (("lower_rad", robot.lower_N), ("upper_rad", robot.upper_N)):
        said = _json(folder, metadata, key)
        if not isinstance(said, list) or len(said) != len(names) or not all(isinstance(x, float) for x in said):
            raise UserError(f"{folder}: its header tells no limits of the joints ('{key}'); {_RENEW}")
        for joint, header, own in zip(names, said, limit_N.tolist(), strict=True):
            if not abs(header - own) <= _SAME_RAD:
                both = f"{header:.6g} and {own:.6g} rad"
                raise UserError(f"{folder}: header and URDF disagree on a limit of '{joint}': {both}; {_RENEW}")
    if metadata.get("robot") != robot.name:
        names = f"'{shortened(metadata.get('robot'))}' and '{robot.name}'"
        raise UserError(f"{folder}: header and settings name two robots, {names}; {_RENEW}")
    if _json(folder, metadata, "seen") != list(inputs):
        raise UserError(f"{folder}: header and settings read other things of a human pose; {_RENEW}")
    try:
        threshold = float(metadata["phi_threshold"])
    except (KeyError, ValueError):
        threshold = math.nan
    if not abs(threshold) <= _LARGEST_THRESHOLD:
        raise UserError(f"{folder}: its header's phi_threshold is no number that phi can be compared with; {_RENEW}")
    return threshold


def check_confidence(folder: Path, metadata: Mapping[str, str]) -> ConfidenceModel:
    """The confidence model that the header tells; the standard one for packages made before there was one."""
    if "confidence" not in metadata:
        return STANDARD
    try:
        return ConfidenceModel.from_json(metadata["confidence"])
    except UserError as error:
        raise UserError(f"{folder}: its header is wrong: {error}; {_RENEW}") from error


def check_prior(folder: Path, metadata: Mapping[str, str], prior: BodyPrior) -> None:
    """Refuses another body prior than the one that the pairs were made with, where the header tells."""
    if metadata.get("prior_xxh3", prior.checksum) != prior.checksum:
        raise UserError(f"{folder}: its body prior is not the one that it was made with; {_RENEW}")


def check_weights(folder: Path, weights: Mapping[str, Tensor], robot: Robot) -> None:
    """Refuses weights, as they are in the network, that hold NaN, or limits that are not the URDF's."""
    for name, tensor in weights.items():
        if not bool(tensor.isfinite().all()):
            raise UserError(f"{folder}: its weights '{shortened(name)}' hold NaN or infinite numbers; {_RENEW}")
    for name, own_N in (("limited.lower_N", robot.lower_N), ("limited.upper_N", robot.upper_N)):
        if not bool(((weights[name] - own_N).abs() <= _SAME_RAD).all()):
            raise UserError(f"{folder}: weights and URDF have other limits of the joints; {_RENEW}")


def _json(folder: Path, metadata: Mapping[str, str], key: str) -> Any:
    try:
        return json.loads(metadata[key])
    except (KeyError, ValueError, RecursionError) as error:
        raise UserError(f"{folder}: its header tells nothing of '{key}'; {_RENEW}") from error
