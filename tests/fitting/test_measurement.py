"""A package is measured against the config's robot only if the two mean the same."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.fitting import measurement
from mrhubo.robot import build_body_map
from mrhubo.runtime.progress import SILENT


def test_a_package_of_another_body_map_is_refused(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_config(root / "conf" / "nao.yaml")
    own = build_body_map(config.robot)
    config.robot.keypoints["left_wrist"] = {"link": "l_wrist", "offset": [0.02, 0, 0]}  # pyright: ignore
    prepared = SimpleNamespace(body_map=build_body_map(config.robot), config=config)
    monkeypatch.setattr(measurement.Retargeter, "load", lambda folder: SimpleNamespace(body_map=own))
    with pytest.raises(UserError, match=r"package: was made with other links or offsets for left_wrist than"):
        measurement.measure_package(prepared, SILENT, Path("package"))  # pyright: ignore[reportArgumentType]
