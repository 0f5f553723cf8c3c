"""Where each value of a config was written, for sentences about it long after the file was read."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import re
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

from mrhubo.config.tree import Node
from mrhubo.errors import UserError

P = ParamSpec("P")
R = TypeVar("R")

_ATTRIBUTE = "_places"
"""Beside the fields of every section: copies and pickles take it along, comparisons and fingerprints do not see it."""


def where(config: Any, key: str) -> str | None:
    """The place from which a key was loaded, ``conf/nao.yaml, line 9``; None if neither file nor command line gave it.

    Args:
        config: a loaded config, or a section of one.
        key: its full name, for instance ``robot.keypoints.left_elbow`` or ``robot.joints[2]``.
    """
    return getattr(config, _ATTRIBUTE, {}).get(key)


@contextlib.contextmanager
def places_named(config: Any) -> Iterator[None]:
    """A `UserError` in here that begins with the full name of a key, ``robot.joints[2]: ...``, gets the place of that
    key in `config` in front, or of the section around it.
    """
    try:
        yield
    except UserError as error:
        place = _nearest_place(config, str(error).partition(": ")[0])
        if place is not None:
            error.args = (f"{place}: {error}",)
        raise


def with_places(function: Callable[P, R]) -> Callable[P, R]:
    """Decorates a function whose first argument is a config or a section of one with `places_named`."""

    @functools.wraps(function)
    def placed(*args: P.args, **kwargs: P.kwargs) -> R:
        with places_named(args[0] if args else next(iter(kwargs.values()), None)):
            return function(*args, **kwargs)

    return placed


def keep_places(config: Any, root: Node) -> None:
    """Lets every section of a config know the places of the tree that it was built from."""
    places: dict[str, str] = {}
    _collect(root, "", places)
    _attach(config, places)


def _nearest_place(config: Any, key: str) -> str | None:
    place = where(config, key)
    while place is None and re.fullmatch(r"[^\s:]+[.\[][^\s:]*", key):
        key = re.sub(r"\[[^\[]*$|\.[^.\[]*$", "", key)
        place = where(config, key)
    return place


def _collect(node: Node, name: str, places: dict[str, str]) -> None:
    if name:
        places[name] = node.where
    if isinstance(node.content, dict):
        for key, child in node.content.items():
            _collect(child, f"{name}.{key}" if name else key, places)
    elif isinstance(node.content, list):
        for index, child in enumerate(node.content):
            _collect(child, f"{name}[{index}]", places)


def _attach(section: Any, places: dict[str, str]) -> None:
    setattr(section, _ATTRIBUTE, places)
    for field in dataclasses.fields(section):
        value = getattr(section, field.name)
        if dataclasses.is_dataclass(value):
            _attach(value, places)
