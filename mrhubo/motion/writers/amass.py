"""Human motions to .npz files with the keys of AMASS.

Legend: T frames, 63 = 21 joints x 3 axis-angle numbers [rad] of SMPL's joints 1..21.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.files.atomic import atomic_path

REST_KEY, OWN_REST = "rest_directions", "mrhubo"
"""The key that says to which rest pose rotations refer, and its text where that is our own skeleton's: other programs
want to hear of a body model they know (`surface_model_type`)."""

CONTACT_KEY = "contact"
"""The key of which points of soles are planted."""


def write_motion(
    path: Path,
    pose_body_T63: np.ndarray,
    root_orient_T3: np.ndarray,
    trans_T3: np.ndarray,
    frame_rate: float,
    description: str,
    contact_T4: np.ndarray | None = None,
) -> None:
    """Writes a motion with AMASS's keys, as float32, atomically; the same numbers give the same bytes.

    ``pose_body_T63`` and ``root_orient_T3``: axis-angle [rad] of joints 1..21, which refer to our skeleton's rest pose,
    and of the pelvis; ``trans_T3``: place of
    the pelvis [m]; ``frame_rate``: frames per second; ``contact_T4``: whether the left heel, the left toe, the right
    heel and the right toe are planted, where that is known.
    """
    frames = len(pose_body_T63)
    arrays = {"pose_body": (pose_body_T63, 63), "root_orient": (root_orient_T3, 3), "trans": (trans_T3, 3)}
    for key, (array, width) in arrays.items():
        if np.shape(array) != (frames, width) or frames == 0:
            raise ValueError(f"{key}: expected shape ({frames}, {width}), one frame or more, got {np.shape(array)}")
        if not np.isfinite(array).all():
            raise ValueError(f"{key}: not finite")
    content: dict[str, Any] = {key: np.asarray(array, dtype="<f4") for key, (array, _) in arrays.items()}
    content |= {
        "mocap_frame_rate": np.asarray(frame_rate, dtype="<f8"),
        "betas": np.zeros(16, dtype="<f4"),
        "gender": np.asarray("neutral", dtype="<U7"),
        "surface_model_type": np.asarray("smplx", dtype="<U5"),
        REST_KEY: np.asarray(OWN_REST, dtype="<U6"),
        "description": np.asarray(description, dtype=f"<U{max(1, len(description))}"),
    }
    if contact_T4 is not None:
        if np.shape(contact_T4) != (frames, 4):
            raise ValueError(f"{CONTACT_KEY}: expected shape ({frames}, 4), got {np.shape(contact_T4)}")
        content[CONTACT_KEY] = np.asarray(contact_T4, dtype=np.bool_)
    with atomic_path(Path(path)) as temporary, open(temporary, "wb") as handle:
        np.savez(handle, **content)
