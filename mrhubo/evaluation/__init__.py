"""How good a retargeter is: human motions with the reference's answers, scores, latency."""

from mrhubo.evaluation.clips import Clip, Motions, load_motions, solve_references
from mrhubo.evaluation.latency import latencies, latency_us
from mrhubo.evaluation.scores import (
    ClipScore,
    Evaluation,
    evaluate_clip,
    evaluate_clips,
    mean_metrics,
    mean_score,
    measures,
    predict_clips,
    run_metrics,
    score_clip,
    table,
)

__all__ = [
    "Clip",
    "ClipScore",
    "Evaluation",
    "Motions",
    "evaluate_clip",
    "evaluate_clips",
    "latencies",
    "latency_us",
    "load_motions",
    "mean_metrics",
    "mean_score",
    "measures",
    "predict_clips",
    "run_metrics",
    "score_clip",
    "solve_references",
    "table",
]
