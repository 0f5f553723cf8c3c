"""Joint angles without any network: the nearest of some thousand robot poses, and steps of the optimiser from them.

Legend: B batch, D directions, F = 3 D features, N joints.
"""

from __future__ import annotations

from torch import Tensor

from mrhubo.reference import DirectionProblem
from mrhubo.reference.starts import StartPool
from mrhubo.reference.trajectory import pick
from mrhubo.retargeter.networks import JointNetwork, LimitedOutput
from mrhubo.retargeter.universal import AllDirections
from mrhubo.robot import BodyMap

_STARTS, _POSES, _STEPS = 3, 2048, 3


class NearestJoints(JointNetwork):
    """What a stream begins at, and looks at beside its last answer, where nothing was trained for a robot: the best of
    three poses far from each other after three steps of optimisation. In nearly all frames it is the optimum's valley.
    """

    def __init__(self, body_map: BodyMap) -> None:
        super().__init__()
        self.features = AllDirections(body_map)
        self.problem = DirectionProblem(body_map)
        self.pool = StartPool(self.problem, _STARTS, seed=0, poses=_POSES)
        self.limited = LimitedOutput(body_map.robot.lower_N, body_map.robot.upper_N, "clamp")

    @property
    def directed(self) -> bool:
        """Always."""
        return True

    def of_directions(self, target_BD3: Tensor) -> Tensor:
        """As for `JointNetwork`."""
        start_YN = self.pool.near(target_BD3).flatten(0, 1)
        found_YN, cost_YC = self.problem.minimise(start_YN, target_BD3.repeat_interleave(_STARTS, dim=0), _STEPS)
        best_BC = cost_YC.unflatten(0, (-1, _STARTS)).argmin(dim=1)
        best_BN = pick(found_YN.unflatten(0, (-1, _STARTS)), best_BC, self.problem.blocks.joints_NC)
        return self.limited.inside(best_BN)

    def joints(self, features_BF: Tensor) -> Tensor:
        """As for `JointNetwork`."""
        return self.of_directions(features_BF.unflatten(1, (-1, 3)))
