"""A small fit learns what it did when the golden values were recorded, and learns enough."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.chain import read_motion
from tests.golden.values import CLIPS, LOSSES, facts, logged, measure, platform_key, read_values
from tests.invariance.packages import answers_alike, changed_package
from tests.invariance.rewrite import KINDS, draw_change

pytestmark = pytest.mark.usefixtures("light_records")

TODAY_CM = 0.34
"""`test/link_cm` of the fit: 0.34, 0.29 and 0.33 with the seeds 0, 1 and 2; 9.6 without learning (trainer.lr=1e-9)."""
RECORD = "python -m tests.golden.record writes this platform's values down; tests/golden/README.md says when to"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Folder and figures of the fit and the pairs."""
    folder = tmp_path_factory.mktemp("golden")
    return folder, measure(folder)


@pytest.fixture(scope="module")
def recorded() -> tuple[dict[str, Any], bool]:
    """The figures to compare with, and whether they are of this very platform."""
    known, key = read_values(), platform_key()
    if key in known:
        return known[key], True
    warnings.warn(f"no golden values of {key}, only of {', '.join(known)}: compared roughly. {RECORD}", stacklevel=1)
    return next(iter(known.values())), False


def explain(recorded: dict[str, Any]) -> str:
    return f"recorded on {recorded['recorded_on']}, here {facts()}; if the change of results is meant: {RECORD}"


def test_losses(fitted: tuple[Path, dict[str, Any]], recorded: tuple[dict[str, Any], bool]) -> None:
    """Another rounding keeps another pair in the filter, and the batches of the training differ from then on: the
    single losses move by a tenth (ATEN_CPU_CAPABILITY=default instead of AVX2), their mean by 2%.
    """
    losses, (golden, same_platform) = fitted[1]["losses"], recorded
    assert len(losses) == LOSSES
    if same_platform:
        assert losses == golden["losses"], explain(golden)
    else:
        assert np.mean(losses) == pytest.approx(np.mean(golden["losses"]), rel=0.1)
        assert np.all(np.abs(np.log(np.divide(losses, golden["losses"]))) < np.log(2))


@pytest.mark.parametrize("solver", ["direct", "reverse", "fine", "fast", "paper"])
def test_shards(fitted: tuple[Path, dict[str, Any]], recorded: tuple[dict[str, Any], bool], solver: str) -> None:
    """Another rounding moves the mean of a tensor by 0.2% or less. The paper's solver takes one step length for all
    poses, and so another path: residuals and costs move by up to 18%, latents by 3% (six roundings).
    """
    found, (golden, same_platform) = fitted[1]["shards"][solver], recorded
    if same_platform:
        assert found == golden["shards"][solver], explain(golden)
    else:
        rough = {"cost": 0.25, "residual_m": 0.25, "z_norm": 0.05} if solver == "paper" else {}
        means = golden["shards"][solver]["means"]
        assert found["means"] == {name: pytest.approx(mean, rel=rough.get(name, 0.01)) for name, mean in means.items()}


def test_reference(fitted: tuple[Path, dict[str, Any]], recorded: tuple[dict[str, Any], bool]) -> None:
    """Another rounding moves it by 3e-6 rad."""
    found, (golden, same_platform) = fitted[1]["reference"], recorded
    if same_platform:
        assert found == golden["reference"], explain(golden)
    else:
        np.testing.assert_allclose(found, golden["reference"], atol=1e-3)


def test_what_was_learnt_does_not_depend_on_how_the_robot_is_written(
    fitted: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    """Other names, another order, axes negated, another base: the trained networks give the same motion."""
    (package,) = (fitted[0] / "mlruns" / "packages").iterdir()
    change = draw_change(package / "config.yaml", 5, *KINDS)
    changed = changed_package(package, change, tmp_path / "changed")
    for name in CLIPS[:2]:
        answers_alike(package, changed, change, read_motion(fitted[0] / "motions" / f"{name}.npz"))


def test_it_learns(fitted: tuple[Path, dict[str, Any]]) -> None:
    (link_cm,) = logged(fitted[0], "test/link_cm")
    (polished_cm,) = logged(fitted[0], "test/retarget/link_cm")
    assert link_cm < 2 * TODAY_CM
    assert polished_cm < link_cm
