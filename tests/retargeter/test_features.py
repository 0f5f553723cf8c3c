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
from mrhubo.retargeter.features import DirectionFeatures, RotationFeatures
from mrhubo.robot import BodyMap, build_body_map


@pytest.fixture(scope="module")
def body_map(root: Path) -> BodyMap:
    return build_body_map(load_config(root / "conf" / "reachy.yaml").robot)


def poses(count: int) -> torch.Tensor:
    turns = 0.6 * torch.randn(count, 21, 3, generator=torch.Generator().manual_seed(0))
    return rotation.axis_angle_to_matrix(turns)


def test_directions_are_those_of_the_body_map(body_map: BodyMap) -> None:
    columns = [3, 0, 7]
    features, local = DirectionFeatures(body_map, columns), poses(6)
    assert features.names == tuple(body_map.direction_names[i] for i in columns) and features.size == 9
    wanted = body_map.human_directions(local)[:, columns].flatten(1)
    torch.testing.assert_close(features(rotation.matrix_to_sixd(local)), wanted, atol=1e-6, rtol=0)
    torch.testing.assert_close(features.of(body_map.human_directions(local)), wanted)


def test_directions_do_not_depend_on_how_turns_are_shared_out(body_map: BodyMap) -> None:
    """Bend axes do, a little, where elbows are straight: the upper arm's own turn is all that tells them there."""
    motion = Motion("m", poses(40), 30.0)
    other = reshare(motion, seed=1)
    assert float((motion.local_TJ33 - other.local_TJ33).abs().max()) > 0.3
    features = DirectionFeatures(body_map, body_map.measured)
    before, after = (features(rotation.matrix_to_sixd(m.local_TJ33.float())) for m in (motion, other))
    torch.testing.assert_close(after, before, atol=1e-4, rtol=0)


def test_directions_go_where_the_network_goes(body_map: BodyMap) -> None:
    features = DirectionFeatures(body_map, [0, 1]).double()
    found = features(rotation.matrix_to_sixd(poses(3).double()))
    assert found.dtype == torch.float64 and body_map.robot.lower_N.dtype == torch.float32


def test_rotations_are_the_pose_itself() -> None:
    pose = torch.randn(3, 21, 6)
    torch.testing.assert_close(RotationFeatures(("left_hip", "head"))(pose), pose[:, [0, 14]].flatten(1))


@pytest.mark.parametrize("names", [(), ("pelvis",), ("left_wirst",)])
def test_impossible_input_joints_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(UserError):
        RotationFeatures(names)
