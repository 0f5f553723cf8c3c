"""A typed config -> plain values, YAML and a fingerprint."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import re
from pathlib import Path
from typing import Any

import yaml

from mrhubo.config.tree import is_given, scalar


def to_plain(value: Any) -> Any:
    """Dicts, lists, text, numbers, truth values and None only: safe for YAML, MLflow, Lightning's hyperparameters."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        given = [field for field in dataclasses.fields(value) if is_given(value, field)]
        return {field.name: to_plain(getattr(value, field.name)) for field in given}
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"a key must be text, found {key!r}")
        return {key: to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int | str) or (isinstance(value, float) and math.isfinite(value)):
        kind = int if isinstance(value, int) else str if isinstance(value, str) else float
        return kind(value)  # no subclass such as numpy.float64, whose text differs
    raise TypeError(f"not a plain value: {value!r}")


def without_paths(config: Any) -> dict[str, Any]:
    """Plain values of those fields of a dataclass that hold no path: what a result depends on, wherever files lie."""
    plain = to_plain(config)
    return {name: value for name, value in plain.items() if not isinstance(getattr(config, name), Path)}


def changed_settings(config: Any, usual: Any = None) -> dict[str, Any]:
    """Those of `without_paths` that differ from those of `usual`, by default from their field's default."""
    if usual is not None:
        defaults = vars(usual)
    else:
        defaults = {
            field.name: field.default_factory() if callable(field.default_factory) else field.default
            for field in dataclasses.fields(config)
        }
    return {name: value for name, value in without_paths(config).items() if getattr(config, name) != defaults[name]}


def to_yaml(config: Any) -> str:
    """YAML that `load_config` reads back to an equal config."""
    return yaml.dump(_escaped(to_plain(config)), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)


def flow_yaml(value: Any) -> str:
    """One value as YAML on one line, as `to_yaml` writes it: ``{link: torso, offset: [0.0, 0.1, 0.0]}``."""
    text = yaml.dump(
        _escaped(to_plain(value)), Dumper=_Dumper, default_flow_style=True, sort_keys=False, width=math.inf
    )
    return text.removesuffix("\n").removesuffix("\n...")


def fingerprint(value: Any) -> str:
    """16 hex digits of a config or of plain values: the order of keys does not count, 2 and 2.0 differ."""
    text = json.dumps(to_plain(value), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _escaped(value: Any) -> Any:
    """Text that only looks like an interpolation stays what it is."""
    if isinstance(value, dict):
        return {key: _escaped(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_escaped(item) for item in value]
    if isinstance(value, str):
        return re.sub(r"(?<!\\)(\\*)\$\{", lambda found: found[1] * 2 + "\\${", value)
    return value


class _Dumper(yaml.SafeDumper):
    """Quotes whatever is not one simple word, or would be read as something else than text."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    simple = re.fullmatch(r"[\w./][\w./-]*( [\w./-]+)*", text, re.ASCII) and isinstance(scalar(text), str)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if simple else '"')


_Dumper.add_representer(str, _text)
