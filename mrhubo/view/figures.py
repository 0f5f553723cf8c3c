"""Figures side by side: a human from a pose, and tables of figures drawn at one scale."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from PIL.Image import Image
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.view.camera import common_cameras
from mrhubo.view.human import HUMAN_COLOR, SKIN_COLOR, human_solids
from mrhubo.view.painter import render
from mrhubo.view.sheets import contact_sheet
from mrhubo.view.solids import Color, Solids


def human_figure(
    pose_J6: Tensor, skeleton: Skeleton | None = None, color: Color = HUMAN_COLOR, skin: Color | None = SKIN_COLOR
) -> Solids:
    """A human in a pose (21, 6); colours as for `human_solids`."""
    with torch.no_grad():
        matrices = rotation.sixd_to_matrix(pose_J6[None].float())
        points = (skeleton or Skeleton()).keypoints(matrices)[0]
    return human_solids(points.numpy(), KEYPOINT_NAMES, color, skin)


def figure_sheet(
    rows: Sequence[Sequence[Solids]],
    columns: Sequence[str] = (),
    titles: Sequence[str] = (),
    caption: str = "",
    size: tuple[int, int] = (220, 260),
) -> Image:
    """A table of figures, all at one scale, with titles above columns and beside rows; `size` of a cell in pixels."""
    cameras = iter(common_cameras([figure for row in rows for figure in row], size))
    pictures = [[render(figure, size, next(cameras)) for figure in row] for row in rows]
    return contact_sheet(pictures, columns, titles, caption)
