"""The models that find a body in a picture: where they come from, and where they are kept.

They are in the npm package @mediapipe/pose, whose authors, at Google, license it under Apache 2.0
(https://www.npmjs.com/package/@mediapipe/pose/v/0.5.1675469404): three networks for landmarks, a detector, and what
runs them in a browser. None of it is part of mrhubo: it is fetched once, and checked against that version's digest.
"""

from __future__ import annotations

import base64
import hashlib
import io
import os
import shutil
import tarfile
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from mrhubo.errors import UserError, listed
from mrhubo.files.cache import user_cache
from mrhubo.files.regular import read_regular
from mrhubo.video.registry import download, registry_url

PACKAGE, VERSION = "@mediapipe/pose", "0.5.1675469404"
INTEGRITY = "sha512-DFZsNWTsSphRIZppnUCuunzBiHP2FdJXR9ehc7mMi4KG+oPaOH0Em3d6kr7Py+TSyTXC1doH88KcF28k2sBxsQ=="
"""SHA-512 of the package's archive, as npm states it (`npm view @mediapipe/pose@0.5.1675469404 dist.integrity`)."""
LICENSE = "Apache-2.0"
MODELS = ("lite", "full", "heavy")
"""The networks for landmarks, the fastest first."""
DETECTOR = "pose_solution_packed_assets.data"
"""The detector: a model of TensorFlow Lite, whatever its ending says."""
FILES = (
    *(f"pose_landmark_{model}.tflite" for model in MODELS),
    DETECTOR,
    "pose.js",
    "pose_solution_packed_assets_loader.js",
    "pose_solution_simd_wasm_bin.data",
    "pose_solution_simd_wasm_bin.js",
    "pose_solution_simd_wasm_bin.wasm",
    "pose_solution_wasm_bin.js",
    "pose_solution_wasm_bin.wasm",
    "pose_web.binarypb",
)
"""What is unpacked; the detector and what follows it run in a browser."""
FOLDER_VARIABLE = "MRHUBO_POSE_MODELS"
_MAX_ARCHIVE = 64 * 2**20
_MAX_FILE = 64 * 2**20
_MAX_MEMBERS = 1_000


def models_folder() -> Path:
    """Where the models are kept: the folder that the environment names, else one in the user's cache."""
    if named := os.environ.get(FOLDER_VARIABLE):
        return Path(os.path.expanduser(named))  # of an unknown user it stays as it is, and is then not found
    return user_cache() / "pose" / VERSION


def find_models() -> Path:
    """The folder with all of `FILES`.

    Raises:
        UserError: they have not been fetched; says how.
    """
    folder = models_folder()
    if not is_set_up(folder):
        raise UserError(
            f"the models that find a body in pictures are not in {folder}: fetch them by `mrhubo models` (40 MB, once)"
        )
    return folder


def is_set_up(folder: Path) -> bool:
    """Whether a folder holds all of `FILES`."""
    return all((folder / name).is_file() for name in FILES)


def set_up(
    archive: Path | None = None,
    folder: Path | None = None,
    tell: Callable[[str], None] = print,
    integrity: str = INTEGRITY,
) -> Path:
    """Fetches the models, unless they are there, and gives their folder.

    The folder appears with all files or not at all.

    Args:
        archive: the package's archive, as `npm pack @mediapipe/pose@0.5.1675469404` saves it; None: it is downloaded
            from npm's registry.
        folder: where they go; None: `models_folder()`.
        tell: given a sentence before the download.
        integrity: digest that the archive must have, in the form of npm.

    Raises:
        Unreachable: the registry does not answer.
        UserError: the archive is missing, is another one, is damaged or hostile, or the folder cannot be written.
    """
    folder = models_folder() if folder is None else folder
    if archive is None and is_set_up(folder):
        return folder
    if archive is None:
        url = f"{registry_url(PACKAGE)}/{PACKAGE}/-/{PACKAGE.rpartition('/')[2]}-{VERSION}.tgz"
        tell(f"fetching {PACKAGE} {VERSION} ({LICENSE}, 40 MB) from {url}")
        where, data = url, download(url, _MAX_ARCHIVE)
    else:
        where, data = str(archive), read_regular(archive, _MAX_ARCHIVE)
    found = "sha512-" + base64.b64encode(hashlib.sha512(data).digest()).decode()
    if found != integrity:
        raise UserError(
            f"{where}: is not the archive of {PACKAGE} {VERSION}: its digest is {found}, expected {integrity}"
        )
    _put(_unpacked(where, data), folder)
    return folder


def _unpacked(where: str, data: bytes) -> dict[str, bytes]:
    """The bytes of each of `FILES`. Members are found by their whole name and read into memory, so that no name, link
    or permission in an archive has any say in what is written where.
    """
    wanted, found = {f"package/{name}": name for name in FILES}, dict[str, bytes]()
    try:
        with tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as archive:
            for count, member in enumerate(archive):
                if count >= _MAX_MEMBERS:
                    raise UserError(f"{where}: has more than {_MAX_MEMBERS:,} members")
                name = wanted.get(member.name)
                if name is None or not member.isreg():
                    continue
                if member.size > _MAX_FILE:
                    raise UserError(f"{where}: {member.name} has {member.size:,} bytes; at most {_MAX_FILE:,} are read")
                file = archive.extractfile(member)
                found[name] = b"" if file is None else file.read()
    except (tarfile.TarError, EOFError, OSError, ValueError) as error:
        raise UserError(f"{where}: is no whole .tgz archive: {error}") from error
    missing = [name for name in FILES if name not in found]
    if missing:
        raise UserError(f"{where}: has no {listed(missing)}")
    return found


def _put(files: Mapping[str, bytes], folder: Path) -> None:
    """Writes the files to a new folder, which then takes its place; whoever was faster with the same is right too."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            for name, data in files.items():
                with open(temporary / name, "wb") as handle:
                    handle.write(data)
                    handle.flush()
                    os.fsync(handle.fileno())
            temporary.chmod(0o755)
            _replace(temporary, folder)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _replace(temporary: Path, folder: Path) -> None:
    """Puts a whole folder in the place of none, of an empty one, or of one that lacks files of ours.

    Raises:
        UserError: the folder holds what is not ours.
    """
    if folder.is_dir():
        others = sorted({path.name for path in folder.iterdir()} - set(FILES))
        if others:
            raise UserError(f"{folder}: holds other files ({listed(others[:5])}); name a folder for the models alone")
        for path in temporary.iterdir():
            os.replace(path, folder / path.name)
        return
    os.replace(temporary, folder)
