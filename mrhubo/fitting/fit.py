"""A fit from its config to the package: the steps of `mrhubo.fitting` strung together."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

from mrhubo.callbacks import ScaleFactorSearch
from mrhubo.config import Config
from mrhubo.errors import UserError
from mrhubo.evaluation import latencies, measures, table
from mrhubo.fitting import pipeline
from mrhubo.fitting.pipeline import Prepared
from mrhubo.fitting.record.recording import Recording
from mrhubo.retargeter import POLISH, Retargeter
from mrhubo.runtime.progress import Progress
from mrhubo.runtime.ranks import Ranks
from mrhubo.runtime.workspace import Workspace


@dataclass(frozen=True)
class FitResult:
    """What a fit leaves behind."""

    package: Path
    model: str
    """URI of the model version in MLflow's registry, or why there is none."""
    run_id: str
    table: str
    measures: dict[str, float]


def fit(config: Config, quiet: bool = False, parent: str | None = None) -> FitResult | None:
    """Runs all steps; what an earlier, interrupted call finished is not done again. `parent`: the id of the MLflow run
    that this one belongs to.

    Started by torchrun or SLURM, all ranks make pairs and train; the first does the rest, the others get None.

    Raises:
        UserError: anything in the config or the files it names is wrong (before any work).
        KeyboardInterrupt: the user stopped it; the same call resumes.
    """
    prepared = pipeline.prepare(config, search=True)
    folder = Recording.folder(config)
    ranks = Ranks.join(config.trainer.accelerator)
    if ranks.count > 1 and config.robot.scale == "search":
        raise UserError("robot.scale: 'search' runs in one process; run it once, then train with what it found")
    if config.trainer.batch_size % ranks.count:
        raise UserError(f"trainer.batch_size: must be a multiple of the {ranks.count} processes that share each batch")
    workspace = Workspace(folder / "fits", config.robot.name, prepared.fingerprint)
    if ranks.rank > 0:
        _help(prepared, workspace, ranks)
        return None
    with workspace:
        with Recording.start(prepared, workspace, parent) as recording:
            watchers = []
            if config.robot.scale == "search":
                search = _search_scale(prepared, recording, quiet)
                prepared, watchers = recording.prepared, [search]
            report = pipeline.make_pairs(prepared, quiet, ranks)
            validation, test = pipeline.make_references(prepared, quiet)
            ranks.wait()
            resume = workspace.last_checkpoint()
            training = pipeline.train(
                prepared, validation, recording.logger, workspace.checkpoints, resume, quiet, ranks, watchers
            )
            recording.resume_after_training()
            recording.pairs(training.pairs, training.filter, report)
            retargeter = Retargeter(
                training.network, prepared.body_map, prepared.prior, prepared.config, training.filter.threshold
            )
            polished = functools.partial(retargeter.predict, polish=POLISH)
            predictions, scores = pipeline.score_test(prepared, retargeter.predict, test)
            _, retarget = pipeline.score_test(prepared, polished, test)
            recording.scores(
                scores,
                latencies(retargeter.predict, test),
                retarget,
                latencies(polished, test),
                training.best_link_cm,
            )
            recording.key_poses(test, predictions)
            recording.animation(test, predictions)
            over_clips = scores[-2]
            package = recording.package(retargeter, over_clips, training.best_checkpoint)
            model = recording.register(retargeter, over_clips, test[0])
            workspace.finish()
        return FitResult(package, model, recording.run_id, table(scores, retarget), measures(over_clips))


def _search_scale(prepared: Prepared, recording: Recording, quiet: bool) -> ScaleFactorSearch:
    """Finds the scale factor, and goes on with a config that has it."""
    config, settings = prepared.config, prepared.config.robot.search
    assert settings is not None
    validation, _ = pipeline.make_references(prepared, quiet)
    search = ScaleFactorSearch(config, prepared.body_map, prepared.prior, validation, recording.folder(config))
    with Progress("scale factor", settings.trials, "trials", quiet) as progress:
        result = search.search(recording.client, config.tracking.experiment, recording.run_id, progress.update)
    recording.scale(pipeline.prepare(result.config), result)
    return search


def _help(prepared: Prepared, workspace: Workspace, ranks: Ranks) -> None:
    """What all ranks but the first do: pairs and training, in step with the first."""
    pipeline.make_pairs(prepared, True, ranks)
    ranks.wait()  # the first has solved the references and readied the workspace
    validation, _ = pipeline.make_references(prepared, True)
    pipeline.train(prepared, validation, False, workspace.checkpoints, workspace.last_checkpoint(), True, ranks)
