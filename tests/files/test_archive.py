"""What an archive unpacks to is bounded before anything is unpacked."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrhubo.body import VPoser, open_skeleton
from mrhubo.errors import UserError
from mrhubo.motion import read_motion
from tests.files.bounded import bounded


def bomb(path: Path, member: str, header: bytes, size: int, method: int = zipfile.ZIP_DEFLATED) -> None:
    """An archive whose one member is a header and `size` zero bytes."""
    zeros = bytes(2**20)
    with zipfile.ZipFile(path, "w", method) as archive, archive.open(member, "w", force_zip64=True) as file:
        file.write(header)
        for _ in range(size // len(zeros)):
            file.write(zeros)


def npy(shape: tuple[int, ...]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return buffer.getvalue()


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    bomb(tmp_path / "a.npz", "pose_body.npy", npy((1_200_000, 63)), 300 * 2**20)
    assert (tmp_path / "a.npz").stat().st_size < 400_000
    (tmp_path / "a.ckpt").symlink_to(tmp_path / "a.npz")
    for path, read in (("a.npz", read_motion), ("a.npz", open_skeleton), ("a.ckpt", VPoser.open)):
        with bounded(20, 2), pytest.raises(UserError, match=r"would unpack to [0-9,]+ times its size"):
            read(tmp_path / path)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_methods_that_cannot_be_bounded_are_not_read(tmp_path: Path, method: int) -> None:
    bomb(tmp_path / "a.npz", "pose_body.npy", npy((4_000, 63)), 2**20, method)
    with bounded(20, 2), pytest.raises(UserError, match="'pose_body' cannot be read"):
        read_motion(tmp_path / "a.npz")


@pytest.mark.parametrize("name", ["a.npz", "a.pt"])
def test_a_member_that_claims_more_than_the_file_has_asks_for_no_memory(name: str, tmp_path: Path) -> None:
    member = "damaged/data.pkl" if name == "a.pt" else "pose_body.npy"
    with zipfile.ZipFile(tmp_path / name, "w") as archive:
        archive.writestr(member, npy((2, 63)) + bytes(504))
    content = bytearray((tmp_path / name).read_bytes())
    place = content.rindex(b"PK\x01\x02") + 20  # of its size as it is packed
    content[place : place + 4] = (600 * 2**20).to_bytes(4, "little")
    (tmp_path / name).write_bytes(content)
    with bounded(20, 2), pytest.raises(UserError, match=name):
        read_motion(tmp_path / name)


def test_a_table_of_contents_without_end_is_not_read(tmp_path: Path) -> None:
    """Some fifty bytes a name in the file, and some hundreds in the memory."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("n", b"")
    content, count = buffer.getvalue(), 200_000
    start, end = content.index(b"PK\x01\x02"), content.index(b"PK\x05\x06")
    table = count * content[start:end]
    last = content[end : end + 8] + b"\xff\xff\xff\xff" + len(table).to_bytes(4, "little") + content[end + 16 :]
    (tmp_path / "a.npz").write_bytes(content[:start] + table + last)
    with bounded(20, 2), pytest.raises(UserError, match="is not an .npz file"):
        read_motion(tmp_path / "a.npz")


def test_a_long_still_motion_is_no_bomb(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", pose_body=np.zeros((66_000, 63), np.float32), mocap_frame_rate=30.0)
    assert len(read_motion(tmp_path / "a.npz")) == 66_000
