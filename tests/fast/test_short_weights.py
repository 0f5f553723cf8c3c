"""Weights of 16 bits."""

import numpy as np
import pytest

from mrhubo.fast.short_weights import are_short, rounded, shortened


@pytest.mark.parametrize("size", [1e-35, 1e-20, 1e-3, 1.0, 32_767.0, 32_768.0, 1e20])
def test_weights_differ_by_half_a_step_and_are_rounded_once(size: float) -> None:
    random = np.random.default_rng(0)
    weight_OE = (size * random.uniform(-1, 1, size=(200, 7))).astype(np.float32)
    weight_OE[0] = 0
    weight_OE[1], weight_OE[2] = size, -size  # the ends of what 16 bits hold
    steps_OE, step_O = shortened(weight_OE)
    assert steps_OE.dtype == np.int16 and step_O.dtype == np.float32 and steps_OE.min() > -32_768
    np.testing.assert_array_equal(np.frexp(step_O)[0], 0.5)  # powers of two
    near_OE = rounded(weight_OE)
    assert near_OE.dtype == np.float32 and not near_OE[0].any()
    most_O = np.maximum(np.abs(weight_OE).max(axis=1), 1e-30) / 32_767
    assert (np.abs(near_OE - weight_OE).max(axis=1) <= most_O).all()
    assert are_short(near_OE) and not are_short(weight_OE)
    again_OE, _ = shortened(near_OE)
    np.testing.assert_array_equal(again_OE, steps_OE)


def test_a_layer_of_no_inputs() -> None:
    assert are_short(np.zeros((3, 0), np.float32))
