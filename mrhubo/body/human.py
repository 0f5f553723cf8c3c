"""The human that a config names: its body prior and its skeleton."""

from __future__ import annotations

from mrhubo.body.official import open_skeleton
from mrhubo.body.prior import BodyPrior
from mrhubo.body.skeleton import Skeleton
from mrhubo.body.vposer import VPoser
from mrhubo.config import BodyConfig
from mrhubo.errors import UserError


def open_prior(config: BodyConfig) -> BodyPrior:
    """The body prior of a config's `body` section.

    Raises:
        UserError: its file is missing, damaged, or of another kind.
    """
    return VPoser.open(config.prior_path) if config.prior == "vposer" else BodyPrior.open(config.prior_path)


def build_skeleton(config: BodyConfig) -> Skeleton:
    """The skeleton of a config's `body` section: the open one, or that of a body model.

    Raises:
        UserError: the model is missing, damaged, or of another kind, or the betas do not fit.
    """
    if config.model_path is not None:
        return open_skeleton(config.model_path, config.betas)
    if config.betas:
        raise UserError("body.betas: shape the body model of body.model_path, which is not given")
    return Skeleton()
