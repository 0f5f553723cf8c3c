"""The terms of the reference retargeter's cost, one a file."""

from mrhubo.fast.together.smoothness import REFERENCE_RATE, pull_at
from mrhubo.reference.terms.direction_jerk import DirectionJerk
from mrhubo.reference.terms.directions import DirectionTerm
from mrhubo.reference.terms.posture import PostureTerm
from mrhubo.reference.terms.self_collision import SelfCollisionTerm
from mrhubo.reference.terms.smoothness import Smoothness
from mrhubo.reference.terms.term import Quadratic, State, Term

__all__ = [
    "REFERENCE_RATE",
    "DirectionJerk",
    "DirectionTerm",
    "PostureTerm",
    "Quadratic",
    "SelfCollisionTerm",
    "Smoothness",
    "State",
    "Term",
    "pull_at",
]
