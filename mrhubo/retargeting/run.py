"""Motion files one after the other: read, cut, answered, written; a bad one does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.fast.poses import check_frame_rate
from mrhubo.motion import Motion, ReadOptions, mirror, read_motion, resample, trim
from mrhubo.retargeting.answering import Answerer
from mrhubo.retargeting.places import Places
from mrhubo.retargeting.summary import Summary
from mrhubo.robot_motion import JointOrder, RobotMotion, in_order, write_lerobot, write_robot_motion
from mrhubo.robot_motion.lerobot import check_lerobot_rate
from mrhubo.robot_motion.span import check_span
from mrhubo.runtime.progress import Reporter


@dataclass(frozen=True)
class Request:
    """What is to be done with every motion."""

    options: ReadOptions = field(default_factory=ReadOptions)
    start: float = 0.0
    """First moment [s]."""
    end: float | None = None
    """Last moment [s]; None: the motion's end."""
    rate: float | None = None
    """Frames per second of the answer; None: the motion's."""
    mirrored: bool = False
    """Whether left and right are exchanged."""
    joint_order: JointOrder | None = None
    """Order of the joints in files; None: the robot's."""

    def __post_init__(self) -> None:
        """Raises a UserError where no motion could be answered so."""
        check_span(self.start, self.end)
        check_frame_rate(self.rate)

    def prepare(self, motion: Motion) -> Motion:
        """The motion that is to be answered.

        Raises:
            UserError: nothing is left of it, or the rate makes no sense.
        """
        motion = trim(motion, self.start, self.end)
        motion = motion if self.rate is None else resample(motion, self.rate)
        return mirror(motion) if self.mirrored else motion


@dataclass
class Outcome:
    """What became of some files."""

    summaries: list[Summary] = field(default_factory=list)
    """Of those that were answered and written, in order."""
    failures: dict[Path, str] = field(default_factory=dict)
    """Why the others were not, a sentence each that names the file."""


def retarget_files(
    files: Sequence[Path],
    answerer: Answerer,
    places: Places,
    request: Request,
    report: Reporter,
    tell: Callable[[str], None] = print,
) -> Outcome:
    """Retargets files and writes the answers.

    Args:
        files: of human motion.
        answerer: who answers.
        places: where the answers go.
        request: what is to be done with every motion.
        report: told of every file.
        tell: given sentences about every file; what is assumed of all alike is said once.

    Raises:
        UserError: a joint of the order is none of the robot, or a dataset of all answers cannot be written.
    """
    outcome, together, said = Outcome(), list[RobotMotion](), set[str]()

    def say(notes: Sequence[str]) -> None:
        for note in notes:
            if note not in said:
                said.add(note)
                tell(f"  {note}")

    if request.joint_order is not None:
        say(in_order(answerer.at_rest, request.joint_order)[1])
    with report.step("retargeting", len(files), "motions") as progress:
        for done, file in enumerate(files):
            progress.update(done, file.name)
            try:
                motion = request.prepare(read_motion(file, request.options))
                tell(f"{file}: {motion.source}; {len(motion)} frames at {motion.frame_rate:g} per second")
                for note in motion.notes:
                    tell(f"  {note}")
                if places.is_dataset:
                    check_lerobot_rate(motion.frame_rate, together[0].frame_rate if together else None)
                answer = answerer.answer(motion)
                if places.is_dataset:
                    together.append(answer)
                else:
                    path = places.path(motion.name)
                    say(write_robot_motion(answer, path, places.format, request.joint_order))
                    tell(f"  written: {path}")
                outcome.summaries.append(Summary.of(answer, answerer.limb_names))
            except UserError as error:
                outcome.failures[file] = str(error) if str(file) in str(error) else f"{file}: {error}"
                tell(f"{file}: not retargeted")
        progress.update(len(files))
    if together:
        order = request.joint_order
        write_lerobot([motion if order is None else in_order(motion, order)[0] for motion in together], places.out)
        tell(f"written: {places.out}, an episode a motion")
    return outcome
