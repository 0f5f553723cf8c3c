"""`mrhubo evaluate ROBOT-whole-body --optimiser` measures, prints and keeps what the optimiser makes of whole bodies."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.evaluate import main
from mrhubo.retargeter import without_training
from mrhubo.retargeter.confidence import STANDARD
from mrhubo.runtime.tracking import open_client
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records")


def test_the_command(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, one_thread: None
) -> None:
    monkeypatch.setattr(without_training, "calibrated", lambda retargeter: STANDARD)
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path / "clips", (1, 2), every=12)
    settings = [f"evaluation.motions=[{tmp_path / 'clips'}]", f"tracking.dir={tmp_path / 'runs'}"]
    main([str(root / "conf" / "nao-whole-body.yaml"), "--optimiser", "--quiet", *settings])
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [line[0] for line in lines if line] == ["reference", "wave", "mean", "stream", "wave", "mean"]
    client = open_client(tmp_path / "runs", "mrhubo")
    experiment = client.get_experiment_by_name("mrhubo")
    assert experiment is not None
    (run,) = client.search_runs([experiment.experiment_id])
    assert run.info.status == "FINISHED" and run.data.tags["robot"] == "nao"
    kept = run.data.metrics
    assert kept["reference/whole_body/sunk"] == kept["stream/whole_body/sunk"] == 0
    assert 0 < kept["stream/whole_body/knee_deg"] < 15 and kept["stream/whole_body/speed_max"] <= 1
    with pytest.raises(UserError, match="names no feet"):
        main([str(root / "conf" / "nao.yaml"), "--optimiser", "--quiet", *settings])
    with pytest.raises(UserError, match="--polish is for a package"):
        main([str(root / "conf" / "nao.yaml"), "--optimiser", "--polish", "1", *settings])
