"""A fit from its config to the package: its steps, one after the other.

prepare        everything that a user can get wrong is checked            preparation
look           the reference's answer to one motion shows the mapping      first_look
references     the reference retargeter answers the motions that measure   references
train          the scale factor if it is to be searched for, the pairs,
the networks: Lightning's trainer with its hooks            training, datamodule, module
calibrate      how far to trust an answer                                  retargeter.calibration
measure        on the test clips                                           measurement
package        what a user takes away, and all of it in MLflow             record
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mrhubo.callbacks import ScaleFactorSearch
from mrhubo.config import Config
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip
from mrhubo.fitting.first_look import look_first
from mrhubo.fitting.measurement import measure, refuse_useless
from mrhubo.fitting.preparation import Prepared, make_places, prepare
from mrhubo.fitting.record import (
    Recording,
    dashboard_command,
    log_answers,
    log_look,
    log_measures,
    log_pairs,
    log_scale,
    register_package,
    save_package,
)
from mrhubo.fitting.references import make_references
from mrhubo.fitting.training import train
from mrhubo.retargeter.calibration import calibrate
from mrhubo.runtime.progress import SILENT, Reporter
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
    dashboard: str
    """The command that opens MLflow's dashboard."""


def fit(config: Config, report: Reporter = SILENT, parent: str | None = None) -> FitResult | None:
    """Runs all steps; what an earlier, interrupted call finished is not done again. `parent`: the id of the MLflow run
    that this one belongs to.

    Started by torchrun or SLURM, all ranks make pairs and train; the first does the rest, the others get None.

    Raises:
        UserError: anything in the config or the files it names is wrong (before any work).
        KeyboardInterrupt: the user stopped it; the same call resumes.
    """
    prepared = prepare(config, search=True)
    ranks = _join_ranks(config)
    workspace = Workspace(prepared.tracking_dir / "fits", config.robot.name, prepared.fingerprint)
    if ranks.rank > 0:
        return _train_with_the_first(prepared, workspace, ranks)
    make_places(prepared)
    with workspace:
        result = _run_steps(prepared, report, workspace, ranks, parent)
        workspace.finish()
    return result


def _run_steps(
    prepared: Prepared, report: Reporter, workspace: Workspace, ranks: Ranks, parent: str | None
) -> FitResult:
    look = look_first(prepared, report)
    with Recording.start(prepared, workspace, parent) as recording:
        log_look(recording, look)
        validation, test = make_references(prepared, report)
        ranks.wait()
        training = train(
            prepared,
            report,
            validation,
            workspace.checkpoints,
            recording.logger,
            ranks,
            _search(prepared, report, validation, recording),
        )
        log_pairs(recording, training)
        retargeter = training.retargeter
        retargeter.confidence = calibrate(retargeter)
        measured = measure(training.prepared, report, retargeter, test)
        log_measures(recording, measured, training.best_link_cm)
        log_answers(recording, report, test, measured.predictions)
        robot = training.prepared.body_map.robot
        remedy = f"a lower trainer.lr than {prepared.config.trainer.lr:g} helps"
        refuse_useless(test, measured.predictions, robot, remedy)
        package = save_package(recording, retargeter, measured.over_clips, training.best_checkpoint)
        model = register_package(recording, retargeter, measured.over_clips, test[0])
    dashboard = dashboard_command(prepared.tracking_dir, prepared.config)
    return FitResult(package, model, recording.run_id, measured.table, measured.measures, dashboard)


def _join_ranks(config: Config) -> Ranks:
    ranks = Ranks.join(config.trainer.accelerator)
    if ranks.count > 1 and config.robot.scale == "search":
        raise UserError("robot.scale: 'search' runs in one process; run it once, then train with what it found")
    if config.trainer.batch_size % ranks.count:
        raise UserError(f"trainer.batch_size: must be a multiple of the {ranks.count} processes that share each batch")
    return ranks


def _search(
    prepared: Prepared, report: Reporter, validation: Sequence[Clip], recording: Recording
) -> list[ScaleFactorSearch]:
    """The callback that searches for the scale factor, where it is to be searched for."""
    if prepared.config.robot.scale != "search":
        return []
    config, folder = prepared.config, prepared.tracking_dir
    return [
        ScaleFactorSearch(
            config, prepared.body_map, prepared.prior, validation, folder, report, partial(log_scale, recording)
        )
    ]


def _train_with_the_first(prepared: Prepared, workspace: Workspace, ranks: Ranks) -> None:
    """What all ranks but the first do: pairs and training, in step with the first, which tells of them."""
    ranks.wait()  # the first has solved the references and readied the workspace
    validation, _ = make_references(prepared, SILENT)
    train(prepared, SILENT, validation, workspace.checkpoints, ranks=ranks)
