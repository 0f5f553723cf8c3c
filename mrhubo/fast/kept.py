"""Whether numba has kept what it compiled of this version, told without importing numba, which takes as long as
answering a short motion.

A note in the user's cache names numba's files. It is written once all that a motion needs has been compiled, and counts
as long as those files are there and neither mrhubo nor numba, Python or the machine has changed.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib.metadata
import importlib.util
import json
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import xxhash

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.cache import keep_text, kept_text, user_cache

_SOURCES = ("compiled", "plain")
_FOLDER = "NUMBA_CACHE_DIR"
"""The environment's variable for the folder in which numba keeps what it compiles."""
MOTIONS, FRAMES, STANDING = "motions", "frames", "frames of who stands"
"""Kinds of work, of which each compiles its own: whole motions, frames as they come, those of a robot with legs too."""
_LONGEST = 10_000_000
"""Bytes of a note that is one of ours."""
_MARK = "mrhubo-compiled.txt"
"""Beside numba's files: which version of the sources they are of."""


@cache
def checksum() -> str:
    """Of all that is compiled, and of what it takes constants from."""
    digest, here = xxhash.xxh3_64(), Path(__file__).parent
    sources = [path for folder in _SOURCES for path in sorted((here / folder).glob("*.py"))]
    # The kinds of steps of one and the order of the other's arrays are constants of what is compiled.
    for path in (*sources, here / "sections.py", here / "leg_section.py"):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def numba_is_there() -> bool:
    """Whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


def is_kept(universal: bool = False, work: str = MOTIONS) -> bool:
    """Whether the compiled form starts some work without compiling, that of the universal network or that of others."""
    try:
        files = json.loads(kept_text(_note(universal, work), _LONGEST) or "[]")
        return bool(files) and all(os.path.isfile(file) for file in files)
    except (OSError, ValueError, TypeError, importlib.metadata.PackageNotFoundError):
        return False


def note_kept(folders: Iterable[str], universal: bool = False, work: str = MOTIONS) -> None:
    """Notes that all that some work needs has been compiled, and kept in numba's folders; where nothing can be written,
    nothing is noted.
    """
    files = [str(file) for folder in sorted(set(folders)) for file in sorted(Path(folder).glob("*kernels.*.nbi"))]
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        keep_text(_note(universal, work), json.dumps(files))


def make_room() -> None:
    """Gives numba a folder that ends with this process where it can keep nothing: it fails without one, and where the
    user has no home it makes one called `~`. To be called before numba is imported.
    """
    if os.environ.get(_FOLDER) or _takes_files(Path(__file__).parent / "compiled" / "__pycache__"):
        return
    with contextlib.suppress(UserError):
        if _takes_files(user_cache().with_name("numba")):
            return
    os.environ[_FOLDER] = folder = tempfile.mkdtemp(prefix="mrhubo-")
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder
    process = os.getpid()
    atexit.register(lambda: os.getpid() == process and shutil.rmtree(folder, ignore_errors=True))


def _takes_files(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made for that; as numba finds it out."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def drop_others(folder: str | None) -> None:
    """Deletes what numba has kept in a folder of other versions of the sources: numba tells them from this one's, but
    cannot read a list of them in which a type is named that has since moved, and would keep them for ever.
    """
    if folder is None:
        return
    mark, told = Path(folder) / _MARK, checksum()
    with contextlib.suppress(OSError, UserError):
        if not mark.is_file() or mark.read_text() != told:
            for file in [*Path(folder).glob("*kernels.*.nbi"), *Path(folder).glob("*kernels.*.nbc")]:
                file.unlink(missing_ok=True)
            Path(folder).mkdir(parents=True, exist_ok=True)
            with atomic_path(mark) as half:
                half.write_text(told)


def _note(universal: bool, work: str) -> str:
    """The name of the note in the user's cache."""
    told = (universal, work, checksum(), importlib.metadata.version("numba"), sys.version, sys.prefix, platform.node())
    return f"compiled-{xxhash.xxh3_64(repr(told).encode()).hexdigest()}.json"
