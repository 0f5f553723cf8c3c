"""What a file is, by its first bytes: enough to choose a reader, or to say what it is that nobody reads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.archive import open_archive
from mrhubo.files.packed import is_packed
from mrhubo.files.regular import open_regular

START = 65_536
"""Bytes that are looked at."""
_ZIP = b"PK\x03\x04"
_MAGIC: tuple[tuple[bytes, str], ...] = (
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\x89PNG", "a picture (PNG)"),
    (b"\xff\xd8\xff", "a picture (JPEG)"),
    (b"GIF8", "a picture (GIF)"),
    (b"\x89HDF", "an HDF5 file"),
    (b"%PDF", "a PDF"),
    (b"MATLAB", "a MATLAB file"),
    (b"PAR1", "a Parquet file"),
    (b"\x89MCAP", "an MCAP recording"),
    (b"#ROSBAG", "a ROS bag"),
    (b"SQLite format 3", "an SQLite database"),
    (b"\x7fELF", "a program"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"v https://git-lfs", "a pointer of Git LFS, in place of the file itself"),
    (b"version https://git-lfs", "a pointer of Git LFS, in place of the file itself"),
)
_MAX_ARCHIVE = 8 * 2**30


class NoMotion(UserError):
    """A file that is not damaged, but no human motion that anybody here reads."""


@dataclass(frozen=True)
class Content:
    """The beginning of a file."""

    path: Path
    start: bytes
    """Its first bytes, at most `START`."""

    @classmethod
    def open(cls, path: Path) -> Content:
        """Looks at a file.

        Raises:
            UserError: it is no regular file, empty, or may not be read.
        """
        with open_regular(path) as handle:
            try:
                start = handle.read(START)
            except OSError as error:
                raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
        if not start:
            raise UserError(f"{path}: is empty; was it copied or downloaded to its end?")
        return cls(path, start)

    @cached_property
    def text(self) -> str | None:
        """The beginning of a text file; None where it is none."""
        if b"\0" in self.start:
            return None
        try:
            # the last letter may be cut in the middle
            return self.start.decode("utf-8-sig", "strict" if len(self.start) < START else "ignore")
        except UnicodeDecodeError:
            decoded = self.start.decode("latin1")  # names of joints with umlauts, from old programs
            return decoded if all(letter.isprintable() or letter.isspace() for letter in decoded[:200]) else None

    @property
    def is_zip(self) -> bool:
        """Whether it is a zip archive, perhaps a damaged one."""
        return self.start.startswith(_ZIP)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of a zip archive's members; none where it is no archive, or its table of contents is damaged."""
        if not self.is_zip:
            return ()
        try:
            with open_archive(self.path, "is damaged", _MAX_ARCHIVE) as archive:
                return tuple(archive.namelist())
        except UserError:
            return ()

    @property
    def is_torch(self) -> bool:
        """Whether it is a zip archive that `torch.save` wrote, perhaps a damaged one."""
        size = int.from_bytes(self.start[26:28], "little")
        begins = self.start[30 : 30 + size].endswith((b"/data.pkl", b"/.format_version"))
        return self.is_zip and (begins or any(name.endswith("/data.pkl") for name in self.names))

    @property
    def is_npy(self) -> bool:
        """Whether it is a single NumPy array."""
        return self.start.startswith(b"\x93NUMPY")

    @property
    def arrays(self) -> frozenset[str]:
        """The names of an .npz file's arrays; none where it is no such file."""
        return frozenset(name.removesuffix(".npy") for name in self.names if name.endswith(".npy"))

    @property
    def described(self) -> str:
        """What it is, as far as can be told, for a sentence: 'is ...' fits before it."""
        if is_packed(self.start):
            return "a packed pickle"
        for magic, what in _MAGIC:
            if self.start.startswith(magic):
                return what
        if self.start[4:8] == b"ftyp":
            return "a sound or a picture (MPEG-4)"
        if self.start[:4] == b"RIFF":
            return "a sound or a picture (RIFF)"
        if self.is_torch:
            return "a PyTorch file"
        if self.arrays:
            return f"an .npz file with {shortened(listed(self.arrays), 200)}"
        if self.is_zip:
            return f"a zip archive of {shortened(listed(self.names), 200)}" if self.names else "a damaged zip archive"
        if self.is_npy:
            return "a single NumPy array (.npy)"
        if self.start[:1] == b"\x80" and self.start[1:2] <= b"\x05":
            return "a Python pickle"
        if self.text is not None:
            line = next((line for line in self.text.splitlines() if line.strip()), "")
            return f"text that begins with '{shortened(line.strip(), 60)}'"
        return "of no kind that is known here"
