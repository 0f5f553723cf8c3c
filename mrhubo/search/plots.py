"""Pictures of an Optuna study: its history, what mattered, which values went together."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

from PIL import Image

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from optuna.study import Study


def study_plots(study: Study, measure: str) -> Mapping[str, Image.Image]:
    """`history`, and where there are two complete trials or more `importance` and `parallel`; `measure` names the value
    with its unit.
    """
    from optuna.exceptions import ExperimentalWarning
    from optuna.importance import PedAnovaImportanceEvaluator
    from optuna.trial import TrialState
    from optuna.visualization import matplotlib as plots

    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        warnings.simplefilter("ignore", UserWarning)  # of layouts and of parameters that never varied
        found = {"history": _image(plots.plot_optimization_history(study, target_name=measure))}
        if len(complete) > 1 and len({trial.value for trial in complete}) > 1:
            evaluator = PedAnovaImportanceEvaluator()
            found["importance"] = _image(plots.plot_param_importances(study, evaluator=evaluator, target_name=measure))
            found["parallel"] = _image(plots.plot_parallel_coordinate(study, target_name=measure), width=11.0)
    return found


def _image(axes: Axes, width: float = 8.0) -> Image.Image:
    """The figure of these axes as a picture, and no longer in matplotlib's memory."""
    figure = axes.figure
    figure.set_size_inches(width, 4.5)  # pyright: ignore[reportAttributeAccessIssue]
    stream = io.BytesIO()
    figure.savefig(stream, dpi=100, bbox_inches="tight", facecolor="white")  # pyright: ignore[reportAttributeAccessIssue]
    close(axes)
    stream.seek(0)
    return Image.open(stream).convert("RGB")


def close(axes: Axes) -> None:
    """Lets go of the figure of these axes, which matplotlib would keep."""
    import matplotlib.pyplot as plt

    plt.close(axes.figure)  # pyright: ignore[reportArgumentType]
