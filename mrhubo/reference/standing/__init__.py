"""Where a robot with feet stands and goes: its root, and legs that keep planted feet where they are."""

from mrhubo.reference.standing.fields import continuous, standing_fields
from mrhubo.reference.standing.human import (
    FAR_M,
    HumanSteps,
    flatten,
    given_contacts,
    has_root,
    motion_root,
    read_steps,
    stand_flat,
)
from mrhubo.reference.standing.legs import Legs
from mrhubo.reference.standing.low_body import LowBody
from mrhubo.reference.standing.stand import PLANTED, UNDER_M, Stand, Standing

__all__ = [
    "FAR_M",
    "PLANTED",
    "UNDER_M",
    "HumanSteps",
    "Legs",
    "LowBody",
    "Stand",
    "Standing",
    "continuous",
    "flatten",
    "given_contacts",
    "has_root",
    "motion_root",
    "read_steps",
    "stand_flat",
    "standing_fields",
]
