"""Lightning callbacks: joint and link metrics, checkpoints, the search of the scale factor, pruning, progress."""

from mrhubo.callbacks.checkpoints import BEST, LAST, CheckedFiles, Checkpoints, resumable
from mrhubo.callbacks.metrics import ClipMetrics
from mrhubo.callbacks.progress import TrainingProgress
from mrhubo.callbacks.pruning import Pruning
from mrhubo.callbacks.scale_search import ScaleFactorSearch, ScaleResult

__all__ = [
    "BEST",
    "LAST",
    "CheckedFiles",
    "Checkpoints",
    "ClipMetrics",
    "Pruning",
    "ScaleFactorSearch",
    "ScaleResult",
    "TrainingProgress",
    "resumable",
]
