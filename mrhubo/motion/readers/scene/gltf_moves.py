"""The animations of a glTF file: keys of where nodes are, how they are turned and scaled, and what is between them.

Appendix C of the specification (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#appendix-c-interpolation).

Legend: N nodes, K keys, F times, X numbers of a key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.fast.plain.human import norm
from mrhubo.fast.rotations import quaternion_to_matrix
from mrhubo.motion.readers.options import RATES
from mrhubo.motion.readers.scene.gltf_file import DAMAGED, GltfFile, entries, inner, whole
from mrhubo.motion.readers.scene.nodes import Animation
from mrhubo.robot_motion.clock import rate_of_rounded

_KINDS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
_METHODS = {"STEP": 1, "LINEAR": 1, "CUBICSPLINE": 3}
"""How many elements a key has."""
_EARLY = 0.05
"""Of a frame: times are rounded, so a key that comes this much after a frame holds in it."""
_SHORTEST = 1e-6
"""Of quaternions that are none to be normalised."""
_LEAST_SCALE = 1e-4
"""What is scaled to nothing, as things are that are to be hidden, keeps axes."""
_NO_RATE = 30.0
"""Frames a second where keys tell none."""
_SLOWEST = 10.0
"""Keys a second: fewer are an animator's, between which more happens."""
_SAME = 2.5e-4
"""Keys of two nodes that are closer are at the same time [s]."""
_OFF, _MOST = 0.15, 0.9
"""How far from a multiple of the usual step others may be, of a step, and how many of them must be nearer."""
_PARTS, _TELLING = 6, 8
"""Where keys have been left out, the shortest step may be so many of the usual one, if so many steps agree."""
_SOME, _SOME_INPUTS = 1_024, 64
"""Keys, and lists of keys, that are looked at for the rate."""
_WORK, _WORK_PER_KEY = 2_000_000, 1_000
"""Frames times nodes that are worked out at most, and how many more for each key: two keys may be a day apart."""


@dataclass(frozen=True)
class Places:
    """Where nodes are in their parents when nothing moves them."""

    local_N34: np.ndarray
    translation_N3: np.ndarray
    rotation_N33: np.ndarray
    scale_N3: np.ndarray


@dataclass(frozen=True)
class _Channel:
    """What moves one node in one way."""

    node: int
    path: str
    method: str
    input_place: int
    """The accessor of its times."""
    time_K: np.ndarray
    value_KX: np.ndarray
    """Of cubic splines (K, 3, X): how fast it comes to a key, what it is there, how fast it leaves [1/s]."""


def find_animations(file: GltfFile, places: Places, number: Mapping[int, int]) -> tuple[Animation, ...]:
    """The animations that move nodes.

    Args:
        file: the file.
        places: the nodes as they are without an animation.
        number: places of the nodes that are kept, by their places in the file.

    Raises:
        UserError: keys are missing, damaged, or do not rise.
    """
    found, names, checked = list[Animation](), set[str](), set[tuple[Any, ...]]()
    for i, entry in enumerate(entries(file.top, "animations")):
        told = entry.get("name")
        name = told if isinstance(told, str) and told else f"animation {i}"
        name = name if name not in names else f"{name} {i}"
        names.add(name)
        channels = _channels(file, entry, f"animation '{shortened(name, 40)}'", number, checked)
        if channels:
            found.append(_animation(name, channels, places))
    return tuple(found)


def _channels(
    file: GltfFile, entry: dict[str, Any], where: str, number: Mapping[int, int], checked: set[tuple[Any, ...]]
) -> list[_Channel]:
    """The channels that move nodes; of two that move a node in the same way, the last."""
    samplers, nodes = entries(entry, "samplers", where), len(file.top["nodes"])
    found: dict[tuple[int, str], _Channel] = {}
    for i, channel in enumerate(entries(entry, "channels", where)):
        target, named = inner(channel, "target"), f"channel {i} of {where}"
        path = target.get("path")
        if not isinstance(path, str) or path not in _KINDS or "node" not in target:  # shapes, and what extensions move
            continue
        node = whole(target, "node", named, nodes - 1)
        if node in number:
            sampler = samplers[whole(channel, "sampler", named, len(samplers) - 1)]
            found[number[node], path] = _channel(file, sampler, number[node], path, named, checked)
    return list(found.values())


def _channel(
    file: GltfFile, sampler: dict[str, Any], node: int, path: str, where: str, checked: set[tuple[Any, ...]]
) -> _Channel:
    """A channel, whose keys are looked at unless they have been already."""
    method = sampler.get("interpolation", "LINEAR")
    if not isinstance(method, str) or method not in _METHODS:
        raise UserError(f"{where} is interpolated by {shortened(method, 30)}; expected {', '.join(_METHODS)}")
    each = _METHODS[method]
    time_K = file.numbers(sampler, "input", "SCALAR", where)[:, 0]
    value_KX = file.numbers(sampler, "output", _KINDS[path], where)
    if len(value_KX) != each * len(time_K):
        counts = f"{len(time_K):,} times and {len(value_KX):,} values; expected {each * len(time_K):,}"
        raise UserError(f"{where} has {counts}; {DAMAGED}")
    value_KX = value_KX.reshape(-1, each, value_KX.shape[1]) if each > 1 else value_KX
    keys = (sampler["input"], sampler["output"], path, method)
    if keys not in checked:
        if time_K.dtype.kind != "f" or (np.diff(time_K) < 0).any():
            raise UserError(f"the times of {where} do not rise; {DAMAGED}")
        at_key_KX = value_KX[:, 1] if each > 1 else value_KX
        if path == "rotation" and (np.abs(at_key_KX).max(axis=1) < _SHORTEST).any():
            raise UserError(f"{where} has keys of 0, which are no rotations; export it again")
        checked.add(keys)
    return _Channel(node, path, method, int(sampler["input"]), time_K, value_KX)


def _animation(name: str, channels: list[_Channel], places: Places) -> Animation:
    moving = [channel for channel in channels if len(channel.time_K) > 1] or channels
    start = min(float(channel.time_K[0]) for channel in moving)
    end = max(float(channel.time_K[-1]) for channel in moving)
    inputs: dict[int, tuple[np.ndarray, int]] = {}
    for channel in channels:
        _, count = inputs.get(channel.input_place, (None, 0))
        inputs[channel.input_place] = (channel.time_K, count + 1)
    told = _rate(list(inputs.values()))
    note = "" if told is not None else "has few keys, or at uneven times"
    rate = told or _NO_RATE
    steps = (end - start) * rate
    if abs(steps - round(steps)) < _OFF:  # times are rounded, and the last frame is not to be lost
        end = start + round(steps) / rate
    work = (end - start) * rate * len(places.local_N34)
    if work > _WORK + _WORK_PER_KEY * max(len(time_K) for time_K, _ in inputs.values()):
        raise UserError(
            f"the keys of animation '{shortened(name, 40)}' are spread over {end - start:.3g} s; cut it to what moves"
        )
    return Animation(name, start, end, rate, _sampler(channels, places, _EARLY / rate), note)


def _rate(inputs: list[tuple[np.ndarray, int]]) -> float | None:
    """Keys a second, of lists of times [s] and how many channels have them: of all together, since programs leave out
    keys that tell nothing, or else of most by themselves; None where they are few, or uneven.
    """
    inputs = sorted((one for one in inputs if len(one[0]) > 1), key=lambda one: -one[1])[:_SOME_INPUTS]
    if not inputs:
        return None
    last = min((float(time_K[_SOME - 1]) for time_K, _ in inputs if len(time_K) > _SOME), default=np.inf)
    all_K = np.unique(np.concatenate([time_K[:_SOME] for time_K, _ in inputs]))
    rate = _even_rate(all_K[all_K <= last].astype(np.float64))
    if rate is not None:
        return rate
    counts: dict[float, int] = {}
    for time_K, channels in inputs:
        own = _even_rate(time_K[:_SOME].astype(np.float64)) if len(time_K) > _TELLING else None
        if own is not None:
            counts[own] = counts.get(own, 0) + channels
    best = max(counts, key=lambda own: counts[own], default=None)
    return best if best is not None and counts[best] > sum(channels for _, channels in inputs) / 2 else None


def _even_rate(time_K: np.ndarray) -> float | None:
    """Keys a second of times [s] that rise, some of which may be left out; None where they are uneven, or few."""
    time_K = time_K[np.concatenate([[True], np.diff(time_K) > _SAME])]
    step_K = np.diff(time_K)
    if not len(step_K):
        return None
    short = float(np.quantile(step_K, 0.1, method="lower"))
    for parts in range(1, (_PARTS if len(step_K) >= _TELLING else 1) + 1):
        step = short / parts
        for longest in (1, 8, 64, np.inf):  # short steps tell the long ones
            number_K = np.maximum(np.rint(step_K / step), 1)
            few_K = number_K <= longest * parts
            step = float(step_K[few_K].sum() / number_K[few_K].sum())
        number_K = np.maximum(np.rint(step_K / step), 1)
        off_K = np.abs(step_K / step - number_K)
        is_near_K = off_K < _OFF
        if is_near_K.mean() < _MOST:
            continue
        rounded = step * float(off_K[is_near_K].max()) + float(np.abs(time_K).max()) * 2.0**-23
        digits = int(np.clip(-np.log10(rounded / (step * number_K.sum())), 2, 7))
        rate = rate_of_rounded(step, digits)
        return rate if _SLOWEST <= rate <= RATES[1] else None
    return None


def _sampler(channels: list[_Channel], places: Places, early: float) -> Callable[[np.ndarray], np.ndarray]:
    """The function of times (F,) that gives where nodes are in their parents (F, N, 3, 4)."""
    of_node: dict[int, dict[str, _Channel]] = {}
    for channel in channels:
        of_node.setdefault(channel.node, {})[channel.path] = channel

    def local_FN34(time_F: np.ndarray) -> np.ndarray:
        found_FN34 = np.repeat(places.local_N34[None], len(time_F), axis=0)
        shares: dict[tuple[int, bool], tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

        def at(channel: _Channel) -> np.ndarray:
            is_step = channel.method == "STEP"
            key = (channel.input_place, is_step)
            if key not in shares:
                shares[key] = _between(channel.time_K, time_F + early if is_step else time_F)
            return _value(channel, *shares[key])

        for node, moved in of_node.items():
            if "rotation" in moved or "scale" in moved:
                turn_33, scale_3 = places.rotation_N33[node], places.scale_N3[node]
                if "rotation" in moved:
                    turn_33 = quaternion_to_matrix(at(moved["rotation"]))
                if "scale" in moved:
                    scale_3 = with_axes(at(moved["scale"]))
                found_FN34[:, node, :, :3] = turn_33 * scale_3[..., None, :]
            if "translation" in moved:
                found_FN34[:, node, :, 3] = at(moved["translation"])
        return found_FN34

    return local_FN34


def with_axes(scale_X3: np.ndarray) -> np.ndarray:
    """Scales (..., 3), those of nothing as very small ones."""
    return np.where(np.abs(scale_X3) < _LEAST_SCALE, _LEAST_SCALE, scale_X3)


def _between(time_K: np.ndarray, time_F: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The key before each time, how far on the way to the next it is (0 to 1), and how long that takes [s]."""
    if len(time_K) == 1:
        return np.zeros(len(time_F), np.int64), np.zeros(len(time_F)), np.zeros(len(time_F))
    before_F = np.clip(np.searchsorted(time_K, time_F, side="right") - 1, 0, len(time_K) - 2)
    start_F = time_K[before_F].astype(np.float64)
    step_F = time_K[before_F + 1] - start_F
    share_F = np.where(step_F > 0, (time_F - start_F) / np.where(step_F > 0, step_F, 1.0), 1.0)
    return before_F, np.clip(share_F, 0.0, 1.0), step_F


def _value(channel: _Channel, before_F: np.ndarray, share_F: np.ndarray, step_F: np.ndarray) -> np.ndarray:
    """What a channel is (F, X) at times; rotations are unit quaternions, w last."""
    is_turn = channel.path == "rotation"
    after_F = np.minimum(before_F + 1, len(channel.time_K) - 1)
    share_F1 = share_F[:, None]
    one_FX, other_FX = (channel.value_KX[place_F].astype(np.float64) for place_F in (before_F, after_F))
    if channel.method == "CUBICSPLINE":
        square_F1, cube_F1, step_F1 = share_F1**2, share_F1**3, step_F[:, None]
        found_FX = (
            (2 * cube_F1 - 3 * square_F1 + 1) * one_FX[:, 1]
            + step_F1 * (cube_F1 - 2 * square_F1 + share_F1) * one_FX[:, 2]
            + (3 * square_F1 - 2 * cube_F1) * other_FX[:, 1]
            + step_F1 * (cube_F1 - square_F1) * other_FX[:, 0]
        )
    elif channel.method == "STEP":
        found_FX = np.where(share_F1 < 1, one_FX, other_FX)
    elif is_turn:
        return _turned(_unit(one_FX), _unit(other_FX), share_F1)
    else:
        found_FX = one_FX + share_F1 * (other_FX - one_FX)
    return _unit(found_FX) if is_turn else found_FX


def _turned(one_F4: np.ndarray, other_F4: np.ndarray, share_F1: np.ndarray) -> np.ndarray:
    """Unit quaternions at shares of the shortest way from some to others."""
    other_F4 = np.where((one_F4 * other_F4).sum(-1, keepdims=True) < 0, -other_F4, other_F4)
    angle_F1 = 2 * np.arctan2(norm(one_F4 - other_F4)[:, None], norm(one_F4 + other_F4)[:, None])
    angle_F1 = np.maximum(angle_F1, 1e-9)  # where they are the same
    return _unit(np.sin((1 - share_F1) * angle_F1) * one_F4 + np.sin(share_F1 * angle_F1) * other_F4)


def _unit(quaternion_X4: np.ndarray) -> np.ndarray:
    """Quaternions of length 1; of one that is 0 between keys, none."""
    return quaternion_X4 / np.maximum(norm(quaternion_X4), np.finfo(np.float64).tiny)[..., None]
