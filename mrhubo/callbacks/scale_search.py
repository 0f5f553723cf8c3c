"""The search of the robot's scale factor theta: a Lightning callback that comes before the pairs.

Legend: C scale factors, P pairs of robot and human pose, N robot joints, J = 21 human joints.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import lightning
import numpy as np
import torch
from PIL.Image import Image
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.config import Config, ManualScaleConfig, fingerprint
from mrhubo.errors import UserError
from mrhubo.evaluation.clips import Clip
from mrhubo.files.storage import checksum_tensors, locked
from mrhubo.pairing import ScaleFactorObjective, pose_settings
from mrhubo.reference import angle_between
from mrhubo.robot import BodyMap, varied
from mrhubo.rotation import matrix_to_sixd
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.runs import log_all, start_run
from mrhubo.search import open_study, open_trials
from mrhubo.search.plots import study_plots
from mrhubo.view import figure_sheet
from mrhubo.view.pictures import Artist

if TYPE_CHECKING:
    from optuna import Study

    from mrhubo.runtime.client import TrackingClient

_AT_ONCE = 20
"""Trials drawn and solved together."""
_REACHED_RAD = math.radians(3.0)
"""Angle between robot and human up to which a pose counts as reached."""


@dataclass(frozen=True)
class ScaleResult:
    """What the search has found."""

    config: Config
    """The run's config with `scale: manual` and the best numbers."""
    values: dict[str, float]
    """Those that varied."""
    distance_rad: float
    """Their distance."""
    start_distance_rad: float
    """That of the numbers that the search departed from."""
    pictures: dict[str, Image]
    """The search, and pairs of the best and the worst numbers, by name."""


@runtime_checkable
class SearchedData(Protocol):
    """A data module whose data depend on the scale factor."""

    def use_config(self, config: Config) -> None:
        """Takes the run's config with the scale factor that was found."""


class ScaleFactorSearch(lightning.Callback):
    """Draws theta from the ranges of `robot.search`, keeps the one whose human poses come nearest to a reference set.

    The reference set are frames of the validation clips with the joint angles that the reference retargeter gives
    them, where the robot can do what the human does: elsewhere no theta can be right, and one that distorts the arms
    would win. The distance is that of `ScaleFactorObjective`. Trials are kept in an Optuna study: a search that was
    stopped goes on, a finished one is read.

    It searches in `setup`, which Lightning calls before anything is trained, and hands the config that it ends with to
    the data module, `SearchedData`, which makes the pairs only then. Each trial is an MLflow run under the training's.
    """

    def __init__(
        self,
        config: Config,
        body_map: BodyMap,
        prior: BodyPrior,
        clips: Sequence[Clip],
        folder: Path,
        report: Reporter = SILENT,
        found: Callable[[ScaleResult], None] = lambda result: None,
    ) -> None:
        """What it searches with.

        Args:
            config: with `robot.scale: search`.
            body_map: its robot.
            prior: its body prior.
            clips: the validation clips.
            folder: the tracking folder.
            report: told of the trials.
            found: called with the result, before the data module gets it.
        """
        assert config.robot.search is not None and config.robot.manual is not None
        self.config, self.start, self.settings = config, config.robot.manual, config.robot.search
        local_FJ33 = torch.cat([clip.motion.local_TJ33 for clip in clips])
        reference_FN = torch.cat([clip.reference_TN for clip in clips])
        chosen = _reachable(body_map, reference_FN, local_FJ33, self.settings.poses)
        self.q_PN, self.local_PJ33 = reference_FN[chosen], local_FJ33[chosen]
        self.objective = ScaleFactorObjective(
            body_map, prior, config.pairs, self.q_PN, self.local_PJ33, config.model.input_frame
        )
        self.artist = Artist(body_map.robot, body_map.skeleton)
        self.folder, self.report, self.found = folder, report, found
        measured_on = checksum_tensors({"q": self.q_PN, "pose": matrix_to_sixd(self.local_PJ33)}, {})
        pairs, robot = config.pairs, pose_settings(config)
        robot["search"] = {**robot["search"], "trials": 0}  # more of them go on where fewer stopped
        self.name = f"{config.robot.name}-scale-" + fingerprint(
            [
                robot, prior.checksum, body_map.robot.description.kinematics, body_map.skeleton.checksum, measured_on,
                [pairs.w_data, pairs.w_prior, pairs.fine_steps, config.model.input_frame],
            ]
        )  # fmt: skip
        self.result: ScaleResult | None = None

    def setup(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule, stage: str) -> None:
        """Finds the scale factor, unless it is known already, and hands it to the data module.

        Raises:
            TypeError: the data module is no `SearchedData`.
        """
        data: object = getattr(trainer, "datamodule", None)
        if not isinstance(data, SearchedData):
            raise TypeError("ScaleFactorSearch needs a data module that takes what it found: use_config")
        client, run_id = (getattr(trainer.logger, name, None) for name in ("experiment", "run_id"))
        result = self.search(client, run_id)
        self.found(result)
        data.use_config(result.config)

    def search(self, client: TrackingClient | None = None, parent: str | None = None) -> ScaleResult:
        """Does the trials that are missing; with a client each is an MLflow run under the run `parent`."""
        # Fits that differ in other settings share the study.
        with locked(self.folder / "fits" / f"{self.name}.lock", wait=True):
            settings = self.settings
            study = open_study(self.folder, None, self.name, settings.sampler, settings.seed, shared=False)
            ranking = self._do_trials(study, client, parent)
        (values, distance), (worst, _) = ranking[0], ranking[-1]
        config = copy.deepcopy(self.config)
        config.robot.scale, config.robot.search = "manual", None
        config.robot.manual = varied(self.start, values)
        pictures = {
            **study_plots(study, "arm distance [rad]"),
            "poses": self._poses(config.robot.manual, varied(self.start, worst)),
        }
        start = float(self.objective.measure([self.start]))
        self.result = ScaleResult(config, values, distance, start, pictures)
        return self.result

    def _do_trials(
        self, study: Study, client: TrackingClient | None, parent: str | None
    ) -> list[tuple[dict[str, float], float]]:
        """Numbers and distances of all trials, the nearest first."""
        if not study.get_trials(deepcopy=False) and (start := self._start_values()):
            study.enqueue_trial(start)  # so that the search ends nowhere worse than where it started
        with self.report.step("scale factor", self.settings.trials, "trials") as progress:
            while True:
                done = self._finished(study)
                best = f"best {math.degrees(done[0][1]):.2f} deg" if done else ""
                progress.update(min(len(done), self.settings.trials), best)
                if len(done) >= self.settings.trials:
                    return done
                self._measure(study, self._draw(study, len(done)), client, parent)

    def on_fit_start(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        """Writes the distances into the training's run."""
        if self.result is not None and trainer.logger is not None:
            found = {"scale/distance_rad": self.result.distance_rad}
            trainer.logger.log_metrics({**found, "scale/start_distance_rad": self.result.start_distance_rad})

    def _start_values(self) -> dict[str, float]:
        """The numbers that the search departs from, if they lie in the ranges."""
        values = {name: float(getattr(self.start, name, 0.0)) for name in self.settings.ranges}
        inside = all(low <= values[name] <= high for name, (low, high) in self.settings.ranges.items())
        return values if inside else {}

    def _finished(self, study: Study) -> list[tuple[dict[str, float], float]]:
        """Numbers and distances of all trials, the nearest first."""
        from optuna.trial import TrialState

        trials = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))[: self.settings.trials]
        found = [(dict(trial.params), float(trial.value or 0.0)) for trial in trials]
        return sorted(found, key=lambda one: one[1])

    def _draw(self, study: Study, done: int) -> dict[int, dict[str, float]]:
        """The next trials' numbers, by trial; what was drawn and never measured comes first."""
        ranges = self.settings.ranges
        drawn = {trial.number: dict(trial.params) for trial in open_trials(study)}
        drawn = {number: values for number, values in drawn.items() if set(values) == set(ranges)}
        for _ in range(min(_AT_ONCE, self.settings.trials - done) - len(drawn)):
            trial = study.ask()
            drawn[trial.number] = {name: trial.suggest_float(name, *ranges[name]) for name in ranges}
        return drawn

    def _measure(
        self, study: Study, drawn: dict[int, dict[str, float]], client: TrackingClient | None, parent: str | None
    ) -> None:
        distances = self.objective.measure([varied(self.start, values) for values in drawn.values()]).tolist()
        for (number, values), distance in zip(drawn.items(), distances, strict=True):
            if client is not None:
                self._log_trial(client, parent, number, {"distance_rad": distance, **values})
            study.tell(number, distance)

    def _log_trial(self, client: TrackingClient, parent: str | None, number: int, values: dict[str, float]) -> None:
        robot = self.config.robot.name
        tags = {"robot": robot, "scale_search": self.name, **({"mlflow.parentRunId": parent} if parent else {})}
        try:
            run = start_run(client, self.config.tracking.experiment, f"{robot} scale {number}", tags).info.run_id
        except UserError:  # the server is away: the study has what counts
            return
        log_all(client, run, {f"scale/{name}": value for name, value in values.items()})
        client.set_terminated(run)

    def _poses(self, best: ManualScaleConfig, worst: ManualScaleConfig, count: int = 5) -> Image:
        """Human poses, the reference's robot poses, and what the best and the worst numbers make of those."""
        local_2PJ33 = self.objective.human_poses([best, worst])
        shown = [round(place) for place in np.linspace(0.1, 0.9, count) * (len(self.q_PN) - 1)]
        rows = [
            [self.artist.human(self.local_PJ33[i]) for i in shown],
            [self.artist.robot_figure(self.q_PN[i]) for i in shown],
            *([self.artist.human(local_PJ33[i]) for i in shown] for local_PJ33 in local_2PJ33),
        ]
        best_deg, worst_deg = self.objective.distances(local_2PJ33).rad2deg().mean(dim=1).tolist()
        titles = ["human", "reference", f"best: {best_deg:.1f} deg", f"worst: {worst_deg:.1f} deg"]
        caption = f"{self.config.robot.name}: what the best and the worst scale factor make of the robot's poses"
        return figure_sheet(rows, (), titles, caption)


@torch.no_grad()
def _reachable(body_map: BodyMap, q_FN: Tensor, local_FJ33: Tensor, count: int) -> Tensor:
    """`count` frames, evenly spaced among those in which every limb of the robot points where the human's does."""
    robot_FD3 = body_map.robot_directions(body_map.robot.forward(q_FN))
    off_F = angle_between(robot_FD3, body_map.human_directions(local_FJ33))[:, body_map.measured].amax(dim=1)
    reached = (off_F < _REACHED_RAD).nonzero()[:, 0]
    if len(reached) < count:
        reached = off_F.argsort()[:count].sort().values
    return reached[torch.linspace(0, len(reached) - 1, min(count, len(reached))).round().long()]
