"""A robot for batched work: which joints move, their limits, and forward kinematics of the links that matter.

Frame: the robot's base frame is the root link of its URDF (x forward, y left, z up for a robot that follows REP 103).
Legend: B batch, N joints that are sampled and predicted (`joint_names`), M = N links that they carry (`moving_links`),
L links whose pose is computed (`links`), A angles of the kinematic chain (N joints, mimicking and held ones), D of them
driven by the N joints.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.config import find_config, load_config, places_named
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.chain import build_chain, chain_joints, chain_like, chain_xml
from mrhubo.robot.entries import check_names
from mrhubo.robot.joint import Joint, Mimic, drive
from mrhubo.robot.keypoints import Keypoints, read_keypoints
from mrhubo.robot.limits import MAX_SPEED, held_angle, in_degrees, joint_range, joint_speed, narrow_to_mimics
from mrhubo.robot.urdf import Description, describe

_MOST_LISTED = 5


@dataclass(frozen=True)
class LinkPoses:
    """Poses of `Robot.links` in the robot's base frame."""

    rotation_BL33: Tensor
    position_BL3: Tensor


class Robot(nn.Module):
    """Joints, limits and batched forward kinematics of one robot."""

    lower_N: Tensor
    """Lower joint limits [rad]."""
    upper_N: Tensor
    """Upper joint limits [rad]."""
    velocity_N: Tensor
    """How fast the joints may turn [rad/s]: the URDF's limits, those of what mimics them, and `max_speed`."""
    select_AN: Tensor
    constant_A: Tensor
    _frames: Tensor
    drive_DN: Tensor
    """Angles of `driven_joints` per unit of q (1 for a joint itself, the multiplier for one that mimics it)."""

    def __init__(
        self,
        urdf: Path | Description,
        joints: Sequence[str],
        links: Iterable[str] = (),
        ranges: Mapping[str, list[float]] | None = None,
        hold: Mapping[str, float] | None = None,
        name: str | None = None,
        max_speed: float = MAX_SPEED,
    ) -> None:
        """Reads the URDF and prepares the kinematics of `joints` and of the extra `links`.

        Args:
            urdf: the URDF file, or what `describe` has read from it.
            joints: joints that are sampled and predicted; their order is the order of q.
            links: links whose poses are wanted besides those that `joints` and what mimics them carry.
            ranges: [lower, upper] in rad, narrower than the URDF's limits, by joint.
            hold: angle in rad at which another joint is held; default 0, clamped to the joint's limits.
            name: short name; default: the URDF file's.
            max_speed: no joint turns faster [rad/s], whatever the URDF gives.

        Raises:
            UserError: the URDF cannot be used, or a joint or link does not exist (with the nearest name).
        """
        super().__init__()
        ranges, hold = dict(ranges or {}), dict(hold or {})
        description = urdf if isinstance(urdf, Description) else describe(Path(urdf))
        self.urdf, self.name = description.path, name or description.path.stem
        self.description = description
        self._made_with = {"links": tuple(links), "ranges": ranges, "hold": hold, "max_speed": max_speed}
        self.hold = hold
        """Angles [rad] that somebody has chosen for joints that are not sampled; `held` has those of all."""
        self.keypoints: Keypoints | None = None
        """Which links stand for which body parts, where `from_urdf` or `from_config` has been told."""
        self.key_links: tuple[str, ...] = ()
        """Links whose position error is the link error."""
        self.balance = 0.0
        """How much the centre of mass is kept over planted soles in whole motions: 0 to 1."""
        if not joints:
            raise UserError("robot.joints: is empty; name at least one joint")
        repeated = sorted({j for j in joints if list(joints).count(j) > 1})
        if repeated:
            raise UserError(f"robot.joints: '{repeated[0]}' appears twice")
        self.joint_names = tuple(joints)
        for key in ranges:
            if key not in self.joint_names:
                description.joint(key)
                raise UserError(f"robot.ranges.{key}: is not among robot.joints")
        for key in hold:
            description.joint(key)
            if key in self.joint_names:
                raise UserError(f"robot.hold.{key}: is among robot.joints, so it cannot be held")
        for joint in self.joint_names:
            _refuse_faults(description, [description.joint(joint)])
        narrowed = narrow_to_mimics(self.urdf, description.joints, self.joint_names)
        if narrowed:
            description = description.with_joints({name: found.joint for name, found in narrowed.items()})
            self.description = description
        limits = [joint_range(self.urdf, description.joint(j), ranges.get(j)) for j in self.joint_names]
        for found in (found for name, found in narrowed.items() if name not in ranges):
            warnings.warn(f"{self.urdf}: {found}", InputWarning, stacklevel=2)
        self.register_buffer("lower_N", _inward([low for low, _ in limits], torch.inf), persistent=False)
        self.register_buffer("upper_N", _inward([high for _, high in limits], -torch.inf), persistent=False)
        speeds = [joint_speed(description.joints, j, max_speed) for j in self.joint_names]
        self.register_buffer("velocity_N", _inward(speeds, -torch.inf), persistent=False)
        self.moving_links = tuple(description.joint(j).child for j in self.joint_names)
        more = [description.check_link(link) for link in self._made_with["links"]]
        self.links = tuple(dict.fromkeys((*self.moving_links, *more)))
        moving = [joint for joint in description.joints.values() if joint.kind != "fixed"]
        degrees = in_degrees(moving)
        self.held = {joint.name: held_angle(joint, hold.get(joint.name), degrees) for joint in moving}
        self._prepare_chain()

    def _prepare_chain(self) -> None:
        needed = {joint.name: joint for link in self.links for joint in self.description.joints_above(link)}
        _refuse_faults(self.description, needed.values())
        drives = {name: self._drive(name) for name in needed}
        _refuse_faults(self.description, [self.description.joints[drive.joint] for drive in drives.values()])
        turned = [name for name, drive in drives.items() if drive.joint in self.joint_names and drive.multiplier]
        rest = {
            name: drive.multiplier * self.held.get(drive.joint, 0.0) + drive.offset for name, drive in drives.items()
        }
        joints = chain_joints(self.description, self.links, turned, rest)
        self._chain = build_chain(chain_xml(self.description.root, joints))
        angles = self._chain.get_joint_parameter_names()
        select_AN, constant_A = torch.zeros(len(angles), len(self.joint_names)), torch.zeros(len(angles))
        for row, joint in enumerate(angles):
            drive = drives[joint]
            if drive.joint in self.joint_names:
                select_AN[row, self.joint_names.index(drive.joint)] = drive.multiplier
                constant_A[row] = drive.offset
            else:
                constant_A[row] = rest[joint]
        driven = [row for row in range(len(angles)) if select_AN[row].abs().sum() > 0]
        self.driven_joints = tuple(angles[row] for row in driven)
        """Joints of the chain that q turns: `joint_names` and those that mimic them."""
        carried = (self.description.joints[name].child for name in self.driven_joints)
        self.links = tuple(dict.fromkeys((*self.links, *carried)))
        frames = self._chain.get_frame_indices(*self.links)
        tensors = {"select_AN": select_AN, "constant_A": constant_A, "drive_DN": select_AN[driven], "_frames": frames}
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor, persistent=False)
        _tell(self.description, needed)

    def _drive(self, joint: str) -> Mimic:
        try:
            return drive(self.description.joints, joint)
        except UserError as error:
            raise UserError(f"{self.urdf}: {error}") from error

    def _apply(self, fn: Callable[[Tensor], Tensor], recurse: bool = True) -> Robot:
        """Moves the chain, which is no module, along with the buffers."""
        super()._apply(fn, recurse)
        self._chain = chain_like(self._chain, self.select_AN)
        return self

    @classmethod
    def from_urdf(
        cls,
        urdf: Path | str | Description,
        joints: Sequence[str],
        keypoints: Mapping[str, Any],
        key_links: Sequence[str] = (),
        ranges: Mapping[str, list[float]] | None = None,
        hold: Mapping[str, float] | None = None,
        name: str | None = None,
        max_speed: float = MAX_SPEED,
        root_follows: str = "pelvis",
        balance: float = 0.0,
    ) -> Robot:
        """A robot that knows which of its links stand for which part of a human body.

        Args:
            urdf: the URDF file, or what `describe` has read from it.
            joints: joints that are sampled and predicted; their order is the order of q.
            keypoints: link by body part, as `robot.keypoints` of a config.
            key_links: links whose position error is the link error.
            ranges: [lower, upper] in rad, narrower than the URDF's limits, by joint.
            hold: angle in rad at which another joint is held; default 0, clamped to the joint's limits.
            name: short name; default: the URDF file's.
            max_speed: no joint turns faster [rad/s], whatever the URDF gives.
            root_follows: how the base is turned, as `robot.root_follows` of a config.
            balance: how much the centre of mass is kept over planted soles, as `robot.balance` of a config.

        Raises:
            UserError: the URDF cannot be used; a joint, link or body part does not exist (with the nearest name).
        """
        parts = replace(read_keypoints(keypoints), root_follows=root_follows)
        known = urdf if isinstance(urdf, Description) else Path(urdf)
        robot = cls(known, joints, [*parts.links, *key_links], ranges, hold, name, max_speed)
        robot.keypoints, robot.key_links, robot.balance = parts, tuple(key_links), balance
        return robot

    @classmethod
    def from_config(cls, config: Path | str) -> Robot:
        """The robot of a config: a YAML file, or the name of one that ships with mrhubo (`nao`, `paper/nao`).

        Raises:
            UserError: the config or what it names cannot be used.
        """
        robot = load_config(find_config(str(config))).robot
        with places_named(robot):
            description = describe(robot.urdf)
            check_names(robot, description)
            return cls.from_urdf(
                description, robot.joints, robot.keypoints, robot.key_links, robot.ranges, robot.hold, robot.name,
                robot.max_speed, robot.root_follows, robot.balance,
            )  # fmt: skip

    def without(self, joints: Collection[str]) -> Robot:
        """The same robot with some of `joint_names` held at 0, or at the limit nearest to 0; at least one must stay."""
        kept = [name for name in self.joint_names if name not in joints]
        ranges = {name: ends for name, ends in self._made_with["ranges"].items() if name in kept}
        return self._again(kept, ranges=ranges)

    def with_links(self, links: Iterable[str]) -> Robot:
        """The same robot, which computes the poses of more links."""
        return self._again(self.joint_names, links=(*self._made_with["links"], *links))

    def _again(self, joints: Sequence[str], **changed: Any) -> Robot:
        robot = Robot(self.description, joints, name=self.name, **{**self._made_with, **changed})
        robot.keypoints, robot.key_links, robot.balance = self.keypoints, self.key_links, self.balance
        return robot.to(self.lower_N.device)

    def link_index(self, link: str) -> int:
        """Position of a link in `links`."""
        return self.links.index(link)

    def forward(self, q_BN: Tensor) -> LinkPoses:
        """Poses of `links` in the base frame for joint angles (B, N) [rad]; differentiable."""
        matrices_FB44 = self._chain.forward_kinematics_tensor(q_BN @ self.select_AN.T + self.constant_A)
        poses_BL44 = matrices_FB44[self._frames].transpose(0, 1)
        return LinkPoses(poses_BL44[..., :3, :3], poses_BL44[..., :3, 3])

    def moving_orientations(self, poses: LinkPoses) -> Tensor:
        """R: orientation (B, M, 6) of `moving_links` in the base frame, 6D columns (the first M of `links`)."""
        return rotation.matrix_to_sixd(poses.rotation_BL33[:, : len(self.moving_links)])

    def sample(self, count: int, generator: torch.Generator) -> Tensor:
        """Joint angles (count, N), uniform inside the limits."""
        unit = torch.rand(count, len(self.joint_names), generator=generator).to(self.lower_N.device)
        return torch.clamp(self.lower_N + unit * (self.upper_N - self.lower_N), self.lower_N, self.upper_N)

    def home(self) -> Tensor:
        """The zero configuration (N,), clamped to the limits (0 may lie outside them)."""
        return torch.zeros_like(self.lower_N).clamp(self.lower_N, self.upper_N)

    def configuration(self, q_N: np.ndarray) -> dict[str, float]:
        """Angles [rad] of every joint of the URDF that is not fixed and mimics none, for tools that pose the whole
        robot.
        """
        free = {n: a for n, a in self.held.items() if self.description.joints[n].mimic is None}
        return {**free, **dict(zip(self.joint_names, map(float, q_N), strict=True))}


def _inward(limits: list[float], towards: float) -> Tensor:
    """Limits as float32, rounded to the inside where float32 cannot hold them, so that no output exceeds the URDF's."""
    exact = torch.tensor(limits, dtype=torch.float64)
    rounded = exact.to(torch.float32)
    outside = (rounded.double() < exact) if towards > 0 else (rounded.double() > exact)
    return torch.where(outside, torch.nextafter(rounded, torch.full_like(rounded, towards)), rounded)


def _refuse_faults(description: Description, joints: Iterable[Joint]) -> None:
    """Refuses joints that are needed and whose numbers cannot be used."""
    for joint in joints:
        if joint.name in description.faults:
            raise UserError(f"robot.urdf: {description.path}, {description.faults[joint.name]}")


def _tell(description: Description, needed: Collection[str]) -> None:
    """Warns of what is odd about joints that are needed, and lists what cannot be read and is not."""
    for joint, doubt in description.doubts.items():
        if joint in needed:
            warnings.warn(f"robot.urdf: {description.path}, {doubt}", InputWarning, stacklevel=3)
    faults = [fault for joint, fault in description.faults.items() if joint not in needed]
    if left_out := [*faults, *description.left_out]:
        more = f"; and {len(left_out) - _MOST_LISTED} more" if len(left_out) > _MOST_LISTED else ""
        listed = "; ".join(left_out[:_MOST_LISTED])
        warnings.warn(
            f"robot.urdf: {description.path}: left out what cannot be read and is not needed: {listed}{more}",
            InputWarning,
            stacklevel=3,
        )
