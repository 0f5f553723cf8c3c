"""The universal network without PyTorch: both forms give PyTorch's angles, for any weights."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.fast import FastRetargeter
from mrhubo.fast.description import FILE
from mrhubo.fast.engines import FORMS
from mrhubo.fast.plain.universal import _softmax
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.universal.robots import RobotBranch, UnfitBranch
from tests.fast.altered import Altered
from tests.fast.exact import in_double
from tests.fast.untrained import SIZES, random_network

pytestmark = pytest.mark.usefixtures("one_thread")
USUAL_RAD, LAYERS_RAD = 1e-6, 2e-4
"""How far apart the forms may be: nearly all frames, and those whose steps enlarge the rounding of float32 layers."""


def make_untrained(name: str) -> Retargeter:
    """A robot's retargeter with random weights."""
    network = random_network(name)
    torch.manual_seed(1)
    body_map, prior = BodyMap.of(Robot.from_config(name)), BodyPrior(hidden=20).eval()
    return Retargeter(UniversalJoints(body_map, network), body_map, prior, None, phi_threshold=0.01)


@pytest.fixture(scope="module")
def made() -> Callable[[str], Retargeter]:
    found: dict[str, Retargeter] = {}
    return lambda name: found.setdefault(name, found.get(name) or make_untrained(name))


def compared(retargeter: Retargeter, form: str, array: np.ndarray, poses: Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Distance of angles (B,) [rad] from PyTorch in float64, and how much more blocks cost (B, C)."""
    found = torch.from_numpy(FastRetargeter(retargeter.describe(), form).predict(array)).double()
    exact = in_double(retargeter)
    with torch.no_grad():
        target = exact.body_map.human_directions(poses.double())
        wanted = exact.network.of_directions(target)
        more = exact.directions.cost(found, target) - exact.directions.cost(wanted, target)
    return (found - wanted).abs().amax(dim=1).numpy(), more.numpy()


def same(off_B: np.ndarray, more_BC: np.ndarray) -> None:
    """All but the two frames of these 44 in which two valleys may be equally deep, so that rounding chooses."""
    assert np.quantile(off_B, 0.75) < USUAL_RAD and np.sort(off_B)[-3] < LAYERS_RAD
    assert np.sort(np.abs(more_BC).max(axis=1))[-3] < 1e-6


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("form", FORMS)
def test_angles_are_pytorchs(
    form: str, name: str, made: Callable[[str], Retargeter], array: np.ndarray, poses: Tensor
) -> None:
    if form == "compiled":
        pytest.importorskip("numba")
    off_B, more_BC = compared(made(name), form, array, poses)
    same(off_B, more_BC)


@pytest.mark.parametrize("form", FORMS)
def test_a_branch_that_the_network_does_not_know_gets_steps(
    form: str, array: np.ndarray, poses: Tensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    if form == "compiled":
        pytest.importorskip("numba")
    begin = RobotBranch.__init__

    def unfit(self: RobotBranch, problem: torch.nn.Module, block: int) -> None:
        if block == 1:
            raise UnfitBranch("of another kind")
        begin(self, problem, block)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(RobotBranch, "__init__", unfit)
    retargeter = make_untrained("nao")
    assert len(retargeter.describe().universal.block_E) == 1  # pyright: ignore[reportOptionalMemberAccess]
    off_B, more_BC = compared(retargeter, form, array, poses)
    same(off_B, more_BC)


@pytest.mark.parametrize("form", FORMS)
def test_frames_alone_or_together_and_none(form: str, made: Callable[[str], Retargeter], array: np.ndarray) -> None:
    if form == "compiled":
        pytest.importorskip("numba")
    fast = FastRetargeter(made("nao").describe(), form)
    many = fast.predict(np.tile(array, (4, 1, 1, 1)))
    np.testing.assert_allclose(fast.predict(array[3]), many[3 + len(array)], atol=USUAL_RAD)
    assert fast.predict(array[:0]).shape == (0, 8)
    cost = fast.description.cost
    assert bool(((many >= cost.lower_N - 1e-6) & (many <= cost.upper_N + 1e-6)).all())


def test_one_file_answers_without_training_and_pytorch(
    made: Callable[[str], Retargeter], array: np.ndarray, tmp_path: Path
) -> None:
    retargeter = made("nao")
    (tmp_path / "robot").mkdir()
    file = retargeter.save_description(tmp_path / "robot")
    assert file == tmp_path / "robot" / FILE
    fast = mrhubo.load_fast(file, "numpy")
    assert fast.facts.made_by == retargeter.facts.made_by
    assert fast.facts.on_base == retargeter.facts.on_base != {}
    np.testing.assert_array_equal(fast(array).q, FastRetargeter(retargeter.describe(), "numpy")(array).q)
    found = fast.imitate(fast.directions(array))
    np.testing.assert_array_equal(found.q, fast(array).q)
    stream = mrhubo.FastStream(fast, rate=30.0)
    assert np.isfinite(np.stack([stream(pose).q for pose in array[:3]])).all()


def test_a_damaged_file_is_refused(made: Callable[[str], Retargeter], tmp_path: Path) -> None:
    """Compiled functions would read what is not theirs."""
    file = made("nao").save_description(tmp_path)
    assert file is not None
    altered = Altered(file)
    own = [name for name in altered.arrays if name.startswith("universal.")]
    for name in own:
        if len(altered.arrays[name]) > 1:
            altered.refused(name, altered.arrays[name][:-1])
        for value in () if "weights" in name else (-7, 10**6):
            altered.refused_with(name, value)
    assert len(own) > 30


def test_who_has_made_underflow_an_error_gets_answers() -> None:
    """As `np.seterr(all="raise")` does; weights that are nearly 0 are as good as 0."""
    with np.errstate(all="raise"):
        np.testing.assert_array_equal(_softmax(np.array([[0.0, -1e3]], np.float32)), [[1.0, 0.0]])
