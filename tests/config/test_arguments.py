"""Arguments of the commands: what they mean, in which order, and what is refused in which words."""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.config import Config, bounded, find_config, number, parse_arguments, whole_number
from mrhubo.config.arguments import CommandParser
from mrhubo.config.kinds import walk
from mrhubo.errors import UserError

COMMANDS = ["fit", "pair", "evaluate", "sweep", "baseline", "reproduce"]


@dataclass
class Small:
    """A schema without required keys."""

    steps: int = bounded(10, 1, 100)
    """Steps to take."""
    name: str | None = None
    """A name."""


def parser(schema: type = Small, takes_config: bool = True) -> CommandParser:
    """A command with every kind of flag."""
    found = CommandParser("mrhubo test", "A test.", schema, takes_config)
    found.add_argument("--quiet", action="store_true", help="say less")
    found.add_argument("--dry-run", action="store_true", help="do nothing")
    found.add_argument("--out", metavar="FILE", help="where to")
    found.add_argument("--count", metavar="NUMBER", type=whole_number(1, 9), default=3, help="how many")
    found.add_argument("--hours", metavar="NUMBER", type=number(0.5), help="how long")
    either = found.add_mutually_exclusive_group()
    either.add_argument("--left", action="store_true", help="one")
    either.add_argument("--right", action="store_true", help="the other")
    return found


def parse(*argv: str, schema: type = Small) -> tuple:
    return parse_arguments(parser(schema), argv)


@pytest.fixture()
def file(tmp_path: Path) -> Path:
    (tmp_path / "a.yaml").write_text("steps: 5")
    return tmp_path / "a.yaml"


def test_config_flags_and_overrides_in_any_order(file: Path) -> None:
    given = [str(file), "--out", "a b", "steps=7", "--quiet", "name=x"]
    for _ in range(len(given)):
        if "--out" not in given[-1:]:  # its value would be the first word
            config, options = parse(*given)
            assert config == Small(7, "x") and options.config == file
            assert (options.quiet, options.dry_run, options.out, options.count) == (True, False, "a b", 3)
            assert sorted(options.overrides) == ["name=x", "steps=7"]
        given = given[1:] + given[:1]


def test_overrides_behind_a_flag_of_several_values(file: Path) -> None:
    several = parser()
    several.add_argument("--files", metavar="FILE", nargs="+", help="what from")
    config, options = parse_arguments(several, [str(file), "--files", "a", "b=c", "steps=7", "d", "name=x=y"])
    assert config == Small(7, "x=y") and options.files == ["a", "b=c", "d"]
    with pytest.raises(UserError, match="--files needs a value: --files FILE ..."):
        parse_arguments(several, [str(file), "--files", "steps=7"])


def test_what_stands_for_the_config(file: Path) -> None:
    for argv in ([str(file)], ["--config", str(file)], [f"--config={file}"]):
        config, options = parse(*argv)
        assert config == Small(5) and options.config == file
    assert parse()[0] == Small() and parse()[1].config is None


def test_a_shipped_config_by_its_name(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for argv in (["nao"], ["--config", "nao"], ["--quiet", "nao"]):
        config, options = parse(*argv, schema=Config)
        assert config.robot.name == "nao" and options.config == root / "conf" / "nao.yaml"
    (tmp_path / "nao").mkdir()  # a folder is no config
    assert parse("paper/nao", schema=Config)[0].robot.scale == "manual"


def test_values() -> None:
    for argv in (["--out", "a b"], ["--out=a b"]):
        assert parse(*argv)[1].out == "a b"
    assert parse("--out=a=b")[1].out == "a=b"
    assert parse("--count", "9", "--hours=0.5")[1].hours == 0.5
    assert parse("name=a=b --quiet")[0].name == "a=b --quiet"
    assert parse("name=--x")[0].name == "--x"
    assert parse("name=")[0].name is None
    assert parse("name=-")[0].name == "-"


@pytest.mark.parametrize(
    ("argv", "sentence"),
    [
        (["--quite"], "command line: flag '--quite' does not exist; nearest: '--quiet'"),
        (["--confg", "x"], "command line: flag '--confg' does not exist; nearest: '--config'"),
        (["--confg=x"], "command line: flag '--confg' does not exist; nearest: '--config'"),
        (["--hlep"], "command line: flag '--hlep' does not exist; nearest: '--help'"),
        (["--verbosity"], "command line: flag '--verbosity' does not exist; available: --config, --count, "),
        (["--qui"], "command line: flag '--qui' does not exist; nearest: '--quiet'"),
        (["--out"], "command line: --out needs a value: --out FILE"),
        (["--out="], "command line: --out needs a value: --out FILE"),
        (["--out", ""], "command line: --out needs a value: --out FILE"),
        (["--out", "--quiet"], "command line: --out needs a value: --out FILE"),
        (["--out=a", "--out=a"], "command line: --out is given twice"),
        (["--count=3", "--count=3"], "command line: --count is given twice"),
        (["--count", "0"], "command line: --count must be a whole number from 1 to 9, found '0'"),
        (["--count", "-5"], "command line: --count must be a whole number from 1 to 9, found '-5'"),
        (["--count", "2.5"], "command line: --count must be a whole number from 1 to 9, found '2.5'"),
        (["--count", "9" * 5000], "command line: --count must be a whole number from 1 to 9, found '999"),
        (["--count="], "command line: --count needs a value: --count NUMBER"),
        (["--hours", "nan"], "command line: --hours must be a number of at least 0.5, found 'nan'"),
        (["--hours", "soon"], "command line: --hours must be a number of at least 0.5, found 'soon'"),
        (["--hours", "inf"], "command line: --hours must be a number of at least 0.5, found 'inf'"),
        (["--left", "--right"], "command line: --right does not go together with --left"),
        (["-q"], "command line: flag '-q' does not exist; "),
        (["--quiet=1"], "command line: --quiet takes no value"),
        (["--steps=3"], "command line: '--steps=3' is a key, not a flag: write steps=VALUE"),
        (["--steps", "3"], "command line: '--steps' is a key, not a flag: write steps=VALUE"),
        (["--"], "command line: flag '--' does not exist"),
        (["-"], "command line: '-' is no file: standard input and output are not used; name a file"),
        (["--config"], "command line: --config needs a value: --config CONFIG"),
        (["--config="], "command line: --config needs a value: --config CONFIG"),
        (["--config", "--quiet"], "command line: --config needs a value: --config CONFIG"),
        (["--config", "a", "--config", "b"], "command line: --config is given twice"),
        (["--config", "a", "b"], "command line: the config is given twice, 'a' and 'b'; one is read"),
        (["a", "x=1", "b"], "command line: the config is given twice, 'a' and 'b'; one is read"),
        (["gone.yaml"], "config file 'gone.yaml' does not exist; "),
        (["nap"], "config 'nap' does not exist; nearest: 'nao'"),
        (
            ["atlas"],
            "config 'atlas' does not exist; available: coman, coman-whole-body, g1-whole-body, nao, nao-whole-body, ",
        ),
        (["no/mine.yaml"], "config file 'no/mine.yaml' does not exist, nor does its folder"),
        (["gone/conf/nao"], "config 'gone/conf/nao' does not exist"),
        (["steps"], "command line: 'steps' is a key: write steps=VALUE"),
        ([""], "command line: '' is neither a flag nor KEY=VALUE"),
        (["=1"], "command line: '=1' is not KEY=VALUE"),
        (["step=1"], "command line: key 'step' does not exist; nearest: 'steps'"),
        (["steps="], "command line: steps must be a whole number from 1 to 100, found nothing"),
        (["a" * 5000], "config 'aaa"),
    ],
)
def test_sentences(argv: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as caught:
        parse(*argv)
    assert str(caught.value).startswith(sentence)


def test_a_shipped_file_that_is_not_here_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"config file 'conf/nao.yaml' does not exist; 'nao' is one that ships"):
        parse("conf/nao.yaml")
    with pytest.raises(UserError, match=r"'conf/sweeps/network.yaml' does not exist; 'network' is one that ships"):
        find_config("conf/sweeps/network.yaml", "sweeps")
    with pytest.raises(UserError, match=r"config 'netwrok' does not exist; nearest: 'network'"):
        find_config("netwrok", "sweeps")


def test_a_config_is_required_where_keys_are() -> None:
    with pytest.raises(UserError, match=r"^command line: CONFIG is missing, for instance mrhubo test nao; --help"):
        parse("trainer.lr=1", schema=Config)


def test_required_flags() -> None:
    needy = parser()
    needy.add_argument("--package", metavar="FOLDER", required=True, help="what a fit ended with")
    with pytest.raises(UserError, match=r"^command line: --package FOLDER is missing: what a fit ended with$"):
        needy.parse_args([])
    with pytest.raises(UserError, match=r"'--pakage' does not exist; nearest: '--package'"):
        needy.parse_args(["--pakage", "x"])
    assert needy.parse_args(["--package", "x"]).package == "x"
    assert "usage: mrhubo test --package" in " ".join(needy.format_usage().split()).replace("[--quiet] [--dry-run] "
        "[--out FILE] [--count NUMBER] [--hours NUMBER] [--left | --right] ", "")  # fmt: skip
    assert "what a fit ended with; required" in needy.format_help()


def test_a_command_with_configs_of_its_own() -> None:
    own = parser(Config, takes_config=False)
    options = own.parse_args(["trainer.lr=1", "--quiet"])
    assert options.config is None and options.overrides == ["trainer.lr=1"] and options.quiet
    assert "CONFIG" not in own.format_help() and "--config" not in own.format_help()
    for argv in (["--config", "x"], ["--config=x"]):
        with pytest.raises(UserError, match="^command line: mrhubo test takes no --config: it has its own"):
            own.parse_args(argv)
    with pytest.raises(UserError, match="^command line: 'nao' is neither a flag nor KEY=VALUE, for instance"):
        own.parse_args(["nao"])


words = st.text(max_size=15) | st.text(max_size=8).map("--".__add__)
words |= st.sampled_from(
    ["--config", "--out", "--count", "--left", "--right", "--quiet", "-1", "--count=", "steps=3", "--"]
)


@settings(deadline=None, max_examples=300)
@given(st.lists(words, max_size=5))
def test_any_arguments_are_taken_or_a_user_error(argv: list[str]) -> None:
    try:
        options = parser().parse_args(argv)
    except UserError as error:
        assert str(error).startswith(("command line: ", "config "))
    except SystemExit as end:
        assert {"-h", "--help"} & set(argv) and end.code == 0
    else:
        assert isinstance(options, argparse.Namespace) and set(vars(options)) == {
            "config", "overrides", "quiet", "dry_run", "out", "count", "hours", "left", "right"
        }  # fmt: skip


@settings(deadline=None)
@given(st.lists(st.text(max_size=15), max_size=4))
def test_junk_never_gets_further_than_a_user_error(argv: list[str]) -> None:
    try:
        parse(*argv, schema=Config)
    except UserError as error:
        assert str(error).strip()
    except SystemExit:
        assert {"-h", "--help"} & set(argv)


# Help


def test_help_shows_every_key(capsys: pytest.CaptureFixture[str]) -> None:
    for argv in (["--help"], ["--quite", "-h"], ["-h", "x", "y", "trainer.lrr=1"], ["--out", "--help"]):
        with pytest.raises(SystemExit) as caught:
            parse(*argv, schema=Config)
        assert caught.value.code == 0
    shown = capsys.readouterr().out
    words = set(shown.split())
    keys = [key for key in walk(Config) if not key.is_section]
    assert len(keys) > 30
    for key in keys:
        assert key.name in words
        for choice in key.field.metadata.get("choices", ()):
            assert choice in shown
        for bound in ("low", "high"):
            if key.field.metadata.get(bound) is not None:
                assert str(key.field.metadata[bound]) in shown
    assert {"--config", "--quiet", "--dry-run", "--help", "required"} <= words
    assert max(map(len, shown.splitlines())) <= 100


def test_help_of_a_small_schema() -> None:
    small = CommandParser("mrhubo small", "Does\n little.", Small)
    small.add_argument("--quiet", action="store_true", help="say less")
    assert small.format_help() == (
        """\
usage: mrhubo small [--quiet] [CONFIG | --config CONFIG] [KEY=VALUE ...]

Does little.

Options:
  CONFIG, --config CONFIG  YAML file with the keys below, or the name of a config that ships with
                           mrhubo: nao, paper/nao
  --quiet                  say less
  -h, --help               print this

Keys, in the file or as KEY=VALUE on the command line, for instance steps=10, which replaces what
the file says. A value is taken literally unless it starts with a bracket or a quote, then it is
YAML: a.b='[x, y]'. A relative path is relative to the file that holds it; on the command line, to
the current directory.

  steps  whole number from 1 to 100; default 10
         Steps to take.
  name   text; default none
         A name.
"""
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_parser_and_loads_no_torch_for_its_help(command: str) -> None:
    code = (
        f"import sys, mrhubo.{command} as command\ntry:\n    command.main(['--help'])\nexcept SystemExit:\n"
        "    print(*{'torch', 'numpy', 'mlflow', 'lightning'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stderr.strip() == ""
    found = importlib.import_module(f"mrhubo.{command}").build_parser()
    assert done.stdout.startswith(f"usage: mrhubo {command} ") and done.stdout == found.format_help()


@pytest.mark.parametrize("command", [*COMMANDS, "prior"])
def test_the_usage_line_tells_what_is_needed(command: str) -> None:
    found = importlib.import_module(f"mrhubo.{command}").build_parser()
    usage = " ".join(found.format_usage().split())
    needed = [action.option_strings[0] for action in found._flags() if action.required]
    groups = [group for group in found._mutually_exclusive_groups if group.required]
    either = [action.option_strings[0] for group in groups for action in group._group_actions]
    assert ("(CONFIG | --config CONFIG" in usage) == found.needs_config
    for action in found._flags():
        flag = action.option_strings[0]
        optional = f"[{flag}" in usage or (f"| {flag}" in usage and flag not in either)
        assert optional == (flag not in [*needed, *either]) and flag in usage


def test_verify_and_inspect_exclude_each_other() -> None:
    from mrhubo.pair import build_parser

    with pytest.raises(UserError, match="--inspect does not go together with --verify"):
        build_parser().parse_args(["nao", "--verify", "--inspect"])
    assert "[--verify | --inspect]" in build_parser().format_usage()
