"""Lightning callbacks: joint and link metrics, the search of the scale factor, pruning, progress."""

from mrhubo.callbacks.metrics import ClipMetrics
from mrhubo.callbacks.progress import TrainingProgress
from mrhubo.callbacks.pruning import Pruning
from mrhubo.callbacks.scale_search import ScaleFactorSearch, ScaleResult

__all__ = ["ClipMetrics", "Pruning", "ScaleFactorSearch", "ScaleResult", "TrainingProgress"]
