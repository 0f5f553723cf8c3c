"""Which body model a file of SMPL's family is of: to whose rest pose its rotations refer."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from mrhubo.body.rest_directions import FAMILIES
from mrhubo.errors import UserError
from mrhubo.files.npz import NpzFile
from mrhubo.motion.readers.rotations import find_form
from mrhubo.motion.writers.amass import OWN_REST, REST_KEY

_FAMILY_OF_JOINTS = {23: "smpl", 24: "smpl", 52: "smplh", 53: "smplx", 55: "smplx"}
"""By how many joints a pose has; 23 are SMPL's without the root, 53 SMPL-X's without eyes."""
_FACE = {
    "pose_jaw", "pose_eye", "jaw_pose", "leye_pose", "reye_pose", "expression", "smplx_verts", "smplx_params",
    "pose_lhand", "pose_rhand",
}  # fmt: skip
"""Keys of what SMPL-X alone has: its face, and the hands of Inter-X (https://github.com/liangxuy/Inter-X)."""
_HANDS = {"pose_hand", "left_hand_pose", "right_hand_pose"}
_MORE_THAN_BODY = {"poses", "pose_hand", "pose_jaw", "pose_eye"}
"""Poses of which AMASS's files hold at least one beside the body's."""
_SHAPE_OF_SMPLH = 16
"""Numbers that tell a body's shape in AMASS's files of SMPL-H, and in what is made of them (HuMoR, SLAHMR, OMOMO);
those of SMPL-X with as many say that they are.
"""
_MAX_TEXT = 1_000
"""Bytes of a name."""


def find_family(file: NpzFile, betas: Sequence[float] | None) -> tuple[str, str]:
    """The family of body models of an AMASS file, a key of `FAMILIES`, and in words what is known of the rest pose; no
    family where rotations refer to our skeleton.

    What mrhubo writes says so in a key of its own. Conversions that were made for our skeleton before there was that
    key do not; but they describe what is done, which no file of AMASS's does, and hold the pose of a body alone,
    without hands, whose shape is all zeros. A file that tells no family is left as it is.
    """
    if _read_text(file, REST_KEY) == OWN_REST:
        return "", "rotations refer to mrhubo's own skeleton, as the file says"
    shapeless = betas is not None and not any(betas)
    if "description" in file.keys and shapeless and not _MORE_THAN_BODY & file.keys:
        return "", "rotations are taken to refer to mrhubo's own skeleton: a described pose of a body without a shape"
    family = family_of(_read_text(file, "surface_model_type"), _joints(file), file.keys, betas)
    return family, rest_in_words(family)


def family_of(said: str, joints: int, keys: Collection[str], betas: Sequence[float] | None) -> str:
    """The family of body models, a key of `FAMILIES`; empty where nothing tells.

    Args:
        said: what the file calls its model.
        joints: how many joints its pose has.
        keys: what else it holds.
        betas: the body's shape, if it tells one; all zeros tell none.
    """
    bare = "".join(character for character in said.lower() if character.isalnum())
    for name in sorted(FAMILIES, key=len, reverse=True):
        if bare.startswith(name):
            return name
    if joints in _FAMILY_OF_JOINTS:
        return _FAMILY_OF_JOINTS[joints]
    if _FACE & set(keys):
        return "smplx"
    shaped = betas is not None and len(betas) == _SHAPE_OF_SMPLH and any(betas)
    return "smplh" if shaped or _HANDS & set(keys) else ""


def rest_in_words(family: str) -> str:
    """What is known of the rest pose of a family, or of a file that tells none."""
    if not family:
        return (
            "rotations are taken to refer to a T-pose, as the file does not tell its body model; if it is SMPL-X, arms"
            " are up to 18 degrees off"
        )
    return (
        f"rotations refer to the rest pose of {FAMILIES[family].name}; limbs are those of its mean body, from which"
        " this person's differ by a few degrees (body.model_path and body.betas make them exact)"
    )


def _joints(file: NpzFile) -> int:
    """How many joints the pose has; 0 where that is not told."""
    for key in ("poses", "pose_body"):
        try:
            form = find_form(file.shape(key), _FAMILY_OF_JOINTS) if key in file.keys else None
        except UserError:
            form = None
        if form is not None:
            return form.joints
    return 0


def _read_text(file: NpzFile, key: str) -> str:
    """A name; nothing where the file has none that is text."""
    if key not in file.keys:
        return ""
    try:
        array = file.read(key, kinds="U", max_bytes=_MAX_TEXT)
    except UserError:
        return ""
    return str(array.reshape(())) if array.size == 1 else ""
