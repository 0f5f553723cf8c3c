"""Searching for settings: spaces of config keys, Optuna studies that any number of processes work on, sweeps."""

from mrhubo.search.space import Dimension, read_space
from mrhubo.search.studies import database_of, open_study, open_trials, remaining, work_on

__all__ = ["Dimension", "database_of", "open_study", "open_trials", "read_space", "remaining", "work_on"]
