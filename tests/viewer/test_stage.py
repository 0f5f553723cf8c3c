"""Who stands where: on the floor, side by side, on one clock."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.motion import Motion
from mrhubo.robot import Robot
from mrhubo.viewer import Stage, arrange, perform, read_person
from mrhubo.viewer.poses import about_z, headings
from tests.viewer.conftest import FRAMES, random_motion, walk


def test_nobody_sinks_and_nobody_overlaps(stage: Stage) -> None:
    person, robot, _ = stage.standings
    assert stage.person is not None
    soles_TP3 = stage.person.soles_TP3
    assert abs(soles_TP3[..., 2].min()) < 0.02
    performance = stage.robots[0]
    poses_BT44 = robot.pose_T44 @ performance.body_poses(np.arange(FRAMES))
    lowest = min(
        float((mesh.vertices_V3 @ pose_44[2, :3] + pose_44[2, 3]).min())
        for body, pose_T44 in zip(performance.bodies, poses_BT44, strict=True)
        for mesh in body.meshes
        for pose_44 in pose_T44
    )
    assert abs(lowest) < 2e-3
    edges = [(s.middle_2[1] + s.low_3[1], s.middle_2[1] + s.high_3[1]) for s in stage.standings]
    assert all(left[1] < right[0] for left, right in zip(edges, edges[1:], strict=False))
    assert edges[0][0] == pytest.approx(-edges[-1][1])
    assert person.pose_T44[0, 1, 3] < robot.pose_T44[0, 1, 3]


def test_bases_keep_their_way(stage: Stage, nao: Robot) -> None:
    """It looked to the left and went there; the person's heading is taken off from all alike."""
    assert stage.person is not None
    walker, standing = stage.robots[1], stage.standings[2]
    start = float(headings(stage.person.root_T33[0]))
    wanted_T3 = walker.scale * np.column_stack([np.zeros(FRAMES), np.linspace(0, 1, FRAMES), np.full(FRAMES, 0.3)])
    wanted_T3 = wanted_T3 @ about_z(np.array(-start)).T
    np.testing.assert_allclose(standing.pose_T44[:, :3, 3] - [*standing.middle_2, 0], wanted_T3, atol=1e-6)
    alone = arrange(None, [perform("walker", nao, walk(nao))])  # turned so that it looks ahead
    np.testing.assert_allclose(alone.standings[0].pose_T44[:, :3, :3], np.tile(np.eye(3), (FRAMES, 1, 1)), atol=1e-6)
    assert (
        alone.followed_F2[-1, 0] > alone.followed_F2[0, 0]
        and not arrange(None, [perform("nao", nao, random_motion(nao))]).followed_F2.any()
    )


def test_a_person_stays_where_no_base_moves(nao: Robot, boxing: Motion) -> None:
    turns_T33 = rotation.axis_angle_to_matrix(torch.linspace(0, 3, FRAMES)[:, None] * torch.tensor([0.0, 1.0, 0.0]))
    way_T3 = torch.linspace(0, 5, FRAMES)[:, None] * torch.tensor([1.0, 0.0, 1.0]) + torch.tensor([0.0, 0.9, 0.0])
    person = read_person(boxing.changed(root_rotation_T33=turns_T33, root_position_T3=way_T3))
    still, goes = (
        arrange(person, [perform("nao", nao, random_motion(nao))]),
        arrange(person, [perform("nao", nao, walk(nao))]),
    )
    np.testing.assert_allclose(headings(still.standings[0].pose_T44[:, :3, :3]), 0, atol=1e-6)
    assert np.ptp(still.standings[0].pose_T44[:, :2, 3], axis=0).max() < 1e-9
    way_T2 = goes.standings[0].pose_T44[:, :2, 3] - goes.standings[0].middle_2
    scale = np.ptp(person.root_T3[:, 0]) / 5  # the way is made to fit the skeleton's legs
    np.testing.assert_allclose(way_T2[-1], [5 * scale, 5 * scale], atol=1e-5)  # z forward and x to the left
    np.testing.assert_allclose(np.unwrap(headings(goes.standings[0].pose_T44[:, :3, :3]))[-1], 3, atol=1e-5)


def test_a_person_without_a_root_stands_on_the_floor(boxing: Motion) -> None:
    person = read_person(boxing.changed(root_rotation_T33=None, root_position_T3=None))
    assert person.planted_TP is None and not person.has_root
    np.testing.assert_allclose(person.soles_TP3[..., 2].min(axis=1), 0, atol=1e-9)
    assert person.place_TJ3.shape == (FRAMES, len(JOINT_NAMES), 3)


def test_one_clock_for_all_rates(nao: Robot, boxing: Motion) -> None:
    slow = perform("slow", nao, random_motion(nao, 5, frame_rate=20.0))
    stage = arrange(read_person(boxing), [slow])
    assert stage.frame_rate == 60.0 and stage.frames == 13 and stage.duration == pytest.approx(0.2)
    assert [stage.frame_of(slow, frame / 60) for frame in (0, 1, 2, 4, 12)] == [0, 0, 1, 1, 4]
    assert stage.person is not None and stage.frame_of(stage.person, 0.2) == FRAMES - 1  # it has ended


def test_what_cannot_be_shown(boxing: Motion) -> None:
    with pytest.raises(UserError, match="nobody to show"):
        arrange(None, [])
    broken = boxing.arrays.local_TJ33.copy()
    broken[3, 2] = np.nan
    with pytest.raises(UserError, match="human pose 3 holds NaN"):
        read_person(boxing.changed(local_TJ33=broken))
    far = torch.full((FRAMES, 3), 1e9)
    with pytest.raises(UserError, match="out of this world"):
        read_person(boxing.changed(root_position_T3=far))
    with pytest.raises(UserError, match="has no frames"):
        read_person(boxing.changed(local_TJ33=boxing.local_TJ33[:0]))
