"""A robot's feet and legs, and a person's, as the plain arrays of `mrhubo.fast`.

Legend: as in `mrhubo.fast.sections`.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_JOINT, KEYPOINT_NAMES, PARENTS, ancestors
from mrhubo.fast.leg_section import Legs, RootTurn
from mrhubo.reference import standing
from mrhubo.retargeter.describing_robot import Bodies, real, whole
from mrhubo.robot import BodyMap
from mrhubo.robot.parts import CHEST

Names = dict[str, list[str]]


def describe_legs(body_map: BodyMap, bodies: Bodies) -> tuple[Legs | None, Names]:
    """The arrays, and the names of feet and of the points of a person's soles; none for a robot without feet."""
    if not body_map.keypoints.standing:
        return None, {}
    legs = standing.Legs(body_map)
    assert legs.joint == 0, "the pelvis carries the legs, in the table of body parts"
    names = {
        "feet": [sole.part.name for sole in legs.soles],
        "contact_points": [KEYPOINT_NAMES[point] for point in legs.contacts],
    }
    stand = standing.Standing(legs)
    low, blocks = stand.low_body, stand.problem.blocks
    block_D = torch.where(blocks.directions_DC.sum(dim=1) > 0, blocks.directions_DC.argmax(dim=1), -1)
    columns = body_map.direction_names.index
    carrier_44 = bodies.inside(legs.link)
    feet = [bodies.inside(sole.link) for sole in legs.soles]
    balls = [ball for sole in legs.soles for ball in [sole.link] * len(sole.balls_K4)]
    others_K = torch.nonzero(low.counts_K)[:, 0]
    bodies_K = [low.outline.bodies.links[body] for body in low.outline.body_K[others_K].tolist()]
    centre_K3 = [*legs.balls_K3, *low.outline.centre_K3[others_K]]
    found = Legs(
        **_person(legs),
        carrier_1=whole([bodies.number(legs.link)]),
        axes_33=real(carrier_44[:3, :3] @ real(legs.axes_33)),
        root_3=_placed(carrier_44, legs.root_3),
        body_H=whole([bodies.number(sole.link) for sole in legs.soles for _ in range(2)]),
        point_H3=real([_placed(feet[h // 2], point_3) for h, point_3 in enumerate(legs.points_P3)]),
        ball_body_J=whole([bodies.number(link) for link in (*balls, *bodies_K)]),
        ball_J3=real([_placed(bodies.inside(x), b) for x, b in zip((*balls, *bodies_K), centre_K3, strict=True)]),
        radius_J=real(torch.cat((legs.radius_K, low.outline.radius_K[others_K]))),
        near_HJ=whole(np.pad(legs.ball_PK, ((0, 0), (0, len(others_K))))),
        scale_1=real([legs.scale]),
        hip_R3=real(torch.stack([leg.hip_3 for leg in legs.built])),
        limb_R2=whole([[columns(name) for name, _ in leg.bones] for leg in legs.built]),
        length_R2=real([[length for _, length in leg.bones] for leg in legs.built]),
        foot_R2=whole([[columns(name) for name in sole.part.direction_names] for sole in legs.soles]),
        built_R23=real(torch.stack([leg.sole_23 for leg in legs.built])),
        block_N=whole(blocks.block_N),
        block_D=whole(block_D),
    )
    return found, names


def describe_root_turn(body_map: BodyMap) -> RootTurn | None:
    """How the base is turned further than the person's pelvis; None: it is not."""
    root = body_map.shared.root_turn
    if root is None:
        return None
    chest = JOINT_NAMES.index(CHEST.joint)
    return RootTurn(
        spine_3=whole(sorted(joint - 1 for joint in ancestors(chest) if joint)),
        leg_D=whole(body_map.shared.turned_D),
        share_1=real([root.share]),
        axis_G3=real(root.axis_W3),
        limit_G2=real(root.limit_W2),
        rest_33=real(root.rest_33),
    )


def _person(legs: standing.Legs) -> dict[str, np.ndarray]:
    """The person's joints and points."""
    skeleton = legs.body_map.skeleton
    carriers = [KEYPOINT_JOINT[point] for point in (*legs.starts, *legs.contacts)]
    joints = sorted({joint for carrier in carriers for joint in ancestors(carrier)} - {JOINT_NAMES.index("pelvis")})
    place = {0: 0, **{joint: k for k, joint in enumerate(joints, 1)}}
    points_E3 = real(skeleton.point_offsets_E3)
    return {
        "joint_L": whole([joint - 1 for joint in joints]),
        "parent_L": whole([place[PARENTS[joint]] for joint in joints]),
        "offset_L3": real(skeleton.offsets_J3)[[joint - 1 for joint in joints]],
        "start_R": whole([place[start] for start in legs.starts]),
        "sole_H": whole([place[KEYPOINT_JOINT[point]] for point in legs.contacts]),
        "sole_H3": real([points_E3[point - len(JOINT_NAMES)] for point in legs.contacts]),
    }


def _placed(pose_44: np.ndarray, point_3: Tensor) -> np.ndarray:
    """A point of a link in the frame of its body [m]."""
    return pose_44[:3, :3] @ real(point_3) + pose_44[:3, 3]
