"""What a config says it only guesses (`robot.unsure`): refused where other parts hang on it, told where none does."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.parts import PARTS


def check_unsure(config: RobotConfig) -> None:
    """Refuses guesses on which other parts hang: a wrong chest or shoulder makes everything wrong. One of a hand or a
    head is told, and the work goes on.

    Raises:
        UserError: names the entries.
    """
    if needed := needed_answers(config.unsure):
        raise UserError(
            f"robot.unsure: {_quoted(needed)} could not be decided when the robot was described; look at the "
            "picture and at these entries, correct what is wrong, and take their names out of the list"
        )
    if config.unsure:
        warnings.warn(
            f"robot.unsure: {_quoted(config.unsure)} could not be decided when the robot was described, and a guess is "
            "used; take the names out of the list when you have looked at these entries",
            InputWarning,
            stacklevel=2,
        )


def needed_answers(unsure: Iterable[str]) -> list[str]:
    """Those of the guesses on which other parts hang: a fit refuses them."""
    carriers = {part.hangs_on for part in PARTS} | {part.seen_from for part in PARTS}
    leaves = {part.name for part in PARTS} - carriers
    return [name for name in unsure if name not in leaves]


def _quoted(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)
