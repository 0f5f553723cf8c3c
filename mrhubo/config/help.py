"""What ``--help`` prints: every key of a schema, from the docstrings under its fields."""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mrhubo.config.kinds import Key, allowed, example, fields_of, noun, walk

WIDTH = 100


@functools.cache
def field_docs(cls: type) -> dict[str, str]:
    """The text under each field of a class and of its bases, on one line each."""
    docs: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
        except (OSError, TypeError, SyntaxError):  # built in, or shipped without source
            continue
        body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
        for statement, following in zip(body, body[1:], strict=False):
            if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
                text = _string(following)
                if text is not None:
                    docs[statement.target.id] = text
    return docs


def help_text(
    schema: type | None, usage: str, description: str, options: Mapping[str, str], in_file: bool = True
) -> str:
    """Usage, options and every key with type, range or choices, default and meaning; at most 100 columns wide.

    `in_file` says whether the user's file can hold the keys, or the command line alone; `schema` None: there are none.
    """
    column = max(map(len, options)) + 4
    lines = [*usage.splitlines(), "", *textwrap.wrap(" ".join(description.split()), WIDTH), "", "Options:"]
    lines += [line for name, meaning in options.items() for line in _row(name, [meaning], column)]
    if schema is None:
        return "\n".join(lines) + "\n"
    lines += ["", *textwrap.wrap(_KEYS_NOTE.format(where="in the file or " * in_file, example=example(schema)), WIDTH)]
    lines += _section(schema, "", 4 + max((len(key.name) for key in walk(schema) if not key.is_section), default=0))
    return "\n".join(lines) + "\n"


_KEYS_NOTE = (
    "Keys, {where}as KEY=VALUE on the command line, for instance {example}, which replaces what the file"
    " says. A value is taken literally unless it starts with a bracket or a quote, then it is YAML: a.b='[x, y]'. A"
    " relative path is relative to the file that holds it; on the command line, to the current directory."
)


def _section(schema: type, prefix: str, column: int) -> list[str]:
    docs = field_docs(schema)
    lines: list[str] = []
    if prefix:
        about = "" if (schema.__doc__ or "").startswith(f"{schema.__name__}(") else schema.__doc__ or ""
        lines += ["", *textwrap.wrap(f"{prefix.rstrip('.')}: {' '.join(about.split())}".rstrip(": "), WIDTH)]
    keys = fields_of(schema, prefix)
    if not prefix and not all(key.is_section for key in keys):
        lines += [""]
    for key in keys:
        if not key.is_section:
            lines += _row(key.name, [_facts(key), docs.get(key.field.name, "")], column)
    for key in keys:
        if key.is_section:
            lines += _section(key.kind, f"{key.name}.", column)
    return lines


def _row(name: str, texts: list[str], column: int) -> list[str]:
    wrapped = [line for text in texts for line in textwrap.wrap(text, WIDTH - column, break_on_hyphens=False)] or [""]
    return [f"{'  ' + name:<{column}}{wrapped[0]}".rstrip()] + [" " * column + line for line in wrapped[1:]]


def _facts(key: Key) -> str:
    limits = allowed(key.field.metadata)
    kind = limits if "choices" in key.field.metadata else f"{noun(key.kind)} {limits}".rstrip()
    return f"{kind}; required" if key.required else f"{kind}; default {_shown(_default(key))}"


def _default(key: Key) -> Any:
    if callable(key.field.default_factory):
        return key.field.default_factory()
    return key.field.default


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_shown(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_shown(item)}" for name, item in value.items()) + "}"
    if isinstance(value, str | Path):
        return str(value) or "''"
    return repr(value)


def _string(statement: ast.stmt) -> str | None:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        if isinstance(statement.value.value, str):
            return " ".join(statement.value.value.split())
    return None
