"""A stage as pictures, films and sheets, by the painter: no browser, no window, no graphics card.

Figures stand in columns, and each keeps to the middle of its own: the camera follows who walks. Legend: T frames.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL.Image import Image

from mrhubo.body import KEYPOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.frames import base_to_human
from mrhubo.view import Solids, animated_frames, figure_sheet, human_solids, save_gif, save_png
from mrhubo.view.robot import RobotShape
from mrhubo.viewer.film import save_mp4
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.person import Person
from mrhubo.viewer.spots import SPOT_COLOR, SPOT_HEIGHT_M, spots_of
from mrhubo.viewer.stage import Stage, Standing

FILM_RATE = 30.0
"""Frames per second of a film at most: whole frames are left out."""
GIF_RATE = 15.0
_MOST_GIF = 600
"""Frames of a GIF: they are in memory all at once."""
_MOMENTS = 6
"""Columns of a sheet."""


def columns(stage: Stage, times: Sequence[float]) -> list[list[Solids]]:
    """The figures of a stage at some moments [s], each where it stands but for its way on the floor."""
    figures: list[Person | Performance] = [*([] if stage.person is None else [stage.person]), *stage.robots]
    found = []
    for figure, standing in zip(figures, stage.standings, strict=True):
        frames = [stage.frame_of(figure, time) for time in times]
        draw = _person_solids if isinstance(figure, Person) else _robot_solids
        solids = draw(figure, standing, frames)  # pyright: ignore[reportArgumentType]
        spots = _spots(figure, standing, frames)
        found.append([Solids.concatenate(pair) for pair in zip(solids, spots, strict=True)])
    return found


def _spots(figure: Person | Performance, standing: Standing, frames: Sequence[int]) -> list[Solids]:
    """Discs under planted feet."""
    spots = spots_of(figure, standing)
    if spots is None:
        return [Solids.empty() for _ in frames]
    half_3, found = np.array([0.0, 0.0, SPOT_HEIGHT_M / 2]), list[Solids]()
    for frame in frames:
        seen_P = spots.planted_TP[frame]
        place_P3 = spots.place_TP3[frame, seen_P] - standing.pose_T44[frame, :3, 3] * [1.0, 1.0, 0.0]
        radius_P, count = spots.radius_P[seen_P], int(seen_P.sum())
        color_P3 = np.tile(SPOT_COLOR, (count, 1))
        found.append(
            Solids(place_P3 - half_3, place_P3 + half_3, radius_P, color_P3, radius_P, np.ones(count, dtype=bool))
        )
    return found


def _in_place(standing: Standing, frames: Sequence[int]) -> np.ndarray:
    pose_T44 = standing.pose_T44[list(frames)]
    pose_T44[:, :2, 3] = 0.0
    return pose_T44


def _person_solids(person: Person, standing: Standing, frames: Sequence[int]) -> list[Solids]:
    pose_T44 = _in_place(standing, frames)
    points_TK3 = person.points_TK3[list(frames)] @ pose_T44[:, :3, :3].swapaxes(-1, -2) + pose_T44[:, None, :3, 3]
    return [human_solids(base_to_human(points_K3), KEYPOINT_NAMES) for points_K3 in points_TK3]


def _robot_solids(robot: Performance, standing: Standing, frames: Sequence[int]) -> list[Solids]:
    shape = RobotShape(robot.robot.description)
    names, poses_TL44 = robot.links()
    poses_TL44 = poses_TL44[list(frames)]
    base_T44 = _in_place(standing, frames)
    poses_TL44[..., :3, 3] /= robot.scale  # shapes are drawn at their own size, and then made larger
    if len(frames):
        first = shape.solids(dict(zip(names, poses_TL44[0], strict=True)))
        shape = shape.coarser(float(np.ptp(first.bounds()[:, 2])))
    return [
        shape.solids(dict(zip(names, poses_L44, strict=True))).scaled(robot.scale).transformed(base_44)
        for poses_L44, base_44 in zip(poses_TL44, base_T44, strict=True)
    ]


def film_times(stage: Stage, most_rate: float) -> tuple[list[float], float]:
    """Moments [s] of a film's frames and their rate: every frame of the clock, or every second, third and so on."""
    stride = max(1, int(np.ceil(stage.frame_rate / most_rate - 1e-6)))
    return [frame / stage.frame_rate for frame in range(0, stage.frames, stride)], stage.frame_rate / stride


def film_frames(stage: Stage, times: Sequence[float], title: str) -> Iterator[Image]:
    """A picture a moment [s], one after the other."""
    captions = [_caption(stage, title, time) for time in times]
    return animated_frames(columns(stage, times), _titles(stage), captions)


def _titles(stage: Stage) -> list[str]:
    return [*([] if stage.person is None else ["human"]), *(robot.label for robot in stage.robots)]


def _caption(stage: Stage, title: str, time: float) -> str:
    """The moment, and how sure each robot is."""
    sure = [
        f"{robot.label} {robot.motion.confidence[stage.frame_of(robot, time)]:.2f}"
        for robot in stage.robots
        if robot.motion.confidence is not None
    ]
    return f"{title}, {time:.1f} s" + (f"\nconfidence: {', '.join(sure)}" if sure else "")


def save_pictures(stage: Stage, path: Path, title: str) -> int:
    """Writes a stage as a film (.mp4, .gif) or as a sheet of six moments (.png), whole or not at all.

    Returns:
        How many frames, or moments, there are.

    Raises:
        UserError: PyAV is needed and not installed, the GIF would be too long, or the disk refuses.
    """
    if path.suffix.lower() == ".png":
        times = [share * stage.duration for share in np.linspace(0.0, 1.0, min(_MOMENTS, stage.frames))]
        save_png(_sheet(stage, times, title), path)
        return len(times)
    times, rate = film_times(stage, GIF_RATE if path.suffix.lower() == ".gif" else FILM_RATE)
    if path.suffix.lower() == ".mp4":
        return save_mp4(film_frames(stage, times, title), path, rate)
    if len(times) > _MOST_GIF:
        raise UserError(
            f"{path}: {len(times)} frames are more than a GIF of {_MOST_GIF}; name an .mp4 file, or give --to"
        )
    save_gif(list(film_frames(stage, times, title)), path, rate)
    return len(times)


def _sheet(stage: Stage, times: Sequence[float], title: str) -> Image:
    moments = [f"{time:.1f} s" for time in times]
    return figure_sheet(columns(stage, times), moments, _titles(stage), title, ground=0.0)
