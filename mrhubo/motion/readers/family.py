"""Which body model a file of SMPL's family is of: to whose rest pose its rotations refer."""

from __future__ import annotations

from collections.abc import Sequence

from mrhubo.body.rest_directions import FAMILIES
from mrhubo.errors import UserError
from mrhubo.files.npz import NpzFile
from mrhubo.motion.writers.amass import OWN_REST, REST_KEY

_FAMILY_OF_WIDTH = {72: "smpl", 156: "smplh", 165: "smplx"}
_MORE_THAN_BODY = {"poses", "pose_hand", "pose_jaw", "pose_eye"}
"""Poses of which AMASS's files hold at least one beside the body's."""
_MAX_TEXT = 1_000
"""Bytes of a name."""


def find_family(file: NpzFile, betas: Sequence[float] | None) -> tuple[str, str]:
    """The family of body models, a key of `FAMILIES`, and in words what is known of the rest pose; no family where
    rotations refer to our skeleton.

    What mrhubo writes says so in a key of its own. Conversions that were made for our skeleton before there was that
    key do not; but they describe what is done, which no file of AMASS's does, and hold the pose of a body alone,
    without hands, whose shape is all zeros. A file that tells no family is left as it is.
    """
    if _read_text(file, REST_KEY) == OWN_REST:
        return "", "rotations refer to mrhubo's own skeleton, as the file says"
    shapeless = betas is not None and not any(betas)
    if "description" in file.keys and shapeless and not _MORE_THAN_BODY & file.keys:
        return "", "rotations are taken to refer to mrhubo's own skeleton: a described pose of a body without a shape"
    family = _family_of(file)
    if not family:
        return "", (
            "rotations are taken to refer to a T-pose, as the file does not tell its body model; if it is SMPL-X, arms"
            " are up to 18 degrees off"
        )
    return family, (
        f"rotations refer to the rest pose of {FAMILIES[family].name}; limbs are those of its mean body, from which"
        " this person's differ by a few degrees (body.model_path and body.betas make them exact)"
    )


def _family_of(file: NpzFile) -> str:
    said = _read_text(file, "surface_model_type").lower()
    said = "".join(character for character in said if character.isalnum())
    for name in sorted(FAMILIES, key=len, reverse=True):
        if said.startswith(name):
            return name
    try:
        width = file.shape("poses")[-1] if "poses" in file.keys else 0
    except (UserError, IndexError):
        width = 0
    if width in _FAMILY_OF_WIDTH:
        return _FAMILY_OF_WIDTH[width]
    return "smplx" if "pose_jaw" in file.keys else "smplh" if "pose_hand" in file.keys else ""


def _read_text(file: NpzFile, key: str) -> str:
    """A name; nothing where the file has none that is text."""
    if key not in file.keys:
        return ""
    try:
        array = file.read(key, kinds="U", max_bytes=_MAX_TEXT)
    except UserError:
        return ""
    return str(array.reshape(())) if array.size == 1 else ""
