"""The entries of `robot.keypoints` in a config: points and oriented body parts on robot links, checked one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from mrhubo.errors import UserError, unknown_name

_DEFAULT_AXES = {"forward": (1.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0)}


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


def _read_link(key: str, value: Any) -> str:
    link = value.get("link") if isinstance(value, Mapping) else value
    if not isinstance(link, str):
        raise UserError(f"robot.keypoints.{key}: expected a link name or {{link: NAME, ...}}, found {value!r}")
    return link


def read_vector(key: str, value: Any) -> tuple[float, float, float]:
    """Three numbers; `key` names the entry in the error."""
    numbers = value if isinstance(value, (list, tuple)) else []
    good = len(numbers) == 3 and all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in numbers)
    if not good or not all(abs(x) < 1e3 for x in numbers):
        raise UserError(f"{key}: expected three numbers [x, y, z], found {value!r}")
    return float(numbers[0]), float(numbers[1]), float(numbers[2])


def _refuse_unknown(key: str, value: Any, allowed: tuple[str, ...]) -> None:
    for word in value if isinstance(value, Mapping) else ():
        if word not in allowed:
            raise UserError(f"robot.keypoints.{key}: {unknown_name('entry', str(word), allowed)}")


def read_point(key: str, value: Any) -> Point:
    """A link name, or {link: NAME, offset: [x, y, z]}."""
    _refuse_unknown(key, value, ("link", "offset"))
    offset = value.get("offset", [0, 0, 0]) if isinstance(value, Mapping) else [0, 0, 0]
    return Point(_read_link(key, value), read_vector(f"robot.keypoints.{key}.offset", offset))


def read_end(key: str, value: Any, words: tuple[str, str]) -> End:
    """{link: NAME, words[0]: [x, y, z], words[1]: [x, y, z]}; forward and up default to x and z."""
    _refuse_unknown(key, value, ("link", *words))
    axes = []
    for word in words:
        given = value.get(word) if isinstance(value, Mapping) else None
        if given is None and word not in _DEFAULT_AXES:
            raise UserError(
                f"robot.keypoints.{key}: '{word}' is missing; give {{link: NAME, {words[0]}: [x, y, z], "
                f"{words[1]}: [x, y, z]}} in the link's frame"
            )
        axes.append(
            torch.tensor(_DEFAULT_AXES[word] if given is None else read_vector(f"robot.keypoints.{key}.{word}", given))
        )
    first, second = axes
    if first.norm() < 1e-6 or torch.linalg.cross(first, second).norm() < 1e-3 * first.norm() * max(second.norm(), 1e-6):
        raise UserError(f"robot.keypoints.{key}: {words[0]} and {words[1]} must be two different directions")
    first = first / first.norm()
    second = second - (first @ second) * first
    return End(_read_link(key, value), torch.stack((first, second / second.norm())))
