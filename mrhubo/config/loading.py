"""YAML file + ``key.sub=value`` overrides -> a typed, checked config."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from mrhubo.config.interpolation import has_interpolation, interpolate
from mrhubo.config.kinds import example
from mrhubo.config.places import keep_places
from mrhubo.config.schema import Config
from mrhubo.config.tree import MAX_DEPTH, Node, command_line, parse_typed, read_file
from mrhubo.config.tuning import fill_in_trainer
from mrhubo.config.typed import build
from mrhubo.errors import UserError

T = TypeVar("T")


def load_config(
    file: Path | str | None, overrides: Sequence[str] = (), schema: type[T] = Config, environment: bool = True
) -> T:
    """Read, override, put values in place of ``${key}``, check, build; raises `UserError` and nothing else.

    A relative path in the file is relative to the file, in an override to the current directory; both come out
    absolute. An override replaces what the file says under its key. `where` tells the place of every value. A file that
    somebody else has written, as that of a package may be, is to be read without the `environment`.
    """
    root = Node({}, command_line()) if file is None else read_file(Path(file))
    for override in overrides:
        _replace(root, override, schema)
    interpolate(root, environment)
    config = build(schema, root)
    keep_places(config, root)
    if isinstance(config, Config):
        fill_in_trainer(config)
    return config


def _replace(root: Node, override: str, schema: type) -> None:
    name, equals, text = override.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts) or len(parts) > MAX_DEPTH:
        raise UserError(f"command line: '{override}' is not KEY=VALUE, for instance {example(schema)}")
    value = parse_typed(text)
    node = root
    for depth, part in enumerate(parts[:-1], start=1):
        child = node.content.get(part)
        if child is None or not isinstance(child.content, dict):
            if child is not None and has_interpolation(child):
                raise UserError(
                    f"command line: {name} cannot be set, because {'.'.join(parts[:depth])} is an interpolation"
                    f" ({child.where})"
                )
            child = node.content[part] = Node({}, value.source)
        node = child
    node.content[parts[-1]] = value
