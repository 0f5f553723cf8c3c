"""Packages that are installed on demand."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from mrhubo.errors import UserError
from mrhubo.lazy import import_optional


def test_a_module_that_is_there() -> None:
    assert import_optional("json.decoder", "no").JSONDecoder.__module__ == "json.decoder"


@pytest.mark.parametrize("name", ["mrhubo_nowhere", "mrhubo_nowhere.part", "json.mrhubo_newer"])
def test_what_is_missing_or_too_old_is_the_sentence(name: str) -> None:
    with pytest.raises(UserError, match="^films need it: pip install it$"):
        import_optional(name, "films need it: pip install it")


@pytest.mark.parametrize(
    ("code", "why"),
    [("import mrhubo_nowhere_else", "No module named 'mrhubo_nowhere_else'"), ("raise ImportError('libGL.so.1: no such file\\nmore')", "libGL.so.1: no such file")],
)  # fmt: skip
def test_what_is_there_and_broken_says_why(
    code: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "mrhubo_broken.py").write_text(code)
    with pytest.raises(UserError, match=f"^mrhubo_broken is installed, but cannot be imported: {why}$"):
        import_optional("mrhubo_broken", "pip install it")


def test_extras_that_are_told_to_be_installed_exist(root: Path) -> None:
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    files = [
        path
        for folder in ("mrhubo", "docs", "examples")
        for path in (root / folder).rglob("*")
        if path.suffix in (".py", ".md")
    ]
    named = {
        name
        for path in files
        for found in re.findall(r"mrhubo\[([\w,]+)\]'", path.read_text())
        for name in found.split(",")
    }
    assert {"fast", "onnx", "mjcf", "ros", "video", "live", "pico", "view"} <= named <= set(extras)
