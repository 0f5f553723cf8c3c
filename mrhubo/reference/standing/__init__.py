"""Where a robot with feet stands and goes: its root, and legs that keep planted feet where they are."""

from mrhubo.reference.standing.human import HumanSteps, flatten, read_steps
from mrhubo.reference.standing.legs import Legs
from mrhubo.reference.standing.stand import Stand, Standing

__all__ = ["HumanSteps", "Legs", "Stand", "Standing", "flatten", "read_steps"]
