"""The body prior's wide layers, cut to what they carry for one robot.

What a robot's parts ask of a human are a few directions. The poses that are read from them turn a few joints in a few
ways, so that the thousand numbers between two of the prior's layers stay close to a space of far fewer dimensions. A
layer that reads them needs its weights in that space alone: W a is nearly (W V)(V' a), where the columns of V span it.
The space is found from poses drawn at random, small turns and wild ones, and kept where it holds them all.

Legend: S poses, T turned human joints, E and O numbers between layers, R dimensions.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import directions_of
from mrhubo.fast.plain.judging import read_pose
from mrhubo.fast.plain.networks import ACTIVATIONS
from mrhubo.fast.plain.root_turn import turned_back
from mrhubo.fast.rotations import axis_angle_to_matrix

LARGE = 2**16
"""Weights of a layer that is large."""
LOST = 1e-3
"""Share of the length of the numbers between layers that may be lost, as root mean square over the poses. NAO's phi
changed by 5 in a thousand at most."""
_POSES, _MOST, _EACH, _JOINTS = 512, 192, 16, 21
"""Poses that are drawn; dimensions at most, and their step."""
_SMALL, _WILD = (0.02, 0.6), (0.1, 2.5)
"""Standard deviations of turns [rad], from the first pose to the last of each half."""


def find_spaces(d: Description) -> tuple[np.ndarray, ...]:
    """For each layer of the encoder, columns (E, R), float32, whose space holds what it reads; none where it is small,
    or the space is not much smaller. The decoder's fewer numbers need nearly all of their dimensions.
    """
    act, spaces = ACTIVATIONS[d.settings.activation], []
    for number, (weight, _) in enumerate(d.prior.encoder):
        spaces.append(np.zeros((weight.shape[1], 0), np.float32))
        if weight.size < LARGE:
            continue
        x_SE = _inputs(d)
        for before, bias in d.prior.encoder[:number]:
            x_SE = act(x_SE @ before.T + bias)
        space_ER = _space(x_SE)
        if space_ER is not None and space_ER.shape[1] * sum(weight.shape) <= weight.size / 2:
            spaces[-1] = space_ER
    return tuple(spaces)


def narrowed(d: Description) -> list[tuple[np.ndarray, np.ndarray, bool]]:
    """The encoder's layers: weights (O, E), biases (O,), and whether no activation stands before."""
    found = []
    spaces = find_spaces(d) if d.prior.spaces is None else d.prior.spaces
    for (weight, bias), space_ER in zip(d.prior.encoder, spaces, strict=True):
        if count := space_ER.shape[1]:
            found.append((np.ascontiguousarray(space_ER.T), np.zeros(count, np.float32), False))
            found.append((weight @ space_ER, bias, True))
        else:
            found.append((weight, bias, False))
    return found


def _inputs(d: Description) -> np.ndarray:
    """What the encoder sees of random poses (S, 6 T), float32."""
    random = np.random.default_rng(0)
    scale_S = np.concatenate([np.linspace(*ends, _POSES // 2) for ends in (_SMALL, _WILD)])
    local_SJ33 = axis_angle_to_matrix(random.normal(size=(_POSES, _JOINTS, 3)) * scale_S[:, None, None])
    local_SJ33 = local_SJ33.astype(np.float32)
    target_SD3 = directions_of(d.human, d.settings.constants, local_SJ33)
    target_SD3 = turned_back(d.root, target_SD3, local_SJ33)
    off_ST33 = read_pose(d.reading, d.settings.constants, target_SD3) - np.eye(3)
    return off_ST33[..., :2].swapaxes(-1, -2).reshape(_POSES, -1).astype(np.float32)


def _space(x_SE: np.ndarray) -> np.ndarray | None:
    """Orthonormal columns (E, R), float32, whose space holds numbers but for what may be lost, with the fewest columns
    in whole steps; None: there is no such space. After Halko, Martinsson and Tropp, "Finding structure with randomness"
    (2011), with one power iteration.
    """
    most = min(_MOST, *x_SE.shape)
    random_SR = np.random.default_rng(1).normal(size=(len(x_SE), most)).astype(np.float32)
    begun_ER, _ = np.linalg.qr(x_SE.T @ random_SR)
    wide_ER, _ = np.linalg.qr((x_SE.T @ (x_SE @ begun_ER)).astype(np.float64))
    inside_SR = x_SE @ wide_ER
    square_R, turn_RR = np.linalg.eigh(inside_SR.T @ inside_SR)
    whole = np.square(x_SE, dtype=np.float64).sum()
    for count in range(_EACH, most + 1, _EACH):
        if whole - square_R[-count:].sum() <= LOST**2 * whole:
            return (wide_ER @ turn_RR[:, -count:]).astype(np.float32)
    return None
