"""The jerk of the robot's directions, as `mrhubo.reference.terms.direction_jerk` has it, where the reasons stand.

Legend: T frames, Y = T - 3 differences of third order, X frames of some lag, D directions, E some of them, N joints,
M some of them, R = 3 E rows, C blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.together.differences import THIRD, bands, share, spread


@dataclass(frozen=True)
class DirectionJerk:
    """sum_t  sum_d  weight_td * |third difference of direction d - goal_td|^2"""

    weight_YD: np.ndarray
    """0 for directions that do not count."""
    goal_YD3: np.ndarray

    def at(self, frame_X: np.ndarray) -> DirectionJerk:
        """The same for some frames alone (X,), by their numbers."""
        return DirectionJerk(self.weight_YD[frame_X[3:] - 3], self.goal_YD3[frame_X[3:] - 3])

    def costs(self, direction_TD3: np.ndarray, directions_DC: np.ndarray) -> np.ndarray:
        """What each frame bears (T, C), for directions as they are seen from their parts (T, D, 3)."""
        off_YD3 = self._off(direction_TD3)
        return share(self.weight_YD * np.einsum("ydi,ydi->yd", off_YD3, off_YD3), 3) @ directions_DC

    def gradient(self, direction_TD3: np.ndarray, jacobian_TD3N: np.ndarray) -> np.ndarray:
        """Half of the gradient (T, N), by the directions' Jacobian (T, D, 3, N) [1/rad]."""
        force_YD3 = self.weight_YD[..., None] * self._off(direction_TD3)
        force_T1R = spread(force_YD3.reshape(len(force_YD3), -1), THIRD)[:, None]
        return (force_T1R @ jacobian_TD3N.reshape(len(jacobian_TD3N), -1, jacobian_TD3N.shape[-1]))[:, 0]

    def hessian(self, jacobian_TE3M: np.ndarray, columns_E: np.ndarray) -> list[np.ndarray]:
        """Half of the Gauss-Newton Hessian of some joints, by how they turn the directions of some columns: entries
        within a frame (T, M, M), then between the joints of the next frame, the rows, and those of a frame (T - 1, M,
        M), of the one after that (T - 2, M, M), and so on.
        """
        frames, joints = len(jacobian_TE3M), jacobian_TE3M.shape[-1]
        rows_TRM = jacobian_TE3M.reshape(frames, -1, joints)
        found = []
        for lag, band_XE in enumerate(bands(self.weight_YD[:, columns_E], THIRD)):
            weighted_XRM = rows_TRM[: frames - lag] * np.repeat(band_XE, 3, axis=1)[..., None]
            found.append(rows_TRM[lag:].swapaxes(-1, -2) @ weighted_XRM)
        return found

    def _off(self, direction_TD3: np.ndarray) -> np.ndarray:
        return np.diff(direction_TD3, n=3, axis=0) - self.goal_YD3
