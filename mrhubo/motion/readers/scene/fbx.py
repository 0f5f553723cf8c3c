"""Human motions from FBX files, binary or text, of version 6 (FBX 2006) and later.

Objects are told apart by numbers, and connected: nodes in nodes; curves, by threes, to what they move of a node;
layers of such threes in an animation. Of an animation's layers the first is read.

Legend: N nodes, F times.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.options import RATES, ReadOptions
from mrhubo.motion.readers.scene.convert import body_motion
from mrhubo.motion.readers.scene.fbx_curves import Curve, read_curve
from mrhubo.motion.readers.scene.fbx_file import BINARY, OLD, BadFbx, Record, is_text_fbx, read_fbx_file
from mrhubo.motion.readers.scene.fbx_nodes import FbxNode, plain_name, properties, read_node
from mrhubo.motion.readers.scene.fbx_old import modernised
from mrhubo.motion.readers.scene.nodes import (
    MAX_NODES,
    Animation,
    Node,
    Rest,
    Scene,
    in_world,
    may_be_joints,
    parents_first,
)
from mrhubo.motion.readers.scene.rests import OWN, bound_rests
from mrhubo.robot_motion.clock import rate_of_rounded

_SECOND, _NEW_SECOND = 46_186_158_000, 141_120_000
"""Units of time in a second; the second where files of version 7 say that they have that of version 8."""
_OLD_TIME = 127
_RATES = (30.0, 120.0, 100.0, 60.0, 50.0, 48.0, 30.0, 30.0, 30e3 / 1001, 30e3 / 1001, 25.0, 24.0, 1000.0, 24e3 / 1001,
          24.0, 96.0, 72.0, 60e3 / 1001)  # fmt: skip
"""Frames a second, by the number that files have for them."""
_OWN_RATE = 14
"""The number of those that have a rate of their own."""
_SLOWEST, _EVEN, _ALIKE = 10.0, 0.9, 1e-3
"""Keys a second, and the share of the steps between them that are alike, of a recording; and how much these differ."""
_DIGITS, _SAME_RATE = 7, 1e-4
"""Of a step between keys that are right; and how far apart rates are that are the same."""
_AXES = ("d|X", "d|Y", "d|Z")

Curves = dict[int, dict[str, tuple[Curve | None, ...]]]
"""By the number of a node, by what they move of it: one for each axis, or none."""


def is_fbx(content: Content) -> bool:
    """Whether a file begins as an FBX file does."""
    return content.start.startswith(BINARY) or (content.text is not None and is_text_fbx(content.text))


def read_fbx(path: Path, options: ReadOptions) -> Motion:
    """Reads an FBX file; which node is which joint is found out (`mrhubo.motion.readers.tree.anatomy`).

    Raises:
        NoMotion: nothing moves in it.
        UserError: the file is missing, damaged, too large or too old, or no human is found in it.
    """
    notes: list[str] = []
    root, version = read_fbx_file(path)

    def scene(every: bool) -> Scene:
        notes.clear()  # of the same file
        try:
            found = _File(modernised(root) if version < OLD else root).scene(every, notes)
        except BadFbx as error:
            raise UserError(f"{path}: is a damaged FBX file: {error}") from error
        if not found.nodes:
            raise NoMotion(f"{path}: is an FBX file without nodes")
        return found

    return body_motion(path, scene, "FBX file, animation", options, notes)


@dataclass(frozen=True)
class _File:
    """The objects of a file."""

    root: Record

    @cached_property
    def objects(self) -> dict[int, Record]:
        """By number."""
        found = {}
        for record in self.root.first("Objects").children:
            number = record.whole()
            if number is not None:
                found[number] = record
        return found

    @cached_property
    def links(self) -> tuple[dict[int, list[int]], dict[int, list[tuple[int, str]]]]:
        """What each object is in; and of what each is a property, and which."""
        whole: dict[int, list[int]] = {}
        parts: dict[int, list[tuple[int, str]]] = {}
        for row in self.root.first("Connections").named("C"):
            child, parent = row.whole(1), row.whole(2)
            if child is None or parent is None:
                continue
            if row.text(0) == "OO":
                whole.setdefault(child, []).append(parent)
            elif row.text(0) == "OP":
                parts.setdefault(child, []).append((parent, row.text(3)))
        return whole, parts

    def named(self, name: str) -> Iterator[tuple[int, Record]]:
        """The objects of a kind."""
        return ((number, record) for number, record in self.objects.items() if record.name == name)

    @cached_property
    def second(self) -> int:
        """Units of time in a second."""
        header = self.root.first("FBXHeaderExtension")
        told = header.first("OtherFlags").first("TCDefinition").whole()
        new = told is not None and told != _OLD_TIME and (header.first("FBXHeaderVersion").whole() or 0) >= 1004
        return _NEW_SECOND if new else _SECOND

    @cached_property
    def rate(self) -> float:
        """Frames a second of the scene."""
        told = properties(self.root.first("GlobalSettings"))
        mode = told["TimeMode"].whole(4) if "TimeMode" in told else None
        own = told["CustomFrameRate"].values[4:5] if "CustomFrameRate" in told else []
        if mode == _OWN_RATE and own and isinstance(own[0], int | float) and RATES[0] <= own[0] <= RATES[1]:
            return float(own[0])
        return _RATES[mode] if mode is not None and 0 <= mode < len(_RATES) else _RATES[0]

    @cached_property
    def up(self) -> str | None:
        """The axis that is up, for instance `z`; None where it is not told."""
        told = properties(self.root.first("GlobalSettings"))
        axis, sign = (told[key].whole(4) if key in told else None for key in ("UpAxis", "UpAxisSign"))
        return f"{'-' if sign == -1 else ''}{'xyz'[axis]}" if axis is not None and 0 <= axis < 3 else None

    def nodes(self) -> tuple[list[FbxNode], list[int]]:
        """Nodes, parents first, and the places of their parents."""
        usual: dict[str, Record] = {}
        for kind in self.root.first("Definitions").named("ObjectType"):
            if kind.text(0) == "Model":
                usual = properties(kind.first("PropertyTemplate"))
        found = [node for _, record in self.named("Model") if (node := read_node(record, usual)) is not None]
        if len(found) > MAX_NODES:
            raise BadFbx(f"has {len(found):,} nodes; at most {MAX_NODES:,} are read")
        place = {node.number: i for i, node in enumerate(found)}
        parents = [next((place[p] for p in self.links[0].get(node.number, ()) if p in place), -1) for node in found]
        order = parents_first(parents)
        if order is None:
            raise BadFbx("has nodes that are in each other in a circle, or too deep")
        new = {old: i for i, old in enumerate(order)}
        return [found[old] for old in order], [new.get(parents[old], -1) for old in order]

    def bound(self, place: Mapping[int, int]) -> dict[int, np.ndarray]:
        """Where bones (3, 4) are when the skin is bound to them, by their places."""
        found: dict[int, np.ndarray] = {}
        for _, record in self.named("Pose"):
            for row in record.named("PoseNode"):
                _add(found, place.get(row.first("Node").whole() or -1), row.first("Matrix"))
        owners: dict[int, int] = {}  # of a skin's clusters, the node
        for child, parents in self.links[0].items():
            if child in place:
                owners |= {parent: place[child] for parent in parents if parent not in place}
        for number, record in self.named("Deformer"):
            _add(found, owners.get(number), record.first("TransformLink"))
        return found

    def curves(self, stack: int) -> tuple[Curves, int]:
        """The curves of the first layer of an animation, and how many more layers move nodes."""
        whole, parts = self.links
        layers = [child for child, parents in whole.items() if stack in parents and self._is(child, "AnimationLayer")]
        threes = {layer: [child for child, parents in whole.items() if layer in parents] for layer in layers}
        moving = [layer for layer in layers if any(self._is(three, "AnimationCurveNode") for three in threes[layer])]
        if not moving:
            return {}, 0
        of_three: dict[int, list[Curve | None]] = {three: [None] * 3 for three in threes[moving[0]]}
        for number, record in self.named("AnimationCurve"):
            for three, axis in parts.get(number, ()):
                if three in of_three and axis in _AXES:
                    of_three[three][_AXES.index(axis)] = read_curve(record, self.second)
        found: Curves = {}
        for three, curves in of_three.items():
            for owner, what in parts.get(three, ()):
                if any(curve is not None for curve in curves):
                    found.setdefault(owner, {})[what] = tuple(curves)
        return found, len(moving) - 1

    def _is(self, number: int, name: str) -> bool:
        return number in self.objects and self.objects[number].name == name

    def scene(self, every: bool, notes: list[str]) -> Scene:
        """What the file holds, of the nodes that may be joints, or of every node; `BadFbx` if it is damaged."""
        nodes, parents, bound = self.joints(every)
        own_N34 = _local(nodes, parents, {}, np.zeros(1))[0]
        unturned_N34 = _local([node.with_no_turn() for node in nodes], parents, {}, np.zeros(1))[0]
        rests = bound_rests(own_N34, parents, bound, self.up)
        rests += [
            Rest(name, in_world(local_N34[None], parents)[0], local_N34 is own_N34)
            for name, local_N34 in (("its pose at all angles 0", unturned_N34), (OWN, own_N34))
        ]
        animations = [self._animation(number, record, nodes, parents, notes)
                      for number, record in self.named("AnimationStack")]  # fmt: skip
        return Scene(
            tuple(Node(node.name, parent, node.is_bone) for node, parent in zip(nodes, parents, strict=True)),
            tuple(rests),
            tuple(animation for animation in animations if animation is not None),
            up=self.up,
        )

    def joints(self, every: bool) -> tuple[list[FbxNode], list[int], dict[int, np.ndarray]]:
        """Nodes that may be joints, parents first, the places of their parents, and where those that a skin is bound
        to are then.
        """
        nodes, parents = self.nodes()
        bound = self.bound({node.number: i for i, node in enumerate(nodes)})
        among = [
            Node(node.name, parent, node.is_bone or i in bound)
            for i, (node, parent) in enumerate(zip(nodes, parents, strict=True))
        ]
        kept = may_be_joints(among, every)
        new = {old: i for i, old in enumerate(kept)}
        return (
            [nodes[old] for old in kept],
            [new.get(parents[old], -1) for old in kept],
            {new[old]: place_34 for old, place_34 in bound.items() if old in new},
        )

    def _animation(
        self, number: int, record: Record, nodes: list[FbxNode], parents: list[int], notes: list[str]
    ) -> Animation | None:
        """An animation; None where it moves nothing."""
        found, others = self.curves(number)
        name = plain_name(record.text(1))
        numbers = {node.number for node in nodes}
        moving = [
            curve for owner, whats in found.items() if owner in numbers for three in whats.values() for curve in three
        ]
        times = [curve.time_K for curve in moving if curve is not None]
        if not times:
            return None
        if others:
            notes.append(
                f"{others} more layers of the animation '{name}' are left out; bake them into one where they move"
                " the body"
            )
        start, end = min(time_K[0] for time_K in times), max(time_K[-1] for time_K in times)
        told = properties(record)
        first, last = (told[key].whole(4) if key in told else None for key in ("LocalStart", "LocalStop"))
        if first is not None and last is not None and first < last:
            first, last = max(start, first / self.second), min(end, last / self.second)
            start, end = (first, last) if first < last else (start, end)
        return Animation(
            name,
            float(start),
            float(end),
            self._rate_of(times),
            lambda time_F: _local(nodes, parents, found, time_F),
        )

    def _rate_of(self, times: list[np.ndarray]) -> float:
        """Keys a second, if most follow each other evenly and fast, as a recording's do; else the scene's rate."""
        steps = np.concatenate([np.diff(time_K) for time_K in times])
        steps = steps[steps > 0]
        usual = float(np.median(steps)) if len(steps) else 1.0
        if not _SLOWEST <= 1 / usual <= RATES[1] or np.mean(np.abs(steps / usual - 1) < _ALIKE) < _EVEN:
            return self.rate
        rate = rate_of_rounded(usual, _DIGITS)
        return self.rate if abs(rate / self.rate - 1) < _SAME_RATE else rate


def _add(found: dict[int, np.ndarray], place: int | None, record: Record) -> None:
    """Adds a map (3, 4) of a record with sixteen numbers, column after column."""
    numbers = record.array()
    if place is not None and numbers is not None and numbers.size == 16:
        found[place] = numbers.astype(np.float64).reshape(4, 4).T[:3]


def _local(nodes: list[FbxNode], parents: list[int], curves: Curves, time_F: np.ndarray) -> np.ndarray:
    """Where nodes are in their parents (F, N, 3, 4) at some times [s]."""
    local_FN34 = np.empty((len(time_F), len(nodes), 3, 4))
    scales: list[np.ndarray] = []
    for place, node in enumerate(nodes):
        above_F3 = scales[parents[place]] if parents[place] >= 0 else None
        moving = curves.get(node.number, {})
        times = time_F if moving or not node.inherits_scale else time_F[:1]
        local_FN34[:, place], scale_F3 = node.local(times, moving, above_F3)
        scales.append(scale_F3)
    return local_FN34
