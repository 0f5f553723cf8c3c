"""Bars in groups: one panel a measure, one group a subject, one bar a method, with what others reported as marks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

_COLORS = ("#3b76af", "#d9822b", "#4f9a57", "#8a63b0", "#b0524a", "#6c737d")

Cells = Mapping[str, Mapping[str, tuple[float, float]]]
"""(mean, standard deviation) by method, by subject."""


def grouped_bars(
    panels: Mapping[str, Cells], marks: Mapping[str, Mapping[str, Mapping[str, float]]], mark_name: str
) -> Image.Image:
    """A chart of `panels` (by the label of the y axis), with a black mark where `marks` has a value for the same bar.

    Raises:
        ValueError: there is nothing to draw.
    """
    if not any(cells for panel in panels.values() for cells in panel.values()):
        raise ValueError("grouped_bars: there is nothing to draw")
    figure = Figure(figsize=(5.4 * len(panels), 3.6), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for axes, (label, subjects) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels.items(), strict=True):
        methods = list(dict.fromkeys(method for cells in subjects.values() for method in cells))
        width = 0.8 / len(methods)
        for column, method in enumerate(methods):
            places = [
                (place - 0.4 + (column + 0.5) * width, subject)
                for place, subject in enumerate(subjects)
                if method in subjects[subject]
            ]
            x = np.array([place for place, _ in places])
            mean, spread = np.array([subjects[subject][method] for _, subject in places]).T
            axes.bar(x, mean, 0.92 * width, yerr=spread, color=_COLORS[column % len(_COLORS)], label=method,
                     error_kw={"linewidth": 1.0})  # fmt: skip
            marked = [(place, marks.get(label, {}).get(subject, {}).get(method)) for place, subject in places]
            marked = [(place, value) for place, value in marked if value is not None]
            if marked:
                axes.plot(*np.array(marked).T, "_", color="black", markersize=60 * width, markeredgewidth=1.6)
        axes.set_xticks(range(len(subjects)), list(subjects))
        axes.set_ylabel(label)
        axes.spines[["top", "right"]].set_visible(False)
    first = figure.axes[0]
    if any(marks.values()):
        first.plot([], [], "_", color="black", markersize=12, markeredgewidth=1.6, label=mark_name)
    figure.legend(*first.get_legend_handles_labels(), loc="outside upper center", ncols=7, frameon=False, fontsize=9)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
