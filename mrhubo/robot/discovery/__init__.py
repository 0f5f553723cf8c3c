"""Finds out from a robot's URDF, by geometry first and names last, which link stands for which part of a human body."""

from mrhubo.robot.discovery.discover import discover
from mrhubo.robot.discovery.result import (
    Candidate,
    Discovery,
    FoundAxis,
    FoundEnd,
    FoundPoint,
    FoundRange,
    Question,
)

__all__ = ["Candidate", "Discovery", "FoundAxis", "FoundEnd", "FoundPoint", "FoundRange", "Question", "discover"]
