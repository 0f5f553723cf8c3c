"""The liveliest clip of a fit's test: a page of its middle, or a GIF where there can be no page."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from mrhubo.evaluation import Clip
from mrhubo.fitting.record import moving
from mrhubo.fitting.record.moving import clip_stage, log_moving
from mrhubo.motion import Motion
from mrhubo.robot import Robot
from mrhubo.runtime.progress import Reporter
from mrhubo.view.pictures import Artist

FRAMES, RATE = 300, 60.0


@pytest.fixture(scope="module")
def robot(root: Path) -> Robot:
    return Robot.from_config(root / "conf" / "nao.yaml")


@pytest.fixture(scope="module")
def clip(robot: Robot) -> Clip:
    """Five seconds, in which no two frames of the robot are alike."""
    pose_T = torch.eye(3).repeat(FRAMES, 21, 1, 1)
    return Clip(
        Motion("a clip", pose_T, RATE, "a <b>motion</b>"), robot.sample(FRAMES, torch.Generator().manual_seed(0))
    )


def keep(robot: Robot, folder: Path) -> Any:
    """A run whose artifacts go into a folder."""

    def log_made(run_id: str, name: str, write: Callable[[Path], object]) -> None:
        (folder / name).parent.mkdir(exist_ok=True)
        write(folder / name)

    return SimpleNamespace(artist=Artist(robot), client=SimpleNamespace(log_made=log_made), run_id="1")


def test_a_page_shows_the_middle(robot: Robot, clip: Clip, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = clip_stage(robot, clip, {"mrhubo": -clip.reference_TN})
    assert (whole.frames, whole.frame_rate) == (FRAMES / 2, 30.0) and whole.person is not None
    monkeypatch.setattr(moving, "PAGE_SECONDS", 2.0)
    stage = clip_stage(robot, clip, {"mrhubo": -clip.reference_TN})
    assert stage.duration == pytest.approx(2.0) and [r.label for r in stage.robots] == ["reference", "mrhubo"]
    middle = clip.reference_TN[89:211:2].numpy()
    np.testing.assert_array_equal(stage.robots[0].motion.q, middle)
    np.testing.assert_array_equal(stage.robots[1].motion.q, -middle)


def test_a_page_or_a_gif(
    robot: Robot, clip: Clip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(moving, "PAGE_SECONDS", 0.2)
    monkeypatch.setattr("mrhubo.view.pictures.GIF_RATE", 1.0)
    log_moving(keep(robot, tmp_path), Reporter(), clip, clip.reference_TN)
    assert [file.name for file in (tmp_path / "test").iterdir()] == ["a clip.html"] and capsys.readouterr().out == ""
    page = (tmp_path / "test" / "a clip.html").read_text(encoding="utf-8")
    assert "<title>nao: a clip (a &lt;b&gt;motion&lt;/b&gt;)</title>" in page and page.count('class="time"') == 2
    monkeypatch.setitem(sys.modules, "viser", None)
    log_moving(keep(robot, tmp_path), Reporter(), clip, clip.reference_TN)
    assert (tmp_path / "test" / "a clip.gif").read_bytes().startswith(b"GIF89a")
    said = capsys.readouterr().out
    assert "kept as a GIF" in said and "pip install 'mrhubo[view]'" in said


def test_a_machine_on_which_nothing_can_listen(
    robot: Robot, clip: Clip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import viser

    def refuse(**_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(viser, "ViserServer", refuse)
    monkeypatch.setattr("mrhubo.view.pictures.GIF_RATE", 1.0)
    log_moving(keep(robot, tmp_path), Reporter(), clip, clip.reference_TN)
    assert [file.name for file in (tmp_path / "test").iterdir()] == ["a clip.gif"]
    assert "127.0.0.1: nothing can listen there: Operation not permitted" in capsys.readouterr().out
