"""How a command ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest


def run(body: str, **options) -> subprocess.CompletedProcess[str]:
    """A process whose main() has this body."""
    return subprocess.run([sys.executable, "-c", script(body)], capture_output=True, text=True, timeout=300, **options)


def script(body: str, more: str = "") -> str:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return (
        "import os, sys, time\nfrom mrhubo.config import run_command\nfrom mrhubo.errors import UserError\n"
        f"def main(argv):\n{lines}\nrun_command(main{more})"
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


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("raise KeyboardInterrupt", "interrupted; the same command begins anew"),
        (
            "import errno; raise OSError(errno.ENOSPC, 'x', 'a.npz')",
            "error: a.npz: No space left on device; put that right and start the same command again",
        ),
    ],
)
def test_a_command_that_does_not_go_on_does_not_say_so(body: str, sentence: str) -> None:
    done = subprocess.run([sys.executable, "-c", script(body, ", resumes=False")], capture_output=True, text=True)
    assert done.stderr == f"{sentence}\n"


def test_a_current_folder_that_is_gone_is_one_sentence(tmp_path: Path) -> None:
    """Where a shell was left in a folder that somebody removed; the package is named, as it cannot be found from there."""
    package = str(Path(__file__).resolve().parents[2])
    gone = "import os, sys; os.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone')\n"
    text = f"import sys; sys.path.insert(0, {package!r})\n{gone}{script('print(1)')}"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == "error: the current folder is gone, or may not be read; change to another one\n"


def test_a_warning_about_the_users_input_is_one_line_once():
    body = "import warnings\nfrom mrhubo.errors import InputWarning\nfor text in ('odd\\n  thing', 'odd thing', 'b'):\n"
    done = run(body + "    warnings.warn(text, InputWarning)\nwarnings.warn('theirs', UserWarning)")
    assert done.returncode == 0 and done.stderr.startswith("warning: odd thing\nwarning: b\n")
    assert done.stderr.count("odd") == 1 and "UserWarning: theirs" in done.stderr


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
        done = subprocess.run([sys.executable, "-c", script(body)], stdout=pipe, stderr=subprocess.PIPE, timeout=300)
    assert (done.returncode, done.stderr) == (141, b"")


def test_closed_output_is_no_error():
    command = f'exec "{sys.executable}" -c "$BODY" >&-'
    done = subprocess.run(
        ["sh", "-c", command],
        env={**os.environ, "BODY": script("print('x')")},
        capture_output=True,
        text=True,
        timeout=300,
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
    _, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (130, "interrupted; the same command resumes\n")


def test_sigterm_ends_as_an_interrupt_does():
    body = "try:\n    print('go', flush=True)\n    time.sleep(60)\nfinally:\n    print('closed')"
    process = subprocess.Popen(
        [sys.executable, "-c", script(body)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stdout.readline() == "go\n"
    process.terminate()
    out, err = process.communicate(timeout=300)
    assert (process.returncode, out, err) == (143, "closed\n", "terminated; the same command resumes\n")


def test_a_signal_that_is_ignored_stays_ignored():
    body = "import signal\nos.kill(os.getpid(), signal.SIGHUP)\nprint('on')"
    done = run(body, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))  # as nohup starts it
    assert (done.returncode, done.stdout) == (0, "on\n")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_letter_that_the_terminal_does_not_know_is_escaped(encoding):
    body = "print('Zü\\u30ca\\udcff'); raise UserError('ä\\u30ca')"
    done = run(body, env={**os.environ, "PYTHONIOENCODING": encoding}, encoding=encoding)
    assert done.returncode == 2 and done.stdout.startswith("Z") and done.stdout.endswith("\\udcff\n")
    assert done.stderr.startswith("error: ") and "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("open('/dev/full', 'wb', 0).write(b'x')", "No space left on device"),
        ("os.mkdir('/tmp/' + 300 * 'n')", "File name too long"),
        ("open('/dev/null/x')", "/dev/null/x: Not a directory"),
    ],
)
def test_a_fault_of_the_machine_is_one_sentence(body, sentence):
    done = run(body)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: ") and sentence in done.stderr


@pytest.mark.parametrize("error", ["UserError", "ValueError"])
def test_no_password_is_printed(error):
    done = run(f"raise {error}('no http://anna:s3cret@host there')")
    assert done.returncode in (1, 2) and "http://anna:***@host" in done.stderr and "s3cret" not in done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="libgomp's setting")
def test_waiting_threads_spin_briefly_unless_the_user_wants_something_else():
    body = "print(*map(os.environ.get, ['GOMP_SPINCOUNT', 'OMP_WAIT_POLICY']), 'torch' in sys.modules)"
    settings = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT")
    without = {name: value for name, value in os.environ.items() if name not in settings}
    assert run(body, env=without).stdout == "3000 None False\n"
    assert run(body, env={**without, "OMP_WAIT_POLICY": "ACTIVE"}).stdout == "None ACTIVE False\n"
    assert run(body, env={**without, "GOMP_SPINCOUNT": "7"}).stdout == "7 None False\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_llvm_tells_what_it_has_compiled_is_not_lost(number: signal.Signals) -> None:
    """ctypes prints what a function raises that C has called, and goes on."""
    pytest.importorskip("llvmlite", reason="numba is not installed")
    body = (
        "import ctypes\nfrom types import SimpleNamespace\nfrom llvmlite.binding import ExecutionEngine\n"
        "def slow(*given):\n    print('go', flush=True); time.sleep(0.3)\n"
        "engine = SimpleNamespace(_object_cache_getbuffer=slow, _find_module_ptr=slow)\n"
        "data = SimpleNamespace(contents=SimpleNamespace(module_ptr=0))\n"
        "called = ctypes.CFUNCTYPE(None)(lambda: ExecutionEngine._raw_object_cache_getbuffer(engine, data))\n"
        "called()\nprint('compiled', flush=True)\ntime.sleep(60)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script(body)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "go\n"
    process.send_signal(number)
    try:
        _, err = process.communicate(timeout=120)
    finally:
        process.kill()
    word = "interrupted" if number == signal.SIGINT else "terminated"
    assert process.returncode == 128 + number and err.endswith(f"{word}; the same command resumes\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_library_that_catches_everything_while_it_is_imported_loses_no_signal(
    tmp_path: Path, number: signal.Signals
) -> None:
    """As trimesh does with what it may go without."""
    library = "import time\ntry:\n    print('go', flush=True)\n    time.sleep(0.3)\nexcept BaseException:\n    pass\n"
    (tmp_path / "careless.py").write_text(library)
    process = subprocess.Popen(
        [sys.executable, "-c", script("import careless\nprint('imported', flush=True)\ntime.sleep(60)")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "go\n"
    for _ in range(2):  # who is impatient presses twice
        process.send_signal(number)
    _, err = process.communicate(timeout=120)
    word = "interrupted" if number == signal.SIGINT else "terminated"
    assert (process.returncode, err) == (128 + number, f"{word}; the same command resumes\n")
