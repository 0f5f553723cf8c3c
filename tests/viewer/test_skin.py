"""The person's mesh is the figure of the pictures, in any pose."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.view import Solids, human_solids
from mrhubo.viewer.meshing import capsules
from mrhubo.viewer.skin import human_skins, joints_of


def test_the_skin_follows_the_bones() -> None:
    local_TJ33 = rotation.axis_angle_to_matrix(0.4 * torch.randn(3, 21, 3, generator=torch.Generator().manual_seed(5)))
    place_TJ3, turn_TJ33 = joints_of(local_TJ33)
    rest_J3 = joints_of(torch.eye(3).expand(1, 21, 3, 3))[0][0]
    points_TK3 = Skeleton().keypoints(local_TJ33).numpy()
    for frame in range(3):
        solids = human_solids(points_TK3[frame], KEYPOINT_NAMES)
        ends_S23 = np.stack([solids.starts_S3, solids.ends_S3], axis=1)
        for skin in human_skins():
            rows = np.flatnonzero((solids.colors_S3 == skin.mesh.color).all(axis=1))
            joint_V = np.array(skin.bones)[skin.carrier_V]
            apart_V3 = skin.mesh.vertices_V3 - rest_J3[joint_V]
            posed_V3 = np.einsum("vab,vb->va", turn_TJ33[frame, joint_V], apart_V3) + place_TJ3[frame, joint_V]
            centre_S23 = posed_V3.reshape(len(rows), 2, -1, 3)
            radii_S2 = np.stack([solids.radii_S, solids.end_radii_S], axis=1)[rows]
            away = np.linalg.norm(centre_S23 - ends_S23[rows][:, :, None], axis=-1) - radii_S2[..., None]
            assert np.abs(away).mean() < 2e-3 and np.abs(away).max() < 0.03  # a calf's muscle turns with the foot


def test_capsules_are_closed_and_look_outwards() -> None:
    rows = [
        (np.zeros(3), np.array([0.0, 0.0, 2.0]), 0.5, 0.5),
        (np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.5, 0.2),
        (np.zeros(3), np.zeros(3), 0.5, 0.5),
    ]
    vertices_S2R3, normals_S2R3, faces_F3 = capsules(Solids.capsules(rows, (1.0, 0.0, 0.0)))
    np.testing.assert_allclose(np.linalg.norm(normals_S2R3, axis=-1), 1.0, atol=1e-9)
    volumes = [trimesh.Trimesh(v.reshape(-1, 3), faces_F3, process=False).volume for v in vertices_S2R3]
    ball = 4 / 3 * np.pi * 0.5**3
    assert 0.9 * (ball + np.pi * 0.25 * 2) < volumes[0] < ball + np.pi * 0.25 * 2
    assert 0.88 * ball < volumes[2] < ball < volumes[1] < ball + 0.6
