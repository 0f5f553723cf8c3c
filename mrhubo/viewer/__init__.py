"""Motions to look at: a stage with the person and robots side by side, in the browser, as a page, a film, a sheet."""

from mrhubo.viewer.performance import Performance, perform
from mrhubo.viewer.person import Person, read_person
from mrhubo.viewer.stage import Stage, arrange

__all__ = ["Performance", "Person", "Stage", "arrange", "perform", "read_person"]
