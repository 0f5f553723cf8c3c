"""A test clip in motion, in a fit's run: a page to look at from all sides where viser is installed, else a GIF.

Legend: T frames, N robot joints.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from pathlib import Path

from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.evaluation import Clip
from mrhubo.fitting.record.recording import Recording
from mrhubo.motion import Motion
from mrhubo.robot import Robot, robot_facts
from mrhubo.robot_motion import RobotMotion
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.runs import log_file
from mrhubo.view import pictures, save_gif
from mrhubo.viewer import Stage, arrange, perform, read_person
from mrhubo.viewer.page import page_text

PAGE_RATE = 30.0
"""Frames per second of a page at most: whole frames are left out."""
PAGE_SECONDS = 20.0
"""Of a clip, from its middle."""


def log_moving(recording: Recording, report: Reporter, clip: Clip, q_TN: Tensor) -> None:
    """Human, reference and `q_TN` [rad] side by side: `test/CLIP.html`, or, where viser is not installed or cannot
    work, `test/CLIP.gif` and a sentence that says why.
    """
    artist, answers = recording.artist, {"mrhubo": q_TN}
    try:
        page = page_text(clip_stage(artist.robot, clip, answers), artist.clip_title(clip))
        ending, write = "html", functools.partial(Path.write_text, data=page, encoding="utf-8")
    except UserError as error:
        report.say(f"the liveliest test clip is kept as a GIF, and not as a page: {error}")
        frames = artist.animation(clip, answers)
        ending, write = "gif", functools.partial(save_gif, frames, frame_rate=pictures.GIF_RATE)
    log_file(recording.client, recording.run_id, f"test/{clip.name}.{ending}", write)


def clip_stage(robot: Robot, clip: Clip, predictions: Mapping[str, Tensor]) -> Stage:
    """The middle of a clip: human, reference, and predictions (T, N) [rad] by their names."""
    motion = clip.motion
    stride = max(1, math.ceil(motion.frame_rate / PAGE_RATE - 1e-6))
    shown = min(len(motion), 1 + round(PAGE_SECONDS * motion.frame_rate))
    first = (len(motion) - shown) // 2
    frames = slice(first, first + shown, stride)
    rate = motion.frame_rate / stride
    person = read_person(Motion(motion.name, motion.local_TJ33[frames], rate))  # in place, as the robots are
    figures = [
        perform(
            name, robot,
            RobotMotion(q_TN[frames].numpy(), tuple(robot.joint_names), rate, robot=robot_facts(robot, made_by, "")),
        )
        for name, made_by, q_TN in (
            ("reference", "the optimiser", clip.reference_TN),
            *((name, "the networks", q_TN) for name, q_TN in predictions.items()),
        )
    ]  # fmt: skip
    return arrange(person, figures)
