"""What a stream does with each frame: filter, two branches, limits. People are a batch and know nothing of each other.

Legend: B people, D directions, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.fast import StreamSettings
from mrhubo.reference.standing import Standing
from mrhubo.retargeter import POLISH, Retargeter
from mrhubo.streaming.branches import Branches, BranchState
from mrhubo.streaming.crossing import Crossing
from mrhubo.streaming.ground import Ground, GroundState, Seen
from mrhubo.streaming.limits import JointLimits, JointState
from mrhubo.streaming.one_euro import OneEuroState, one_euro


@dataclass(frozen=True)
class StreamState:
    """All that a stream remembers of its people."""

    filtered: OneEuroState
    branches: BranchState
    joints: JointState
    crossing: Crossing
    unseen_B: Tensor
    """Time since each person was last seen [s]; infinite for one who never was."""
    placed_B: Tensor
    """Whether the robot already stands somewhere, so that it has to go from there."""
    ground: GroundState | None
    """Where robots with feet stand; None: nobody's root is told, or the robot has none."""


class Follower:
    """The work on a frame, for one retargeter."""

    def __init__(
        self,
        retargeter: Retargeter,
        settings: StreamSettings,
        longest_step: float,
        standing: Standing | None = None,
        floor: float | None = None,
    ) -> None:
        """What is worked with.

        Args:
            retargeter: as it was loaded.
            settings: times and speeds.
            longest_step: no more time [s] counts as passed when joints move.
            standing: of robots that stand on a floor; None: joint angles alone are followed.
            floor: its height [m] in the people's world; None: it is learned.
        """
        body_map = retargeter.body_map
        self.retargeter, self.settings, self.longest_step = retargeter, settings, longest_step
        self.ground = None if standing is None else Ground(standing, longest_step, floor)
        self.problem = retargeter.directions if standing is None else standing.problem
        avoidance = None
        if settings.avoid_collisions:
            avoidance = retargeter.avoidance if standing is None else standing.avoidance
        self.branches = Branches(self.problem, settings, avoidance)
        self.limits = JointLimits(body_map.robot, settings.ramp_time)
        unit_D1 = torch.zeros(len(body_map.directions), 1)
        unit_D1[body_map.measured] = 1.0
        if standing is not None:
            unit_D1 = torch.cat((unit_D1, torch.ones(2, 1)))  # the root's turn
        self._unit_D1 = unit_D1.to(retargeter.device)

    def begin(self, people: int, q_BN: Tensor | None = None) -> StreamState:
        """Nobody has been seen. `q_BN`: where the robots stand [rad], inside the limits; default: their home pose,
        which the first answer may leave at once.
        """
        robot, problem = self.retargeter.body_map.robot, self.problem
        stand_BN = robot.home().expand(people, -1) if q_BN is None else q_BN
        nothing_BD3 = stand_BN.new_zeros(people, len(self._unit_D1), 3)
        return StreamState(
            OneEuroState.at(nothing_BD3), BranchState.at(stand_BN, problem.blocks.joints_NC.shape[1]),
            JointState.at_rest(stand_BN), Crossing.none(stand_BN), stand_BN.new_full((people,), torch.inf),
            torch.full((people,), q_BN is not None, device=stand_BN.device),
            None if self.ground is None else self.ground.begin(people),
        )  # fmt: skip

    def advance(
        self,
        state: StreamState,
        local_BJ33: Tensor,
        target_BD3: Tensor,
        seen_B: Tensor,
        passed: float,
        seen: Seen | None = None,
    ) -> StreamState:
        """The next state; its `joints.q_BN` are the answer.

        Args:
            state: the last one.
            local_BJ33: human poses.
            target_BD3: their directions.
            seen_B: who is seen in this frame; the poses of the others are not looked at, only moved through.
            passed: time since the last state [s], more than 0.
            seen: the people with their root, if there is a ground.
        """
        unseen_B = state.unseen_B + passed
        since_B = unseen_B.clamp_max(self.longest_step)
        filtered, branches, ground = state.filtered, state.branches, state.ground
        velocity_BN = torch.zeros_like(branches.kept_BN)
        begun_BN = torch.zeros_like(velocity_BN, dtype=torch.bool)
        joints = state.joints
        if ground is not None:
            still = replace(ground.contacts, began_BP=ground.contacts.began_BP & False)
            ground = replace(ground, contacts=still)
        if bool(seen_B.any()):
            new_B, known_B = seen_B & unseen_B.isinf(), seen_B & unseen_B.isfinite()
            filter_B = torch.where(known_B, unseen_B, self.longest_step)
            raw_BD3 = target_BD3
            if self.ground is not None and seen is not None:
                point_BK3, turn_B33 = self.ground.carrier(seen)
                raw_BD3 = torch.cat((target_BD3, turn_B33[:, :, :2].mT), dim=1)
            moved = one_euro(filtered, raw_BD3, filter_B, self._unit_D1, self.settings)
            filtered = filtered.where(known_B, moved).where(new_B, OneEuroState.at(raw_BD3))
            aim_BD3 = wanted_BX3 = filtered.filtered_BD3
            if self.ground is not None and ground is not None and seen is not None:
                aim_BD3, turn_BX3 = aim_BD3[:, :-2], aim_BD3[:, -2:]
                turn_B33 = rotation.sixd_to_matrix(turn_BX3.flatten(1))
                passed_B = filter_B.double().cpu().numpy()
                looked = self.ground.look(ground, point_BK3, turn_B33, seen, passed_B)
                aim_BD3 = self.ground.level(looked, aim_BD3)
                looked, wanted_BX3 = self.ground.ask(ground, looked, aim_BD3, passed_B)
                ground = ground.where(seen_B.cpu().numpy(), looked)
            network_BN = self.retargeter.answer(local_BJ33, aim_BD3)
            if bool(known_B.any()):
                followed, speed_BN, left_BN = self.branches.advance(branches, network_BN, wanted_BX3, since_B)
                branches = branches.where(known_B, followed)
                velocity_BN = torch.where(known_B[:, None], speed_BN, velocity_BN)
                begun_BN = known_B[:, None] & left_BN
            if bool(new_B.any()):
                first_BN = self.retargeter.answer(local_BJ33, aim_BD3, POLISH)
                if self.ground is not None:
                    first_BN = self.problem.minimise(first_BN, wanted_BX3, POLISH)[0]
                goal_BN = self.branches.free(first_BN, wanted_BX3)
                branches = branches.where(new_B, BranchState.at(first_BN, branches.worse_BC.shape[1], goal_BN))
                joints = joints.where(new_B & ~state.placed_B, JointState.at_rest(goal_BN))
            unseen_B = torch.where(seen_B, 0.0, unseen_B)
        step_B = torch.full_like(unseen_B, min(passed, self.longest_step))
        distance_BN = (branches.goal_BN.double() - joints.q_BN).abs()
        crossing = state.crossing.begun(self.problem.blocks, self.settings, begun_BN, distance_BN, self.limits.speed_N)
        on_way = crossing.goals(joints.q_BN, joints.velocity_BN, branches.goal_BN, velocity_BN, step_B)
        joints = self.limits.follow(joints, *on_way, step_B)
        if self.ground is not None and ground is not None and state.ground is not None:
            poses = self.retargeter.body_map.robot.forward(joints.q_BN)
            ground = self.ground.stand(state.ground, ground, poses)
        placed_B = torch.ones_like(state.placed_B)
        return StreamState(filtered, branches, joints, crossing.after(step_B), unseen_B, placed_B, ground)
