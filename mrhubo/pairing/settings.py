"""The settings of pairs with `auto` decided: how the human poses of forward pairs are found."""

from __future__ import annotations

import copy

from mrhubo.config import Config, PairsConfig
from mrhubo.errors import UserError


def pairing_settings(config: Config) -> PairsConfig:
    """A config's `pairs` section with the solver that `auto` stands for.

    Raises:
        UserError: the solver is `direct`, and a part of the pose is used that only a search finds.
    """
    used = _searched_for(config)
    if used and config.pairs.solver == "direct":
        raise UserError(
            f"pairs.solver: 'direct' puts human poses together from the robot's directions alone, but {used} uses more"
            " of them; set pairs.solver to auto or fine"
        )
    settings = copy.copy(config.pairs)
    if settings.solver == "auto":
        settings.solver = "fine" if used else "direct"
    return settings


def _searched_for(config: Config) -> str:
    """The first setting that uses more of a forward pair's human pose than directions; nothing if none does."""
    uses = {
        "pairs.align=false": not config.pairs.align,
        "pairs.phi=all": config.pairs.phi == "all",
        "model.input_frame=local": config.model.input_frame == "local",
        f"robot.scale={config.robot.scale}": config.robot.scale != "auto",
    }
    return next((name for name, holds in uses.items() if holds), "")
