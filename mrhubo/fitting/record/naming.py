"""What a run is called, and the command that shows it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from mrhubo.config import Config, changed_settings
from mrhubo.runtime.tracking import database_uri

_SIZES = ("count", "max_steps", "seed")
"""Settings that lengthen or repeat a fit, rather than change what it does."""


def run_name(config: Config) -> str:
    """The robot's name and the settings that differ from the defaults: `nao stages=1 filter=none`."""
    sections = (config.body, config.pairs, config.model, config.trainer)
    changed = {name: value for section in sections for name, value in changed_settings(section).items()}
    changed.pop("workers", None)  # the result does not depend on it
    if config.robot.scale != "auto":
        changed["scale"] = config.robot.scale
    changed |= {name: changed.pop(name) for name in _SIZES if name in changed}  # last: tables cut long names off
    return " ".join([config.robot.name, *(f"{name}={value}" for name, value in changed.items())])


def dashboard_command(folder: Path, config: Config) -> str:
    """The command that opens the dashboard, on this machine only, light (one worker, no job runner)."""
    uri = shlex.quote(config.tracking.uri or database_uri(folder))
    command = f"{shlex.quote(sys.executable)} -m mlflow ui --backend-store-uri {uri} --host 127.0.0.1 --workers 1"
    return f"MLFLOW_SERVER_ENABLE_JOB_EXECUTION=false {command}"
