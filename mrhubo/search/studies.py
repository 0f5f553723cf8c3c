"""Optuna studies that any number of processes work on, and that survive the death of any of them.

A trial whose process is gone (same machine: looked up; other machines: no heartbeat for a while) is drawn again with
the values that it had drawn; the others are drawn anew. Every trial's draw is seeded by (seed, number of the trial),
so a study that was stopped goes on as it would have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrhubo.config.secrets import redacted
from mrhubo.errors import Unreachable, UserError, first_line, was_interrupted
from mrhubo.files.storage import locked
from mrhubo.runtime.database import sqlite_uri
from mrhubo.runtime.processes import is_gone, this_process

if TYPE_CHECKING:
    import optuna
    from optuna.samplers import BaseSampler
    from optuna.study import Study
    from optuna.trial import FrozenTrial, Trial

_HEARTBEAT, _GRACE = 30, 120
"""Seconds between two signs of life, and until a process on another machine is taken for dead."""
_LOCKED = 120
"""Seconds that a locked SQLite database is waited for."""
_OWNER, _ERROR = "owner", "error"
_FAILURES = 3
"""Trials that may fail one after the other before something is wrong with all of them."""


def open_study(
    folder: Path, url: str | None, name: str, sampler: str, seed: int, pruner: str = "none", shared: bool = True
) -> Study:
    """The study of that name, new or as it was left.

    Args:
        folder: tracking folder; the SQLite database `studies.db` and a lock for its creation are there.
        url: SQLAlchemy URL of another database.
        name: of the study.
        sampler: `tpe`, `random` or `cmaes`.
        seed: of the sampler.
        pruner: `median`, `halving` or `none`.
        shared: several processes may work on it, by `work_on`.

    Raises:
        UserError: the database cannot be opened.
    """
    import warnings

    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
    database = url or sqlite_uri(folder.resolve() / "studies.db")
    pruners = {
        "median": lambda: optuna.pruners.MedianPruner(n_startup_trials=5, n_warmup_steps=0),
        "halving": lambda: optuna.pruners.SuccessiveHalvingPruner(min_resource=1, reduction_factor=4),
        "none": optuna.pruners.NopPruner,
    }
    try:
        if url is not None:
            from mrhubo.runtime.failures import ANSWER_SECONDS, silence

            fault = silence(url, ANSWER_SECONDS)
            if fault is not None:
                raise ConnectionError(f"no server answers there ({fault})")
        with locked(folder / "studies.lock", wait=True):  # two processes cannot make the tables at once
            beats: dict[str, Any] = {"heartbeat_interval": _HEARTBEAT, "grace_period": _GRACE}
            beats["heartbeat_stale_trial_callback"] = _retry
            patience = {"connect_args": {"timeout": _LOCKED}} if database.startswith("sqlite") else {}
            storage = optuna.storages.RDBStorage(database, engine_kwargs=patience, **(beats if shared else {}))
            return optuna.create_study(
                storage=storage,
                study_name=name,
                sampler=_seeded_by_trial(sampler, seed),
                pruner=pruners[pruner](),
                load_if_exists=True,
            )
    except Exception as error:  # SQLAlchemy's, its drivers', and ModuleNotFoundError for a driver that is not there
        sentence = f"storage: the study's database {database} cannot be opened: {first_line(error)}"
        raise UserError(redacted(sentence, database)) from error


def _seeded_by_trial(kind: str, seed: int) -> BaseSampler:
    import optuna

    def fresh(number: int) -> BaseSampler:
        mixed = (seed * 1_000_003 + number) % 2**32
        if kind == "tpe":  # the liar: trials that others are at count as bad, so that nobody draws the same
            return optuna.samplers.TPESampler(seed=mixed, constant_liar=True, multivariate=True, group=True)
        if kind == "cmaes":
            others = optuna.samplers.RandomSampler(seed=mixed)
            return optuna.samplers.CmaEsSampler(seed=mixed, independent_sampler=others, warn_independent_sampling=False)
        return optuna.samplers.RandomSampler(seed=mixed)

    class SeededByTrial(optuna.samplers.BaseSampler):
        """A new sampler for each trial; what the library's samplers remember is in the study itself."""

        def __init__(self) -> None:
            self.inner = fresh(0)

        def before_trial(self, study: Study, trial: FrozenTrial) -> None:
            self.inner = fresh(trial.number)
            self.inner.before_trial(study, trial)

        def infer_relative_search_space(self, study: Study, trial: FrozenTrial) -> dict[str, Any]:
            return self.inner.infer_relative_search_space(study, trial)

        def sample_relative(self, study: Study, trial: FrozenTrial, search_space: dict[str, Any]) -> dict[str, Any]:
            return self.inner.sample_relative(study, trial, search_space)

        def sample_independent(self, study: Study, trial: FrozenTrial, param_name: str, param_distribution: Any) -> Any:
            return self.inner.sample_independent(study, trial, param_name, param_distribution)

        def after_trial(self, study: Study, trial: FrozenTrial, state: Any, values: Any) -> None:
            self.inner.after_trial(study, trial, state, values)

    return SeededByTrial()


def open_trials(study: Study) -> list[FrozenTrial]:
    """Trials that some process is at."""
    from optuna.trial import TrialState

    return study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))


def remaining(study: Study, trials: int) -> int:
    """How many trials are still to be begun, of `trials` in all. One that failed by itself counts as done."""
    from optuna.trial import TrialState

    over = (TrialState.COMPLETE, TrialState.PRUNED, TrialState.RUNNING)
    counted = [t for t in study.get_trials(deepcopy=False) if t.state in over or _ERROR in t.user_attrs]
    return trials - len(counted)


def work_on(
    study: Study, objective: Callable[[Trial], float], trials: int, time_is_up: Callable[[], bool] = lambda: False
) -> None:
    """Does trials until the study has `trials` of them, together with all other processes that work on it.

    A trial that is interrupted is drawn again at the next start; one that raises UserError counts as failed.

    Raises:
        UserError: three trials in a row failed; the reason of the last.
        Unreachable: the study's database or the tracking server does not answer any more.
    """
    failures = 0

    def guarded(trial: optuna.Trial) -> float:
        nonlocal failures
        trial.set_user_attr(_OWNER, this_process())
        try:
            value = objective(trial)
        except (KeyboardInterrupt, Unreachable):  # no fault of the trial
            _retry(study, study.trials[trial.number])
            raise
        except UserError as error:
            failures += 1
            trial.set_user_attr(_ERROR, str(error))
            if failures >= _FAILURES:
                raise UserError(f"{failures} trials failed one after the other; the last: {error}") from error
            raise _Failed from error
        failures = 0
        return value

    with _answering():
        while not time_is_up():
            _free_the_dead(study)
            if remaining(study, trials) <= 0:
                return
            study.optimize(guarded, n_trials=1, catch=(_Failed,))


@contextmanager
def _answering() -> Iterator[None]:
    """One sentence where the database goes away in the midst of the work."""
    from optuna.exceptions import StorageInternalError
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (StorageInternalError, SQLAlchemyError) as error:
        if was_interrupted(error):
            raise
        reason = first_line(error.__cause__ or error)
        raise Unreachable(redacted(f"storage: the study's database does not answer any more: {reason}")) from error


class _Failed(Exception):
    """A trial failed; the study goes on."""


def _free_the_dead(study: Study) -> None:
    from optuna.exceptions import UpdateFinishedTrialError
    from optuna.trial import TrialState

    for trial in open_trials(study):
        if not is_gone(trial.user_attrs.get(_OWNER, "")):
            continue
        try:
            study.tell(trial.number, state=TrialState.FAIL)
        except (UpdateFinishedTrialError, ValueError):  # another process was faster
            continue
        _retry(study, trial)


def _retry(study: Study, trial: FrozenTrial) -> None:
    if trial.params:
        study.enqueue_trial(trial.params)
