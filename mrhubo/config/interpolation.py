"""Puts the values of other keys in the place of ``${key}``: the rules and the work are OmegaConf's, within bounds.

A config may come from a stranger. OmegaConf works a reference out anew wherever it stands, so texts that refer to texts
that refer to texts (each twice, say) take a time and a memory that double with each; how much all of them come to is
counted beforehand. Of its resolvers, which may do anything, only ``${oc.env:NAME}`` is known, and only in what the user
himself starts a command with: a config that belongs to a package reads no environment.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from typing import Any

from mrhubo.config.tree import Node, describe
from mrhubo.errors import UserError, first_line, shortened

_MOST_LETTERS = 30_000
"""Of all texts with references, everything put in their places, and of one such text before that."""
_MOST_STEPS = 50
"""References that lead from one to the next."""
_REFERENCE = re.compile(r"\$\{([^${}]*)\}")
_RESOLVER = re.compile(r"\s*[\w.]+\s*:")
_ENVIRONMENT = re.compile(r"\s*oc\.env\s*:")
Keys = tuple[str | int, ...]


def has_interpolation(node: Node) -> bool:
    """Whether a value is a text with an interpolation in it, or with one that is escaped."""
    return isinstance(node.content, str) and "${" in node.content


def interpolate(root: Node, environment: bool = True) -> None:
    """Puts values in the place of all references in a tree.

    Args:
        root: the tree.
        environment: whether files may read variables of the environment; what is typed always may.

    Raises:
        UserError: a key does not exist, refers to itself, all of it becomes too large, or a resolver is used that must
            not be.
    """
    found = [(keys, node) for keys, node in _leaves(root, ()) if has_interpolation(node)]
    if not found:
        return
    from omegaconf import OmegaConf

    _Bounds(root, environment).check(found)
    for keys, node in found:
        with _blaming(keys, node):
            OmegaConf.create({"value": node.content})  # its syntax
    tree = OmegaConf.create(root.plain())
    results: list[Any] = []
    for keys, node in found:
        with _blaming(keys, node):
            value: Any = tree
            for key in keys:
                value = value[key]
            results.append(OmegaConf.to_container(value, resolve=True) if OmegaConf.is_config(value) else value)
    for (_, node), value in zip(found, results, strict=True):
        _fill(node, value)


class _Bounds:
    """Counts what references come to without putting anything in their places."""

    def __init__(self, root: Node, environment: bool) -> None:
        self.root, self.environment = root, environment
        self.known: dict[int, int] = {}
        self.active: list[int] = []

    def check(self, found: list[tuple[Keys, Node]]) -> None:
        """Refuses what is too large, or reads what it must not."""
        letters = 0
        for keys, node in found:
            self._check_form(keys, node)
        for keys, node in found:
            letters += self._letters(keys, node)
            if letters > _MOST_LETTERS:
                raise _error(keys, node, f"all references together would make more than {_MOST_LETTERS:,} letters")

    def _check_form(self, keys: Keys, node: Node) -> None:
        text = str(node.content)
        if len(text) > _MOST_LETTERS:
            raise _error(keys, node, f"it has more than {_MOST_LETTERS:,} letters")
        if re.search(r"\$\{[^{}]*\$\{", text):
            raise _error(keys, node, "one reference inside another is not supported")
        for match in _REFERENCE.finditer(text):
            if not _RESOLVER.match(match[1]):
                continue
            if not _ENVIRONMENT.match(match[1]):
                raise _error(keys, node, "of OmegaConf's resolvers only oc.env is supported")
            if not self.environment and not node.source.typed:
                raise _error(keys, node, "the environment is not read for a file that came with a package")

    def _letters(self, keys: Keys, node: Node) -> int:
        """Of a value with all that it refers to; what refers to itself or to nothing is for OmegaConf to name."""
        if id(node) in self.active:
            return 0
        if id(node) not in self.known:
            if len(self.active) > _MOST_STEPS:
                raise _error(keys, node, f"more than {_MOST_STEPS} references lead from one to the next")
            self.active.append(id(node))
            self.known[id(node)] = min(self._count(keys, node), _MOST_LETTERS + 1)
            self.active.pop()
        return self.known[id(node)]

    def _count(self, keys: Keys, node: Node) -> int:
        inner = _children(node)
        if inner:
            return sum(self._letters((*keys, key), child) for key, child in inner)
        letters = len(str(node.content)) + 1
        if has_interpolation(node):
            targets = (self._target(keys, match[1]) for match in _REFERENCE.finditer(node.content))
            letters += sum(self._letters(*target) for target in targets if target is not None)
        return letters

    def _target(self, keys: Keys, reference: str) -> tuple[Keys, Node] | None:
        """Where a reference leads to; a text on the way that is a reference itself stands for all that it makes."""
        reference = reference.strip()
        up = len(reference) - len(reference.lstrip("."))
        found, place = self.root, list(keys[: len(keys) - up] if up else ())
        path = [*map(str, place), *re.findall(r"[^.\[\]]+", reference[up:])]
        for depth, part in enumerate(path):
            inner = dict((str(key), child) for key, child in _children(found))
            if part not in inner:
                return (tuple(path[:depth]), found) if has_interpolation(found) else None
            found = inner[part]
        return tuple(path), found


def _children(node: Node) -> list[tuple[str | int, Node]]:
    if isinstance(node.content, dict):
        return list(node.content.items())
    return list(enumerate(node.content)) if isinstance(node.content, list) else []


def _leaves(node: Node, keys: Keys) -> Iterator[tuple[Keys, Node]]:
    if not isinstance(node.content, dict | list):
        yield keys, node
    for key, child in _children(node):
        yield from _leaves(child, (*keys, key))


def _fill(node: Node, value: Any) -> None:
    node.text = str(value) if isinstance(value, int) and not isinstance(value, bool) else None
    if isinstance(value, dict):
        node.content = {str(key): Node(None, node.source, node.line) for key in value}
        for key, item in value.items():
            _fill(node.content[str(key)], item)
    elif isinstance(value, list):
        node.content = [Node(None, node.source, node.line) for _ in value]
        for child, item in zip(node.content, value, strict=True):
            _fill(child, item)
    else:
        node.content = value


@contextlib.contextmanager
def _blaming(keys: Keys, node: Node) -> Iterator[None]:
    """Turns what OmegaConf raises into a sentence about this node."""
    from omegaconf.errors import OmegaConfBaseException

    try:
        yield
    except (OmegaConfBaseException, RecursionError, ValueError) as error:
        reason = "it refers to itself" if isinstance(error, RecursionError) else first_line(error)
        raise _error(keys, node, shortened(reason, 200)) from None


def _error(keys: Keys, node: Node, reason: str) -> UserError:
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")
    return node.error(f"{shortened(name)}, {describe(node)}, cannot be resolved: {reason}")
