"""Distributions side by side: one panel a measure, one line a series."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

_COLORS = ("#3b76af", "#d9822b", "#4f9a57", "#8a63b0")


def distributions(
    series: Mapping[str, Mapping[str, np.ndarray]], titles: Mapping[str, str], size: tuple[int, int] = (1080, 300)
) -> Image.Image:
    """Histograms, over a logarithmic axis where the values span more than a factor of 30.

    Args:
        series: values (P,) by measure, by name of the series. Values at or below zero are drawn at the smallest
            positive one.
        titles: measures to show and the labels of their axes, in order.
        size: of the picture, in pixels.

    Raises:
        ValueError: a series is empty, holds no positive number, or one that is not finite.
    """
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(titles), squeeze=False)[0]
    for axes, (measure, title) in zip(panels, titles.items(), strict=True):
        values = {name: np.asarray(columns[measure], float).reshape(-1) for name, columns in series.items()}
        for name, numbers in values.items():
            if not len(numbers) or not np.isfinite(numbers).all() or numbers.max() <= 0:
                raise ValueError(f"distributions: {measure} of '{name}' must hold finite numbers, some above zero")
        positive = np.concatenate([numbers[numbers > 0] for numbers in values.values()])
        low, high = np.quantile(positive, 0.0005), positive.max()
        logarithmic = high > 30 * low
        edges = (np.geomspace if logarithmic else np.linspace)(low, max(high, 1.01 * low), 61)
        for (name, numbers), color in zip(values.items(), _COLORS * len(values), strict=False):
            share = np.histogram(np.clip(numbers, edges[0], edges[-1]), edges)[0] / len(numbers)
            axes.stairs(100 * share, edges, color=color, label=name, fill=len(values) == 1, linewidth=1.6)
            axes.axvline(numbers.mean(), color=color, linewidth=1.0, linestyle="--")
        if logarithmic:
            axes.set_xscale("log")
        axes.set_xlabel(f"{title} (dashed: mean)")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("share of pairs [%]")
    if len(series) > 1:
        panels[0].legend(frameon=False, fontsize=9)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
