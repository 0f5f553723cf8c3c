"""A sheet of the robot beside the human in the five poses, for a look before hours of work.

Legend: P poses, N robot joints.
"""

from __future__ import annotations

import torch
from PIL import Image

from mrhubo.describing.figures import Figure, FigureMaker
from mrhubo.describing.poses import POSES, human_poses
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap
from mrhubo.view import Camera, common_cameras, contact_sheet, render

_CELL = (300, 310)


def draw(body_map: BodyMap) -> Image.Image:
    """The sheet of a body map, which need not make sense: what is wrong is to be seen."""
    maker, poses_PJ33 = FigureMaker(body_map), human_poses()
    q_PN, _ = OptimizationRetargeter(body_map).solve_frames(poses_PJ33)
    off_PD = _limb_errors(body_map, q_PN, poses_PJ33)
    humans = [maker.human(pose) for pose in poses_PJ33]
    robots = [maker.robot_figure(q_N) for q_N in q_PN]
    figures = [humans, robots]
    cameras = iter(common_cameras([figure.body for row in figures for figure in row], _CELL))
    rows = [[_render(figure, next(cameras)) for figure in row] for row in figures]
    titles = ["human", body_map.robot.name]
    return contact_sheet(rows, list(POSES), titles, "")


def _limb_errors(body_map: BodyMap, q_PN: torch.Tensor, poses_PJ33: torch.Tensor) -> torch.Tensor:
    from mrhubo.reference.metrics import direction_error

    return direction_error(body_map, q_PN, poses_PJ33)


def _render(figure: Figure, camera: Camera) -> Image.Image:
    picture = render(figure.body, _CELL, camera)
    marks = render(figure.marks, _CELL, camera, background=None, ground=None)
    picture.paste(marks, (0, 0), marks)
    return picture
