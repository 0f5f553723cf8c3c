"""The paper's scale factor: positions, lengthened limbs, shift and factor, against arithmetic and the robots' own
directions.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.config import ManualScaleConfig, load_config
from mrhubo.errors import UserError
from mrhubo.frames import base_to_human
from mrhubo.pairing import PairGenerator, lbfgs
from mrhubo.robot import BodyMap, LinkPoses, build_body_map
from mrhubo.robot.manual_scale import check_ranges, varied

ROBOTS = ["nao", "coman", "reachy"]


def body_map_of(root: Path, name: str, **changes: Any) -> BodyMap:
    config = load_config(root / "conf" / "paper" / f"{name}.yaml").robot
    assert config.manual is not None
    for key, value in changes.items():
        setattr(config.manual, key, value)
    return build_body_map(config)


@functools.cache
def shipped(root: Path, name: str) -> BodyMap:
    return body_map_of(root, name)


def some_poses(body_map: BodyMap, count: int = 60) -> LinkPoses:
    return body_map.robot.forward(body_map.robot.sample(count, torch.Generator().manual_seed(0)))


def targets(body_map: BodyMap) -> dict[str, torch.Tensor]:
    return dict(zip(body_map.keypoint_names, body_map.targets(some_poses(body_map)).unbind(1), strict=True))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_authors_numbers_give_a_human(root: Path, name: str) -> None:
    body_map = shipped(root, name)
    at, directions = targets(body_map), body_map.robot_directions(some_poses(body_map))
    assert float(at["pelvis"].abs().max()) == 0
    rest = dict(zip(body_map.keypoint_names, body_map.skeleton.rest_K3[body_map.keypoint_indices], strict=True))
    for side, sign in (("left", 1), ("right", -1)):
        # the directions of `auto` are kept, the lengths are a human's within a fifth
        arm = at[f"{side}_elbow"] - at[f"{side}_shoulder"]
        wanted = directions[:, body_map.direction_names.index(f"{side}_elbow")]
        torch.testing.assert_close(torch.nn.functional.normalize(arm, dim=-1), wanted, atol=1e-5, rtol=0)
        length = float((rest[f"{side}_elbow"] - rest[f"{side}_shoulder"]).norm())
        assert float(arm.norm(dim=-1).mean()) == pytest.approx(length, rel=0.2)
        assert float((at[f"{side}_shoulder"][0] - rest[f"{side}_shoulder"]).norm()) < 0.08
        assert float(sign * at[f"{side}_hip"][0, 0]) > 0.02 and float(at[f"{side}_knee"][0, 1]) < -0.2
    assert 0.3 < float(at["neck"][0, 1]) < 0.55


def test_limbs_are_lengthened_and_carry_the_hand(root: Path) -> None:
    plain = targets(body_map_of(root, "nao", upper_arm=0.0, forearm=0.0, factor=1.0))
    longer = targets(body_map_of(root, "nao", upper_arm=0.5, forearm=0.25, factor=1.0))
    for side in ("left", "right"):
        upper = plain[f"{side}_elbow"] - plain[f"{side}_shoulder"]
        fore = plain[f"{side}_wrist"] - plain[f"{side}_elbow"]
        torch.testing.assert_close(longer[f"{side}_shoulder"], plain[f"{side}_shoulder"])
        torch.testing.assert_close(longer[f"{side}_elbow"], plain[f"{side}_elbow"] + 0.5 * upper)
        for point in ("wrist", "thumb", "middle"):
            expected = plain[f"{side}_{point}"] + 0.5 * upper + 0.25 * fore
            torch.testing.assert_close(longer[f"{side}_{point}"], expected)
    for name in ("neck", "left_eye", "right_knee"):
        torch.testing.assert_close(longer[name], plain[name])


def test_factor_scales_all_alike(root: Path) -> None:
    one, two = (targets(body_map_of(root, "reachy", factor=factor)) for factor in (1.0, 2.0))
    for name, point in one.items():
        torch.testing.assert_close(two[name], 2 * point)


def test_a_shift_moves_nothing_and_says_so(root: Path, recwarn: pytest.WarningsRecorder) -> None:
    plain = targets(shipped(root, "reachy"))
    assert not recwarn.list
    with pytest.warns(UserWarning, match=r"robot.manual.shift: \[0.1, 0.2, 0.3\] moves nothing.*pelvis"):
        moved = targets(body_map_of(root, "reachy", shift=[0.1, 0.2, 0.3]))
    for name, point in plain.items():
        torch.testing.assert_close(moved[name], point, atol=1e-6, rtol=0)


def test_what_the_warning_of_a_shift_advises_does_move(root: Path) -> None:
    plain = targets(shipped(root, "reachy"))
    config = load_config(root / "conf" / "paper" / "reachy.yaml").robot
    assert config.manual is not None
    config.manual.keypoints["pelvis"] = {"offset": [-0.1, -0.2, 0.6 - 0.3]}
    moved = targets(build_body_map(config))
    torch.testing.assert_close(moved["neck"], plain["neck"] + base_to_human(torch.tensor([0.1, 0.2, 0.3])))


def test_means_offsets_and_constants_are_in_the_base_frame(root: Path) -> None:
    keypoints = {
        "pelvis": {"offset": [0.0, 0.0, 0.0]},
        "neck": {"links": {"l_wrist": 3, "r_wrist": 1}, "offset": [0.1, 0.2, 0.3]},
        "left_knee": {"offset": [1.0, 2.0, 3.0]},
    }
    body_map = body_map_of(root, "nao", keypoints=keypoints, factor=1.0)
    poses = some_poses(body_map)
    found = body_map.targets(poses)
    left, right = (poses.position_BL3[:, body_map.robot.link_index(f"{s}_wrist")] for s in "lr")
    expected = (3 * left + right) / 4 + torch.tensor([0.1, 0.2, 0.3])
    torch.testing.assert_close(found[:, 1], base_to_human(expected))
    torch.testing.assert_close(found[:, 2], torch.tensor([2.0, 3.0, 1.0]).expand(60, 3))


def test_pairs_come_from_it(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lbfgs, "_ITERATIONS", 60)
    config = load_config(root / "conf" / "paper" / "nao.yaml", ["pairs.shard_size=100"])
    body_map, prior = build_body_map(config.robot), BodyPrior.open()
    maker = PairGenerator(body_map, prior, config)
    pairs = maker.shard("forward", 0)
    wanted = body_map.targets(body_map.robot.forward(pairs["q"]))
    points = body_map.skeleton.keypoints(prior.decode_matrices(torch.zeros(1, prior.latent)))[
        :, body_map.keypoint_indices
    ]
    assert float(pairs["residual_m"].mean()) < 0.5 * float((points - wanted).norm(dim=-1).mean())


@pytest.mark.parametrize(
    ("keypoints", "message"),
    [
        ({"neck": "Neck"}, "'pelvis' is missing"),
        ({"pelvis": "torso"}, "names the pelvis alone"),
        ({"pelvis": "torso", "nek": "Neck"}, "neck"),
        ({"pelvis": "torso", "neck": "Nek"}, "Neck"),
        ({"pelvis": "torso", "neck": 3}, "must be a link name, .*, found 3"),
        ({"pelvis": "torso", "neck": {"lnk": "Neck"}}, "link"),
        ({"pelvis": "torso", "neck": {"link": "Neck", "links": {"Neck": 1}}}, "'link' and 'links' do not go together"),
        ({"pelvis": "torso", "neck": {"links": {"Neck": 0}}}, "neck.links.Neck must be a number from"),
        ({"pelvis": "torso", "neck": {"links": ["Neck"]}}, "neck.links must be a mapping .*found a list"),
        ({"pelvis": "torso", "neck": {"offset": [1, 2]}}, "three numbers"),
    ],
)
def test_mistakes_are_named(root: Path, keypoints: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        body_map_of(root, "nao", keypoints=keypoints)


def test_its_numbers_are_needed(root: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["robot.scale=manual"]).robot
    with pytest.raises(UserError, match="robot.manual: is missing"):
        build_body_map(config)
    assert ManualScaleConfig({}).factor == 1


def test_varied_numbers_and_offsets(root: Path) -> None:
    start = load_config(root / "conf" / "paper" / "nao.yaml").robot
    assert start.manual is not None
    plain = targets(shipped(root, "nao"))
    changed = load_config(root / "conf" / "paper" / "nao.yaml").robot
    changed.manual = varied(start.manual, {"factor": 1.0, "shoulder.y": 0.02, "pelvis.z": 0.1})
    moved = dict(zip(
        (body_map := build_body_map(changed)).keypoint_names, body_map.targets(some_poses(body_map)).unbind(1), strict=True
    ))  # fmt: skip
    up, left = torch.tensor([0.0, 0.1, 0.0]), torch.tensor([0.02, 0.0, 0.0])  # human axes
    torch.testing.assert_close(moved["neck"], plain["neck"] / 2 - up)
    torch.testing.assert_close(moved["left_shoulder"], plain["left_shoulder"] / 2 - up + left)
    torch.testing.assert_close(moved["right_shoulder"], plain["right_shoulder"] / 2 - up - left)
    assert start.manual.factor == 2.0 and start.manual.keypoints["left_shoulder"] == "LShoulder"


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({}, "empty"),
        ({"facto": [1.0, 2.0]}, "'facto' .*'factor'"),
        ({"sholder.y": [0.0, 1.0]}, "'sholder.y' .*'shoulder"),
        ({"shoulder.w": [0.0, 1.0]}, "'shoulder.w' .*'shoulder.x'"),
        ({"left_toe.x": [0.0, 1.0]}, "'left_toe.x' does not exist"),
        ({"factor": [2.0, 1.0]}, "low below high"),
        ({"factor": [1.0]}, "low below high"),
        ({"factor": [0.0, 2.0]}, "within .0.001, 1000"),
        ({"upper_arm": [-2.0, 2.0]}, "within .-0.9, 100"),
    ],
)
def test_impossible_ranges(root: Path, ranges: dict[str, list[float]], words: str) -> None:
    manual = load_config(root / "conf" / "paper" / "nao.yaml").robot.manual
    assert manual is not None
    with pytest.raises(UserError, match=words):
        check_ranges(manual, ranges)


@pytest.mark.parametrize("missing", ["manual", "search"])
def test_search_needs_numbers_and_ranges(root: Path, missing: str) -> None:
    config = load_config(root / "conf" / "paper" / "nao.yaml", ["robot.scale=search"]).robot
    setattr(config, missing, None)
    with pytest.raises(UserError, match=rf"robot\.{missing}: is missing"):
        build_body_map(config)
