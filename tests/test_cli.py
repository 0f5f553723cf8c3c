"""The one command: its table of verbs, its help, and how it ends."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import mrhubo
from mrhubo.cli import VERBS, dispatch
from mrhubo.errors import UserError


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "mrhubo", *arguments], capture_output=True, text=True)


def test_every_verb_has_a_command_and_every_command_a_verb(root: Path) -> None:
    for verb in VERBS.values():
        spec = importlib.util.find_spec(verb.module)
        assert spec is not None and spec.origin is not None
        tree = ast.parse(Path(spec.origin).read_text())
        assert "main" in [node.name for node in tree.body if isinstance(node, ast.FunctionDef)], verb.module
    files = [*(root / "mrhubo").glob("*.py"), *(root / "mrhubo").glob("*/__main__.py")]
    endings = {
        p.stem if p.stem != "__main__" else p.parent.name: "run_command(main)" in p.read_text()
        for p in files
        if "run_command(main" in p.read_text()
    }
    assert endings == {name: verb.resumes for name, verb in VERBS.items()}


def test_help_lists_the_verbs_and_loads_no_torch(capsys: pytest.CaptureFixture[str]) -> None:
    assert dispatch(["--help"]) == 0
    help_text = capsys.readouterr().out
    assert dispatch([]) == 2 and capsys.readouterr().out == help_text
    for name, verb in VERBS.items():
        assert f"  {name} " in help_text and verb.meaning in help_text
    code = "import sys; from mrhubo.cli import dispatch; dispatch(['-h']); assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    assert dispatch(["--version"]) == 0
    assert capsys.readouterr().out == f"mrhubo {mrhubo.__version__}\n"


@pytest.mark.parametrize(
    ("word", "message"), [("fitt", "command 'fitt' .*'fit'"), ("--verbose", "flag '--verbose' does not exist")]
)
def test_an_unknown_verb_is_told_what_there_is(word: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        dispatch([word])


def test_a_verb_gets_the_rest_and_a_mistake_is_one_line_and_status_2() -> None:
    done = run("fit", "--help")
    assert done.returncode == 0 and "trainer" in done.stdout and "reverse_share" in done.stdout
    done = run("fit", "--config", "nowhere.yaml")
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: ") and "nowhere.yaml" in done.stderr
