"""The folder in which a fit keeps what it needs to resume: its MLflow run, its checkpoints.

One folder per config (named after its fingerprint), so that the same command finds it again. A finished fit leaves a
mark, and the same command then starts a new run. A lock keeps two processes out of one folder.
"""

from __future__ import annotations

import json
import shutil
import uuid
from pathlib import Path
from types import TracebackType

import torch

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import check_regular, read_regular
from mrhubo.files.storage import Locked, locked


class Workspace:
    """Use as a context manager: the lock is held inside."""

    def __init__(self, folder: Path, name: str, fingerprint: str) -> None:
        self.folder = folder / f"{name}-{fingerprint}"
        self._state_file = self.folder / "state.json"

    def __enter__(self) -> Workspace:
        self._lock = locked(self.folder / "lock")
        try:
            self._lock.__enter__()
        except Locked as error:
            raise Locked(f"{self.folder}: another process is running this very fit; wait for it or stop it") from error
        if self._read().get("finished"):
            self._clear()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.__exit__(kind, error, trace)

    @property
    def run_id(self) -> str | None:
        """MLflow run of the unfinished fit, if there is one."""
        run = self._read().get("run_id")
        return run if isinstance(run, str) else None

    @property
    def attempt(self) -> str | None:
        """The mark of a start that was broken off before it could note its run."""
        attempt = self._read().get("attempt")
        return attempt if isinstance(attempt, str) else None

    def new_attempt(self) -> str:
        """Notes a mark for the run that is going to be made, and returns it."""
        attempt = uuid.uuid4().hex
        self._write({"attempt": attempt})
        return attempt

    @property
    def unsent(self) -> Path:
        """File for what a server did not take."""
        return self.folder / "unsent.jsonl"

    @property
    def checkpoints(self) -> Path:
        """Folder of the training's checkpoints."""
        return self.folder / "checkpoints"

    def last_checkpoint(self) -> Path | None:
        """Checkpoint to resume from; one that cannot be read is passed over."""
        path = self.checkpoints / "last.ckpt"
        try:
            check_regular(path)
            torch.load(path, map_location="cpu", weights_only=True)
        except Exception:
            return None
        return path

    def start(self, run_id: str) -> None:
        """Notes the run, and clears what another run left."""
        if self.run_id != run_id:
            self._clear()
        self._write({"run_id": run_id})

    def finish(self) -> None:
        """Notes that nothing is left to do, and drops the checkpoints."""
        self._write({"run_id": self.run_id, "finished": True})
        shutil.rmtree(self.checkpoints, ignore_errors=True)
        self.unsent.unlink(missing_ok=True)

    def _clear(self) -> None:
        self._state_file.unlink(missing_ok=True)
        self.unsent.unlink(missing_ok=True)
        shutil.rmtree(self.checkpoints, ignore_errors=True)

    def _read(self) -> dict[str, object]:
        try:
            state = json.loads(read_regular(self._state_file))
        except (UserError, ValueError):
            return {}
        return state if isinstance(state, dict) else {}

    def _write(self, state: dict[str, object]) -> None:
        with atomic_path(self._state_file) as temporary:
            temporary.write_text(json.dumps(state))
