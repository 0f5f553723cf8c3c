"""Every form gives PyTorch's numbers."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter
from mrhubo.fast.engines import FORMS
from mrhubo.retargeter import Retargeter
from tests.fast.exact import in_double

SAME_RAD = 2e-6
FIELDS = ("confidence", "branch_confidence", "direction_error_deg", "phi", "collision")


@pytest.fixture(scope="module", autouse=True)
def _one_thread(one_thread: None) -> None:
    """Small batches."""


@pytest.fixture(scope="module", params=FORMS)
def fast(retargeter: Retargeter, request: pytest.FixtureRequest) -> FastRetargeter:
    if request.param == "compiled":
        pytest.importorskip("numba")
    return FastRetargeter(retargeter.describe(), request.param)


def largest(found: np.ndarray, wanted: Tensor) -> float:
    assert found.shape == tuple(wanted.shape)
    return float(np.abs(found - wanted.numpy()).max())


def test_directions(fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor) -> None:
    exact = copy.deepcopy(retargeter.body_map.shared).double().of_human(poses.double())
    assert largest(fast.directions(array), exact) < 1e-6


def test_networks(fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor) -> None:
    assert largest(fast.predict(array), retargeter.predict(poses)) < SAME_RAD
    single = np.stack([fast.predict(pose) for pose in array])
    assert np.abs(single - fast.predict(array)).max() < SAME_RAD


def test_steps_are_those_of_the_optimiser(
    fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor
) -> None:
    """In float64, which leaves rounding no say: PyTorch's own float32 ends up to 1e-3 rad elsewhere where a joint hardly
    matters.
    """
    exact = in_double(retargeter)
    target = exact.body_map.human_directions(poses.double())
    start = torch.from_numpy(fast.predict(array)).double()
    for steps in (1, 10):
        wanted = exact.polisher(start.clone(), target, steps)
        found = fast.predict(array, steps, avoid_collisions=False)
        assert largest(found, wanted) < SAME_RAD
        assert np.abs(fast.predict(array[3], steps, avoid_collisions=False) - found[3]).max() < SAME_RAD


def test_steps_away_from_self_collision_are_those_of_pytorch(
    fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor
) -> None:
    assert retargeter.avoidance.collision is retargeter.collision  # its shapes are read in float32
    exact = in_double(retargeter)
    target = exact.body_map.human_directions(poses.double())
    start = exact.polisher(torch.from_numpy(fast.predict(array)).double(), target, 10)
    wanted = exact.avoidance(start, target)
    assert int((wanted != start).any(dim=1).sum()) >= 5, "hardly any pose touches"
    found = fast.predict(array, 10)
    assert largest(found, wanted) < SAME_RAD
    assert np.abs(fast(array).q - found).max() < SAME_RAD
    for frame in range(0, len(array), 4):
        assert np.abs(fast(array[frame]).q - found[frame]).max() < SAME_RAD
    np.testing.assert_array_equal(fast.predict(array, 0), fast.predict(array, 0, avoid_collisions=False))
    turned = target.roll(7, 0)  # what somebody else shows, who is not listened to
    found = fast.engine.avoid(start.numpy(), turned.numpy(), staying=True)
    assert largest(found, exact.avoidance(start, turned, staying=True)) < SAME_RAD


def test_what_is_told_of_an_answer(
    fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor
) -> None:
    for rate, some in ((None, slice(None)), (30.0, slice(15, 25))):
        found = fast(array[some], frame_rate=rate)
        wanted = retargeter.judge(torch.from_numpy(found.q), poses[some], rate)
        for name, most in zip(FIELDS, (1e-4, 1e-4, 2e-3, 1e-4, 0), strict=True):
            assert largest(getattr(found, name).astype(float), getattr(wanted, name).double()) <= most, name
        assert (found.joint_names, found.branch_names) == (wanted.joint_names, wanted.branch_names)
        assert found.direction_names == retargeter.body_map.measured_names and found.frame_rate == rate


def test_answers_are_inside_the_limits_and_no_worse_than_pytorchs(
    fast: FastRetargeter, retargeter: Retargeter, array: np.ndarray, poses: Tensor
) -> None:
    found = torch.from_numpy(fast(array, avoid_collisions=False).q)
    assert bool(((found >= retargeter.directions.lower_N) & (found <= retargeter.directions.upper_N)).all())
    target = retargeter.body_map.human_directions(poses)
    cost = [
        retargeter.directions.cost(q, target) for q in (found, retargeter.predict(poses, 10, avoid_collisions=False))
    ]
    assert bool((cost[0] <= cost[1] + 1e-4).all())


def test_a_frame_alone_and_among_many(fast: FastRetargeter, array: np.ndarray) -> None:
    many = fast(np.tile(array, (3, 1, 1, 1)))
    for frame in (0, 25, 42):
        one = fast(array[frame])
        for name in ("q", *FIELDS):
            np.testing.assert_allclose(
                getattr(one, name), getattr(many, name)[frame + len(array)], atol=SAME_RAD if name == "q" else 2e-3
            )
        assert one.q.shape == (len(one.joint_names),) and one.confidence.shape == ()


def test_a_large_prior_is_coarser_but_for_a_hundredth(make: Callable[[str], Retargeter], array: np.ndarray) -> None:
    """The compiled form keeps its large layers in 16 bits."""
    pytest.importorskip("numba")
    nao = make("nao")
    whole = Retargeter(nao.network, nao.body_map, BodyPrior.open(), nao.config, nao.phi_threshold)
    one, other = (FastRetargeter(whole.describe(), form)(array[:30]) for form in FORMS)
    assert one.phi is not None and other.phi is not None
    np.testing.assert_allclose(one.phi, other.phi, rtol=1e-2)
    np.testing.assert_allclose(one.branch_confidence, other.branch_confidence, atol=5e-3)
    assert np.abs(one.phi - other.phi).max() > 0


def test_directions_in_place_of_poses(make: Callable[[str], Retargeter], array: np.ndarray) -> None:
    fast = FastRetargeter(make("nao").describe(), "numpy")
    found = fast.imitate(fast.directions(array).reshape(4, 11, -1, 3))
    np.testing.assert_array_equal(found.q.reshape(44, -1), fast(array).q)
    with pytest.raises(UserError, match="no unit vector"):
        fast.imitate(2 * fast.directions(array))
    with pytest.raises(UserError, match="see rotations"):
        FastRetargeter(make("reachy").describe(), "numpy").imitate(fast.directions(array))


def test_both_forms_agree_to_the_bit_but_for_rounding(make: Callable[[str], Retargeter], array: np.ndarray) -> None:
    """From the same angles; each form's own networks round differently, and steps enlarge that a little."""
    pytest.importorskip("numba")
    description = make("reachy").describe()
    whole, other_whole = (FastRetargeter(description, form)(array) for form in FORMS)
    assert np.abs(whole.q - other_whole.q).max() < 5 * SAME_RAD
    np.testing.assert_array_equal(whole.collision, other_whole.collision)
    engines = [FastRetargeter(description, form).engine for form in FORMS]
    (target, start), (other_target, other_start) = (engine.look(array, array.shape[:1]) for engine in engines)
    assert np.abs(target - other_target).max() < 1e-6 and np.abs(start - other_start).max() < SAME_RAD
    one, other = (engine.answer(start, target, 10, True, None) for engine in engines)
    assert np.abs(one.q_BN - other.q_BN).max() < SAME_RAD
    np.testing.assert_array_equal(one.collision_B, other.collision_B)


def test_threads_tell_the_first_frame_that_is_wrong(make: Callable[[str], Retargeter], array: np.ndarray) -> None:
    pytest.importorskip("numba")
    fast, many = FastRetargeter(make("nao").describe(), "compiled"), np.tile(array, (8, 1, 1, 1))
    for frame, change, said in ((340, 1.5, "no rotation"), (290, np.nan, "NaN"), (131, 1.5, "no rotation")):
        many[frame, 4, 0, 0] = change
        with pytest.raises(UserError, match=f"pose {frame} holds .*{said}"):
            fast.predict(many)
    many.flags.writeable = False
    np.testing.assert_array_equal(fast.predict(many[:44]), fast.predict(array))
