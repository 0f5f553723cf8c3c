"""The step of a fit in which the reference retargeter answers the human motions that measure the result."""

from __future__ import annotations

from mrhubo.evaluation import Clip, solve_references
from mrhubo.fitting.preparation import Prepared
from mrhubo.runtime.progress import Reporter


def make_references(prepared: Prepared, report: Reporter) -> tuple[list[Clip], list[Clip]]:
    """Validation and test clips with the reference retargeter's joint angles; what is on disk is not solved again."""
    return solve_references(prepared.config, prepared.body_map, prepared.motions, prepared.references_dir, report)
