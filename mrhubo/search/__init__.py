"""Searching for settings: spaces of config keys, Optuna studies that any number of processes work on, sweeps."""

from mrhubo.search.space import Dimension, check_fixed, override, read_space, refuse_fixed
from mrhubo.search.studies import open_study, open_trials, remaining, work_on

__all__ = [
    "Dimension",
    "check_fixed",
    "open_study",
    "open_trials",
    "override",
    "read_space",
    "refuse_fixed",
    "remaining",
    "work_on",
]
