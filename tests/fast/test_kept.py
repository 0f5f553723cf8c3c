"""What numba kept of other versions goes; what it kept of this one, and what is not ours, stays."""

from __future__ import annotations

from pathlib import Path

from mrhubo.fast.kept import checksum, drop_others


def test_files_of_other_versions_go(tmp_path: Path) -> None:
    ours = [tmp_path / f"kernels.make_kernels.locals.look-1.py311.{ending}" for ending in ("nbi", "1.nbc")]
    other = tmp_path / "robot.place-1.py311.nbi"
    for known in (None, "another version", checksum()):
        for file in (*ours, other):
            file.write_bytes(b"x")
        if known is not None:
            (tmp_path / "mrhubo-compiled.txt").write_text(known)
        drop_others(str(tmp_path))
        assert [file.exists() for file in ours] == [known == checksum()] * 2 and other.exists()
        assert (tmp_path / "mrhubo-compiled.txt").read_text() == checksum()


def test_a_folder_that_is_not_there_or_cannot_be_written_is_left(tmp_path: Path) -> None:
    drop_others(None)
    (tmp_path / "file").write_text("no folder")
    drop_others(str(tmp_path / "file"))
    drop_others(str(tmp_path / "new"))
    assert (tmp_path / "new" / "mrhubo-compiled.txt").read_text() == checksum()
