"""The small robots of the tests of `mrhubo.robot`."""

from tests.robot.conftest import arm, pair

__all__ = ["arm", "pair"]
