"""A retargeter as the plain arrays of `mrhubo.fast`: everything that can be worked out before the first pose comes.

Legend: as in `mrhubo.fast.description`.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.body import BodyPrior, anatomy
from mrhubo.body.rest_directions import is_ours
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, PARENTS, ancestors
from mrhubo.body.vposer import VPoser
from mrhubo.errors import UserError
from mrhubo.fast.description import (
    BEND,
    LIMB,
    ORIENT,
    SHARE,
    Capsules,
    Cost,
    Description,
    Features,
    Human,
    Kinematics,
    Layers,
    Part,
    Prior,
    Reading,
    Settings,
    Trust,
)
from mrhubo.reference import DirectionProblem, polish
from mrhubo.retargeter import confidence
from mrhubo.retargeter.features import DirectionFeatures, PoseFeatures, RotationFeatures
from mrhubo.retargeter.networks import Branched, ResidualMLP
from mrhubo.robot import BodyMap, Robot, bending
from mrhubo.robot.joint import drive
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.parts import BendPart, LimbPart, OrientedPart

if TYPE_CHECKING:
    from mrhubo.retargeter.package import Retargeter


@torch.no_grad()
def describe(retargeter: Retargeter) -> Description:
    """The arrays of a retargeter, wherever it is.

    Raises:
        UserError: its body prior is one that the arrays do not hold.
    """
    network, body_map = retargeter.network, retargeter.body_map
    features, first, last = network.features, network.pre, network.post
    parts = [part for stage in (first, last) if isinstance(stage, Branched) for part in stage.parts]
    constants = {
        "plane_low_deg": bending.PLANE_DEG[0], "plane_high_deg": bending.PLANE_DEG[1],
        "needed_low_deg": bending.NEEDED_DEG[0], "needed_high_deg": bending.NEEDED_DEG[1],
        "far_rad": polish.FAR_RAD, "gain_rad": polish.GAIN_RAD, "first_steps": polish.FIRST_STEPS,
        "starts": polish.STARTS, "good_deg": confidence.GOOD_DEG, "excess_deg": confidence.EXCESS_DEG,
        "shake_deg": confidence.SHAKE_DEG, "acceleration": confidence.ACCELERATION,
        "neighbours": confidence.NEIGHBOURS, "usual_phi": retargeter.confidence.usual_phi,
    }  # fmt: skip
    reading, prior = _reading(body_map), retargeter.prior
    return Description(
        _human(body_map),
        _features(features),
        _parts(first) if isinstance(first, Branched) else (),
        _parts(last),
        _kinematics(retargeter.directions),
        _cost(retargeter.directions, retargeter.polisher),
        reading,
        _prior(prior, reading.joint_T),
        _trust(retargeter, reading.joint_T),
        _capsules(body_map),
        Settings(
            body_map.robot.name,
            body_map.robot.joint_names,
            body_map.direction_names,
            tuple(branch.name for branch in retargeter.branches),
            "directions" if isinstance(features, DirectionFeatures) else "local",
            network.limited.kind,
            isinstance(parts[0], ResidualMLP),
            prior.activation,
            {name: float(value) for name, value in constants.items()},
            is_ours(body_map.skeleton),
            {
                "made_by": retargeter.facts.made_by,
                "checksum": retargeter.facts.checksum,
                "others": [asdict(other) for other in retargeter.facts.others],
            },
        ),
    )


def _int(values: Tensor | Sequence[int] | np.ndarray) -> np.ndarray:
    values = values.cpu().numpy() if isinstance(values, Tensor) else values
    return np.array(values, np.int64)


def _float(values: Tensor | Sequence[float] | np.ndarray) -> np.ndarray:
    values = values.cpu().numpy() if isinstance(values, Tensor) else values
    return np.array(values, np.float64)


def _human(body_map: BodyMap) -> Human:
    shared = body_map.shared
    turns, order = shared.turns, shared.order_D.tolist()
    parents = [torch.zeros(end - start).long() for start, end in turns._levels[:1]]
    parents += [turns.get_buffer(f"_parents_{level}") for level in range(1, len(turns._levels))]
    outputs, views = turns.get_buffer("_outputs").tolist(), len(shared.views)
    upper, lower = ([order.index(place) for place in places] for places in shared._bent_limbs)
    return Human(
        joint_P=_int(turns.get_buffer("_rows")),
        parent_P=_int(torch.cat(parents)),
        view_V=_int(outputs[:views]),
        place_D=_int([outputs[views + place] for place in order]),
        rest_D3=_float(shared.rest_D3[shared.order_D]),
        seen_D=_int(shared.view_D),
        bend_Z=_int(shared.bend_columns),
        upper_Z=_int(upper),
        lower_Z=_int(lower),
    )


def _features(features: PoseFeatures) -> Features:
    if isinstance(features, RotationFeatures):
        rows, nothing = features.get_buffer("_rows"), np.zeros(0, np.int64)
        center_F = np.zeros(features.size, np.float32)
        return Features(_int(rows), *[nothing] * 8, center_F, center_F + 1)
    assert isinstance(features, DirectionFeatures)
    names = ("columns_I", "bend_X", "upper_X", "lower_X", "first_P", "second_P", "limb_V", "axis_V", "seen_V")
    places = [_int(features.get_buffer(f"_{name}")) for name in names]
    return Features(*places, _single(features.center_F), _single(features.scale_F))


def _layers(linear: Iterable[nn.Module]) -> Layers:
    found = []
    for layer in linear:
        if isinstance(layer, nn.Linear):
            found.append(tuple(_single(tensor) for tensor in (layer.weight, layer.bias)))
    return tuple(found)


def _single(tensor: Tensor) -> np.ndarray:
    return np.array(tensor.detach().cpu().numpy(), np.float32)


def _parts(stage: Branched) -> tuple[Part, ...]:
    place, found = 0, []
    outputs = stage.get_buffer("_order").argsort().tolist()
    for number, net in enumerate(stage.parts):
        layers = _layers(net.modules())
        width = len(layers[-1][1])
        inputs = stage.get_buffer(f"_columns_{number}")
        found.append(Part(_int(inputs), _int(outputs[place : place + width]), layers))
        place += width
    return tuple(found)


class _Bodies:
    """The links that driven joints carry, and where others are fixed to them."""

    def __init__(self, robot: Robot) -> None:
        self.description = robot.description
        depth = {name: len(self.description.joints_above(self._child(name))) for name in robot.driven_joints}
        self.joints = sorted(robot.driven_joints, key=lambda name: depth[name])
        """Each after those above it."""
        exact, home_N = copy.deepcopy(robot).double(), robot.home().double()
        poses, self._pose = exact.forward(home_N[None]), {self.description.root: np.eye(4)}
        for link, rotation_33, position_3 in zip(
            exact.links, poses.rotation_BL33[0], poses.position_BL3[0], strict=True
        ):
            pose_44 = np.eye(4)
            pose_44[:3, :3], pose_44[:3, 3] = rotation_33.cpu().numpy(), position_3.cpu().numpy()
            self._pose[link] = pose_44
        self.home_N = home_N.cpu().numpy()

    def _child(self, joint: str) -> str:
        return self.description.joints[joint].child

    def number(self, link: str) -> int:
        """Of the body that a link is fixed to; 0 is the root."""
        above = (joint.name for joint in self.description.joints_above(link))
        return next((self.joints.index(name) + 1 for name in above if name in self.joints), 0)

    def inside(self, link: str) -> np.ndarray:
        """Pose (4, 4) of a link in the frame of its body."""
        number = self.number(link)
        body = self._child(self.joints[number - 1]) if number else self.description.root
        return np.linalg.inv(self._pose[body]) @ self._pose[link]

    def origin(self, joint: str, angle: float) -> tuple[int, np.ndarray]:
        """The body that carries a joint, and the joint's pose (3, 4) in its frame; `angle`: the joint's at home."""
        own = self.description.joints[joint]
        parent = self.number(own.parent)
        body = self._child(self.joints[parent - 1]) if parent else self.description.root
        home_44 = np.linalg.inv(self._pose[body]) @ self._pose[own.child]
        return parent, (home_44 @ np.linalg.inv(_moved(own.axis_3, angle, own.rotary)))[:3]


def _moved(axis_3: np.ndarray, angle: float, rotary: bool) -> np.ndarray:
    pose_44 = np.eye(4)
    if not rotary:
        pose_44[:3, 3] = angle * axis_3
        return pose_44
    x, y, z = axis_3
    cross_33 = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose_44[:3, :3] += np.sin(angle) * cross_33 + (1 - np.cos(angle)) * cross_33 @ cross_33
    return pose_44


def _kinematics(problem: DirectionProblem) -> Kinematics:
    body_map, jacobian = problem.body_map, problem.kinematics
    robot, shared = body_map.robot, body_map.shared
    bodies = _Bodies(robot)
    drives = [drive(robot.description.joints, name) for name in bodies.joints]
    columns = [robot.joint_names.index(d.joint) for d in drives]
    angles = [d.multiplier * bodies.home_N[n] + d.offset for d, n in zip(drives, columns, strict=True)]
    placed = [bodies.origin(name, angle) for name, angle in zip(bodies.joints, angles, strict=True)]
    own = [robot.description.joints[name] for name in bodies.joints]

    def point(link: str, offset: Iterable[float]) -> tuple[int, np.ndarray]:
        pose_44 = bodies.inside(link)
        return bodies.number(link), pose_44[:3, :3] @ np.array(list(offset)) + pose_44[:3, 3]

    def axis(link: str, axis_3: Tensor) -> tuple[int, np.ndarray]:
        return bodies.number(link), bodies.inside(link)[:3, :3] @ axis_3.cpu().double().numpy()

    starts, ends = [], []
    for direction in body_map.directions:
        if isinstance(direction, Limb):
            starts.append(point(direction.start.link, direction.start.offset_3))
            ends.append(point(direction.end.link, direction.end.offset_3))
        else:
            starts.append((0, np.zeros(3)))
            ends.append(axis(direction.link, direction.axis_3))
    views = [
        (bodies.number(link), bodies.inside(link)[:3, :3] @ axes_33.cpu().double().numpy())
        for link, axes_33 in zip(shared.view_links, shared.view_axes_V33, strict=True)
    ]
    here = [bodies.joints.index(name) for name in robot.driven_joints]
    pairs = len(jacobian._direction_P)
    column_Q = np.zeros(pairs, np.int64)
    layers_KD3N = jacobian._layers_KX.reshape(-1, len(body_map.directions), 3, len(robot.joint_names)).cpu()
    for layer, d, n in torch.nonzero(layers_KD3N[:, :, 0] < 3 * pairs).tolist():
        column_Q[int(layers_KD3N[layer, d, 0, n]) // 3] = n
    factors = [getattr(jacobian, f"_{name}_P1")[:, 0] for name in ("end", "start", "bend", "slide")]
    return Kinematics(
        parent_A=_int([parent for parent, _ in placed]),
        origin_A34=_float(np.array([origin for _, origin in placed])),
        axis_A3=_float(np.array([joint.axis_3 for joint in own])),
        rotary_A=_int([joint.rotary for joint in own]),
        column_A=_int(columns),
        ratio_A=_float([d.multiplier for d in drives]),
        offset_A=_float([d.offset for d in drives]),
        limb_D=_int([isinstance(direction, Limb) for direction in body_map.directions]),
        start_body_D=_int([body for body, _ in starts]),
        start_D3=_float(np.array([point_3 for _, point_3 in starts])),
        end_body_D=_int([body for body, _ in ends]),
        end_D3=_float(np.array([point_3 for _, point_3 in ends])),
        view_body_V=_int([body for body, _ in views]),
        view_V33=_float(np.array([axes_33 for _, axes_33 in views])),
        direction_Q=_int(jacobian._direction_P),
        joint_Q=_int([here[a % len(here)] for a in jacobian._joint_P.tolist()]),
        column_Q=column_Q,
        factor_Q4=_float(torch.stack(factors, dim=1)),
    )


def _cost(problem: DirectionProblem, polisher: polish.Polish) -> Cost:
    blocks, posture, pool = problem.blocks, problem.posture, polisher.pool
    turned_DC = blocks.directions_DC
    block_D = torch.where(turned_DC.sum(dim=1) > 0, turned_DC.argmax(dim=1), -1)
    ridge_CU = torch.zeros(pool.cells_CU.shape, device=pool.q_UN.device)
    for block, part in enumerate(pool.blocks):
        for number, cell in enumerate(part.get_submodule("cells").children()):
            ridge_CU[block, pool.cells_CU[block] == number] = cell.get_buffer("constant_U")
    directions_UD3 = problem.body_map.robot_directions(problem.robot.forward(pool.q_UN))
    return Cost(
        lower_N=_float(problem.lower_N),
        upper_N=_float(problem.upper_N),
        velocity_N=_float(problem.robot.velocity_N),
        middle_N=_float(posture.mid_N),
        ridge_N=_float(posture.ridge_N),
        block_N=_int(blocks.block_N),
        block_D=_int(block_D),
        weight_D=_float(problem.directions.weight_D),
        partial_D=_int(problem.directions.partial_D > 0),
        pool_UN=_single(pool.q_UN),
        pool_UD3=_single(directions_UD3),
        pool_ridge_CU=_single(ridge_CU),
        cell_CU=np.array(pool.cells_CU.cpu().numpy(), np.int32),
    )


class _Turned:
    """Slots of the joints that the steps of a reading turn."""

    def __init__(self) -> None:
        self.slots: dict[int, int] = {}

    def of(self, joint: int) -> int:
        """Whose turn a joint has: its own, or that of the nearest turned joint above it, as the others are at rest."""
        return next((self.slots[above] for above in ancestors(joint) if above in self.slots), 0)

    def turn(self, joint: int) -> int:
        """The slot of a joint, which is turned from here on."""
        return self.slots.setdefault(joint, len(self.slots) + 1)


def _reading(body_map: BodyMap) -> Reading:
    """The steps of `mrhubo.robot.alignment.align_pose` for a person at rest."""
    column = {name: i for i, name in enumerate(body_map.direction_names)}
    rest_K3 = body_map.skeleton.rest_K3.cpu()
    joint_of = {part.name: JOINT_NAMES.index(part.joint) for part in body_map.keypoints.parts}
    turned, seen_from, steps = _Turned(), {}, []
    nothing = (0.0, 0.0, 0.0)
    for part in body_map.keypoints.parts:
        columns = [column[name] for name in part.direction_names if name in column]
        there = bool(columns) and len(columns) == len(part.direction_names)
        if not part.seen_from or not (there or isinstance(part, BendPart)):
            continue
        seen = seen_from.setdefault(part.seen_from, turned.of(joint_of[part.seen_from]))
        joint = JOINT_NAMES.index(part.joint)
        of = turned.of(joint)
        if isinstance(part, LimbPart):
            start, end = (KEYPOINT_NAMES.index(name) for name in (part.start, part.end))
            bone_3 = torch.nn.functional.normalize(rest_K3[end] - rest_K3[start], dim=0).tolist()
            steps.append((LIMB, turned.turn(joint), of, seen, (*columns, -1, -1), (bone_3, nothing), 1.0, 0))
        elif isinstance(part, BendPart):
            limbs = [column[limb.direction_names[0]] for limb in body_map.keypoints.parts if limb.name in part.limbs]
            wanted = (*limbs, columns[0] if there else -1)
            steps.append((BEND, turned.turn(joint), of, seen, wanted, (part.rest, nothing), 1.0, 0))
        elif isinstance(part, OrientedPart):
            for shares, name in zip(range(len(part.turned_by), 1, -1), part.turned_by, strict=False):
                inner, last = JOINT_NAMES.index(name), turned.of(joint)
                of = turned.of(inner)
                steps.append((SHARE, turned.turn(inner), of, seen, (*columns, -1), part.rest, 1 / shares, last))
            of = turned.of(joint)
            steps.append((ORIENT, turned.turn(joint), of, seen, (*columns, -1), part.rest, 1.0, of))
    kind, slot, of, seen, direction, rest, share, last = zip(*steps, strict=True)
    joints = list(turned.slots)
    rows = [joint - 1 for joint in joints]
    return Reading(
        kind_K=_int(kind), slot_K=_int(slot), of_K=_int(of), seen_K=_int(seen), direction_K3=_int(direction),
        rest_K23=_float(rest), share_K=_float(share), last_K=_int(last), joint_T=_int(rows),
        parent_T=_int([turned.of(PARENTS[joint]) for joint in joints]),
        axis_T33=_float(anatomy.AXES_J33[rows]), limit_T32=_float(anatomy.LIMITS_J32[rows]).reshape(-1, 3, 2),
        mirror_T=_int(anatomy.RIGHT[rows]),
    )  # fmt: skip


def _prior(prior: BodyPrior, joint_T: np.ndarray) -> Prior:
    """The layers that tell of some joints alone, of a person whose other joints are at rest."""
    if isinstance(prior, VPoser):
        raise UserError("VPoser is a body prior that only PyTorch works with; fit with `body.prior: open`")
    (first, *inner), decoder = _layers(prior.encoder), prior.decoder
    numbers = (6 * joint_T[:, None] + np.arange(6)).reshape(-1)
    last_weight, last_bias = inner.pop()
    encoder = ((first[0][:, numbers], first[1]), *inner, (last_weight[: prior.latent], last_bias[: prior.latent]))
    *outer, (weight, bias) = _layers(decoder)
    bias = bias + _single(decoder.identity_F)
    found = Prior(tuple(encoder), (*outer, (weight[numbers], bias[numbers])))
    return Prior(*(tuple((np.ascontiguousarray(w), np.ascontiguousarray(b)) for w, b in layers)
                   for layers in (found.encoder, found.decoder)))  # fmt: skip


def _trust(retargeter: Retargeter, joint_T: np.ndarray) -> Trust:
    branches, directions = retargeter.branches, len(retargeter.body_map.directions)
    weights = [asdict(weights) for weights in (retargeter.confidence.moving, retargeter.confidence.still)]
    return Trust(
        column_XD=_int([[d in branch.columns for d in range(directions)] for branch in branches]).reshape(
            -1, directions
        ),
        slot_XT=_int([[j in branch.joints for j in joint_T] for branch in branches]).reshape(-1, len(joint_T)),
        measured=_int(retargeter.body_map.measured),
        weight_25=_float([[w[name] for name in ("certain", *confidence.SIGNALS)] for w in weights]),
    )


def _capsules(body_map: BodyMap) -> Capsules:
    collision, joints = body_map.collision, body_map.robot.driven_joints
    numbers = _Bodies(body_map.robot)
    children = [body_map.robot.description.joints[name].child for name in joints]
    number = [0, *(numbers.number(child) for child in children)]
    return Capsules(
        body_S=_int([number[body] for body in collision._body_C.tolist()]),
        end_S23=_float(collision._ends_C23),
        radius_S=_float(collision._radius_C),
        pair_Y2=np.array(collision._pair_2P.T.cpu().numpy(), np.int32),
    )
