"""What a fit keeps in MLflow: its run, what went in and came out, pictures, the package as a model version."""

from mrhubo.fitting.record.naming import dashboard_command, run_name
from mrhubo.fitting.record.outcome import log_answers, log_look, log_measures
from mrhubo.fitting.record.packages import register_package, save_package
from mrhubo.fitting.record.pairs import log_pairs, log_scale
from mrhubo.fitting.record.predictions import log_predictions, read_predictions
from mrhubo.fitting.record.recording import Recording

__all__ = [
    "Recording",
    "dashboard_command",
    "log_answers",
    "log_look",
    "log_measures",
    "log_pairs",
    "log_predictions",
    "log_scale",
    "read_predictions",
    "register_package",
    "run_name",
    "save_package",
]
