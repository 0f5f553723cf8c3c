"""How good a retargeter is: human motions with the reference's answers, scores, measures, tables, latency."""

from mrhubo.evaluation.clips import Clip, Motions, load_motions, reshare_clips, solve_references
from mrhubo.evaluation.latency import latencies, latency_us
from mrhubo.evaluation.measures import (
    Evaluation,
    evaluate_clip,
    evaluate_clips,
    mean_metrics,
    measures,
    run_metrics,
)
from mrhubo.evaluation.scores import ClipScore, mean_score, predict_clips, score_clip
from mrhubo.evaluation.tables import motion_table, table

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
    "motion_table",
    "predict_clips",
    "reshare_clips",
    "run_metrics",
    "score_clip",
    "solve_references",
    "table",
]
