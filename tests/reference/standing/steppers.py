"""People who squat or step on the spot, of hips, knees and ankles alone, with a root that fits."""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.body.skeleton import KEYPOINT_NAMES, POSED_JOINT_NAMES, keypoint_indices
from mrhubo.motion import Motion


def squat(frames: int = 48, rate: float = 24.0, sway: float = 0.2) -> Motion:
    """Bends the knees and sways from side to side; both feet stay where they are."""
    phase_T = torch.linspace(0, 2 * torch.pi, frames)
    return _standing(0.3 + 0.25 * torch.cos(phase_T), sway * torch.sin(phase_T), rate, 0.0)


def bow(frames: int = 48, rate: float = 24.0) -> Motion:
    """Squats and sways, and bends the back forwards by up to 50 degrees and to both sides."""
    standing = squat(frames, rate)
    phase_T, local_TJ33 = torch.linspace(0, 2 * torch.pi, frames), standing.local_TJ33.clone()
    turn_T3 = torch.stack((0.15 * (1 - phase_T.cos()), 0.1 * phase_T.sin(), 0.08 * phase_T.sin()), dim=1)
    for name in ("spine1", "spine2", "spine3"):
        local_TJ33[:, POSED_JOINT_NAMES.index(name)] = rotation.axis_angle_to_matrix(turn_T3)
    return standing.changed(local_TJ33=local_TJ33)


def jump(frames: int = 48, rate: float = 24.0) -> Motion:
    """Squats, and is off the floor for the middle quarter."""
    phase_T = torch.linspace(0, 1, frames)
    air_T = ((phase_T - 0.375) / 0.25).clamp(0, 1)
    return _standing(0.5 * torch.sin(torch.pi * phase_T) ** 2, 0 * phase_T, rate, 0.6 * air_T * (1 - air_T))


def lunge(frames: int = 24, rate: float = 24.0) -> Motion:
    """Kneels low with the left foot in front and breathes; the hind foot is flat, with the shin far over it."""
    still = _standing(torch.zeros(frames), torch.zeros(frames), rate, 0.0)
    bend_T, local_TJ33 = 1.15 + 0.01 * torch.linspace(0, 2 * torch.pi, frames).sin(), still.local_TJ33.clone()
    for side, hip_T in (("left", -bend_T), ("right", 0 * bend_T)):
        hip, knee, ankle = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee", "ankle"))
        local_TJ33[:, hip], local_TJ33[:, knee] = _pitch(hip_T), _pitch(bend_T)
        local_TJ33[:, ankle] = (local_TJ33[:, hip] @ local_TJ33[:, knee]).mT
    place_T3 = -Skeleton().keypoints(local_TJ33)[:, keypoint_indices(["left_heel", "right_heel"])].mean(dim=1)
    return still.changed(local_TJ33=local_TJ33, root_position_T3=place_T3)


def kneel(frames: int = 24, rate: float = 24.0, ankle: float = 0.5) -> Motion:
    """Kneels upright on shins and insteps, with feet that point backwards [rad], and breathes."""
    still = _standing(torch.zeros(frames), torch.zeros(frames), rate, 0.0)
    local_TJ33, breath_T = still.local_TJ33.clone(), 0.01 * torch.linspace(0, 2 * torch.pi, frames).sin()
    for side in ("left", "right"):
        knee, foot = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("knee", "ankle"))
        local_TJ33[:, knee], local_TJ33[:, foot] = _pitch(torch.pi / 2 + breath_T), _pitch(ankle + 0 * breath_T)
    lowest_T = Skeleton().keypoints(local_TJ33)[..., 1].amin(dim=1)
    place_T3 = torch.stack((0 * lowest_T, -lowest_T, 0 * lowest_T), dim=1)
    return still.changed(local_TJ33=local_TJ33, root_position_T3=place_T3)


def lie(frames: int = 24, rate: float = 24.0) -> Motion:
    """Lies still on the right side, legs stretched."""
    still = _standing(torch.zeros(frames), torch.zeros(frames), rate, 0.0)
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, torch.pi / 2]))
    point_TK3 = Skeleton().keypoints(still.local_TJ33)[:, keypoint_indices(["right_heel", "right_toe"])] @ turn_33.T
    up_3 = torch.tensor([0.0, -float(point_TK3[..., 1].min()), 0.0])
    return still.changed(root_rotation_T33=turn_33.repeat(frames, 1, 1), root_position_T3=up_3.repeat(frames, 1))


def crawl(frames: int = 24, rate: float = 24.0) -> Motion:
    """Is on all fours, and breathes: arms and thighs hang down from a level trunk, shins lie."""
    return _put_down(1.5, {"hip": (-1.5, 0, 0), "knee": (1.57, 0, 0), "ankle": (0.6, 0, 0), "shoulder": (0, -1.5, 0)},
                     frames, rate)  # fmt: skip


def stand_on_hands(frames: int = 24, rate: float = 24.0) -> Motion:
    """Stands on straight arms, head down, and breathes."""
    return _put_down(torch.pi, {"shoulder": (0, 0, 1.4)}, frames, rate)


def lie_prone(frames: int = 24, rate: float = 24.0) -> Motion:
    """Lies face down, arms along the trunk."""
    return _put_down(torch.pi / 2, {"ankle": (0.8, 0, 0), "shoulder": (0, 0, -1.3)}, frames, rate)


def _put_down(pitch: float, turns: dict[str, tuple[float, float, float]], frames: int, rate: float) -> Motion:
    """Who is turned forwards [rad], with joints of both sides turned so (left; axis-angle), lies on what is lowest."""
    still = _standing(torch.zeros(frames), torch.zeros(frames), rate, 0.0)
    turn_TJ3, breath_T = torch.zeros(frames, len(POSED_JOINT_NAMES), 3), torch.linspace(0, 2 * torch.pi, frames).sin()
    for name, (x, y, z) in turns.items():
        turn_TJ3[:, POSED_JOINT_NAMES.index(f"left_{name}")] = torch.tensor([x, y, z])
        turn_TJ3[:, POSED_JOINT_NAMES.index(f"right_{name}")] = torch.tensor([x, -y, -z])
    turn_TJ3[:, POSED_JOINT_NAMES.index("spine1"), 0] = 0.01 * breath_T
    local_TJ33, root_T33 = rotation.axis_angle_to_matrix(turn_TJ3), _pitch(torch.full((frames,), pitch))
    lowest_T = (Skeleton().keypoints(local_TJ33) @ root_T33.mT)[..., 1].amin(dim=1)
    place_T3 = torch.stack((0 * lowest_T, -lowest_T, 0 * lowest_T), dim=1)
    return still.changed(local_TJ33=local_TJ33, root_rotation_T33=root_T33, root_position_T3=place_T3)


def walk(frames: int, speed: float = 0.6) -> Motion:
    """Goes straight on with bent knees [m/s]: each foot is planted for half a second and swings forward for another; at
    60 frames a second.
    """
    still, skeleton = _standing(torch.full((frames,), 0.45), torch.zeros(frames), 60.0, 0.0), Skeleton()
    local_TJ33, time_T = still.local_TJ33.clone(), torch.arange(frames) / 60
    heights = dict(zip(KEYPOINT_NAMES, skeleton.keypoints(local_TJ33[:1])[0, :, 1].tolist(), strict=True))
    for late, side in enumerate(("left", "right")):
        hip, knee, ankle = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee", "ankle"))
        phase_T = (2 * time_T + late) % 2
        ahead_T = speed / 2 * torch.where(phase_T < 1, 0.5 - phase_T, phase_T - 1.5)
        lift_T = 0.5 * (phase_T - 1).clamp_min(0) * (2 - phase_T)
        swing_T = -(ahead_T / (heights[f"{side}_hip"] - heights[f"{side}_ankle"])).asin()
        local_TJ33[:, hip] = _pitch(swing_T - 2 * lift_T) @ local_TJ33[:, hip]
        local_TJ33[:, knee] = local_TJ33[:, knee] @ _pitch(4 * lift_T)
        local_TJ33[:, ankle] = (local_TJ33[:, hip] @ local_TJ33[:, knee]).mT
    lowest_T = skeleton.keypoints(local_TJ33)[..., 1].amin(dim=1)
    place_T3 = torch.stack((0 * time_T, -lowest_T, speed * time_T), dim=1)
    return still.changed(local_TJ33=local_TJ33, root_position_T3=place_T3)


def _pitch(angle_T: Tensor) -> Tensor:
    return rotation.axis_angle_to_matrix(torch.stack((angle_T, 0 * angle_T, 0 * angle_T), dim=1))


def _standing(bend_T: Tensor, lean_T: Tensor, rate: float, above: Tensor | float) -> Motion:
    turn_TJ3 = torch.zeros(len(bend_T), len(POSED_JOINT_NAMES), 3)
    for side in ("left", "right"):
        for joint, factor in (("hip", -1.0), ("knee", 2.0), ("ankle", -1.0)):
            turn_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_{joint}"), 0] = factor * bend_T
        turn_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_hip"), 2] += lean_T
    local_TJ33 = rotation.axis_angle_to_matrix(turn_TJ3)
    for side in ("left", "right"):  # ankles give back what hips have leaned
        j = POSED_JOINT_NAMES.index(f"{side}_ankle")
        chain = [POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee")]
        local_TJ33[:, j] = (local_TJ33[:, chain[0]] @ local_TJ33[:, chain[1]]).mT
    soles = keypoint_indices(["left_heel", "right_heel"])
    place_T3 = -Skeleton().keypoints(local_TJ33)[:, soles].mean(dim=1)
    place_T3[:, 1] += above
    return Motion("person", local_TJ33, rate, root_rotation_T33=torch.eye(3).repeat(len(bend_T), 1, 1),
                  root_position_T3=place_T3)  # fmt: skip


def moved(motion: Motion, turn: float = 0.0, place: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Motion:
    """The same, turned about the vertical [rad] and elsewhere [m]."""
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, turn, 0.0]))
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    return motion.changed(root_rotation_T33=turn_33 @ motion.root_rotation_T33,
                          root_position_T3=motion.root_position_T3 @ turn_33.T + torch.tensor(place))  # fmt: skip
