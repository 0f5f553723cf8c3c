"""The step of a fit that measures what was trained, and the same for a package.

Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, Evaluation, evaluate_clips, latencies, measures, table
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.references import make_references
from mrhubo.reference import at_limit_share
from mrhubo.retargeter import POLISH, Retargeter
from mrhubo.robot import Robot
from mrhubo.runtime.progress import Reporter

_STILL_RAD, _MOVING_RAD = 1e-5, 0.1
"""Range of the joints' angles over all test clips that counts as none, and as one that should be there."""
_AT_LIMITS = 0.99
"""Share of angles at a limit above which nothing can have been learned."""


@dataclass(frozen=True)
class Measured:
    """A retargeter's answers to the test clips and what they are worth."""

    predictions: Sequence[Tensor]
    """Joint angles (T, N) [rad] of every clip, the networks' alone."""
    networks: Sequence[Evaluation]
    """Of the networks alone: clip by clip, then the means over clips and over frames."""
    networks_latency: Mapping[str, float]
    retarget: Sequence[Evaluation]
    """Of `Retargeter.retarget`, which makes a step of optimisation after them."""
    retarget_latency: Mapping[str, float]

    @property
    def over_clips(self) -> Evaluation:
        """Of the networks alone, the mean over clips."""
        return self.networks[-2]

    @property
    def table(self) -> str:
        """For a person."""
        return table(self.networks, self.retarget)

    @property
    def measures(self) -> dict[str, float]:
        """Of the networks alone, means over clips, by name."""
        return measures(self.over_clips)


def measure(prepared: Prepared, report: Reporter, retargeter: Retargeter, clips: Sequence[Clip]) -> Measured:
    """Answers and scores of the networks alone and with the step of optimisation, and how long both take."""
    polished = functools.partial(retargeter.predict, polish=POLISH)
    with report.step("evaluation", 2 * len(clips), "clips") as progress:
        progress.update(0)
        predictions, networks = _score(prepared, retargeter.predict, clips)
        progress.update(len(clips))
        _, retarget = _score(prepared, polished, clips)
        progress.update(2 * len(clips))
    return Measured(predictions, networks, latencies(retargeter.predict, clips), retarget, latencies(polished, clips))


def _score(
    prepared: Prepared, predict: Callable[[Tensor], Tensor], clips: Sequence[Clip]
) -> tuple[list[Tensor], list[Evaluation]]:
    predictions = [predict(clip.motion.local_TJ33) for clip in clips]
    return predictions, evaluate_clips(predictions, clips, prepared.body_map, prepared.config.robot.key_links)


def refuse_useless(clips: Sequence[Clip], predictions: Sequence[Tensor], robot: Robot, remedy: str) -> None:
    """Refuses answers that no training should end with.

    Args:
        clips: of the test.
        predictions: joint angles (T, N) [rad] for each.
        robot: whose.
        remedy: what to do about it.

    Raises:
        UserError: they hold NaN; or, unlike the reference's, they stand at the limits of all joints in nearly all
            frames, or never move.
    """
    q_TN, reference_TN = torch.cat(list(predictions)), torch.cat([clip.reference_TN for clip in clips])
    at_limits, reference_at_limits = (float(at_limit_share(robot, q).mean()) for q in (q_TN, reference_TN))
    moved, reference_moved = (float((q.amax(dim=0) - q.amin(dim=0)).max()) for q in (q_TN, reference_TN))
    faults = {
        "are no numbers": not bool(torch.isfinite(q_TN).all()),
        "stand at the joints' limits in all frames": at_limits > _AT_LIMITS > reference_at_limits,
        "never move": moved < _STILL_RAD < _MOVING_RAD < reference_moved,
    }
    found = [fault for fault, there in faults.items() if there]
    if found:
        raise UserError(f"the training has learned nothing: on the test clips its answers {found[0]}; {remedy}")


def measure_package(
    prepared: Prepared, report: Reporter, package: Path, validation: bool = False, polish: int = 0
) -> str:
    """The table of clips and their means, and the latency, of a package.

    Args:
        prepared: the robot, and the motions that measure.
        report: told of the clips.
        package: the folder that a fit ended with.
        validation: the validation clips in place of the test clips.
        polish: steps of optimisation after the networks.

    Raises:
        UserError: the package cannot be used, or is of another robot.
    """
    retargeter = Retargeter.load(package)
    body_map, own = prepared.body_map, retargeter.body_map.robot
    same = own.description.kinematics == body_map.robot.description.kinematics
    if not same or own.joint_names != body_map.robot.joint_names:
        config = prepared.config.robot
        raise UserError(
            f"{package}: was made for another robot or other joints ('{own.name}': {', '.join(own.joint_names)}) than"
            f" the config's ('{config.name}': {', '.join(config.joints)})"
        )
    differ = retargeter.body_map.keypoints.differences(body_map.keypoints)
    if differ:
        raise UserError(
            f"{package}: was made with other links or offsets for {', '.join(differ)} than robot.keypoints of "
            "the config has; measured against each other, they would tell nothing"
        )
    clips = make_references(prepared, report)[0 if validation else 1]
    predictions = []
    with report.step("evaluation", len(clips), "clips") as progress:
        for done, clip in enumerate(clips, start=1):
            predictions.append(retargeter.predict(clip.motion.local_TJ33, polish))
            progress.update(done, clip.name)
    found = evaluate_clips(predictions, clips, body_map, prepared.config.robot.key_links)
    one, many = latencies(lambda pose: retargeter.predict(pose, polish), clips).values()
    lines = [table(found), ""]
    if links := body_map.collision.uncovered:
        lines.append(f"collision: {len(links)} links have meshes for collision, which are not read: {', '.join(links)}")
    lines.append(f"latency, one thread: {one:.0f} us for one frame, {many:.1f} us a frame for 1,000 at once")
    return "\n".join(lines)
