"""Where the configs, robots and motions that come with mrhubo are, and which config a name stands for."""

from __future__ import annotations

import os
from pathlib import Path

from mrhubo.errors import UserError, nearest, unknown_name

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped_root() -> Path:
    """The folder that holds `conf`, `data/robots` and `data/motions`: the checkout, or the installed package itself."""
    checkout = _PACKAGE.parent
    return checkout if (checkout / "pyproject.toml").is_file() else _PACKAGE


def find_config(text: str, folder: str = "") -> Path:
    """The file that a word of the command line names: a path, or the name of a config that ships with mrhubo.

    Args:
        text: a path, which wins where the file exists, or a name: ``nao`` for conf/nao.yaml, ``paper/nao``.
        folder: part of `conf` that names are looked up in, for instance ``sweeps``.

    Raises:
        UserError: there is neither such a file nor such a config; names the nearest.
    """
    if os.path.isfile(text):
        return Path(text)
    root = shipped_root() / "conf" / folder
    names = shipped_configs(folder)
    if text in names:
        return root / f"{text}.yaml"
    if text.endswith((".yaml", ".yml")) or os.path.exists(text):
        words = os.path.splitext(text)[0].removeprefix("conf/"), os.path.splitext(os.path.basename(text))[0]
        near = next((near for word in words if (near := nearest(word, names)) is not None), None)
        if os.path.exists(text) or os.path.isdir(os.path.dirname(text) or ".") or near is None:
            return Path(text)  # what reads it tells what is wrong with it
        raise UserError(f"config file '{text}' does not exist; '{near}' is one that ships with mrhubo")
    raise UserError(unknown_name("config", text, names))


def shipped_configs(folder: str = "") -> list[str]:
    """Names of the configs that ship with mrhubo; those of sweeps only where `folder` asks for them."""
    root = shipped_root() / "conf" / folder
    names = [path.relative_to(root).with_suffix("").as_posix() for path in sorted(root.rglob("*.yaml"))]
    return [name for name in names if not name.startswith("sweeps/")]


def is_config(text: str) -> bool:
    """Whether a word of the command line names a config, there or not: a YAML file, or one that ships with mrhubo."""
    return text.endswith((".yaml", ".yml")) or (not os.path.exists(text) and text in shipped_configs())
