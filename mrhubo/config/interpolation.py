r"""Puts the values of other keys in the place of ``${key}``, in bounded time and memory.

    ${section.key}      the value of that key, whatever it is, or as part of a text
    ${.key} ${..key}    the same, from the section around, or the one around that
    \${                 what stands there: no interpolation
    ${oc.env:NAME}      a variable of the environment, or ${oc.env:NAME,default}: on the command line alone

A config may come from a stranger. So no file reads the environment, and texts that refer to texts that refer to texts
(each twice, say) end at a size, not when the memory does.
"""

from __future__ import annotations

import os
import re

from mrhubo.config.tree import MAX_NODES, Node, describe
from mrhubo.errors import UserError, shortened

_MAX_TEXT = 10_000
"""Letters of one text."""
_MAX_LETTERS = 1_000_000
"""Letters of all texts together."""
_MAX_DEPTH = 50
"""References that lead from one to the next."""
_REFERENCE = re.compile(r"(?<!\\)(\\*)\$\{(?:([^${}]*)\})?")
_KEY = re.compile(r"(\.*)([^.\[\]:\s]+(?:\.[^.\[\]:\s]+|\[[0-9]{1,9}\])*)")
_ENVIRONMENT = re.compile(r"oc\.env:\s*([A-Za-z_][A-Za-z0-9_]*)\s*(?:,(.*))?", re.DOTALL)


def has_interpolation(node: Node) -> bool:
    """Whether a value is a text with an interpolation in it, or with one that is escaped."""
    return isinstance(node.content, str) and "${" in node.content


def interpolate(root: Node) -> None:
    """Puts values in the place of all references in a tree.

    Raises:
        UserError: a key does not exist, refers to itself, or all of it becomes too large.
    """
    if any(map(has_interpolation, root.walk())):
        _Interpolation(root).resolve_all(root)


class _Interpolation:
    def __init__(self, root: Node) -> None:
        self.root = root
        self.names: dict[int, tuple[str, ...]] = {}
        self.active: list[int] = []
        self.nodes = self.letters = 0
        self._name(root, ())

    def _name(self, node: Node, keys: tuple[str, ...]) -> None:
        """Notes where each value stands."""
        self.names[id(node)] = keys
        for key, child in _children(node):
            self._name(child, (*keys, key))

    def resolve_all(self, root: Node) -> None:
        """All values of the tree."""
        for node in list(root.walk()):
            self._resolve(node)

    def _resolve(self, node: Node) -> None:
        """A value alone; what it refers to first."""
        if not has_interpolation(node) or id(node) not in self.names:  # or copied from one that is done
            return
        if id(node) in self.active:
            raise self._error(node, "Recursive interpolation detected: it refers to itself")
        if len(self.active) >= _MAX_DEPTH:
            raise self._error(node, f"more than {_MAX_DEPTH} interpolations lead from one to the next")
        self.active.append(id(node))
        text = node.content
        found = list(_REFERENCE.finditer(text))
        whole = found[0] if len(found) == 1 and found[0][0] == text and not found[0][1] else None
        if whole is not None:
            self._copy(self._value(node, whole), node, node)
        else:
            self._set_text(node, "".join(self._parts(node, text, found)), node)
        self.active.pop()
        del self.names[id(node)]

    def _parts(self, node: Node, text: str, found: list[re.Match[str]]) -> list[str]:
        """The pieces of a text, values in place of references."""
        parts, end, length = [], 0, 0
        for match in found:
            slashes = len(match[1])
            parts += [text[end : match.start()], "\\" * (slashes // 2)]
            if slashes % 2:
                parts.append(match[0][slashes:])
            else:
                value = self._value(node, match)
                if isinstance(value.content, dict | list):
                    raise self._error(node, f"{shortened(match[0])} is {describe(value)}, which is no part of a text")
                parts.append(str(value.content))
            end = match.end()
            length += sum(map(len, parts[-3:]))
            if length > _MAX_TEXT:
                raise self._error(node, f"it would have more than {_MAX_TEXT:,} letters")
        return [*parts, text[end:]]

    def _set_text(self, node: Node, text: str, asked: Node) -> None:
        self.letters += len(text)
        if len(text) > _MAX_TEXT or self.letters > _MAX_LETTERS:
            raise self._error(asked, f"texts would have more than {_MAX_TEXT:,} letters, or {_MAX_LETTERS:,} together")
        node.content, node.text = text, None

    def _copy(self, value: Node, node: Node, asked: Node) -> None:
        """Makes a value what another is; its place stays. `asked` is the reference, for sentences."""
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise self._error(asked, f"all together would have more than {MAX_NODES:,} values")
        content = value.content
        if isinstance(content, dict):
            node.content = {key: Node(None, node.source, node.line) for key in content}
        elif isinstance(content, list):
            node.content = [Node(None, node.source, node.line) for _ in content]
        elif isinstance(content, str):
            self._set_text(node, content, asked)
        else:
            node.content = content
        node.text = str(content) if isinstance(content, int) and not isinstance(content, bool) else None
        for (_, child), (_, other) in zip(_children(node), _children(value), strict=True):
            self._copy(other, child, asked)

    def _value(self, node: Node, match: re.Match[str]) -> Node:
        """What a reference stands for, itself resolved."""
        reference = (match[2] or "").strip()
        if reference.startswith("oc."):
            return Node(self._variable(node, reference), node.source)
        key = _KEY.fullmatch(reference)
        if key is None:
            raise self._error(
                node, f"{shortened(match[0])} is none of ${{key}}, ${{section.key}}, ${{.key}}, ${{key[0]}}"
            )
        path = re.findall(r"[^.\[\]]+", key[2])
        if key[1]:
            around, up = self.names[id(node)], len(key[1])
            if up > len(around):
                raise self._error(node, f"Interpolation key '{shortened(reference)}' not found")
            path = [*around[: len(around) - up], *path]
        found = self.root
        for part in path:
            self._resolve(found)
            inner = _child(found, part)
            if inner is None:
                raise self._error(node, f"Interpolation key '{shortened(reference)}' not found")
            found = inner
        if found.text == "???" or found.content == "???":
            raise self._error(node, f"'{shortened(reference)}' has no value yet")
        self._resolve(found)
        self._resolve_inside(found, node)
        return found

    def _resolve_inside(self, found: Node, node: Node) -> None:
        for _, child in _children(found):
            if child is node or id(child) in self.active:
                raise self._error(node, "Recursive interpolation detected: it refers to what it is in")
            self._resolve(child)
            self._resolve_inside(child, node)

    def _variable(self, node: Node, reference: str) -> str:
        """A variable of the environment, for who types the command."""
        match = _ENVIRONMENT.fullmatch(reference)
        if match is None:
            raise self._error(node, "of OmegaConf's resolvers only oc.env is known")
        if not node.source.typed:
            raise self._error(node, "the environment is read on the command line alone, not by a file")
        name, default = match[1], match[2]
        if name in os.environ:
            return os.environ[name]
        if default is None:
            raise self._error(node, f"Environment variable '{name}' not found")
        return default.strip()

    def _error(self, node: Node, reason: str) -> UserError:
        keys = self.names[id(node)]
        name = "".join(f"[{key}]" if key.isdecimal() else f".{key}" for key in keys).lstrip(".")
        return node.error(f"{name}, {describe(node)}, cannot be resolved: {reason}")


def _child(node: Node, key: str) -> Node | None:
    """The value of a key of a mapping, or at a position of a list; None if there is none."""
    if isinstance(node.content, dict):
        return node.content.get(key)
    if isinstance(node.content, list) and re.fullmatch("[0-9]{1,9}", key) and int(key) < len(node.content):
        return node.content[int(key)]
    return None


def _children(node: Node) -> list[tuple[str, Node]]:
    """The values in a mapping or a list, with their keys or positions as text."""
    if isinstance(node.content, dict):
        return list(node.content.items())
    if isinstance(node.content, list):
        return [(str(index), child) for index, child in enumerate(node.content)]
    return []
