"""The network that is the same for every robot (`mrhubo.universal`), where a robot's own networks stand otherwise.

Legend: B batch, D directions, F = 3 D features, N joints.
"""

from __future__ import annotations

import copy

from torch import Tensor

from mrhubo import rotation
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import JointNetwork, LimitedOutput
from mrhubo.robot import BodyMap
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.robots import UniversalRetargeter


class AllDirections(PoseFeatures):
    """`BodyMap.human_directions`, as they are."""

    def __init__(self, body_map: BodyMap) -> None:
        super().__init__()
        self.names = body_map.direction_names
        self.sources = tuple(frozenset({i}) for i in range(len(self.names)) for _ in range(3))
        self._shared = copy.deepcopy(body_map.shared)  # which goes where the network goes

    def forward(self, pose_BJ6: Tensor) -> Tensor:
        """As for `PoseFeatures`."""
        return self._shared.of_human(rotation.stack_columns(pose_BJ6)).flatten(1)


class UniversalJoints(JointNetwork):
    """Five iterations of the universal network."""

    def __init__(self, body_map: BodyMap, network: UniversalNetwork) -> None:
        """`network` may have the shipped weights (`mrhubo.universal.weights.open_network`), or be tuned to a robot."""
        super().__init__()
        self.features = AllDirections(body_map)
        self.optimiser = UniversalRetargeter(copy.deepcopy(body_map), network)
        self.limited = LimitedOutput(body_map.robot.lower_N, body_map.robot.upper_N, "clamp")

    @property
    def directed(self) -> bool:
        """Always."""
        return True

    def of_directions(self, target_BD3: Tensor) -> Tensor:
        """As for `JointNetwork`."""
        return self.limited.inside(self.optimiser(target_BD3))

    def joints(self, features_BF: Tensor) -> Tensor:
        """As for `JointNetwork`."""
        return self.of_directions(features_BF.unflatten(1, (-1, 3)))
