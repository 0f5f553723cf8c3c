"""Where a robot's centre of mass is, by the masses that its URDF tells of links.

Legend: B batch, K bodies: links that driven joints carry, with all that is fixed to them; the last is the root.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.errors import UserError
from mrhubo.robot.driven_bodies import DrivenBodies
from mrhubo.robot.model import LinkPoses, Robot


class CentreOfMass(nn.Module):
    """The centre of mass of one robot, whose other joints stay where they are held."""

    share_K: Tensor
    """Of the whole mass."""
    centre_K3: Tensor
    """In the frame of the body's link [m]."""

    def __init__(self, robot: Robot) -> None:
        """Adds masses up.

        Raises:
            UserError: the URDF tells no masses.
        """
        super().__init__()
        masses = {link: mass for link, mass in robot.description.masses.items() if mass[0] > 0}
        if not masses:
            raise UserError(
                f"robot.balance: {robot.urdf} tells no masses, so nobody knows where its centre of mass is; set it to 0"
            )
        bodies = DrivenBodies(robot)
        moments: dict[str, np.ndarray] = {}
        for link, (mass, *centre) in masses.items():
            body, place_4 = bodies.link_of(link), bodies.inside(link) @ np.array([*centre, 1.0])
            moments[body] = moments.get(body, np.zeros(4)) + mass * place_4
        moments[robot.description.root] = moments.pop(robot.description.root, np.zeros(4))  # is the last
        self.links = tuple(moments)
        self._rows = [robot.link_index(link) for link in self.links[:-1]]
        moment_K4 = torch.from_numpy(np.stack(list(moments.values())))
        centre_K3 = moment_K4[:, :3] / moment_K4[:, 3:].clamp_min(1e-12)
        for name, tensor in (("share_K", moment_K4[:, 3] / moment_K4[:, 3].sum()), ("centre_K3", centre_K3)):
            self.register_buffer(name, tensor.to(robot.lower_N), persistent=False)

    def forward(self, poses: LinkPoses) -> Tensor:
        """The centre of mass (B, 3) of poses of the robot, base frame [m]."""
        turned_BK3 = (poses.rotation_BL33[:, self._rows] @ self.centre_K3[:-1, :, None])[..., 0]
        root_B13 = self.centre_K3[-1].expand(len(turned_BK3), 1, 3)
        place_BK3 = torch.cat((poses.position_BL3[:, self._rows] + turned_BK3, root_B13), dim=1)
        return (self.share_K[:, None] * place_BK3).sum(dim=1)
