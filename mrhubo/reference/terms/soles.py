"""Points of soles are where they are to be:  sum_p w_p |x_p(q) - x*_p|^2 + (h_p . (x_p(q) - x*_p))^2

Places are seen from what carries the legs (`mrhubo.reference.standing.legs`). They and the weights come after the
directions in a problem's targets: P rows of places [m], then P rows whose first number is the weight [1/m^2], and then,
where heights count besides, P rows h, which point up and are as long as the root of that weight [1/m].

Legend: B problems, P points, A driven joints, N joints, C blocks, D directions.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.standing.legs import Legs
from mrhubo.reference.terms.term import Quadratic, State, Term


class SoleTerm(Term):
    """The term above."""

    factor_PA: Tensor
    """1 where a driven joint moves a point against what carries the legs, -1 where it moves that against the point."""
    rotary_A: Tensor
    axes_A3: Tensor

    def __init__(self, legs: Legs) -> None:
        super().__init__()
        self.legs, robot = legs, legs.body_map.robot
        joints = [robot.description.joints[name] for name in robot.driven_joints]

        def above(link: str) -> list[float]:
            names = {joint.name for joint in robot.description.joints_above(link)}
            return [float(joint.name in names) for joint in joints]

        carrier_A = torch.tensor(above(legs.link))
        feet_SA = torch.tensor([above(sole.link) for sole in legs.soles])
        tensors = {
            "factor_PA": (feet_SA - carrier_A).repeat_interleave(2, dim=0),
            "rotary_A": torch.tensor([float(joint.rotary) for joint in joints]),
            "axes_A3": torch.tensor([joint.axis_3.tolist() for joint in joints]),
        }
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor.to(robot.lower_N), persistent=False)
        self._children = [robot.link_index(joint.child) for joint in joints]

    def couplings(self) -> list[set[int]]:
        """Of each point the joints that move it."""
        moved_PN = (self.factor_PA.abs() @ self.legs.body_map.robot.drive_DN.abs()) > 0
        return [{n for n, moved in enumerate(row) if moved} for row in moved_PN.tolist()]

    def residual(self, state: State) -> tuple[Tensor, Tensor, Tensor]:
        """Differences of places (B, P, 3) [m], their Jacobian (B, P, 3, N) [m/rad], and weights (B, P); h is left
        out.
        """
        points, robot, poses = len(self.factor_PA), self.legs.body_map.robot, state.poses
        place_BP3, axes_B33, root_B3 = self.legs.seen(poses)
        axis_BA3 = (poses.rotation_BL33[:, self._children] @ self.axes_A3[..., None])[..., 0] @ axes_B33
        origin_BA3 = (poses.position_BL3[:, self._children] - root_B3[:, None]) @ axes_B33
        lever_BPA3 = place_BP3[:, :, None] - origin_BA3[:, None]
        axis_BPA3 = axis_BA3[:, None].expand_as(lever_BPA3)
        turned_BPA3 = torch.linalg.cross(axis_BPA3, lever_BPA3)
        rotary_A1 = self.rotary_A[:, None]
        moved_BPA3 = self.factor_PA[..., None] * (rotary_A1 * turned_BPA3 + (1 - rotary_A1) * axis_BPA3)
        first = len(self.legs.body_map.directions)
        target_BX3 = state.target_BD3[:, first : first + 2 * points]
        return place_BP3 - target_BX3[:, :points], moved_BPA3.mT @ robot.drive_DN, target_BX3[:, points:, 0]

    def add_to(self, model: Quadratic | None, state: State, blocks: Blocks) -> Quadratic:
        """As `Term.add_to`."""
        assert model is not None, "it is no term to begin with: it tells of some joints alone"
        miss_BP3, jacobian_BP3N, weight_BP = self.residual(state)
        root_BP = weight_BP.sqrt()
        rows_BRN = (jacobian_BP3N * root_BP[..., None, None]).flatten(1, 2)
        miss_BR1 = (miss_BP3 * root_BP[..., None]).flatten(1)[..., None]
        cost_BP = miss_BP3.square().sum(-1) * weight_BP
        upwards_BP3 = state.target_BD3[:, len(self.legs.body_map.directions) + 2 * len(self.factor_PA) :]
        if upwards_BP3.shape[1]:
            high_BP = (upwards_BP3 * miss_BP3).sum(-1)
            cost_BP = cost_BP + high_BP.square()
            rows_BRN = torch.cat((rows_BRN, (upwards_BP3[:, :, None] @ jacobian_BP3N)[:, :, 0]), dim=1)
            miss_BR1 = torch.cat((miss_BR1, high_BP[..., None]), dim=1)
        return model.plus(cost_BP @ self._points_PC(blocks), (rows_BRN.mT @ miss_BR1)[..., 0], rows_BRN.mT @ rows_BRN)

    def _points_PC(self, blocks: Blocks) -> Tensor:
        """1 where a point moves with the joints of a block."""
        moved_PN = (self.factor_PA.abs() @ self.legs.body_map.robot.drive_DN.abs() > 0).to(blocks.joints_NC)
        return (moved_PN @ blocks.joints_NC > 0).to(blocks.joints_NC)
