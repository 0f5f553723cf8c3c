"""Sources and sinks that a command line names: what of the machine they will use, so that what cannot be had is told
before anything slow is done. Those of users' own, as `run` takes them, need none of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from mrhubo.live.endpoints import Endpoint
from mrhubo.live.loop import Sink, Source


class NamedSource(Source, Protocol):
    """A source that a command line names."""

    @property
    def endpoint(self) -> Endpoint | None:
        """Where it listens by UDP; None: nowhere."""
        return None

    def notes(self) -> list[str]:
        """What is to be known once it is open, a sentence each."""
        return []


class NamedSink(Sink, Protocol):
    """A sink that a command line names."""

    @property
    def endpoint(self) -> Endpoint | None:
        """Where it sends by UDP; None: nowhere."""
        return None

    @property
    def writes(self) -> tuple[Path, ...]:
        """Files that it writes."""
        return ()

    def check(self, joint_names: Sequence[str], urdf: Path | None) -> None:
        """Looks whether it is for this robot.

        Args:
            joint_names: those of what will be sent.
            urdf: the robot's model, where it is known.

        Raises:
            UserError: `open` would refuse it.
        """
