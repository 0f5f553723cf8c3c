"""What happens around a training: metrics on clips, pictures, progress, the search of the scale factor."""

from mrhubo.callbacks.clips import Clip, Motions, load_motions, solve_references
from mrhubo.callbacks.metrics import ClipMetrics, ClipScore, mean_score, predict_clips, score_clip

__all__ = [
    "Clip",
    "ClipMetrics",
    "ClipScore",
    "Motions",
    "load_motions",
    "mean_score",
    "predict_clips",
    "score_clip",
    "solve_references",
]
