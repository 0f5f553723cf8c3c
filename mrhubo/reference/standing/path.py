"""Where the root goes so that planted points stay where they are: one least-squares problem for the whole motion.

    sum_t,p w_tp |d_t + c_tp - a_k(t,p)|^2  +  tau^4 sum_t |d''_t|^2  +  eps^2 sum_t |d_t|^2

d is what the root is off the person's scaled path; c where a sole's point would be on that path; a the place of each
contact, one for all of its frames. So planted feet carry the root, at touch-down and lift-off one takes over from the
other as its weight w grows, in flight the root moves as the person's does, and eps takes out what adds up over steps.

Legend: T frames, P points of soles, K contacts, X coordinates.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

TAU_S = 0.05
"""Accelerations that differ from the person's for so long [s] cost as much as a foot that is off by as many metres."""
EPSILON = 0.1
"""What the root is off the path costs against what a planted foot is: steps of legs of other proportions are drawn
out or shortened by some per cent, and do not add up."""


def carry(
    on_path_TPX: np.ndarray,
    weight_TP: np.ndarray,
    phase_TP: np.ndarray,
    frame_rate: float,
    place_KX: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """What the root is off the path (T, X), and the places of the contacts (K, X) [m].

    Args:
        on_path_TPX: where points of soles are, with the root on the path [m].
        weight_TP: how much each is planted, 0..1.
        phase_TP: in which contact it is; -1: none.
        frame_rate: frames per second.
        place_KX: the places of the contacts, where they are known [m].
    """
    frames, contacts = len(on_path_TPX), int(phase_TP.max(initial=-1)) + 1
    row_C, point_C = np.nonzero(weight_TP)
    phase_C, weight_C, place_CX = phase_TP[row_C, point_C], weight_TP[row_C, point_C], on_path_TPX[row_C, point_C]
    system = sparse.diags_array(np.full(frames, EPSILON**2) + np.bincount(row_C, weight_C, frames))
    system = system + (TAU_S * frame_rate) ** 4 * _bent(frames)
    right_TX = -_sums(row_C, weight_C[:, None] * place_CX, frames)
    if place_KX is not None:
        right_TX += _sums(row_C, weight_C[:, None] * place_KX[phase_C], frames)
        return _solve(system, right_TX), place_KX
    couple = sparse.coo_array((-weight_C, (row_C, phase_C)), shape=(frames, contacts))
    whole_K = np.bincount(phase_C, weight_C, contacts)
    whole = sparse.block_array([[system, couple], [couple.T, sparse.diags_array(np.maximum(whole_K, 1e-9))]])
    right_KX = _sums(phase_C, weight_C[:, None] * place_CX, contacts)
    found = _solve(whole, np.concatenate((right_TX, right_KX)))
    return found[:frames], found[frames:]


def _bent(frames: int) -> Any:
    """The matrix of the sum of squared second differences."""
    row_X, lag_X = np.repeat(np.arange(max(frames - 2, 0)), 3), np.tile([0, 1, 2], max(frames - 2, 0))
    second = sparse.coo_array((np.array([1.0, -2.0, 1.0])[lag_X], (row_X, row_X + lag_X)), shape=(frames, frames))
    return second.T @ second


def _sums(row_C: np.ndarray, value_CX: np.ndarray, rows: int) -> np.ndarray:
    found = np.zeros((rows, value_CX.shape[1]))
    np.add.at(found, row_C, value_CX)
    return found


def _solve(system: Any, right_RX: np.ndarray) -> np.ndarray:
    return np.asarray(spsolve(sparse.csc_array(system), right_RX)).reshape(right_RX.shape)
