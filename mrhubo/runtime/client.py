"""An MLflow client that bears with its server: it waits for a lock, asks again after a passing failure, and where
nobody answers it keeps what is to be written and sends it later.
"""

from __future__ import annotations

import contextlib
import functools
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from mlflow import MlflowClient
from mlflow.entities import Metric

from mrhubo.config.notices import print_warning
from mrhubo.config.secrets import redacted
from mrhubo.errors import Unreachable, UserError, was_interrupted
from mrhubo.runtime.failures import BUGS, may_pass, reason_of, silence
from mrhubo.runtime.processes import uninterrupted

_READS = (
    "download_artifacts", "get_experiment_by_name", "get_model_version", "get_model_version_by_alias", "get_run",
    "list_artifacts", "search_logged_models", "search_model_versions", "search_registered_models", "search_runs",
)  # fmt: skip
"""Asked again where the failure may pass."""
_WRITES = (
    "delete_tag", "log_artifact", "log_artifacts", "log_batch", "log_image", "log_inputs", "log_metric", "log_text",
    "set_tag", "set_terminated", "update_run",
)  # fmt: skip
"""Kept while nobody answers: the work does not need what they return."""
_CREATES = (
    "create_experiment", "create_logged_model", "create_model_version", "create_registered_model", "create_run",
    "delete_logged_model", "finalize_logged_model", "log_model_artifacts", "log_outputs", "set_logged_model_tags",
)  # fmt: skip
"""Done now or not at all."""
_PAUSES = (0.5, 2.0)
"""Seconds before a question is asked again."""
_LOCKED_SECONDS = 120.0
"""How long a locked database is waited for."""
_NEXT_TRY_SECONDS = 30.0
"""Between two attempts to send what was kept."""
_SIGN_SECONDS = 3.0
"""How long a server that was away may take for a sign of life."""


class _Kept(NamedTuple):
    """A write that waits."""

    call: Callable[[], Any]
    line: str = ""
    """Of the file that outlives the process; only metrics have one, all else is made again by the next start."""


class TrackingClient(MlflowClient):
    """MLflow's client. `patient` decides what a write does that fails: raise, or be kept until `deliver`.

    Keys are sent as they are: `mrhubo.runtime.names` makes them.
    """

    def __init__(self, uri: str) -> None:
        super().__init__(tracking_uri=uri)
        self.uri = uri
        self.patient = False
        self._local = uri.startswith("sqlite")
        self._inside = False
        self._kept: list[_Kept] = []
        self._next_try = 0.0
        self._file: Path | None = None

    @property
    def away(self) -> bool:
        """Whether something waits because nobody answered."""
        return bool(self._kept)

    def log_made(self, run_id: str, name: str, make: Callable[[Path], object]) -> None:
        """The artifact `name` (folder and file) of a run, made by `make`, which is given the path to write to."""

        def call() -> None:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / Path(name).name
                make(path)
                MlflowClient.log_artifact(self, run_id, str(path), str(Path(name).parent))

        self._write(call)

    def keep_in(self, file: Path) -> None:
        """Metrics that cannot be sent are kept in this file too; those that an ended process left there are sent."""
        self._file = file
        for line, run_id, metrics in _read(file):
            self._kept.append(_Kept(functools.partial(MlflowClient.log_batch, self, run_id, metrics), line))

    def deliver(self, whole: str = "") -> None:
        """Sends what was kept.

        Args:
            whole: what is done all the same, for the sentence.

        Raises:
            Unreachable: nobody answers, or the server takes something no more.
        """
        try:
            self._send()
        except Exception as error:
            if was_interrupted(error) or isinstance(error, BUGS):
                raise
            done = f"{whole}; " if whole else ""
            raise Unreachable(
                f"{self._sentence(error)}, so the run is not complete; {done}when that is put right, start the same"
                " command again, which sends what is missing"
            ) from error

    def _ask(self, call: Callable[[], Any]) -> Any:
        """An answer, asked for again where the failure may pass."""
        if self._inside:
            return call()
        if self.away and not self._worth_a_try():
            raise Unreachable(f"tracking.uri: MLflow at {redacted(self.uri)} cannot be used: nobody answers")
        for pause in (*_PAUSES, None):
            try:
                return self._do(call)
            except Exception as error:
                if not may_pass(error):
                    raise
                if pause is None or self.away:
                    raise Unreachable(self._sentence(error)) from error
                time.sleep(pause)
        return None

    def _write(self, call: Callable[[], Any], line: str = "") -> Any:
        """Does it now, or keeps it."""
        if self._inside:
            return call()
        if self.patient and self._kept and not self._worth_a_try():
            self._keep(_Kept(call, line))
            return None
        try:
            if self.patient:
                self._send()
            return self._do(call)
        except Exception as error:
            if was_interrupted(error) or isinstance(error, (UserError, *BUGS)):
                raise
            if not self.patient:
                raise Unreachable(self._sentence(error)) from error
            if not self._kept:
                print_warning(
                    f"{self._sentence(error)}; the work goes on, and what belongs to its run is kept for later"
                )
            self._next_try = time.monotonic() + _NEXT_TRY_SECONDS
            self._keep(_Kept(call, line))
            return None

    def _worth_a_try(self) -> bool:
        """Whether what was kept may go now; a server that is silent must not stop the work for long."""
        if time.monotonic() < self._next_try:
            return False
        if not self._local and silence(self.uri, _SIGN_SECONDS) is not None:
            self._next_try = time.monotonic() + _NEXT_TRY_SECONDS
            return False
        return True

    def _create(self, call: Callable[[], Any]) -> Any:
        return call() if self._inside else self._do(call)

    def _do(self, call: Callable[[], Any]) -> Any:
        """Once, or where somebody has locked the database as often as it takes."""
        end, told = time.monotonic() + _LOCKED_SECONDS, False
        while True:
            try:
                with self._all_the_way():
                    return call()
            except Exception as error:
                if not (self._local and "locked" in str(error) and time.monotonic() < end) or was_interrupted(error):
                    raise
                if not told:
                    print_warning(f"{self.uri} is locked by another process; waiting")
                told = True
                time.sleep(0.5)

    @contextlib.contextmanager
    def _all_the_way(self) -> Iterator[None]:
        """MLflow's methods call each other; a transaction in a file is not broken off."""
        self._inside = True
        try:
            with uninterrupted() if self._local else contextlib.nullcontext():
                yield
        finally:
            self._inside = False

    def _send(self) -> None:
        """What was kept, in order; what the server refuses stays, and the rest goes all the same."""
        if not self._kept:
            return
        refused: list[tuple[_Kept, Exception]] = []
        try:
            while self._kept:
                try:
                    self._do(self._kept[0].call)
                except Exception as error:
                    if may_pass(error) or was_interrupted(error):
                        raise
                    refused.append((self._kept[0], error))
                self._kept.pop(0)
        finally:
            self._kept = [*(kept for kept, _ in refused), *self._kept]
        if refused:
            raise refused[0][1]
        if self._file is not None:
            self._file.unlink(missing_ok=True)

    def _keep(self, kept: _Kept) -> None:
        self._kept.append(kept)
        if self._file is not None and kept.line:
            with contextlib.suppress(OSError), open(self._file, "a") as file:  # no room: it is in memory still
                file.write(kept.line)

    def _sentence(self, error: Exception) -> str:
        return redacted(f"tracking.uri: MLflow at {self.uri} cannot be used: {reason_of(error)}", self.uri)


def _line(run_id: str, metrics: Any = (), *_: Any, **__: Any) -> str:
    return json.dumps([run_id, [[m.key, m.value, m.timestamp, m.step] for m in metrics]]) + "\n" if metrics else ""


def _read(file: Path) -> Iterator[tuple[str, str, list[Metric]]]:
    """Each whole line, and what it says: the id of a run, and metrics."""
    try:
        for line in file.read_text().splitlines(keepends=True):
            run_id, metrics = json.loads(line)
            found = [Metric(str(k), float(value), int(stamp), int(step)) for k, value, stamp, step in metrics]
            yield line, str(run_id), found
    except (OSError, ValueError, TypeError):  # not there, or broken off at its end
        return


def _method(name: str, through: Callable[..., Any]) -> Callable[..., Any]:
    """MLflow's method of that name, as it is when it is called, through one of ours."""

    @functools.wraps(getattr(MlflowClient, name))
    def method(self: TrackingClient, *given: Any, **named: Any) -> Any:
        line = (_line(*given, **named),) if name == "log_batch" else ()
        return through(self, functools.partial(getattr(MlflowClient, name), self, *given, **named), *line)

    return method


_WAYS = {TrackingClient._ask: _READS, TrackingClient._write: _WRITES, TrackingClient._create: _CREATES}
for _through, _names in _WAYS.items():
    for _name in _names:
        setattr(TrackingClient, _name, _method(_name, _through))
