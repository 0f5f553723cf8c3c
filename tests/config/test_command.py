"""Arguments of the commands, and how a command ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.config import Config, bounded, help_text, parse_arguments
from mrhubo.config.kinds import walk
from mrhubo.errors import UserError


@dataclass
class Small:
    """A schema without required keys."""

    steps: int = bounded(10, 1, 100)
    """Steps to take."""
    name: str | None = None
    """A name."""


FLAGS = {"quiet": "Print only the result.", "dry-run": "Do nothing.", "out FILE": "Where to."}


def parse(*argv: str, schema: type = Small):
    return parse_arguments(argv, "python -m mrhubo.test", "A test.", schema, FLAGS)


def test_arguments(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("steps: 5")
    assert parse() == (Small(), {"quiet": False, "dry-run": False, "out": None})
    assert parse("--config", str(file), "--quiet") == (Small(5), {"quiet": True, "dry-run": False, "out": None})
    for argv in (["--out", "a b"], ["--out=a b"]):
        assert parse(*argv)[1]["out"] == "a b"
    assert parse(f"--config={file}", "steps=7", "--dry-run", "name=--x") == (
        Small(7, "--x"),
        {"quiet": False, "dry-run": True, "out": None},
    )
    assert parse("steps=7", "--config", str(file))[0] == Small(7)


@pytest.mark.parametrize(
    ("argv", "sentence"),
    [
        (["--quite"], "command line: flag '--quite' does not exist; nearest: '--quiet'"),
        (["--confg", "x"], "command line: flag '--confg' does not exist; nearest: '--config'"),
        (["--confg=x"], "command line: flag '--confg' does not exist; nearest: '--config'"),
        (["--out"], "command line: --out needs a value: --out FILE"),
        (["--out", "--quiet"], "command line: --out needs a value: --out FILE"),
        (["--out=a", "--out=b"], "command line: --out is given twice"),
        (["-q"], "command line: flag '-q' does not exist; "),
        (["--quiet=1"], "command line: flag '--quiet=1' takes no value"),
        (["--steps=3"], "command line: '--steps=3' is a key, not a flag: write steps=VALUE"),
        (["--steps", "3"], "command line: '--steps' is a key, not a flag: write steps=VALUE"),
        (["--"], "command line: flag '--' does not exist"),
        (["--config"], "command line: --config needs a file name"),
        (["--config="], "command line: --config needs a file name"),
        (["--config", "--quiet"], "command line: --config needs a file name"),
        (["--config", "a.yaml", "--config", "b.yaml"], "command line: --config is given 2 times; one file is read"),
        (["a.yaml"], "command line: 'a.yaml' stands alone: write --config a.yaml"),
        (["steps"], "command line: 'steps' is neither a flag nor KEY=VALUE, for instance steps=10"),
        ([""], "command line: '' is neither a flag nor KEY=VALUE"),
        (["step=1"], "command line: key 'step' does not exist; nearest: 'steps'"),
    ],
)
def test_sentences(argv, sentence):
    with pytest.raises(UserError) as caught:
        parse(*argv)
    assert str(caught.value).startswith(sentence)


def test_config_is_required_where_keys_are():
    with pytest.raises(UserError, match=r"^command line: --config FILE is missing; python -m mrhubo.test --help lists"):
        parse("trainer.lr=1", schema=Config)


@settings(deadline=None)
@given(st.lists(st.text(max_size=15) | st.text(max_size=8).map("--".__add__), max_size=4))
def test_junk_is_a_user_error(argv):
    try:
        parse(*argv)
    except UserError as error:
        assert str(error).startswith(
            ("command line: ", "config file", argv[argv.index("--config") + 1] if "--config" in argv else "\0")
        )


def test_help_shows_every_key(capsys):
    for argv in (["--help"], ["--quite", "-h"]):
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


def test_help_of_a_small_schema():
    assert help_text(Small, "python -m small", "Does\n little.", {"quiet": "Say less."}) == (
        """\
usage: python -m small [--config FILE] [--quiet] [KEY=VALUE ...]

Does little.

Options:
  --config FILE  YAML file with the keys below.
  --quiet        Say less.
  -h, --help     Print this text.

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


# How a command ends


def run(body: str, **options) -> subprocess.CompletedProcess[str]:
    """A process whose main() has this body."""
    return subprocess.run([sys.executable, "-c", script(body)], capture_output=True, text=True, timeout=60, **options)


def script(body: str) -> str:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return (
        "import os, sys, time\nfrom mrhubo.config import run_command\nfrom mrhubo.errors import UserError\n"
        f"def main(argv):\n{lines}\nrun_command(main)"
    )


@pytest.mark.parametrize(
    ("body", "status", "out", "err"),
    [
        ("print('done')", 0, "done\n", ""),
        ("return 3", 3, "", ""),
        ("sys.exit(0)", 0, "", ""),
        ("sys.exit('why')", 1, "", "why\n"),
        ("print('part'); raise UserError('a\\n  b')", 2, "part\n", "error: a b\n"),
        ("raise KeyboardInterrupt", 130, "", "interrupted; the same command resumes\n"),
        (
            "try:\n    raise KeyboardInterrupt\nfinally:\n    raise RuntimeError('unexpected pos')",
            130,
            "",
            "interrupted; the same command resumes\n",
        ),
        (
            "try:\n    raise KeyboardInterrupt\nexcept KeyboardInterrupt:\n    sys.exit(1)",
            130,
            "",
            "interrupted; the same command resumes\n",
        ),
    ],
)
def test_ends(body, status, out, err):
    done = run(body)
    assert (done.returncode, done.stdout, done.stderr) == (status, out, err)


def test_a_bug_shows_its_traceback():
    done = run("1 / 0")
    assert done.returncode == 1
    assert "ZeroDivisionError" in done.stderr and "Traceback" in done.stderr


def test_a_broken_pipe_inside_is_a_bug():
    done = run("raise BrokenPipeError('a worker died')")
    assert done.returncode == 1
    assert "a worker died" in done.stderr


@pytest.mark.parametrize("body", ["for i in range(100000): print(i)", "print('x')\nraise SystemExit(0)"])
def test_a_reader_that_went_away_is_quiet(body):
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as pipe:
        done = subprocess.run([sys.executable, "-c", script(body)], stdout=pipe, stderr=subprocess.PIPE, timeout=60)
    assert (done.returncode, done.stderr) == (141, b"")


def test_closed_output_is_no_error():
    command = f'exec "{sys.executable}" -c "$BODY" >&-'
    done = subprocess.run(
        ["sh", "-c", command],
        env={**os.environ, "BODY": script("print('x')")},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_ctrl_c(tmp_path: Path):
    process = subprocess.Popen(
        [sys.executable, "-c", script("print('go', flush=True)\ntime.sleep(60)")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored below a shell's background job
    )
    assert process.stdout is not None and process.stdout.readline() == "go\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "interrupted; the same command resumes\n")
