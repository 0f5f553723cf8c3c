"""Pictures of a study show its trials, as many of them as there are."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import optuna
import pytest

from mrhubo.search.plots import study_plots


@pytest.mark.parametrize(("values", "names"), [([], {"history"}), ([1.0], {"history"}), ([2.0, 2.0], {"history"}),
                                               ([3.0, 1.0, 2.0], {"history", "importance", "parallel"})])  # fmt: skip
def test_what_can_be_told_is_drawn(values: list[float], names: set[str]) -> None:
    study = optuna.create_study()
    distribution = optuna.distributions.FloatDistribution(0.0, 1.0)
    for number, value in enumerate(values):
        params = {"a": number / 10, "b": 1 - number / 20}
        distributions = dict.fromkeys(params, distribution)
        study.add_trial(optuna.trial.create_trial(params=params, distributions=distributions, value=value))
    before = plt.get_fignums()
    found = study_plots(study, "error [cm]")
    assert set(found) == names and plt.get_fignums() == before
    for picture in found.values():
        assert picture.width > 500 and picture.height > 300
        assert not values or len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0)) > 20


def test_other_values_are_another_picture() -> None:
    """The drawing follows the trials."""
    pictures = []
    for values in ([1.0, 2.0], [2.0, 1.0]):
        study = optuna.create_study()
        for value in values:
            study.add_trial(optuna.trial.create_trial(value=value))
        pictures.append(np.asarray(study_plots(study, "error")["history"]))
    assert pictures[0].shape != pictures[1].shape or (pictures[0] != pictures[1]).mean() > 0.001
