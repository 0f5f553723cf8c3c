"""How honest a probability is, drawn: what was promised against what came true, and how well bad is told from good."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

_COLORS = ("#3b76af", "#d9822b", "#4f9a57", "#8a63b0")
_BINS = 10


def reliability_curve(promised_X: np.ndarray, true_X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean promise, share that came true, and count of each of ten bins of equal width that is not empty."""
    bin_X = np.minimum((promised_X * _BINS).astype(int), _BINS - 1)
    count = np.bincount(bin_X, minlength=_BINS)
    there = count > 0
    sums = [np.bincount(bin_X, weights=values, minlength=_BINS)[there] for values in (promised_X, true_X)]
    return sums[0] / count[there], sums[1] / count[there], count[there]


def roc_curve(score_X: np.ndarray, bad_X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of good ones that are taken for bad, and share of bad ones that are found, for every limit on a score that
    is low where something is bad.
    """
    order = np.argsort(score_X, kind="stable")
    last = np.append(np.diff(score_X[order]) > 0, True)  # of those with one score
    found, mistaken = np.cumsum(bad_X[order])[last], np.cumsum(~bad_X[order])[last]
    return np.append(0, mistaken) / max(1, mistaken[-1]), np.append(0, found) / max(1, found[-1])


def roc_area(score_X: np.ndarray, bad_X: np.ndarray) -> float:
    """Probability that something bad has a lower score than something good; ties count half."""
    mistaken, found = roc_curve(score_X, bad_X)
    return float(np.trapezoid(found, mistaken))


def reliability_sheet(
    promised: Mapping[str, tuple[np.ndarray, np.ndarray]], told_apart: Mapping[str, tuple[np.ndarray, np.ndarray]]
) -> Image.Image:
    """Two panels: reliability curves, and receiver operating characteristics.

    Args:
        promised: by name, probabilities (X,) and what came true (X,), bool.
        told_apart: by name, scores (X,) that are low where something is bad, and what is bad (X,), bool.
    """
    figure = Figure(figsize=(10.0, 4.4), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for color, (name, (promised_X, true_X)) in zip(_COLORS, promised.items(), strict=False):
        mean, share, _ = reliability_curve(promised_X, true_X)
        left.plot(mean, share, "o-", color=color, label=name)
    left.plot([0, 1], [0, 1], color="0.6", linewidth=1, linestyle="--")
    left.set_xlabel("confidence")
    left.set_ylabel("share of good answers")
    for color, (name, (score_X, bad_X)) in zip(_COLORS, told_apart.items(), strict=False):
        area = roc_area(score_X, bad_X)
        right.plot(*roc_curve(score_X, bad_X), color=color, label=f"{name}: {area:.3f}")
    right.plot([0, 1], [0, 1], color="0.6", linewidth=1, linestyle="--")
    right.set_xlabel("good frames taken for bad")
    right.set_ylabel("bad frames found")
    for axes in (left, right):
        axes.set_xlim(0, 1)
        axes.set_ylim(0, 1)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=9, loc="lower right")
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
