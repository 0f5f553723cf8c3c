"""The step of a fit that measures what was trained, and the same for a package.

Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.evaluation import (
    Clip,
    Evaluation,
    evaluate_clips,
    latencies,
    mean_metrics,
    measures,
    motion_table,
    reshare_clips,
    run_metrics,
    table,
)
from mrhubo.fitting.first_look import unknown_collisions
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.references import make_references
from mrhubo.fitting.whole_body import ASKED, WholeBodyTable, score_ways
from mrhubo.motion import Motion
from mrhubo.reference import at_limit_share
from mrhubo.reference.standing import has_root
from mrhubo.retargeter import POLISH, Retargeter
from mrhubo.robot import Robot
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.threads import each_in_a_thread
from mrhubo.streaming import Stream

_STILL_RAD, _MOVING_RAD = 1e-5, 0.1
"""Range of the joints' angles over all test clips that counts as none, and as one that should be there."""
_AT_LIMITS = 0.99
"""Share of angles at a limit above which nothing can have been learned."""


_SUFFIX = ", re-shared"
"""The same clips with their rotations shared out otherwise among the joints (`mrhubo.motion.reshare`)."""


@dataclass(frozen=True)
class Way:
    """A way of answering motions."""

    prefix: str
    """Of the names of its measures in a run, after `test`."""
    answer: Callable[[Retargeter, Sequence[Motion]], list[Tensor]]
    """Joint angles (T, N) [rad] of each motion."""


_FRAMES, _CLIPS, _STREAM, _REFERENCE = "frame by frame", "whole clips", "stream", "reference"
_WAYS: Mapping[str, Way] = {
    "networks": Way("", lambda r, motions: [r.predict(m.local_TJ33) for m in motions]),
    _FRAMES: Way("retarget", lambda r, motions: each_in_a_thread(lambda m: _polished(r, m, None), motions)),
    _CLIPS: Way("clip", lambda r, motions: each_in_a_thread(lambda m: _polished(r, m, m.frame_rate), motions)),
    _STREAM: Way("stream", lambda r, motions: _streamed(r, motions)),
}
"""None avoids self-collision, nor stands on a floor, as the reference, which they are measured against, does not."""


def _streamed(retargeter: Retargeter, motions: Sequence[Motion]) -> list[Tensor]:
    if retargeter.standing is not None:
        motions = [motion.changed(root_rotation_T33=None, root_position_T3=None) for motion in motions]
    return [found.q for found in Stream(retargeter, settings=ASKED).retarget_all(motions)]


def _polished(retargeter: Retargeter, motion: Motion, frame_rate: float | None) -> Tensor:
    return retargeter.predict(motion.local_TJ33, POLISH, frame_rate, avoid_collisions=False)


@dataclass(frozen=True)
class Measured:
    """A retargeter's answers to the test clips and what they are worth."""

    predictions: Sequence[Tensor]
    """Joint angles (T, N) [rad] of every clip, the networks' alone."""
    ways: Mapping[str, Sequence[Evaluation]]
    """By the way of answering, to the clips as they are and to re-shared ones: clip by clip, then the means over clips
    and over frames."""
    networks_latency: Mapping[str, float]
    """Of the networks alone."""
    retarget_latency: Mapping[str, float]
    """With the steps of optimisation."""
    whole_body: WholeBodyTable | None = None
    """Of robots with feet, where the clips have a root."""

    @property
    def networks(self) -> Sequence[Evaluation]:
        """Of the networks alone, to the clips as they are."""
        return self.ways["networks"]

    @property
    def over_clips(self) -> Evaluation:
        """Of the networks alone, the mean over clips."""
        return self.networks[-2]

    @property
    def table(self) -> str:
        """For a person."""
        whole_body = f"\n\n{self.whole_body.text}" if self.whole_body else ""
        return f"{table(self.networks)}\n\n{motion_table(self.ways)}{whole_body}"

    @property
    def measures(self) -> dict[str, float]:
        """Of the networks alone, means over clips, by name."""
        return measures(self.over_clips)

    @property
    def metrics(self) -> dict[str, float]:
        """Under the names that a run has for them."""
        found = run_metrics(self.networks, self.networks_latency)
        for name, evaluations in self.ways.items():
            way, reshared = name.removesuffix(_SUFFIX), name.endswith(_SUFFIX)
            prefix = _REFERENCE if way == _REFERENCE else _WAYS[way].prefix
            parts = ["test", *(["reshared"] if reshared else []), *([prefix] if prefix else [])]
            found |= mean_metrics(evaluations, self.retarget_latency if name == _FRAMES else {}, "/".join(parts))
        for way, means in self.whole_body.means.items() if self.whole_body else ():
            known = {name: value for name, value in means.items() if math.isfinite(value)}
            found |= {f"test/{_WAYS[way].prefix}/whole_body/{name}": value for name, value in known.items()}
        return found


def measure(prepared: Prepared, report: Reporter, retargeter: Retargeter, clips: Sequence[Clip]) -> Measured:
    """Answers and scores in every way, and how long a frame takes."""
    sets = {"": clips, _SUFFIX: reshare_clips(clips)}
    asked = [clip for chosen in sets.values() for clip in chosen]
    found: dict[str, list[Tensor]] = {}
    with report.step("evaluation", len(_WAYS) * len(asked), "clips") as progress:
        for name, way in _WAYS.items():
            progress.update(len(found) * len(asked), name)
            # All at once: a stream takes as long for many people as for one.
            found[name] = way.answer(retargeter, [clip.motion for clip in asked])
        progress.update(len(_WAYS) * len(asked))
    ways: dict[str, Sequence[Evaluation]] = {}
    for i, (suffix, chosen) in enumerate(sets.items()):
        part = slice(i * len(clips), (i + 1) * len(clips))
        ways |= {name + suffix: _score(prepared, answers[part], chosen) for name, answers in found.items()}
    predictions = next(iter(found.values()))[: len(clips)]
    ways[_REFERENCE] = _score(prepared, [clip.reference_TN for clip in clips], clips)
    polished = functools.partial(retargeter.predict, polish=POLISH)
    spent = latencies(retargeter.predict, clips), latencies(polished, clips)
    return Measured(predictions, ways, *spent, _whole_body(retargeter, [clip.motion for clip in clips]))


def _whole_body(retargeter: Retargeter, motions: Sequence[Motion]) -> WholeBodyTable | None:
    """What becomes of the feet and of the way, of a robot with feet and of motions that have a root."""
    rooted = [motion for motion in motions if has_root(motion)]
    if retargeter.standing is None or not rooted:
        return None
    ways = {
        _CLIPS: lambda asked: [retargeter(motion, avoid_collisions=False) for motion in asked],
        _STREAM: Stream(retargeter, settings=ASKED).retarget_all,
    }
    return score_ways(retargeter.body_map, rooted, ways)


def _score(prepared: Prepared, predictions: Sequence[Tensor], clips: Sequence[Clip]) -> list[Evaluation]:
    return evaluate_clips(predictions, clips, prepared.body_map, prepared.config.robot.key_links)


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
    prepared: Prepared, report: Reporter, package: Path, validation: bool = False, polish: int | None = None
) -> str:
    """The tables of clips and their means, and the latency, of a package.

    Args:
        prepared: the robot, and the motions that measure.
        report: told of the clips.
        package: the folder that a fit ended with.
        validation: the validation clips in place of the test clips.
        polish: steps of optimisation after the networks, each frame on its own; None: the networks alone, then every
            way of answering.

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
    if polish is not None:
        predict = functools.partial(retargeter.predict, polish=polish, avoid_collisions=False)
        with report.step("evaluation", len(clips), "clips"):
            found = _score(prepared, [predict(clip.motion.local_TJ33) for clip in clips], clips)
        lines, latency = [table(found)], latencies(predict, clips)
    else:
        measured = measure(prepared, report, retargeter, clips)
        lines, latency = [measured.table], measured.networks_latency
    lines += unknown_collisions(body_map)
    one, many = latency.values()
    lines.append(f"latency, one thread: {one:.0f} us for one frame, {many:.1f} us a frame for 1,000 at once")
    return "\n".join([lines[0], "", *lines[1:]])
