"""The entries of `robot.keypoints` and `robot.manual.keypoints`: points and oriented body parts on robot links.

Their form is the config's affair; whether it suits the body part, and whether links and joints exist, is told here. A
sentence begins with the full key, so that its place in the YAML can be put in front (`mrhubo.config.with_places`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from mrhubo.config import (
    ConstantEntry,
    KeypointEntry,
    ManualEntry,
    MeanEntry,
    PointEntry,
    RobotConfig,
    Vector,
    typed_value,
)
from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.urdf import Description

_LONGEST_SOLE = 2.0
"""No robot's sole reaches farther [m]; other units than metres are."""
DEFAULT_AXES = {"forward": (1.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Point:
    """A point fixed to a link: offset [m] in the link's frame."""

    link: str
    offset_3: tuple[float, float, float]


@dataclass(frozen=True)
class End:
    """An oriented body part: two orthonormal directions (2, 3) fixed to a link, in the link's frame."""

    link: str
    axes_23: Tensor
    sole: tuple[float, float, float] | None = None
    """Of a foot, how far its sole reaches from the link's origin backwards, forwards and down [m], where told."""


def read_vector(key: str, value: Any) -> tuple[float, float, float]:
    """Three finite numbers; `key` names the entry in the error."""
    x, y, z = typed_value(Vector, value, key)
    return x, y, z


def read_point(key: str, value: Any) -> Point:
    """A point on a link, from the entry of body part `key`: a link name, or {link: NAME, offset: [x, y, z]}.

    Raises:
        UserError: the entry is of another form.
    """
    key = f"robot.keypoints.{key}"
    entry = typed_value(KeypointEntry, value, key)
    if isinstance(entry, str):
        return Point(entry, (0.0, 0.0, 0.0))
    if not isinstance(entry, PointEntry):
        raise UserError(f"{key}: is a point, so it is a link name or {{link: NAME, offset: [x, y, z]}}")
    return Point(entry.link, _offset(entry.offset))


def read_end(key: str, value: Any, words: tuple[str, str], stands: bool = False) -> End:
    """An oriented body part, from the entry of body part `key`: {link: NAME, words[0]: [x, y, z], words[1]: [x, y, z]};
    forward and up default to x and z. What stands on the floor may have a `sole` too.

    Raises:
        UserError: the entry is of another form, or its directions are one.
    """
    key, form = f"robot.keypoints.{key}", f"{{link: NAME, {words[0]}: [x, y, z], {words[1]}: [x, y, z]}}"
    entry = typed_value(KeypointEntry, value, key)
    given = {} if isinstance(entry, str) else {f.name: getattr(entry, f.name) for f in dataclasses.fields(entry)}
    given = {word: numbers for word, numbers in given.items() if numbers is not None}
    for word in given:
        if word not in ("link", *words, *(["sole"] if stands else [])):
            raise UserError(f"{key}: has no '{word}'; it is {form}")
    axes = []
    for word in words:
        if word not in given and word not in DEFAULT_AXES:
            raise UserError(f"{key}: '{word}' is missing; give {form} in the link's frame")
        axes.append(torch.tensor(read_vector(f"{key}.{word}", given.get(word, DEFAULT_AXES.get(word)))))
    first, second = axes
    if first.norm() < 1e-6 or torch.linalg.cross(first, second).norm() < 1e-3 * first.norm() * max(second.norm(), 1e-6):
        raise UserError(f"{key}: {words[0]} and {words[1]} must be two different directions")
    first = first / first.norm()
    second = second - (first @ second) * first
    sole = read_vector(f"{key}.sole", given["sole"]) if "sole" in given else None
    if sole is not None and (sole[0] + sole[1] <= 0 or max(map(abs, sole)) > _LONGEST_SOLE):
        raise UserError(
            f"{key}.sole: is how far the sole reaches backwards, forwards and down from the link's origin, in metres, "
            f"for instance [0.05, 0.12, 0.035]; found {list(sole)}"
        )
    axes_23 = torch.stack((first, second / second.norm()))
    return End(entry if isinstance(entry, str) else entry.link, axes_23, sole)


def read_mean(key: str, value: Any) -> tuple[dict[str, float], tuple[float, float, float]]:
    """Weights by link and an offset [m], from the entry of keypoint `key` of `robot.manual`: a link name,
    {link: NAME, offset: [x, y, z]}, {links: {NAME: WEIGHT, ...}, offset: ...} or {offset: ...}.

    Raises:
        UserError: the entry is of another form.
    """
    entry = typed_value(ManualEntry, value, f"robot.manual.keypoints.{key}")
    if isinstance(entry, str):
        return {entry: 1.0}, (0.0, 0.0, 0.0)
    if isinstance(entry, ConstantEntry):
        return {}, _offset(entry.offset)
    return dict(entry.links) if isinstance(entry, MeanEntry) else {entry.link: 1.0}, _offset(entry.offset)


def check_names(config: RobotConfig, description: Description) -> None:
    """Refuses joints and links that the URDF does not have.

    Raises:
        UserError: names the key, the URDF and the nearest name.
    """
    joints = [*_listed("robot.joints", config.joints), *_keys("robot.ranges", config.ranges)]
    for key, joint in (*joints, *_keys("robot.hold", config.hold)):
        if joint not in description.joints:
            raise UserError(f"{key}: {unknown_name('joint', joint, description.joints, str(config.urdf))}")
    for key, link in _links(config):
        if link not in description.links:
            raise UserError(f"{key}: {unknown_name('link', link, description.links, str(config.urdf))}")


def _links(config: RobotConfig) -> Iterator[tuple[str, str]]:
    """Every link that a config names, by its key."""
    entries = _keyed("robot.keypoints", config.keypoints, KeypointEntry)
    if config.manual is not None and config.scale != "auto":
        entries += _keyed("robot.manual.keypoints", config.manual.keypoints, ManualEntry)
    for key, entry in entries:
        if isinstance(entry, str):
            yield key, entry
        elif isinstance(entry, MeanEntry):
            yield from _keys(f"{key}.links", entry.links)
        elif not isinstance(entry, ConstantEntry):
            yield f"{key}.link", entry.link
    yield from _listed("robot.key_links", config.key_links)


def _keyed(key: str, entries: Mapping[str, Any], hint: Any) -> list[tuple[str, Any]]:
    return [(f"{key}.{name}", typed_value(hint, value, f"{key}.{name}")) for name, value in entries.items()]


def _listed(key: str, names: Iterable[str]) -> list[tuple[str, str]]:
    return [(f"{key}[{index}]", name) for index, name in enumerate(names)]


def _keys(key: str, mapping: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(f"{key}.{name}", name) for name in mapping]


def _offset(numbers: list[int | float] | None) -> tuple[float, float, float]:
    x, y, z = (0.0, 0.0, 0.0) if numbers is None else map(float, numbers)
    return x, y, z
