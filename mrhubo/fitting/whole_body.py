"""Whole bodies measured: answers to motions with a root, as whole motions and as streams."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace

from mrhubo import rotation
from mrhubo.config import Config
from mrhubo.errors import UserError
from mrhubo.evaluation import load_motions
from mrhubo.evaluation.whole_body import WholeBodyScore, mean_whole_body, score_whole_body
from mrhubo.fitting.preparation import tracking_dir
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.standing import has_root
from mrhubo.retargeter import RetargetResult
from mrhubo.robot import BodyMap, build_body_map
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.runs import ending, log_all, start_run
from mrhubo.runtime.tables import aligned
from mrhubo.runtime.tracking import open_client
from mrhubo.streaming import Stream, StreamSettings

_HEADS = {
    "knee_deg": ("thighs [deg]", "{:.1f}"),
    "ankle_deg": ("shins [deg]", "{:.1f}"),
    "trunk_deg": ("chest [deg]", "{:.1f}"),
    "foot_deg": ("feet [deg]", "{:.1f}"),
    "elbow_deg": ("upper arms", "{:.1f}"),
    "wrist_deg": ("forearms", "{:.1f}"),
    "slide_cm_s": ("slide [cm/s]", "{:.1f}"),
    "human_slide_cm_s": ("own", "{:.1f}"),
    "sunk": ("sunk", "{:.1%}"),
    "sunk_max_cm": ("most [cm]", "{:.1f}"),
    "body_sunk": ("body sunk", "{:.1%}"),
    "body_sunk_max_cm": ("most [cm]", "{:.1f}"),
    "floating": ("floats", "{:.1%}"),
    "floating_max_cm": ("most [cm]", "{:.1f}"),
    "height_cm": ("height [cm]", "{:.2f}"),
    "path_cm_m": ("path [cm/m]", "{:.1f}"),
    "heading_deg": ("heading [deg]", "{:.1f}"),
    "speed_max": ("speed/limit", "{:.2f}"),
    "jumps": ("jumps", "{:.0f}"),
}
Answer = OptimizationResult | RetargetResult
Ways = Mapping[str, Callable[[Sequence[Motion]], Sequence[Answer]]]
ASKED = StreamSettings(avoid_collisions=False)
"""Of streams that are measured: nothing gives way to self-collision, as the reference does not either."""


def measure_optimiser(config: Config, report: Reporter, validation: bool = False) -> str:
    """The table of the optimiser's whole-body answers, a row a clip and the mean, for whole motions and for streams;
    the means are kept in a run of MLflow, as `reference/whole_body/MEASURE` and `stream/whole_body/MEASURE`.

    Args:
        config: of a robot with feet.
        report: told of the clips.
        validation: the validation clips in place of the test clips.

    Raises:
        UserError: the robot has no feet, or no clip has a root; or as for a fit, of the config and the motions.
    """
    body_map = build_body_map(config.robot)
    if not body_map.keypoints.standing:
        raise UserError("robot.keypoints: names no feet; --optimiser measures whole bodies, see docs/whole-body.md")
    found = load_motions(config, body_map.skeleton)
    motions = [motion for motion in (found.validation if validation else found.test) if has_root(motion)]
    if not motions:
        raise UserError(f"evaluation.motions: no clip of {found.folder} tells a root, and whole bodies need one")
    optimiser = OptimizationRetargeter(body_map, config.evaluation.smoothness)
    stream = Stream(optimiser, settings=ASKED)
    ways: Ways = {"reference": lambda asked: [optimiser(motion) for motion in asked], "stream": stream.retarget_all}
    with report.step("evaluation", len(ways) * len(motions), "clips") as progress:
        tables = []
        for number, way in enumerate(ways):
            progress.update(number * len(motions), way)
            tables.append(score_ways(body_map, motions, {way: ways[way]}))
        progress.update(len(ways) * len(motions))
    _keep(config, {way: means for table in tables for way, means in table.means.items()})
    return "\n\n".join(table.text for table in tables)


@dataclass(frozen=True)
class WholeBodyTable:
    """Ways of answering motions with a root, measured."""

    text: str
    """A table a way: a row a motion, and their mean."""
    means: Mapping[str, Mapping[str, float]]
    """The means over motions by way, as of `mean_whole_body`."""


def score_ways(body_map: BodyMap, motions: Sequence[Motion], ways: Ways) -> WholeBodyTable:
    """Measures of a robot with feet.

    Args:
        body_map: the robot's.
        motions: with a root.
        ways: who answers them, by name.
    """
    tables, means = [], {}
    for way, answer in ways.items():
        scores = [_score(body_map, *pair) for pair in zip(motions, answer(motions), strict=True)]
        means[way] = mean_whole_body(scores)
        tables.append("\n".join(_table(way, motions, scores, means[way])))
    return WholeBodyTable("\n\n".join(tables), means)


def _score(body_map: BodyMap, motion: Motion, answer: Answer) -> WholeBodyScore:
    assert answer.root_position is not None and answer.root_quaternion_wxyz is not None
    base_T33 = rotation.wxyz_to_matrix(answer.root_quaternion_wxyz)
    return score_whole_body(body_map, motion, answer.q, answer.root_position, base_T33)


def _table(
    way: str, motions: Sequence[Motion], scores: Sequence[WholeBodyScore], mean: Mapping[str, float]
) -> list[str]:
    rows = [(motion.name, mean_whole_body([score])) for motion, score in zip(motions, scores, strict=True)]
    known = [SimpleNamespace(name=name, **{**dict.fromkeys(_HEADS, math.nan), **row})
             for name, row in [*rows, ("mean over clips", mean)]]  # fmt: skip
    return aligned(way, known, _HEADS)


def _keep(config: Config, means: Mapping[str, Mapping[str, float]]) -> None:
    client = open_client(tracking_dir(config), config.tracking.experiment, config.tracking.uri)
    tags = {"robot": config.robot.name, "kind": "whole body"}
    run_id = start_run(client, config.tracking.experiment, f"{config.robot.name}, whole body", tags).info.run_id
    known = {f"{way}/whole_body/{name}": value for way, row in means.items() for name, value in row.items()}
    with ending(client, run_id):
        log_all(client, run_id, {name: value for name, value in known.items() if math.isfinite(value)})
