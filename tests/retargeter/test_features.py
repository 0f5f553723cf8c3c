"""Features see what they should of a pose."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.motion import Motion
from mrhubo.motion.resharing import reshare
from mrhubo.reference import DirectionJacobian
from mrhubo.retargeter.features import DirectionFeatures, RotationFeatures
from mrhubo.robot import BodyMap, build_body_map


@pytest.fixture(scope="module")
def body_map(root: Path) -> BodyMap:
    return build_body_map(load_config(root / "conf" / "reachy.yaml").robot)


def poses(count: int) -> torch.Tensor:
    turns = 0.6 * torch.randn(count, 21, 3, generator=torch.Generator().manual_seed(0))
    return rotation.axis_angle_to_matrix(turns)


def test_directions_are_those_of_the_body_map(body_map: BodyMap) -> None:
    columns = [7, 0, 3]
    features, local = DirectionFeatures(body_map, [columns]), poses(6)
    assert features.names == tuple(body_map.direction_names[i] for i in sorted(columns))
    wanted = body_map.human_directions(local)[:, sorted(columns)].flatten(1)
    torch.testing.assert_close(features(rotation.matrix_to_sixd(local))[:, :9], wanted, atol=1e-6, rtol=0)
    torch.testing.assert_close(features.of(body_map.human_directions(local))[:, :9], wanted)


def arms_of(body_map: BodyMap) -> list[list[int]]:
    """Directions of each branch."""
    return [sorted(directions) for directions, _ in DirectionJacobian(body_map).blocks]


def test_what_follows_from_a_branchs_directions_is_its_own(body_map: BodyMap) -> None:
    """Another pose of the other branches changes none of a branch's features."""
    groups = arms_of(body_map)
    features = DirectionFeatures(body_map, groups)
    one, other = (body_map.human_directions(poses(8)[i::2]) for i in (0, 1))
    turned = sorted(i for group in groups for i in group)
    taken = set()
    for group in groups:
        mixed = other.clone()
        mixed[:, group] = one[:, group]
        columns = features.columns(turned.index(i) for i in group)
        taken |= set(columns)
        assert torch.equal(features.of(mixed)[:, columns], features.of(one)[:, columns])
    assert taken == set(range(features.size)), "every feature belongs to a branch"


def test_angles_and_views_do_not_depend_on_how_all_is_turned(body_map: BodyMap) -> None:
    groups = arms_of(body_map)
    features, directions = DirectionFeatures(body_map, groups), body_map.human_directions(poses(8))
    turn = rotation.axis_angle_to_matrix(torch.tensor([0.3, -1.0, 0.5]))
    before, after = features.of(directions), features.of(directions @ turn.T)
    vectors = 3 * (len(features.names) + sum(name.endswith("elbow_axis") for name in features.names))
    assert features.size > vectors + 20
    torch.testing.assert_close(after[:, vectors:], before[:, vectors:], atol=1e-5, rtol=0)
    assert float((after[:, :vectors] - before[:, :vectors]).abs().max()) > 0.5


def test_conditioned_features_have_mean_0_and_spread_1(body_map: BodyMap) -> None:
    features, directions = DirectionFeatures(body_map, arms_of(body_map)), body_map.human_directions(poses(500))
    raw = features.of(directions)
    for _ in range(2):  # the second time they are conditioned already
        found = features.condition(features.of(directions))
        torch.testing.assert_close(features.of(directions), found, atol=1e-4, rtol=0)
        torch.testing.assert_close(found.mean(0), torch.zeros(features.size), atol=1e-4, rtol=0)
        spread = found.std(0)[raw.std(0) > 0.06]
        torch.testing.assert_close(spread, torch.ones_like(spread), atol=1e-3, rtol=0)


def test_directions_do_not_depend_on_how_turns_are_shared_out(body_map: BodyMap) -> None:
    """Bend axes do, a little, where elbows are straight: the upper arm's own turn is all that tells them there."""
    motion = Motion("m", poses(40), 30.0)
    other = reshare(motion, seed=1)
    assert float((motion.local_TJ33 - other.local_TJ33).abs().max()) > 0.3
    features = DirectionFeatures(body_map, [body_map.measured])
    before, after = (features(rotation.matrix_to_sixd(m.local_TJ33.float())) for m in (motion, other))
    torch.testing.assert_close(after, before, atol=1e-4, rtol=0)


def test_directions_go_where_the_network_goes(body_map: BodyMap) -> None:
    features = DirectionFeatures(body_map, [[0, 1]]).double()
    found = features(rotation.matrix_to_sixd(poses(3).double()))
    assert found.dtype == torch.float64 and body_map.robot.lower_N.dtype == torch.float32


def test_rotations_are_the_pose_itself() -> None:
    pose = torch.randn(3, 21, 6)
    torch.testing.assert_close(RotationFeatures(("left_hip", "head"))(pose), pose[:, [0, 14]].flatten(1))


@pytest.mark.parametrize("names", [(), ("pelvis",), ("left_wirst",)])
def test_impossible_input_joints_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(UserError):
        RotationFeatures(names)
