"""Imports go one way: down the list of rooms below, and never in a circle. Imports inside functions count too."""

from __future__ import annotations

import ast
import functools
import graphlib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ROOMS = (
    "errors", "lazy", "rotation", "frames", "files", "robot_motion", "fast", "config", "runtime", "search", "body", "robot", "video", "motion", "reference",
    "universal", "pairing", "retargeter", "streaming", "exporting", "retargeting", "evaluation", "view", "viewer", "describing", "live", "callbacks", "body.prior_training", "universal.learning", "fitting",
    "baselines", "paper", "universal.__main__", "live.__main__", "commands",
)  # fmt: skip
"""Each may import from itself and from those before it. `commands` is everything else that lies in the package's
folder: the verbs, the table of them, and the public names. The prior's training lies in the body, but is a training: it
has callbacks, and the body does not know it; so does the universal network's, and `__main__` beside it starts that. A
live session is started by the `__main__` in its room."""


def modules() -> dict[str, Path]:
    """Every module of the package, by its full name."""
    found = {}
    for path in sorted((ROOT / "mrhubo").rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@functools.cache
def statements(text: str) -> list[ast.Import | ast.ImportFrom]:
    """The imports in a module's text; those for type checkers alone are left out."""
    tree = ast.parse(text)
    ignored = {id(node) for test in ast.walk(tree) if _for_type_checkers(test) for node in ast.walk(test)}
    return [
        node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom) and id(node) not in ignored
    ]


def imports(name: str, path: Path, known: set[str]) -> Iterator[tuple[int, str]]:
    """Line and module of each import of a module of the package."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in statements(path.read_text()):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names if alias.name in known)
        else:
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{module}.{alias.name}"
                if inner in known or module in known:
                    yield node.lineno, inner if inner in known else module


def _for_type_checkers(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def room(module: str) -> int:
    """Place of a module's room in the list."""
    _, *parts = module.split(".")
    names = (".".join(parts[:2]), *parts[:1], "commands")
    return next(ROOMS.index(name) for name in names if name in ROOMS)


def upward(known: dict[str, Path]) -> Iterator[str]:
    """Each import from a later room, as a sentence."""
    for name, path in known.items():
        for line, target in imports(name, path, set(known)):
            # The package itself is always there; it is asked for its version or its folder.
            if target != "mrhubo" and room(target) > room(name):
                yield f"{path.relative_to(ROOT)}:{line} imports {target}"


def circle(known: dict[str, Path]) -> list[str]:
    """Modules that import each other in a circle, or nothing."""
    graph = {name: {target for _, target in imports(name, path, set(known))} - {name, "mrhubo"}
             for name, path in known.items()}  # fmt: skip
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_every_folder_is_a_room() -> None:
    folders = {path.parent.name for path in (ROOT / "mrhubo").glob("*/__init__.py")}
    assert folders <= set(ROOMS), "a new room: say where it stands, here and in CONTRIBUTING"


def test_imports_go_down_the_rooms() -> None:
    assert list(upward(modules())) == []


def test_no_import_circle() -> None:
    assert circle(modules()) == []


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("from mrhubo.fitting import fit", "imports mrhubo.fitting"),
        ("def late():\n    from ..view import sheets", "imports mrhubo.view.sheets"),
        ("import mrhubo.cli", "imports mrhubo.cli"),
        ("from mrhubo import rotation, errors\nimport mrhubo\nfrom mrhubo import __version__", None),
        ("if TYPE_CHECKING:\n    from mrhubo.view import sheets", None),
    ],
)
def test_the_test_sees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, sentence: str | None) -> None:
    names = ["__init__", "cli", "errors", "rotation", "body/__init__", "body/a", "fitting/__init__", "view/__init__"]
    for name in [*names, "view/sheets"]:
        path = tmp_path / "mrhubo" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text if name == "body/a" else "")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    found = list(upward(modules()))
    assert [f.split(" ", 1)[1] for f in found] == ([sentence] if sentence else [])
    (tmp_path / "mrhubo/errors.py").write_text("def f():\n    from mrhubo import rotation")
    assert circle(modules()) == []
    (tmp_path / "mrhubo/rotation.py").write_text("from .errors import f")
    assert set(circle(modules())) == {"mrhubo.errors", "mrhubo.rotation"}
