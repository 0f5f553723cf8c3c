"""A file is whole or refused; the same input gives the same bytes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.errors import UserError
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.atomic import atomic_path
from mrhubo.files.storage import Locked, locked, read_tensors, write_tensors

TENSORS = {"b": torch.arange(12.0).reshape(3, 4), "a": torch.tensor([True, False]), "none": torch.empty(0, 3)}
METADATA = {"seed": "7", "robot": "nao", "fingerprint": "abc"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "deep" / "file.safetensors"
    write_tensors(path, TENSORS, METADATA)
    return path


def test_round_trip(file: Path) -> None:
    tensors, metadata = read_tensors(file)
    assert metadata == METADATA
    assert set(tensors) == set(TENSORS)
    for name, tensor in TENSORS.items():
        assert torch.equal(tensors[name], tensor)


def test_transposed_tensors_are_written_too(tmp_path: Path) -> None:
    tensor = torch.arange(6.0).reshape(2, 3).T
    write_tensors(tmp_path / "t", {"t": tensor}, {})
    assert torch.equal(read_tensors(tmp_path / "t")[0]["t"], tensor)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_flipped_bit_is_noticed(file: Path, data: st.DataObject) -> None:
    content = bytearray(file.read_bytes())
    position = data.draw(st.integers(0, 8 * len(content) - 1))
    content[position // 8] ^= 1 << position % 8
    damaged = file.with_name("damaged")
    damaged.write_bytes(content)
    try:
        tensors, metadata = read_tensors(damaged)
    except DamagedFile:
        return
    # Padding blanks of the header are the only bits without a meaning.
    assert metadata == METADATA and all(torch.equal(tensors[k], v) for k, v in TENSORS.items())


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 0.999))
def test_a_truncated_file_is_noticed(file: Path, share: float) -> None:
    content = file.read_bytes()
    damaged = file.with_name("damaged")
    damaged.write_bytes(content[: int(share * len(content))])
    with pytest.raises(DamagedFile):
        read_tensors(damaged)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=400))
def test_junk_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "junk").write_bytes(content)
    with pytest.raises(DamagedFile):
        read_tensors(tmp_path / "junk")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DamagedFile, match="nothing-here"):
        read_tensors(tmp_path / "nothing-here")


def test_bytes_do_not_depend_on_the_process(file: Path, tmp_path: Path) -> None:
    script = (
        "import sys, torch; from pathlib import Path; from mrhubo.files.storage import write_tensors\n"
        "t = {'a': torch.tensor([True, False]), 'none': torch.empty(0, 3), 'b': torch.arange(12.).reshape(3, 4)}\n"
        "write_tensors(Path(sys.argv[1]), t, {'fingerprint': 'abc', 'robot': 'nao', 'seed': '7'})"
    )
    other = tmp_path / "other"
    subprocess.run([sys.executable, "-c", script, str(other)], check=True, env={**os.environ, "PYTHONHASHSEED": "123"})
    assert other.read_bytes() == file.read_bytes()


def test_a_failed_write_leaves_the_old_file(file: Path) -> None:
    before = file.read_bytes()
    with pytest.raises(RuntimeError), atomic_path(file) as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError
    assert file.read_bytes() == before
    assert [p.name for p in file.parent.iterdir()] == [file.name]


def test_a_folder_in_the_way_is_a_clear_error(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(UserError, match="taken: cannot be written"), atomic_path(tmp_path / "taken") as temporary:
        temporary.write_bytes(b"x")
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="file is no folder"), atomic_path(tmp_path / "file" / "a"):
        pass


HOLD = (
    "import sys, time; from pathlib import Path; from mrhubo.files.storage import locked\n"
    "for seconds in (0.5, 60):\n"
    "    with locked(Path(sys.argv[1]), wait=True):\n"
    "        print('held', flush=True)\n"
    "        time.sleep(seconds)\n"
    "        print('given back', flush=True)\n"
    "    sys.stdin.readline()\n"
)


@contextmanager
def holder(lock: Path) -> Iterator[tuple[IO[str], IO[str], subprocess.Popen[str]]]:
    """Another process that holds a lock for half a second, and when it is told to, until it ends."""
    command = [sys.executable, "-c", HOLD, str(lock)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
    try:
        assert process.stdin and process.stdout and process.stdout.readline() == "held\n"
        yield process.stdin, process.stdout, process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("path", [".", "/"])
def test_a_path_without_a_name_is_a_clear_error(path: str) -> None:
    with pytest.raises(UserError, match="is a folder; name a file"), atomic_path(Path(path)):
        pass


def test_who_waits_gets_the_lock_after_the_other_and_it_ends_with_its_process_however_that_ends(tmp_path: Path) -> None:
    lock = tmp_path / "work" / "lock"
    with holder(lock) as (told, says, process):
        with locked(lock, wait=True):
            assert says.readline() == "given back\n"
        told.write("go on\n")
        assert says.readline() == "held\n"
        with (
            pytest.raises(Locked, match=r"work: another process is at work there; wait for it or stop it"),
            locked(lock),
        ):
            pass
        process.kill()  # kill -9: nothing in the process can clean up
        process.wait()
        with locked(lock):
            pass


def test_a_lock_is_given_back_when_its_block_fails(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), locked(tmp_path / "lock"):
        raise RuntimeError
    with locked(tmp_path / "lock"):
        pass


def test_a_lock_that_cannot_be_made_is_a_clear_error(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(UserError, match="taken: cannot be locked"), locked(tmp_path / "taken"):
        pass


def test_reading_needs_nothing_that_only_posix_has(file: Path) -> None:
    script = (
        "import sys\n"
        "sys.modules.update(dict.fromkeys(('fcntl', 'resource', 'termios', 'psutil')))\n"  # importing them now fails
        "from pathlib import Path; from mrhubo.files.storage import read_tensors\n"
        "import mrhubo.files.npz, mrhubo.files.checkpoint\n"
        "assert sorted(read_tensors(Path(sys.argv[1]))[0]) == ['a', 'b', 'none']\n"
    )
    subprocess.run([sys.executable, "-c", script, str(file)], check=True)
