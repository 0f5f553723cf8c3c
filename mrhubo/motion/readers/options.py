"""What the user knows of a motion file that the file does not tell."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mrhubo.errors import UserError, shortened

RATES = (1.0, 1000.0)
"""Frames per second that are believed."""


class NoRate(UserError):
    """A motion file does not tell its frame rate, and nobody else does."""

    def __init__(self, path: Path, why: str) -> None:
        """`why`: what the file tells in place of it, for a sentence about the file."""
        super().__init__(
            f"{path}: {why}; say what it is, by --rate 30 on the command line or ReadOptions(rate=30) in Python"
        )
        self.path, self.why = path, why

    def instead(self, remedy: str) -> UserError:
        """The same where neither is there to be used: what to do then."""
        return UserError(f"{self.path}: {self.why}; {remedy}")


@dataclass(frozen=True)
class ReadOptions:
    """How a motion file is to be read, as far as the file itself does not say."""

    rate: float | None = None
    """Frames per second of a file that does not tell; where it does, the file is believed and a note says so."""
    person: str | None = None
    """Which of several people in a file: the name or number that the file has for them; default: whoever is seen
    longest."""
    bvh_map: Path | None = None
    """A YAML file that says which joint of a BVH file, or node of a scene (FBX, glTF), is which."""
    pose_model: str = "full"
    """Which model finds the body in a video: `lite`, `full` or `heavy`, the faster or the more exact."""
    animation: str | None = None
    """Which of several animations of a scene (FBX, glTF), by its name; default: the longest."""

    def __post_init__(self) -> None:
        """Raises a UserError where the rate is none."""
        if self.rate is not None:
            low, high = RATES
            if not (isinstance(self.rate, int | float) and low <= self.rate <= high):
                raise UserError(f"the rate is {self.rate} frames per second; expected {low:g} to {high:g}")

    def of_one(self) -> list[str]:
        """What to say of a file that has one person only, whom it does not name: that another is asked for, if so."""
        if self.person is None:
            return []
        return [f"the person '{shortened(self.person, 40)}' that was asked for is left out: there is one only"]
