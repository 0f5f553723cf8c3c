"""The sheet is drawn of whatever links there are, shows a wrong side where it is, and is known again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from mrhubo.config import RobotConfig
from mrhubo.describing import picture
from mrhubo.describing.figures import FigureMaker
from mrhubo.describing.markers import SIDE_COLORS
from mrhubo.describing.poses import POSES, human_poses
from mrhubo.robot import BodyMap, Robot
from tests.robot.two_arms import KEYPOINTS

SWAPPED = {name: KEYPOINTS[f"{other}_{name.partition('_')[2]}"] for side, other in (("left", "right"), ("right", "left"))
           for name in KEYPOINTS if name.startswith(side)}  # fmt: skip


def body_map(config: RobotConfig) -> BodyMap:
    return BodyMap(Robot.from_urdf(config.urdf, config.joints, config.keypoints, config.key_links))


def test_the_sheet_has_a_column_a_pose_and_the_points_below(
    pair: Callable[..., RobotConfig], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture, "_CELL", (60, 50))
    monkeypatch.setattr(picture, "_DETAIL", (40, 40))
    sheet = picture.draw(body_map(pair(keypoints=SWAPPED)))
    assert sheet.width >= len(POSES) * 60 and sheet.height >= 2 * 50 + 40
    red, green, blue = np.asarray(sheet, int).reshape(-1, 3).T
    assert (red > blue + 60).any() and (blue > red + 60).any() and (green > red + 40).any()  # left, right, front


def test_sides_are_shown_where_they_are_seen_from_the_chest(pair: Callable[..., RobotConfig]) -> None:
    """x forward, y left, z up: a chest that looks backwards, or a side that is wrong, puts left on the right."""
    backwards = {"link": "chest", "forward": [-1, 0, 0], "up": [0, 0, 1]}
    for keypoints, sign in (({}, 1.0), (SWAPPED, -1.0), ({"chest": backwards}, -1.0)):
        robot = body_map(pair(keypoints=keypoints))
        places = FigureMaker(robot).places(robot.robot.home())
        assert np.sign(places["left_shoulder"][1] - places["right_shoulder"][1]) == sign


def test_marks_lie_on_the_configs_points_in_the_colour_of_their_side(pair: Callable[..., RobotConfig]) -> None:
    robot = body_map(pair())
    maker = FigureMaker(robot)
    home = robot.robot.home()
    figure, places = maker.robot_figure(home), maker.places(home)
    for name, place_3 in places.items():
        near_S = np.linalg.norm(figure.marks.starts_S3 - place_3, axis=1) < 1e-5
        assert np.any(near_S & (figure.marks.colors_S3 == SIDE_COLORS[name.partition("_")[0]]).all(axis=1)), name


def test_limbs_of_human_and_robot_are_of_one_size(pair: Callable[..., RobotConfig]) -> None:
    robot = body_map(pair())
    maker, pose = FigureMaker(robot), human_poses()[0]
    places = maker.places(robot.robot.home())
    own = [places[f"left_{a}"] - places[f"left_{b}"] for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))]
    points = maker._human_points(pose)
    human = [points[f"left_{a}"] - points[f"left_{b}"] for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))]
    assert np.linalg.norm(own, axis=1).sum() == pytest.approx(np.linalg.norm(human, axis=1).sum(), rel=1e-3)


def test_a_sheet_is_known_again_and_nothing_else(tmp_path: Path) -> None:
    picture.save_picture(Image.new("RGB", (4, 4)), tmp_path / "ours.png")
    Image.new("RGB", (4, 4)).save(tmp_path / "photo.png")
    (tmp_path / "text.png").write_text("no picture")
    assert picture.is_our_picture(tmp_path / "ours.png")
    assert not any(picture.is_our_picture(tmp_path / name) for name in ("photo.png", "text.png", "none.png"))


def test_points_that_are_off_their_axes_say_how_far(pair: Callable[..., RobotConfig]) -> None:
    shifted = {"left_shoulder": {"link": "l_upper", "offset": [0.05, 0, 0]}}
    away = picture._distances(body_map(pair(keypoints=shifted)))
    assert away["left_shoulder"] == pytest.approx(0.05, abs=1e-3)
    assert away["right_shoulder"] == pytest.approx(0.0, abs=1e-3)


def test_a_robot_with_a_head_alone_is_drawn(pair: Callable[..., RobotConfig], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "_CELL", (40, 40))
    monkeypatch.setattr(picture, "_DETAIL", (40, 40))
    config = pair()
    robot = Robot.from_urdf(config.urdf, ["neck"], {"chest": "chest", "head": "head"}, ["head"])
    with torch.no_grad():
        assert picture.draw(BodyMap(robot)).width > 5 * 40
