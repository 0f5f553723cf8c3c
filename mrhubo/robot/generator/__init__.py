"""Random humanoids as URDF text, with what is true of them: to try on what was never seen, and to train on."""

from mrhubo.robot.generator.humanoid import Humanoid, humanoid

__all__ = ["Humanoid", "humanoid"]
