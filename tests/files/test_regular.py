"""Only regular files are opened; what is none is named, at once."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mrhubo.body import BodyPrior, VPoser, open_skeleton
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.files.atomic import checksum_file
from mrhubo.files.npz import open_npz
from mrhubo.files.regular import MissingFile, check_regular, read_regular, refuse_input
from mrhubo.files.storage import read_tensors
from mrhubo.motion import read_motion


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def listener(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # names of sockets are short
    socket.socket(socket.AF_UNIX).bind(path.name)
    os.chdir(here)


ODD = {"is a pipe": pipe, "is a device": device, "is a socket": listener, "is a folder": Path.mkdir}


def _npz(path: Path) -> None:
    with open_npz(path):
        pass


READERS: dict[str, Callable[[Path], Any]] = {
    "a.yaml": load_config,
    "b.npz": read_motion,
    "c.npz": open_skeleton,
    "d.pkl": open_skeleton,
    "e.safetensors": read_tensors,
    "f.safetensors": BodyPrior.open,
    "g.ckpt": VPoser.open,
    "h": checksum_file,
    "i.npz": _npz,
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("what", ODD)
def test_what_is_no_file_is_named(tmp_path: Path, name: str, what: str) -> None:
    path = tmp_path / name
    ODD[what](path)
    if name == "g.ckpt" and what == "is a folder":
        what = "holds no snapshot"
    with pytest.raises(UserError, match=what) as caught:
        READERS[name](path)
    assert str(caught.value).count(str(path)) == 1


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("path", ["no/such/{}", "n" * 300 + "{}", "nul\0{}"])
def test_a_name_that_no_file_has_is_one_sentence(name: str, path: str) -> None:
    with pytest.raises(UserError):
        READERS[name](Path(path.format(name)))


def test_sizes_and_rights(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert check_regular(path) == 5 and read_regular(path) == b"12345"
    (tmp_path / "link").symlink_to(path)
    assert read_regular(tmp_path / "link", 5) == b"12345"
    with pytest.raises(UserError, match="a: has 5 bytes; at most 4 bytes are read"):
        read_regular(path, 4)
    with pytest.raises(MissingFile, match="no such file"):
        check_regular(tmp_path / "b")
    with open(tmp_path / "sparse", "wb") as file:
        file.truncate(5 * 2**30)  # takes no room on the disk
    with pytest.raises(UserError, match="sparse: has 5 GiB; at most 4 GiB are read"):
        read_regular(tmp_path / "sparse")


def test_what_is_read_is_known_by_any_name(tmp_path: Path) -> None:
    (tmp_path / "a.npz").touch()
    (tmp_path / "link").symlink_to("a.npz")
    os.link(tmp_path / "a.npz", tmp_path / "hard")
    for name in ("a.npz", "link", "hard"):
        with pytest.raises(UserError, match="--out .*: would be written over what is read"):
            refuse_input("--out", tmp_path / name, [None, "nao", "a\0b", tmp_path / "missing", tmp_path / "a.npz"])
    refuse_input("--out", tmp_path / "new.npz", [tmp_path / "a.npz", tmp_path])
    with pytest.raises(UserError, match="--out .*a.npz: would be written over what is read"):  # a file of a package
        refuse_input("--out", tmp_path / "a.npz", [tmp_path])
