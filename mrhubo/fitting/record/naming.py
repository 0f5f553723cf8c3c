"""What a run is called, and the command that shows it."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from mrhubo.config import Config, changed_settings, usual_trainer
from mrhubo.config.secrets import redacted
from mrhubo.runtime.database import database_uri

_SIZES = ("count", "max_steps", "seed")
"""Settings that lengthen or repeat a fit, rather than change what it does."""


def run_name(config: Config) -> str:
    """The robot's name and the settings that differ from the defaults: `nao stages=1 filter=none`."""
    sections = (config.body, config.pairs, config.model)
    changed = {name: value for section in sections for name, value in changed_settings(section).items()}
    changed |= changed_settings(config.trainer, usual_trainer(config))
    changed.pop("workers", None)  # the result does not depend on it
    if config.robot.scale != "auto":
        changed["scale"] = config.robot.scale
    changed |= {name: changed.pop(name) for name in _SIZES if name in changed}  # last: tables cut long names off
    return " ".join([config.robot.name, *(f"{name}={value}" for name, value in changed.items())])


def dashboard_command(folder: Path, config: Config) -> str:
    """The command that opens the dashboard, on this machine only, light (one worker, no job runner) and without
    telemetry; of a server its address, which is the dashboard's.
    """
    uri = redacted(config.tracking.uri or database_uri(folder))
    if uri.startswith(("http://", "https://")):
        return re.sub(r"//[^/?#]*@", "//", uri)  # a browser asks for the user
    command = f"{shlex.quote(sys.executable)} -m mlflow ui --backend-store-uri {shlex.quote(uri)}"
    settings = "MLFLOW_SERVER_ENABLE_JOB_EXECUTION=false MLFLOW_DISABLE_TELEMETRY=true"
    return f"{settings} {command} --host 127.0.0.1 --workers 1"
