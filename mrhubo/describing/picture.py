"""A sheet of the robot beside the human in the five poses, and of its joint centres from near.

What is wrong in a config is to be seen at a glance: colours say which side an entry names, figures are seen from the
chest, limbs in the human's colours run where the entries say, and rods show where the joints' axes really are.

Legend: P poses, N robot joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image, UnidentifiedImageError

from mrhubo.describing.figures import Figure, FigureMaker
from mrhubo.describing.poses import POSES, human_poses, pose_names
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.metrics import direction_error
from mrhubo.robot import BodyMap, Limb
from mrhubo.robot.parts import PELVIS
from mrhubo.view import Camera, common_cameras, contact_sheet, render, save_png

_MAKER = "mrhubo describe"
_CELL, _WHOLE_CELL, _DETAIL = (350, 300), (350, 430), (225, 235)
"""Pixels of a figure, of one with legs or a waist, and of a joint centre."""
_IN_A_ROW = 8
"""Pictures of joint centres beside each other."""
_NEAR_M = 0.30
"""Width [m] of the picture of a joint centre, at the human's size."""
_WIDE_M, _BELOW_M = (1.62, 2.2), 0.14
"""Least and greatest width [m] of the picture of a figure, and how far below the shoulders its middle is."""
_DETAIL_POSE = list(POSES).index("elbows at right angles")
_CAPTION = (
    "orange: what the config calls left; blue: right; green: where the chest looks, and the head; purple: joint axes."
    " Balls are the config's points: a shoulder's lies where the axes that turn the upper arm meet, an elbow's on its"
    " hinge."
)


def draw(body_map: BodyMap) -> Image.Image:
    """The sheet of a body map, which need not make sense."""
    whole_body = PELVIS.name in body_map.shared.views
    maker, poses_PJ33 = FigureMaker(body_map), human_poses(whole_body)
    q_PN, _ = OptimizationRetargeter(body_map).solve_frames(poses_PJ33)
    humans = [maker.human(pose_J33) for pose_J33 in poses_PJ33]
    robots = [maker.robot_figure(q_N) for q_N in q_PN]
    rows = _whole_rows(humans, robots) if whole_body else _upper_rows(humans, robots)
    names, errors = pose_names(whole_body), _errors(body_map, q_PN, poses_PJ33)
    titles = [f"{name}\n{off}" for name, off in zip(names, errors, strict=True)]
    figures = contact_sheet(rows, titles, ["human", body_map.robot.name])
    details = _details(body_map, maker, q_PN[_DETAIL_POSE])
    return contact_sheet([[figures], [details]], caption=_CAPTION, gap=4)


def _upper_rows(*rows: Sequence[Figure]) -> list[list[Image.Image]]:
    """Arms and heads from near."""
    wide = _width([figure for row in rows for figure in row])
    return [[_render(figure, _CELL, _upper_body(figure, wide)) for figure in row] for row in rows]


def _whole_rows(*rows: Sequence[Figure]) -> list[list[Image.Image]]:
    """Figures from head to foot, those of a row at one scale."""
    found = []
    for row in rows:
        cameras = common_cameras([figure.body for figure in row], _WHOLE_CELL)
        found.append([_render(figure, _WHOLE_CELL, camera) for figure, camera in zip(row, cameras, strict=True)])
    return found


def save_picture(sheet: Image.Image, path: Path) -> None:
    """Writes a sheet, so that `is_our_picture` knows it again."""
    save_png(sheet, path, _MAKER)


def is_our_picture(path: Path) -> bool:
    """Whether a file is a sheet that was drawn here, and may be drawn anew."""
    try:
        with Image.open(path, formats=["PNG"]) as picture:
            return picture.info.get("Software") == _MAKER
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, ValueError):
        return False


def _errors(body_map: BodyMap, q_PN: torch.Tensor, poses_PJ33: torch.Tensor) -> list[str]:
    """How far the limbs are off, in words, for each pose."""
    limbs = [isinstance(body_map.directions[column], Limb) for column in body_map.measured]
    off_PD = direction_error(body_map, q_PN, poses_PJ33)[:, torch.tensor(limbs)]
    if off_PD.shape[1] == 0:
        return [""] * len(q_PN)
    return [f"limbs {float(off_D.mean()):.0f}° off, at most {float(off_D.max()):.0f}°" for off_D in off_PD]


def _render(figure: Figure, size: tuple[int, int], camera: Camera, ground: str | None = "auto") -> Image.Image:
    picture = render(figure.body, size, camera, ground=ground)
    marks = render(figure.marks, size, camera, background=None, ground=None)
    picture.paste(marks, (0, 0), marks)
    return picture


def _width(figures: Sequence[Figure]) -> float:
    """Width [m] of a picture that shows the arms of all figures whole, as far as arms go."""
    right_3 = Camera().basis()[0]
    reach = [np.abs(np.array(figure.body.extent(right_3)) - figure.middle_3 @ right_3).max() for figure in figures]
    return float(np.clip(2.1 * max(reach), *_WIDE_M))


def _upper_body(figure: Figure, wide: float) -> Camera:
    """The camera that shows arms and head; a small picture of the whole robot is among the details."""
    x, y, z = figure.middle_3.tolist()
    return Camera(target=(x, y, z - _BELOW_M), width_m=wide)


def _details(body_map: BodyMap, maker: FigureMaker, q_N: torch.Tensor) -> Image.Image:
    """The whole robot, and every point of the config from near, with the axes around it."""
    figure, away = maker.robot_figure(q_N, 0.45, 0.6 * _NEAR_M, near=True), _distances(body_map)
    views = [Camera.framing(figure.body, _DETAIL, azimuth, 8.0) for azimuth in (0.0, 90.0)]
    whole = [render(figure.body, _DETAIL, camera) for camera in views]
    pictures, titles = whole, ["from the front", "from its left"]
    for name, place_3 in maker.places(q_N).items():
        camera = Camera(35.0, 25.0, (float(place_3[0]), float(place_3[1]), float(place_3[2])), _NEAR_M)
        pictures.append(_render(figure, _DETAIL, camera, None))
        shown = name.replace("_", " ")
        titles.append(f"{shown}\n{1000 * away[name]:.0f} mm from its axes" if name in away else shown)
    rows = -(-len(pictures) // _IN_A_ROW)
    count = -(-len(pictures) // rows)
    parts = [
        [contact_sheet([pictures[i : i + count]], titles[i : i + count], font_size=15)]
        for i in range(0, len(pictures), count)
    ]
    return parts[0][0] if rows == 1 else contact_sheet(parts, gap=4)


def _distances(body_map: BodyMap) -> Mapping[str, float]:
    """How far [m] the points of a config lie from where the axes alone put them, where these tell it."""
    found = {name: body_map.yardstick.distance(name, point) for name, point in body_map.keypoints.points.items()}
    return {name: distance for name, distance in found.items() if distance is not None}
