"""One process's share of a sweep: trials of a study, each a training in an MLflow run under the sweep's own.

The engine knows spaces, studies and runs; what a trial trains is a `Method`: `mrhubo.fitting.trials` for fits, the
baseline's in its own room. A config that some trial has been trained with is never trained again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from mrhubo.config import Config, SweepConfig, fingerprint, to_plain, to_yaml
from mrhubo.config.secrets import without_secrets
from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.storage import locked
from mrhubo.fitting.preparation import Prepared, make_places, prepare
from mrhubo.fitting.record import dashboard_command
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.names import check_name
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.provenance import git_commit
from mrhubo.runtime.runs import close_run, find_run, log_all, reopen, start_run
from mrhubo.runtime.tables import markdown
from mrhubo.runtime.tracking import open_client
from mrhubo.runtime.workspace import Workspace
from mrhubo.search import open_study, open_trials, override, read_space, refuse_fixed, remaining, work_on

if TYPE_CHECKING:
    from mlflow.entities import Run
    from optuna.trial import FrozenTrial, Trial

    from mrhubo.runtime.client import TrackingClient

_TAG = "sweep_trial"
_SETTLED = "settled"
_VALUE = "val/best_link_cm"


@dataclass(frozen=True)
class SweepResult:
    """What a sweep has found so far."""

    table: str
    """The best trials, best first."""
    best: Path
    """File of the best config."""
    dashboard: str
    """The command that opens MLflow's dashboard."""


class SweepTrial:
    """One trial, for the method that trains it."""

    def __init__(
        self, trial: Trial, client: TrackingClient, parent: str, workspace: Workspace, show: Callable[[str], None]
    ) -> None:
        self.trial, self.client = trial, client
        self.parent, self.workspace = parent, workspace
        """The sweep's run, and a folder for what a training needs to go on."""
        self.show = show
        """Says how the trial is getting on."""
        self.pruned = False

    def begin(self, run_id: str) -> None:
        """Notes the trial's run."""
        self.run_id = run_id
        self.trial.set_user_attr("run_id", run_id)

    def conclude(
        self, fingerprint: str, link_cm: float, settled: Mapping[str, str] | None = None, pruned: bool = False
    ) -> float:
        """Writes down what the trial has come to, while its run is open.

        Args:
            fingerprint: `Prepared.fingerprint` of its config.
            link_cm: validation link error.
            settled: settings that the trial chose by itself, by key: part of its config from here on.
            pruned: it was stopped early.
        """
        self.pruned, settled = pruned, dict(settled or {})
        self.trial.set_user_attr(_SETTLED, settled)
        log_all(self.client, self.run_id, {_VALUE: link_cm})
        tags = {"trial": str(self.trial.number), "trial_state": "pruned" if pruned else "complete"}
        if not pruned:
            tags |= {_TAG: fingerprint, _SETTLED: json.dumps(settled)}
        for name, value in tags.items():
            self.client.set_tag(self.run_id, name, value)
        return link_cm

    def take_over(self, run: Run) -> float:
        """The result of a trial that another one has had: the same config."""
        self.trial.set_user_attr("run_id", run.info.run_id)
        self.trial.set_user_attr(_SETTLED, json.loads(run.data.tags.get(_SETTLED, "{}")))
        return run.data.metrics[_VALUE]


class Method(Protocol):
    """What the trials of a sweep train."""

    @property
    def schema(self) -> type[Config]:
        """Of the configs, and so of the keys that can vary."""
        ...

    def train(self, prepared: Prepared, trial: SweepTrial) -> float:
        """Trains with a config in an MLflow run, calls `begin` and `conclude`; returns the validation link error."""
        ...


class Sweep:
    """A sweep over a config; everything is checked when it is made."""

    def __init__(
        self,
        load: Callable[[Sequence[str]], Config],
        overrides: Sequence[str],
        settings: SweepConfig,
        method: Method,
        report: Reporter,
    ) -> None:
        """Checks space, config and files, and opens the study and its MLflow run.

        Args:
            load: gives the config with `key.sub=value` changes.
            overrides: such changes of all trials; they come after the sweep's `fixed`.
            settings: the sweep.
            method: what is trained.
            report: told of the trials.

        Raises:
            UserError: anything is wrong.
        """
        self.load, self.settings, self.method, self.report = load, settings, method, report
        self.overrides = [*(override(key, value) for key, value in settings.fixed.items()), *overrides]
        self.base = self._config([])
        self.space = read_space(settings.space, lambda text: self._config([text]), method.schema)
        refuse_fixed(self.space, self.overrides)
        check_name("name", settings.name)
        prepared = prepare(self.base)
        self.folder = prepared.tracking_dir
        make_places(prepared, self.folder / "sweeps")
        deciding = {**to_plain(settings), "trials": 0, "minutes": 0, "storage": ""}
        mark = fingerprint([prepared.fingerprint, deciding])
        self.name = f"{self.base.robot.name}-{settings.name}-{mark[:8]}"
        """Of the study; the same settings find it again, with more trials too."""
        self.study = open_study(
            self.folder, settings.storage, self.name, settings.sampler, settings.seed, settings.pruner
        )
        tracking = self.base.tracking
        self.client = open_client(self.folder, tracking.experiment, tracking.uri)
        with locked(self.folder / "studies.lock", wait=True):
            self.parent = self._open_run()

    def run(self) -> SweepResult:
        """Trials until there are enough, or the time is up; other processes may do some of them.

        Raises:
            UserError: three trials in a row failed, or the time was up before any was done.
            KeyboardInterrupt: the user stopped it; the same call goes on, with the trial that was interrupted.
        """
        start, limit = time.monotonic(), self.settings.minutes
        error: BaseException | None = None
        whole = ""
        try:
            with self.report.step("sweep", self.settings.trials, "trials") as self._progress:
                self._progress.update(self._done())
                work_on(
                    self.study,
                    self._trial,
                    self.settings.trials,
                    lambda: limit is not None and time.monotonic() - start > 60 * limit,
                )
                self._progress.update(self._done(), self._best_so_far())
            self.client.patient = True
            result = self._conclude()
            whole = f"the best config is whole: {result.best}"
            return result
        except BaseException as raised:
            error = raised
            raise
        finally:
            self.client.patient = True
            if not self._others_at_work():  # else another process will end it
                close_run(self.client, self.parent, error, whole)
            elif error is None:
                self.client.deliver(whole)

    def _others_at_work(self) -> bool:
        try:
            return bool(open_trials(self.study))
        except Exception:  # the study's database is away, and that is told already
            return False

    def _config(self, texts: Sequence[str]) -> Config:
        return self.load([*self.overrides, *texts])

    def _open_run(self) -> str:
        """The run that all trials belong to."""
        tags = {"sweep": self.name}
        run = find_run(self.client, self.base.tracking.experiment, tags)
        if run is None:
            tags |= {"robot": self.base.robot.name, "git_commit": git_commit(project_root())}
            name = f"{self.base.robot.name} sweep {self.settings.name}"
            run = start_run(self.client, self.base.tracking.experiment, name, tags)
        else:
            reopen(self.client, run)
        described = {f"space/{dimension.key}": dimension.describe() for dimension in self.space}
        kept = {key: value for key, value in to_plain(self.settings).items() if key not in ("space", "storage")}
        written = {**{f"sweep/{key}": value for key, value in kept.items()}, **described}
        # Those that a start which was killed has not written.
        missing = {name: value for name, value in written.items() if name not in run.data.params}
        log_all(self.client, run.info.run_id, {}, missing)
        self.client.log_text(run.info.run_id, to_yaml(without_secrets(self.base)), "base.yaml")
        return run.info.run_id

    def _done(self) -> int:
        return self.settings.trials - remaining(self.study, self.settings.trials) - len(open_trials(self.study))

    def _trial(self, trial: Trial) -> float:
        texts = [dimension.draw(trial) for dimension in self.space]
        config = self._config(texts)
        shown = " ".join(text.split(".", 1)[1] for text in texts)
        config.tracking.run_name = f"{self.base.robot.name} {self.settings.name} {trial.number}: {shown}"
        prepared = prepare(config)
        workspace = Workspace(self.folder / "fits", f"{config.robot.name}-sweep", prepared.fingerprint)
        run = SweepTrial(trial, self.client, self.parent, workspace, lambda measure: self._show(trial, measure))
        with locked(workspace.folder.with_suffix(".lock"), wait=True):  # another process may draw the same config
            known = find_run(self.client, config.tracking.experiment, {_TAG: prepared.fingerprint}, finished=True)
            if known is not None:
                return run.take_over(known)
            link_cm = self.method.train(prepared, run)
        if run.pruned:
            import optuna

            raise optuna.TrialPruned
        return link_cm

    def _show(self, trial: Trial, measure: str) -> None:
        self._progress.update(min(self._done(), self.settings.trials - 1), ", ".join(
            part for part in (f"trial {trial.number} {measure}", self._best_so_far()) if part))  # fmt: skip

    def _ranking(self) -> list[FrozenTrial]:
        from optuna.trial import TrialState

        done = self.study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
        return sorted(done, key=lambda trial: trial.value if trial.value is not None else float("inf"))

    def _best_so_far(self) -> str:
        ranking = self._ranking()
        return f"best {ranking[0].value:.3f} cm (trial {ranking[0].number})" if ranking else ""

    def _conclude(self) -> SweepResult:
        """Tables, pictures and the best config, as they are now."""
        from mrhubo.search.plots import study_plots
        from mrhubo.view import save_png

        ranking = self._ranking()
        if not ranking:
            raise UserError(f"sweep {self.name}: no trial is done yet; give it more time")
        chosen = [{**trial.params, **trial.user_attrs.get(_SETTLED, {})} for trial in ranking]
        keys = list(dict.fromkeys([*(dimension.key for dimension in self.space), *chosen[0]]))
        heads = ["trial", "validation link error [cm]", *keys]
        rows = [
            [str(trial.number), f"{trial.value:.3f}", *(_short(values.get(key, "")) for key in keys)]
            for trial, values in zip(ranking, chosen, strict=True)
        ]
        best = self._config([f"{key}={value}" for key, value in chosen[0].items()])
        path = self.folder / "sweeps" / f"{self.name}.yaml"
        with atomic_path(path) as temporary:
            temporary.write_text(to_yaml(without_secrets(best)), encoding="utf-8")
        self.client.log_artifact(self.parent, str(path))
        self.client.log_text(self.parent, markdown(heads, rows) + "\n", "trials.md")
        log_all(self.client, self.parent, {_VALUE: float(rows[0][1]), "sweep/trials": float(self._done())})
        for name, image in study_plots(self.study, "validation link error [cm]").items():
            picture = path.with_name(f"{self.name}-{name}.png")
            save_png(image, picture)
            self.client.log_artifact(self.parent, str(picture))
        return SweepResult(markdown(heads, rows[:5]), path, dashboard_command(self.folder, self.base))


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
