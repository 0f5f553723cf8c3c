"""The body prior's wide layers, cut to what they carry."""

from collections.abc import Callable

import numpy as np
import pytest

from mrhubo.body import BodyPrior
from mrhubo.retargeter import Retargeter

pytest.importorskip("numba")
from mrhubo.fast.narrowing import LARGE, narrowed
from mrhubo.fast.plain.networks import ACTIVATIONS


def test_a_narrow_layer_gives_what_the_wide_one_gives(make: Callable[[str], Retargeter]) -> None:
    nao = make("nao")
    d = Retargeter(nao.network, nao.body_map, BodyPrior.open(), nao.config, nao.phi_threshold).describe()
    layers, act = narrowed(d), ACTIVATIONS[d.settings.activation]
    assert len(layers) > len(d.prior.encoder), "NAO's arms need few dimensions"
    assert sum(weight.size for weight, _, _ in layers) < sum(weight.size for weight, _ in d.prior.encoder) / 2
    # People at rest, whose prior's input is 0.
    wide = narrow = np.zeros((1, d.prior.encoder[0][0].shape[1]), np.float32)
    for number, (weight, bias) in enumerate(d.prior.encoder):
        wide = (act(wide) if number else wide) @ weight.T + bias
    for number, (weight, bias, linear) in enumerate(layers):
        narrow = (act(narrow) if number and not linear else narrow) @ weight.T + bias
    np.testing.assert_allclose(narrow, wide, atol=1e-2 * float(np.abs(wide).max()))


def test_small_layers_stay_as_they_are(make: Callable[[str], Retargeter]) -> None:
    d = make("nao").describe()
    assert all(weight.size < LARGE for weight, _ in d.prior.encoder)
    for (weight, bias, linear), (own, own_bias) in zip(narrowed(d), d.prior.encoder, strict=True):
        assert weight is own and bias is own_bias and not linear
