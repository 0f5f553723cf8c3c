"""How a run's dashboard is opened."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

import pytest

from mrhubo.config import load_config
from mrhubo.fitting.record import dashboard_command


@pytest.mark.parametrize(
    ("uri", "shown"),
    [
        ("http://host:5000", "http://host:5000"),
        ("https://anna:s3cret@host/mlflow", "https://host/mlflow"),
        ("http://token@host:5000/", "http://host:5000/"),
    ],
)
def test_of_a_server_it_is_its_address(root: Path, tmp_path: Path, uri: str, shown: str) -> None:
    assert dashboard_command(tmp_path, load_config(root / "conf" / "nao.yaml", [f"tracking.uri={uri}"])) == shown


@pytest.mark.parametrize("name", ["mlruns", "my runs", "it's", "q?x"])
def test_of_a_database_it_is_a_command_that_a_shell_takes(root: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    words = shlex.split(dashboard_command(tmp_path / name, load_config(root / "conf" / "nao.yaml")))
    settings = dict(word.split("=", 1) for word in words[:2])
    assert settings == {"MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false", "MLFLOW_DISABLE_TELEMETRY": "true"}
    assert os.path.isfile(words[2]) and words[3:6] == ["-m", "mlflow", "ui"]
    assert words[words.index("--backend-store-uri") + 1].startswith("sqlite") and "127.0.0.1" in words


def test_a_databases_password_is_not_shown(root: Path, tmp_path: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["tracking.uri=postgresql://anna:s3cret@host/db"])
    assert "postgresql://anna:***@host/db" in dashboard_command(tmp_path, config)
