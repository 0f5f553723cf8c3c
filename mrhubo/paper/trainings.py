"""Does the trainings that the paper's tables need, and puts the tables together."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mrhubo.baselines.s3le.experiment import run_baseline
from mrhubo.config import BaselineConfig, fingerprint, to_plain
from mrhubo.errors import UserError
from mrhubo.fitting.fit import fit
from mrhubo.fitting.preparation import prepare, tracking_dir
from mrhubo.fitting.record import read_predictions
from mrhubo.fitting.references import make_references
from mrhubo.paper.tables import ALL_METHODS, BASELINE, METHODS, OUR_DEFAULT, Part, chart, parts, tables
from mrhubo.runtime.locations import default_capture, project_root
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.provenance import git_commit
from mrhubo.runtime.runs import ending, find_run, reopen, start_run
from mrhubo.runtime.tracking import open_client
from mrhubo.view.pictures import Artist, liveliness

if TYPE_CHECKING:
    from mlflow.entities import Run
    from PIL.Image import Image

    from mrhubo.runtime.client import TrackingClient


def reproduce(
    robots: Sequence[str],
    seeds: int,
    overrides: Sequence[str],
    report: Reporter = SILENT,
    paper: bool = False,
    methods: Sequence[str] | None = None,
) -> str:
    """Does what is not done yet and returns the tables.

    Args:
        robots: names of shipped robots.
        seeds: trainings of each kind.
        overrides: `key.sub=value` for all of them.
        report: told what is trained, and of its steps.
        paper: with the paper's settings in place of ours.
        methods: columns of the tables; default: all.

    Raises:
        UserError: a robot, a method or a setting is wrong, or S3LE is asked for by name and has nothing to learn from
            (before any work).
        KeyboardInterrupt: the user stopped it; the same call goes on.
    """
    capture = default_capture()
    if methods is None and not capture.is_file():
        methods = tuple(METHODS)
        report.say(f"S3LE is left out: it learns from human motion capture, and {capture} does not exist")
    work = parts(robots, seeds, overrides, ALL_METHODS if methods is None else methods, paper)
    if not capture.is_file() and any(part.method == BASELINE for part in work):
        raise UserError(f"command line: --methods: S3LE learns from human motion capture, and {capture} does not exist")
    client, parent = _open_parent(work)
    start, results, first = time.monotonic(), {}, {}
    with ending(client, parent):
        for part in work:
            run = _run_of(part, client, parent, report)
            measures = {k.removeprefix("test/"): v for k, v in run.data.metrics.items() if k.startswith("test/")}
            results.setdefault((part.robot, part.method), []).append(measures)
            if part.seed == 0:
                first.setdefault(part.robot, []).append((part, run.info.run_id))
        text = tables({key: results[key] for key in sorted(results, key=lambda key: robots.index(key[0]))})
        client.log_text(parent, text + "\n", "tables.md")
        client.log_image(parent, chart(results), artifact_file="errors.png")
        for robot, runs in first.items():
            picture = _key_poses(client, runs, report)
            if picture is not None:
                client.log_image(parent, picture, artifact_file=f"key_poses_{robot}.png")
        client.log_metric(parent, "seconds", time.monotonic() - start)
    return text


def _open_parent(work: Sequence[Part]) -> tuple[TrackingClient, str]:
    """The run that all trainings belong to: that of an earlier call with the same settings, or a new one."""
    config = work[0].config
    tags = {
        "reproduce": fingerprint([[part.robot, part.method, part.seed, to_plain(part.config)] for part in work]),
        "git_commit": git_commit(project_root()),
    }
    folder = tracking_dir(config)
    name = f"reproduce {', '.join(dict.fromkeys(part.robot for part in work))}"
    client = open_client(folder, config.tracking.experiment, config.tracking.uri)
    found = find_run(client, config.tracking.experiment, {"reproduce": tags["reproduce"]})
    if found is None:
        found = start_run(client, config.tracking.experiment, name, tags)
    else:
        reopen(client, found)
    return client, found.info.run_id


def _key_poses(client: TrackingClient, runs: Sequence[tuple[Part, str]], report: Reporter) -> Image | None:
    """Human, reference, and what the two-stage network and the baseline made of one test clip, as in the paper's
    figure 3; None if no run has kept its answers.
    """
    shown = {part.method: run for part, run in runs if part.method in ("proposed", OUR_DEFAULT, BASELINE)}
    found = {method: read_predictions(client, run) for method, run in shown.items()}
    prepared = prepare(runs[0][0].config)
    clip = max(make_references(prepared, report)[1], key=liveliness)
    answers = {method: answer[clip.name] for method, answer in found.items() if clip.name in answer}
    artist = Artist(prepared.body_map.robot, prepared.body_map.skeleton)
    return artist.key_poses(clip, answers) if answers else None


def _run_of(part: Part, client: TrackingClient, parent: str, report: Reporter) -> Run:
    """A finished run with the same settings, pairs, prior and motions, or that of a new fit."""
    wanted = {"config_fingerprint": prepare(part.config).fingerprint}
    experiment = part.config.tracking.experiment
    run = find_run(client, experiment, wanted, finished=True)
    if run is None:
        report.say(f"{part.robot}, {part.method}, seed {part.seed}")
        if isinstance(part.config, BaselineConfig):
            run_baseline(part.config, report, parent)
        else:
            fit(part.config, report, parent)
        run = find_run(client, experiment, wanted, finished=True)
    if run is None:
        raise UserError(f"{part.robot}, {part.method}: the run of this training is not in the tracking database")
    return run
