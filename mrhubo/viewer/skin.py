"""The human figure of the pictures as meshes that bones carry along.

Which bone carries an end of a capsule is not written down anywhere a second time: it is seen in some poses, in which
the end keeps its place against one joint and none else.

Axes of all: x forward, y left, z up, m, from the pelvis. Legend: K poses, S capsules, J = 22 joints, V vertices, B
bones of one mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import torch

from mrhubo import rotation
from mrhubo.body import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton
from mrhubo.frames import human_to_world
from mrhubo.view import human_solids
from mrhubo.viewer.meshing import Mesh, capsules, joined

_POSES, _TURN = 8, 0.35
"""Poses that are looked at, and how far [rad] joints turn in them about each axis."""


@dataclass(frozen=True)
class Skin:
    """A mesh of one colour at rest, and the joints that carry its vertices."""

    mesh: Mesh
    bones: tuple[int, ...]
    """Numbers in `JOINT_NAMES`."""
    carrier_V: np.ndarray
    """Number in `bones` of the one that carries each vertex."""


@cache
def human_skins() -> tuple[Skin, ...]:
    """The figure at rest, a mesh a colour."""
    generator = torch.Generator().manual_seed(0)
    turn_KJ3 = _TURN * torch.randn(_POSES, len(POSED_JOINT_NAMES), 3, generator=generator)
    place_KJ3, turn_KJ33, ends_KS23 = _figure(rotation.axis_angle_to_matrix(turn_KJ3))
    apart_KSEJ3 = ends_KS23[..., None, :] - place_KJ3[:, None, None]
    local_KSEJ3 = np.einsum("kjba,ksejb->kseja", turn_KJ33, apart_KSEJ3)
    carrier_S2 = local_KSEJ3.std(axis=0).max(axis=-1).argmin(axis=-1)
    rest_J33 = torch.eye(3).expand(1, len(POSED_JOINT_NAMES), 3, 3)
    points_K3 = Skeleton().keypoints(rest_J33)[0].numpy()
    solids = human_solids(points_K3, KEYPOINT_NAMES)
    vertices_S2R3, _, faces_F3 = capsules(solids)
    skins = []
    for color in dict.fromkeys(map(tuple, solids.colors_S3.tolist())):
        rows = np.flatnonzero((solids.colors_S3 == color).all(axis=1))
        mesh = joined([Mesh(vertices_S2R3[row].reshape(-1, 3), faces_F3, color) for row in rows])[0]
        joint_V = np.repeat(carrier_S2[rows].reshape(-1), vertices_S2R3.shape[2])
        bones_B, carrier_V = np.unique(joint_V, return_inverse=True)
        skins.append(Skin(mesh, tuple(bones_B.tolist()), carrier_V))
    return tuple(skins)


def _figure(local_KJ33: torch.Tensor) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (K, J, 3) and rotations (K, J, 3, 3) of all joints, and the ends (K, S, 2, 3) of the figure's capsules."""
    place_KP3, turn_KJ33 = joints_of(local_KJ33)
    points_KP3, _ = Skeleton().keypoints_and_rotations(local_KJ33)
    figures = [human_solids(points_P3.numpy(), KEYPOINT_NAMES) for points_P3 in points_KP3]
    return place_KP3, turn_KJ33, np.stack([np.stack([f.starts_S3, f.ends_S3], axis=1) for f in figures])


def joints_of(local_TJ33: torch.Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 22, 3) [m] and rotations (T, 22, 3, 3) of all joints, from the pelvis, for local rotations
    (T, 21, 3, 3) of joints 1..21.
    """
    with torch.no_grad():
        points_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(local_TJ33)
    return human_to_world(points_TK3[:, : len(JOINT_NAMES)].double().numpy()), world_rotations(
        turn_TJ33.double().numpy()
    )


def world_rotations(human_X33: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) given along the human axes, along those of the world."""
    turned_X33 = human_to_world(human_X33)  # its rows' coordinates
    return human_to_world(turned_X33.swapaxes(-1, -2)).swapaxes(-1, -2)
