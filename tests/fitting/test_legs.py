"""A fit of a robot with legs: pairs of its legs too, a package that stands, and what is measured of both."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

import mrhubo
from mrhubo import rotation
from mrhubo.config import Config, load_config
from mrhubo.config.live import LiveConfig
from mrhubo.fitting.fit import FitResult, fit
from mrhubo.fitting.preparation import prepare
from mrhubo.live.robot import LiveRobot
from mrhubo.pairing.verify import verify
from mrhubo.reference import angle_between
from mrhubo.retargeting import of_package
from mrhubo.runtime.progress import SILENT
from mrhubo.runtime.tracking import open_client
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records")


@pytest.fixture(scope="module")
def config(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Config:
    folder = tmp_path_factory.mktemp("legs")
    for name in ("drinking", "wave"):
        cut_motion(name, folder / "clips", (1, 2), every=12)
    return load_config(
        root / "conf" / "nao-whole-body.yaml",
        [f"evaluation.motions=[{folder / 'clips'}]", f"tracking.dir={folder / 'runs'}", f"pairs.dir={folder / 'pairs'}",
         "pairs.count=200", "pairs.shard_size=100", "model.hidden=8", "trainer.max_steps=10", "trainer.batch_size=32",
         "trainer.accelerator=cpu"],
    )  # fmt: skip


@pytest.fixture(scope="module")
def fitted(config: Config, light_records: None, one_thread: None) -> FitResult:
    found = fit(config)
    assert found is not None
    return found


def test_pairs_are_of_legs_too(config: Config, fitted: FitResult) -> None:
    """Forward pairs point exactly as the robot does, reverse ones as far as it can."""
    prepared = prepare(config)
    assert verify(prepared.store, prepared.body_map.robot, SILENT) == []
    pairs, body_map = prepared.store.read_all(), prepared.body_map
    human_PD3 = body_map.human_directions(rotation.sixd_to_matrix(pairs["H"]))
    robot_PD3 = body_map.robot_directions(body_map.robot.forward(pairs["q"]))
    off_PD = torch.rad2deg(angle_between(human_PD3, robot_PD3))
    legs = [i for i, d in enumerate(body_map.directions) if d.part.region in ("leg", "foot")]
    assert len(legs) == 8 and int((~pairs["reverse"]).sum()) == 100
    assert float(off_PD[~pairs["reverse"]][:, legs].max()) < 0.1
    assert 1 < float(off_PD[pairs["reverse"]][:, legs].mean()) < 20


def test_every_part_is_measured_and_kept(config: Config, fitted: FitResult) -> None:
    assert "legs [deg]" in fitted.table and "feet [deg]" in fitted.table and "slide [cm/s]" in fitted.table
    assert config.tracking.dir is not None
    kept = open_client(config.tracking.dir, "mrhubo").get_run(fitted.run_id).data.metrics
    assert kept["test/leg_excess_deg"] > 0 and kept["test/retarget/leg_excess_deg"] < 0.1
    assert kept["test/clip/leg_deg"] < kept["test/leg_deg"] and "test/foot_deg" in kept
    assert kept["test/clip/whole_body/sunk"] == kept["test/stream/whole_body/sunk"] == 0
    assert "test/chest_deg" not in kept  # it has no waist


def test_its_package_stands(root: Path, fitted: FitResult, tmp_path: Path) -> None:
    motion = mrhubo.read_motion(cut_motion("wave", tmp_path, (1, 2), every=12))
    retargeter = mrhubo.load(fitted.package)
    found = retargeter(motion)
    assert found.root_position is not None and retargeter.standing is not None
    written = of_package(str(fitted.package)).answer(motion)
    assert written.root_position is not None
    torch.testing.assert_close(torch.from_numpy(written.root_position), found.root_position, atol=1e-5, rtol=0)
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    root_ = motion.root_rotation_T33[0], motion.root_position_T3[0]
    assert mrhubo.Stream(retargeter)(motion.local_TJ33[0], root=root_).root_position is not None
    assert mrhubo.Stream(retargeter)(motion.local_TJ33[0]).root_position is None
    live = LiveRobot.of_package(str(fitted.package), LiveConfig(), "numpy")
    assert live.standing is not None and live.foot_names == found.contact_names
