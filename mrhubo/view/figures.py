"""Figures side by side: a human from a pose, tables of figures at one scale, and the same in motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
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
    local_J33: Tensor, skeleton: Skeleton | None = None, color: Color = HUMAN_COLOR, skin: Color | None = SKIN_COLOR
) -> Solids:
    """A human in a pose, local rotations (21, 3, 3); colours as for `human_solids`."""
    with torch.no_grad():
        matrices = rotation.orthonormal(local_J33[None].float())
        points = (skeleton or Skeleton()).keypoints(matrices)[0]
    return human_solids(points.numpy(), KEYPOINT_NAMES, color, skin)


def figure_sheet(
    rows: Sequence[Sequence[Solids]],
    columns: Sequence[str] = (),
    titles: Sequence[str] = (),
    caption: str = "",
    size: tuple[int, int] = (220, 260),
    ground: float | None = None,
) -> Image:
    """A table of figures, all at one scale, with titles above columns and beside rows; `size` of a cell in pixels,
    `ground` as for `common_cameras`.
    """
    cameras = iter(common_cameras([figure for row in rows for figure in row], size, ground=ground))
    floor = "auto" if ground is None else ground
    pictures = [[render(figure, size, next(cameras), ground=floor) for figure in row] for row in rows]
    return contact_sheet(pictures, columns, titles, caption)


def figure_animation(
    columns: Sequence[Sequence[Solids]],
    titles: Sequence[str],
    captions: Sequence[str],
    size: tuple[int, int] = (200, 270),
) -> list[Image]:
    """Frames of moving figures side by side; arguments and errors as for `animated_frames`."""
    return list(animated_frames(columns, titles, captions, size))


def animated_frames(
    columns: Sequence[Sequence[Solids]],
    titles: Sequence[str],
    captions: Sequence[str],
    size: tuple[int, int] = (200, 270),
) -> Iterator[Image]:
    """Frames of moving figures side by side, all at one scale; the camera and the floor stand still. They are drawn one
    by one, when they are asked for.

    Args:
        columns: the figures of each column, one a frame.
        titles: above the columns.
        captions: below each frame.
        size: of a cell, in pixels.

    Raises:
        ValueError: there is no frame, or a column has not as many figures as there are captions.
    """
    if not captions or any(len(figures) != len(captions) for figures in columns):
        raise ValueError(f"figure_animation: columns of {[len(c) for c in columns]} figures, {len(captions)} captions")
    paths = [Solids.concatenate(figures) for figures in columns]
    cameras = common_cameras(paths, size)
    floors = [path.extent(np.array([0.0, 0.0, 1.0]))[0] for path in paths]
    for figures, caption in zip(zip(*columns, strict=True), captions, strict=True):
        views = zip(figures, cameras, floors, strict=True)
        row = [render(figure, size, camera, ground=floor) for figure, camera, floor in views]
        yield contact_sheet([row], titles, caption=caption)
