"""Whether a description that was read from a file can be used: its arrays fit together, and no place in one lies
outside another, where compiled functions would read what is not theirs.

Legend: as in `mrhubo.fast.sections`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mrhubo.fast.description import Description
    from mrhubo.fast.leg_section import Legs, RootTurn
    from mrhubo.fast.sections import Layers, Part, Universal

_JOINTS = 21
_ACTIVATIONS = ("silu", "leaky_relu", "tanh")
"""Of the body prior."""
_CONSTANTS = (
    "plane_low_deg", "plane_high_deg", "needed_low_deg", "needed_high_deg", "far_rad", "gain_rad", "first_steps",
    "starts", "good_deg", "excess_deg", "shake_deg", "acceleration", "neighbours", "usual_phi",
)  # fmt: skip
_INPUTS = ("bend_W", "upper_W", "lower_W", "first_O", "second_O", "limb_M", "axis_M", "seen_M")
_MOST = 1e6
"""No constant is larger."""
_ROUNDED = 1e-3
"""How far lengths of axes may be from 1."""
_LARGEST = 1024
"""Nor is a size of the universal network."""


def check(d: Description) -> None:
    """Refuses a description that does not fit together.

    Raises:
        ValueError: says what does not.
    """
    human, k, cost, reading, trust, capsules = d.human, d.kinematics, d.cost, d.reading, d.trust, d.capsules
    sizes = {
        "P": len(human.joint_P), "V": len(human.view_V), "D": len(human.place_D), "Z": len(human.bend_Z),
        "A": len(k.parent_A), "Q": len(k.direction_Q), "N": len(cost.lower_N), "C": len(cost.cell_CU),
        "U": len(cost.pool_UN), "K": len(reading.kind_K), "T": len(reading.joint_T), "X": len(trust.column_XD),
        "I": len(d.features.input_I), "W": len(d.features.bend_W), "O": len(d.features.first_O),
        "M": len(d.features.limb_M), "F": len(d.features.center_F), "S": len(capsules.body_S),
        "Y": len(capsules.pair_Y2), "E": 0 if d.universal is None else len(d.universal.block_E),
        "G": 0 if d.root is None else len(d.root.axis_G3),
        **({} if d.legs is None else {"R": len(d.legs.hip_R3), "H": 2 * len(d.legs.hip_R3),
                                      "J": len(d.legs.radius_J), "L": len(d.legs.joint_L)}),
    }  # fmt: skip
    for name, array in d.arrays().items():
        axes = name.rpartition("_")[2] if "_" in name else ""
        if "layers" not in name and axes and all(axis in sizes or axis.isdigit() for axis in axes):
            wanted = tuple(sizes[axis] if axis in sizes else int(axis) for axis in axes)
            _refuse(array.shape != wanted, f"{name} has shape {array.shape}, expected {wanted}")
        whole, real = array.dtype in (np.int64, np.int32), array.dtype in (np.float32, np.float64)
        _refuse(not (whole or (real and np.isfinite(array).all())), f"{name} holds what are no finite numbers")
    _refuse(sizes["A"] < 1 or sizes["N"] < 1 or sizes["D"] < 1 or sizes["C"] < 1, "nothing moves")
    _refuse(bool((cost.lower_N > cost.upper_N).any()), "cost.lower_N is above cost.upper_N")
    _refuse(bool((cost.velocity_N <= 0).any()), "cost.velocity_N lets a joint not turn")
    bodies, places, slots = sizes["A"] + 1, sizes["P"] + 1, sizes["T"] + 1
    for name, array, most in (
        ("human.joint", human.joint_P, _JOINTS), ("human.parent", human.parent_P, np.arange(1, places)),
        ("human.view", human.view_V, places), ("human.place", human.place_D, places),
        ("human.seen", human.seen_D, sizes["V"]), ("human.bend", human.bend_Z, sizes["D"]),
        ("human.upper", human.upper_Z, sizes["D"]), ("human.lower", human.lower_Z, sizes["D"]),
        ("kinematics.parent", k.parent_A, np.arange(1, bodies)), ("kinematics.column", k.column_A, sizes["N"]),
        ("kinematics.start", k.start_body_D, bodies), ("kinematics.end", k.end_body_D, bodies),
        ("kinematics.view", k.view_body_V, bodies), ("kinematics.direction", k.direction_Q, sizes["D"]),
        ("kinematics.joint", k.joint_Q, sizes["A"]), ("kinematics.column", k.column_Q, sizes["N"]),
        ("cost.block", cost.block_N, sizes["C"]), ("cost.block", cost.block_D + 1, sizes["C"] + 1),
        ("reading.kind", reading.kind_K, 4), ("reading.slot", reading.slot_K - 1, sizes["T"]),
        ("reading.of", reading.of_K, slots), ("reading.seen", reading.seen_K, slots),
        ("reading.last", reading.last_K, slots), ("reading.direction", reading.direction_K3[:, 0], sizes["D"]),
        ("reading.direction", reading.direction_K3 + 1, sizes["D"] + 1), ("reading.joint", reading.joint_T, _JOINTS),
        ("reading.parent", reading.parent_T, slots), ("trust.measured", trust.measured, sizes["D"]),
        ("capsules.body", capsules.body_S, bodies), ("capsules.pair", capsules.pair_Y2, sizes["S"]),
        ("features", d.features.input_I, sizes["D"] if d.settings.features == "directions" else _JOINTS),
        *(("features", getattr(d.features, name), sizes["I"]) for name in _INPUTS),
    ):  # fmt: skip
        _refuse(not _are_places(array, most), f"{name} names what is not there")
    _refuse(len(set(cost.block_N.tolist())) != sizes["C"], "cost.block_N leaves a block without a joint")
    needs_two = reading.kind_K > 0
    _refuse(bool((reading.direction_K3[needs_two, 1] < 0).any()), "reading.direction names what is not there")
    _refuse(
        bool((trust.column_XD.sum(1) < 1).any() or (trust.slot_XT.sum(1) < 1).any()), "a branch is measured by nothing"
    )
    _refuse(set(_CONSTANTS) != set(d.settings.constants), "constants are others")
    _refuse(not all(abs(float(x)) < _MOST for x in d.settings.constants.values()), "a constant is no number")
    _check_names(d, sizes)
    if d.universal is not None:
        _check_universal(d.universal, sizes)
    elif d.post:
        _check_stages(d, sizes)
    else:
        _check_starts(d)
    if d.legs is not None:
        _check_legs(d, d.legs, sizes)
    if d.root is not None:
        _check_root(d.root)
    _check_prior(d, sizes)


def _refuse(wrong: bool, what: str) -> None:
    if wrong:
        raise ValueError(what)


def _are_places(array: np.ndarray, most: int | np.ndarray) -> bool:
    """Whether all are whole numbers from 0 to under some most: compiled functions look nowhere else."""
    return array.dtype.kind == "i" and not bool(((array < 0) | (array >= most)).any())


def _check_names(d: Description, sizes: dict[str, int]) -> None:
    settings = d.settings
    for names, axis in ((settings.joint_names, "N"), (settings.direction_names, "D"), (settings.branch_names, "X")):
        _refuse(len(names) != sizes[axis] or not _are_names(names), "names are others than there are numbers for")
    _refuse(
        settings.activation not in _ACTIVATIONS or settings.bound not in ("tanh", "clamp"), "an activation is unknown"
    )
    _refuse(settings.features not in ("directions", "local"), "features are unknown")
    _refuse(not isinstance(settings.collision_known, bool), "collision_known is neither true nor false")


def _are_names(names: Iterable[Any]) -> bool:
    return all(isinstance(name, str) for name in names)


def _check_stages(d: Description, sizes: dict[str, int]) -> None:
    more = sizes["W"] * 3 + sizes["O"] + sizes["M"] * 3
    features = sizes["I"] * 3 + more if d.settings.features == "directions" else sizes["I"] * 6
    _refuse(sizes["F"] != features, "features are others than there are numbers for")
    links = 6 * sizes["N"]
    if d.pre:
        _check_stage("pre", d.pre, features, links)
    _check_stage("post", d.post, links if d.pre else features, sizes["N"])


def _check_universal(u: Universal, sizes: dict[str, int]) -> None:
    for name, array, most in (
        ("block_E", u.block_E, sizes["C"]), ("slot_E5", u.slot_E5 + 1, sizes["D"] + 1),
        ("view_E", u.view_E, sizes["V"]), ("joint_N", u.joint_N, sizes["A"]), ("axial_E3", u.axial_E3 + 1, 3),
        ("flip_E53", u.flip_E53 + 1, 3), ("sense_N", u.sense_N + 1, 3), ("size_2", u.size_2 - 1, _LARGEST),
    ):  # fmt: skip
        _refuse(not _are_places(array, most), f"universal.{name} names what is not there")
    _refuse(len(set(u.block_E.tolist())) != len(u.block_E), "universal.block_E names a block twice")
    (heads, hypotheses), width = u.size_2.tolist(), len(u.weights["joint.bias"])
    _refuse(not 1 <= width <= _LARGEST or bool(width % heads), "the universal network's sizes are no network's")
    pairs = {"mix": (3 * width, width), "mixed": (width, width), "up": (2 * width, width), "down": (width, 2 * width)}
    layers = {f"layers.{i}.{name}": shape for i in range(2) for name, shape in pairs.items()}
    layers |= {"joint": (width, 44), "first": (4 * hypotheses, width), "later": (4, width)}
    norms = ["norm", *(f"layers.{i}.norm{k}" for i in range(2) for k in (1, 2))]
    shapes = {f"{name}.weight": shape for name, shape in layers.items()} | {"branch.weight": (width, 37)}
    shapes |= {f"{name}.bias": shape[:1] for name, shape in layers.items()}
    shapes |= {f"{name}.{kind}": (width,) for name in norms for kind in ("weight", "bias")}
    found = {name: array.shape for name, array in u.weights.items() if array.dtype == np.float32}
    _refuse(found != shapes or len(found) != len(u.weights), "the universal network has other layers than are needed")


def _check_starts(d: Description) -> None:
    """Where no network answers, each cell needs poses to start from."""
    _refuse(bool(d.pre), "its networks give no joint angles")
    starts = int(d.settings.constants["starts"])
    _refuse(not 1 <= starts <= len(d.cost.pool_UN), "there are no poses to start from")
    found = [bool((d.cost.cell_CU == start).any(axis=1).all()) for start in range(starts)]
    _refuse(not all(found), "cost.cell leaves a start without a pose")


def _check_legs(d: Description, legs: Legs, sizes: dict[str, int]) -> None:
    bodies, places = sizes["A"] + 1, sizes["L"] + 1
    for name, array, most in (
        ("joint_L", legs.joint_L, _JOINTS), ("parent_L", legs.parent_L, np.arange(1, places)),
        ("start_R", legs.start_R, places), ("sole_H", legs.sole_H, places), ("carrier_1", legs.carrier_1, bodies),
        ("body_H", legs.body_H, bodies), ("ball_body_J", legs.ball_body_J, bodies), ("near_HJ", legs.near_HJ, 2),
        ("limb_R2", legs.limb_R2, sizes["D"]), ("foot_R2", legs.foot_R2, sizes["D"]),
        ("block_N", legs.block_N, sizes["C"]), ("block_D", legs.block_D + 1, sizes["C"] + 1),
    ):  # fmt: skip
        _refuse(not _are_places(array, most), f"legs.{name} names what is not there")
    for name in ("offset_L3", "sole_H3", "axes_33", "root_3", "point_H3", "ball_J3", "radius_J", "scale_1", "hip_R3",
                 "length_R2", "built_R23"):  # fmt: skip
        _refuse(getattr(legs, name).dtype != np.float64, f"legs.{name} holds other numbers than are needed")
    _refuse(not sizes["R"] or not legs.near_HJ.any(axis=1).all(), "legs.near_HJ leaves an end of a sole without a ball")
    names = [d.settings.facts.get(name) for name in ("feet", "contact_points")]
    counts = [len(names) if isinstance(names, list) and _are_names(names) else 0 for names in names]
    _refuse(counts != [sizes["R"], sizes["H"]], "feet have other names than there are numbers for")


def _check_root(root: RootTurn) -> None:
    for name, array, most in (("spine_3", root.spine_3, _JOINTS), ("leg_D", root.leg_D, 2)):
        _refuse(not _are_places(array, most), f"root.{name} names what is not there")
    _refuse(float(root.share_1[0]) not in (0.5, 1.0), "root.share_1 is neither a half nor the whole")
    _refuse(bool((root.limit_G2[:, 0] > root.limit_G2[:, 1]).any()), "root.limit_G2 ends before it begins")
    lengths_G, crooked_33 = (root.axis_G3**2).sum(-1), root.rest_33.T @ root.rest_33 - np.eye(3)
    off = max(np.abs(lengths_G - 1).max(initial=0.0), np.abs(crooked_33).max())
    _refuse(bool(off > _ROUNDED), "root holds axes that are no unit vectors")


def _check_prior(d: Description, sizes: dict[str, int]) -> None:
    numbers = 6 * sizes["T"]
    latent = len(d.prior.encoder[-1][1]) if d.prior.encoder else 0
    _check_layers("prior", d.prior.encoder, numbers, latent)
    _check_layers("prior", d.prior.decoder, latent, numbers)
    for space_ER, (weight, _) in zip(d.prior.spaces or (), d.prior.encoder, strict=False):
        fits = space_ER.ndim == 2 and space_ER.shape[0] == weight.shape[1] and space_ER.shape[1] <= space_ER.shape[0]
        _refuse(not fits or space_ER.dtype != np.float32, "a space of the prior does not fit the layer that reads it")


def _check_stage(name: str, stage: tuple[Part, ...], inputs: int, outputs: int) -> None:
    given = np.concatenate([part.output for part in stage]) if stage else np.zeros(0, int)
    whole = _are_places(given, outputs) and np.array_equal(np.sort(given), np.arange(outputs))
    _refuse(not whole, f"{name} gives other numbers than are needed")
    for part in stage:
        _refuse(not _are_places(part.input, inputs), f"{name} sees what is not there")
        _check_layers(name, part.layers, len(part.input), len(part.output))


def _check_layers(name: str, layers: Layers, inputs: int, outputs: int) -> None:
    width = inputs
    for weight, bias in layers:
        _refuse(weight.dtype != np.float32 or bias.dtype != np.float32, f"{name} has layers that are no float32")
        _refuse(
            weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1],
            f"{name} has layers that do not fit",
        )
        width = len(bias)
    _refuse(not layers or width != outputs, f"{name} has layers that do not fit")
