"""The commands as pages show them and as `--help` tells them: what is written is accepted, what is needed is said."""

from __future__ import annotations

import ast
import contextlib
import importlib
import io
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mrhubo.config import BaselineConfig, Config, LiveConfig, PriorConfig, SweepConfig, UniversalConfig, load_config
from mrhubo.errors import UserError

ROOT = Path(__file__).resolve().parent.parent
MODULES = {
    name: f"mrhubo.{name}"
    for name in (
        "describe",
        "fit",
        "pair",
        "retarget",
        "show",
        "evaluate",
        "export",
        "sweep",
        "baseline",
        "reproduce",
        "prior",
        "models",
    )
}
MODULES |= {name: f"mrhubo.{name}.__main__" for name in ("universal", "live")}
SCHEMAS = {"baseline": BaselineConfig, "reproduce": BaselineConfig, "prior": PriorConfig, "universal": UniversalConfig,
           "live": LiveConfig}  # fmt: skip
"""Of the config; elsewhere `Config`."""
HEAVY = {"torch", "lightning", "mlflow", "matplotlib", "optuna", "scipy", "pandas"}
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "Makefile")),
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "conf").rglob("*.yaml")),
    *sorted(path for folder in ("mrhubo", "benchmarks", "examples") for path in (ROOT / folder).rglob("*.py")),
]
PLACEHOLDERS = {
    "<robot>": "nao", "<scale>": "manual", "$(CONFIG)": "conf/nao.yaml", "$(ARGS)": "", "--polish N": "--polish 1",
}  # fmt: skip
OWN_FILE = re.compile(r"(conf/)?(my\w*|mine|config|robot)\.yaml|[A-Z]+")
"""What stands for a file of the reader's own."""
STARTS = re.compile(
    r"(?:[\w.$()/-]*/)?(?:\S+ )*?(?:-m mrhubo\.(?P<module>[a-z][\w.]*)|(?<![\w./`-])mrhubo (?P<verb>[a-z]+))(?P<rest>.*)"
)
MAY_SHOW = re.compile(r"-m[\s\\]+mrhubo\.|mrhubo[\s\\]+(?!import\b)[a-z]")
"""In every text of which a part begins as `STARTS` says."""


def command(name: str) -> Any:
    """The module of a command."""
    return importlib.import_module(MODULES[name])


def parse(name: str, arguments: list[str]) -> None:
    """Refuses what the command's parser refuses, before any work.

    Raises:
        UserError or SystemExit: an argument is refused.
    """
    command(name).build_parser().parse_args(arguments)


def accepted(name: str) -> set[str]:
    """Every long flag that the command's parser takes."""
    actions = command(name).build_parser()._actions
    return {flag for action in actions for flag in action.option_strings if flag.startswith("--")}


# What pages show


def snippets(path: Path) -> Iterator[str]:
    """The lines of code blocks, and code between the lines, of a page, a docstring or a comment."""
    text = path.read_text()
    if MAY_SHOW.search(text) is None:  # else every process that collects parses all modules
        return
    if path.suffix == ".py":
        nodes = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Module | ast.FunctionDef | ast.ClassDef)]
        text = "\n\n".join(ast.get_docstring(node) or "" for node in nodes)
    elif path.suffix == ".yaml":
        text = "\n".join("    " + line.split("#", 1)[1].split(":", 1)[-1] for line in text.splitlines() if "#" in line)
    fenced, between = False, []
    for line in text.replace("\\\n", " ").splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or (line.startswith(("    ", "\t")) and "`" not in line):  # else a list's second line
            yield line
        else:
            between.append(line)
    yield from (" ".join(code.split()) for code in re.findall(r"`([^`]+)`", "\n".join(between)))


def lines_of(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Command and arguments of every command line that a page shows; placeholders are filled in or left out."""
    names = {module: name for name, module in MODULES.items()}
    for snippet in snippets(path):
        found = STARTS.fullmatch(snippet.strip().removeprefix("$ ").removeprefix("time "))
        if found is None or re.match(r"(from|import) ", snippet.strip()):
            continue
        if found["module"]:
            name = names.get(f"mrhubo.{found['module']}", found["module"])
        else:
            name = found["verb"]
        rest = found["rest"]
        for placeholder, value in PLACEHOLDERS.items():
            rest = rest.replace(placeholder, value)
        rest = re.sub(r"\[?\b(KEY=VALUE|key(\.sub)?=value)( \.\.\.)?\]?", "", rest)
        rest = re.sub(r"\[(--[^\]]*)\]", r"\1", rest).replace("...", "")
        arguments = shlex.split(rest, comments=True)
        yield name, arguments if arguments != ["--config"] else []  # the flag is what is talked about


SHOWN = [(path, name, arguments) for path in PAGES if path.is_file() for name, arguments in lines_of(path)]


def test_pages_show_commands() -> None:
    assert len(SHOWN) > 30
    assert {name for _, name, _ in SHOWN} == set(MODULES)
    assert {path.suffix for path, _, _ in SHOWN} >= {".md", ".yaml", ".py", ""}


@pytest.mark.parametrize(
    ("path", "name", "arguments"),
    [pytest.param(*shown, id=f"{shown[0].relative_to(ROOT)}-{i}") for i, shown in enumerate(SHOWN)],
)
def test_what_pages_show_is_accepted(path: Path, name: str, arguments: list[str]) -> None:
    assert name in MODULES, f"{name}: there is no such command"
    arguments = [text for text in arguments if text != "--help"]
    if not arguments:
        return  # only named
    parse(name, arguments)
    if name == "describe":
        return  # its word is a model, of the reader's own
    settings = [text for text in arguments if re.match(r"[a-z][\w.]*=", text)]
    rest = [text for text in arguments if text not in settings]
    file = rest[rest.index("--config") + 1] if "--config" in rest else "" if not rest else rest[0]
    if not file or file.startswith("-"):
        file = f"conf/{name}.yaml" if name in ("prior", "universal") else "conf/nao.yaml"
    load_config(None if name == "live" else shipped(file), settings, SCHEMAS.get(name, Config))
    if "--sweep" in rest:
        load_config(shipped(rest[rest.index("--sweep") + 1], "sweeps/network"), (), SweepConfig)


def shipped(text: str, instead: str = "nao") -> Path:
    """The file that a command line names; one of the reader's own is stood in for."""
    if OWN_FILE.fullmatch(text):
        return ROOT / "conf" / f"{instead}.yaml"
    names = (ROOT / text, *(ROOT / "conf" / folder / f"{text}.yaml" for folder in ("", "sweeps")))
    found = [path for path in names if path.is_file()]
    assert found, f"{text} does not exist"
    return found[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("    python -m mrhubo.fit --config conf/nao.yaml a.b=1   # why\n", [("fit", ["--config", "conf/nao.yaml", "a.b=1"])]),
        ("Say `mrhubo pair nao\n--verify`, or not.", [("pair", ["nao", "--verify"])]),
        ("```sh\nmrhubo fit nao \\\n  'a.b=[1, 2]'\n```\n", [("fit", ["nao", "a.b=[1, 2]"])]),
        ("    torchrun --nproc-per-node 2 -m mrhubo.fit --config X\n", [("fit", ["--config", "X"])]),
        ("    python -m mrhubo.reproduce [--paper] [KEY=VALUE ...]\n", [("reproduce", ["--paper"])]),
        ("`mrhubo.fit` of mrhubo makes `import mrhubo`; `mrhubo/body/x.py`", []),
    ],
)  # fmt: skip
def test_the_test_finds_them(tmp_path: Path, text: str, expected: list[tuple[str, list[str]]]) -> None:
    (tmp_path / "page.md").write_text(text)
    assert list(lines_of(tmp_path / "page.md")) == expected


# What --help tells


def usage(name: str) -> str:
    """The first paragraph of a command's help."""
    with contextlib.redirect_stdout(io.StringIO()) as output, contextlib.suppress(SystemExit):
        command(name).main(["--help"])
    return output.getvalue().split("\n\n")[0]


def required(text: str) -> list[set[str]]:
    """What a usage line shows without brackets: a set for each thing needed, of the flags that give it.

    `(--config FILE | CONFIG)` is one thing that two give. Positional arguments are words in capitals.
    """
    text = text.split(":", 1)[1]
    while (shorter := re.sub(r"\[[^\[\]]*\]", "", text)) != text:
        text = shorter
    groups = re.findall(r"\(([^()]*)\)", text) + [re.sub(r"\([^()]*\)", " ", text)]
    found = [{alternative.split()[0] for alternative in group.split("|")} for group in groups[:-1]]
    words = groups[-1].split()
    for place, word in enumerate(words):
        if word.startswith("--") or (word.isupper() and not words[place - 1].startswith("-")):
            found.append({word})
    return found


COMMANDS = list(MODULES)


@pytest.mark.parametrize("name", COMMANDS)
def test_usage_shows_every_flag_and_no_other(name: str) -> None:
    shown = set(re.findall(r"--[\w-]+", usage(name)))
    assert shown - {"--help"} == accepted(name) - {"--help"}


GIVEN = {
    "--config": "conf/nao.yaml",
    "CONFIG": "conf/nao.yaml",
    "--retargeter": "no-package",
    "--sweep": "no-sweep.yaml",
    "--motion": "wave.npz",
    "--predictions": "wave.npz",
    "--out": "wave.csv",
    "--robot": "nao",
    "--to": "numpy",
    "FILE": "my.urdf",
    "--source": "udp",
    "--sink": "ws",
}
NEEDED = {
    "describe": 1,
    "fit": 1,
    "pair": 1,
    "retarget": 3,
    "show": 0,
    "evaluate": 2,
    "export": 3,
    "sweep": 2,
    "baseline": 1,
    "reproduce": 0,
    "prior": 1,
    "models": 0,
    "universal": 0,
    "live": 3,
}
"""How many things each command cannot do without."""


@pytest.mark.parametrize("name", COMMANDS)
def test_usage_shows_what_is_needed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without brackets; and without any one of it the command refuses, and names it."""
    monkeypatch.chdir(ROOT)
    needed = required(usage(name))
    assert len(needed) == NEEDED[name], needed
    for missing in needed:
        others = [min(GIVEN.keys() & group) for group in needed if group != missing]
        arguments = [word for flag in others for word in ([flag, GIVEN[flag]] if flag[0] == "-" else [GIVEN[flag]])]
        with pytest.raises((UserError, SystemExit)) as refused, contextlib.redirect_stderr(io.StringIO()) as said:
            command(name).main(arguments)
        if isinstance(refused.value, SystemExit):
            assert refused.value.code == 2
        message = f"{refused.value} {said.getvalue()}"
        assert any(flag in message for flag in missing), message


def test_reproduce_takes_no_config_and_says_so() -> None:
    with pytest.raises((UserError, SystemExit)), contextlib.redirect_stderr(io.StringIO()):
        command("reproduce").main(["--config", str(ROOT / "conf" / "nao.yaml")])
    assert "--config" not in usage("reproduce")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_costs_no_heavy_import(name: str) -> None:
    module = MODULES[name]
    code = (
        f"import runpy, sys\nsys.argv = ['{module}', '--help']\n"
        f"try:\n    runpy.run_module('{module}', run_name='__main__')\n"
        f"except SystemExit as stop:\n    assert not stop.code\n"
        "print('LOADED', *sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout.startswith("usage: "), done.stderr
    assert not HEAVY & set(done.stderr.rpartition("LOADED")[2].split())


def test_importing_the_package_costs_no_heavy_import() -> None:
    code = "import sys, mrhubo\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert not (HEAVY | {"numpy", "yaml"}) & set(done.stdout.split())
