"""A retargeter as the plain arrays of `mrhubo.fast`: everything that can be worked out before the first pose comes.

Legend: as in `mrhubo.fast.sections`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import nn

from mrhubo.body import BodyPrior, anatomy
from mrhubo.body.rest_directions import is_ours
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, PARENTS, ancestors
from mrhubo.body.vposer import VPoser
from mrhubo.errors import UserError
from mrhubo.fast.description import Description
from mrhubo.fast.narrowing import find_spaces
from mrhubo.fast.plain.human import BEND_DEG
from mrhubo.fast.sections import (
    BEND,
    LIMB,
    ORIENT,
    SHARE,
    Features,
    Human,
    Layers,
    Part,
    Prior,
    Reading,
    Settings,
    Trust,
)
from mrhubo.files.storage import write_tensors
from mrhubo.reference import polish
from mrhubo.retargeter import confidence
from mrhubo.retargeter.describing_legs import describe_legs, describe_root_turn
from mrhubo.retargeter.describing_robot import (
    Bodies,
    describe_capsules,
    describe_cost,
    describe_kinematics,
    real,
    single,
    whole,
)
from mrhubo.retargeter.describing_universal import describe_universal
from mrhubo.retargeter.features import DirectionFeatures, PoseFeatures
from mrhubo.retargeter.networks import Branched, ResidualMLP, RetargetNetwork
from mrhubo.retargeter.universal import AllDirections, UniversalJoints
from mrhubo.robot import BodyMap
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
    stages = (network.pre, network.post) if isinstance(network, RetargetNetwork) else (None, None)
    parts = [part for stage in stages if isinstance(stage, Branched) for part in stage.parts]
    constants = {
        **BEND_DEG,
        "far_rad": polish.FAR_RAD, "gain_rad": polish.GAIN_RAD, "first_steps": polish.FIRST_STEPS,
        "starts": polish.STARTS, "good_deg": confidence.GOOD_DEG, "excess_deg": confidence.EXCESS_DEG,
        "shake_deg": confidence.SHAKE_DEG, "acceleration": confidence.ACCELERATION,
        "neighbours": confidence.NEIGHBOURS, "usual_phi": retargeter.confidence.usual_phi,
    }  # fmt: skip
    first, last = (_parts(stage) if isinstance(stage, Branched) else () for stage in stages)
    reading, prior, bodies = _reading(body_map), retargeter.prior, Bodies(body_map.robot)
    legs, names_of_legs = describe_legs(body_map, bodies)
    return Description(
        _human(body_map),
        _features(network.features),
        first,
        last,
        describe_kinematics(retargeter.directions, bodies),
        describe_cost(retargeter.directions, retargeter.polisher),
        reading,
        _prior(prior, reading.joint_T),
        _trust(retargeter, reading.joint_T),
        describe_capsules(body_map, bodies),
        Settings(
            body_map.robot.name,
            body_map.robot.joint_names,
            body_map.direction_names,
            tuple(branch.name for branch in retargeter.branches),
            "directions" if network.directed else "local",
            network.limited.kind,
            any(isinstance(part, ResidualMLP) for part in parts[:1]),
            prior.activation,
            {name: float(value) for name, value in constants.items()},
            is_ours(body_map.skeleton),
            {
                "made_by": retargeter.facts.made_by,
                "checksum": retargeter.facts.checksum,
                "others": [asdict(other) for other in retargeter.facts.others],
                "on_base": {link: list(place) for link, place in retargeter.facts.on_base.items()},
                **names_of_legs,
            },
            body_map.collision.known,
        ),
        describe_universal(network, bodies) if isinstance(network, UniversalJoints) else None,
        legs,
        describe_root_turn(body_map),
    )


def write_description(description: Description, file: Path) -> Path:
    """Writes a description; the file's path. What would take long to look for at each start is looked for here."""
    prior = replace(description.prior, spaces=find_spaces(description))
    description = replace(description, prior=prior)
    tensors = {name: torch.from_numpy(array) for name, array in description.arrays().items()}
    write_tensors(file, tensors, description.metadata())
    return file


def _human(body_map: BodyMap) -> Human:
    shared = body_map.shared
    turns, order = shared.turns, shared.order_D.tolist()
    parents = [torch.zeros(end - start).long() for start, end in turns._levels[:1]]
    parents += [turns.get_buffer(f"_parents_{level}") for level in range(1, len(turns._levels))]
    outputs, views = turns.get_buffer("_outputs").tolist(), len(shared.views)
    upper, lower = ([order.index(place) for place in places] for places in shared._bent_limbs)
    return Human(
        joint_P=whole(turns.get_buffer("_rows")),
        parent_P=whole(torch.cat(parents)),
        view_V=whole(outputs[:views]),
        place_D=whole([outputs[views + place] for place in order]),
        rest_D3=real(shared.rest_D3[shared.order_D]),
        seen_D=whole(shared.view_D),
        bend_Z=whole(shared.bend_columns),
        upper_Z=whole(upper),
        lower_Z=whole(lower),
    )


def _features(features: PoseFeatures) -> Features:
    if isinstance(features, DirectionFeatures):
        names = ("columns_I", "bend_X", "upper_X", "lower_X", "first_P", "second_P", "limb_V", "axis_V", "seen_V")
        places = [whole(features.get_buffer(f"_{name}")) for name in names]
        numbers = [single(features.center_F), single(features.scale_F)]
    else:  # nothing that is worked out; what knows no network of its own takes the directions as they are
        rows = np.zeros(0, np.int64) if isinstance(features, AllDirections) else whole(features.get_buffer("_rows"))
        places = [rows, *[np.zeros(0, np.int64)] * 8]
        numbers = [np.full(6 * len(rows), value, np.float32) for value in (0.0, 1.0)]
    return Features(**{field.name: array for field, array in zip(fields(Features), [*places, *numbers], strict=True)})


def _layers(linear: Iterable[nn.Module]) -> Layers:
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for layer in linear:
        if isinstance(layer, nn.Linear):
            found.append((single(layer.weight), single(layer.bias)))
    return tuple(found)


def _parts(stage: Branched) -> tuple[Part, ...]:
    place, found = 0, []
    outputs = stage.get_buffer("_order").argsort().tolist()
    for number, net in enumerate(stage.parts):
        layers = _layers(net.modules())
        width = len(layers[-1][1])
        inputs = stage.get_buffer(f"_columns_{number}")
        found.append(Part(whole(inputs), whole(outputs[place : place + width]), layers))
        place += width
    return tuple(found)


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
        kind_K=whole(kind), slot_K=whole(slot), of_K=whole(of), seen_K=whole(seen), direction_K3=whole(direction),
        rest_K23=real(rest), share_K=real(share), last_K=whole(last), joint_T=whole(rows),
        parent_T=whole([turned.of(PARENTS[joint]) for joint in joints]),
        axis_T33=real(anatomy.AXES_J33[rows]), limit_T32=real(anatomy.LIMITS_J32[rows]).reshape(-1, 3, 2),
        mirror_T=whole(anatomy.RIGHT[rows]),
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
    bias = bias + single(decoder.identity_F)
    coders = encoder, (*outer, (weight[numbers], bias[numbers]))
    return Prior(
        *(tuple((np.ascontiguousarray(w), np.ascontiguousarray(b)) for w, b in layers) for layers in coders),
        spaces=None,
    )


def _trust(retargeter: Retargeter, joint_T: np.ndarray) -> Trust:
    branches, directions = retargeter.branches, len(retargeter.body_map.directions)
    weights = [asdict(weights) for weights in (retargeter.confidence.moving, retargeter.confidence.still)]
    return Trust(
        column_XD=whole([[d in branch.columns for d in range(directions)] for branch in branches]).reshape(
            -1, directions
        ),
        slot_XT=whole([[j in branch.joints for j in joint_T] for branch in branches]).reshape(-1, len(joint_T)),
        measured=whole(retargeter.body_map.measured),
        weight_25=real([[w[name] for name in ("certain", *confidence.SIGNALS)] for w in weights]),
    )
