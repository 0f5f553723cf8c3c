"""Archives as npm makes them, with whatever a test wants in them."""

from __future__ import annotations

import base64
import hashlib
import io
import tarfile
from collections.abc import Mapping
from pathlib import Path

from mrhubo.video.models import FILES

WHOLE = {f"package/{name}": name.encode() for name in FILES}


def write_archive(path: Path, members: Mapping[str, bytes], links: Mapping[str, str] | None = None) -> str:
    """Writes a .tgz of files and symbolic links; returns its digest in the form of npm."""
    with tarfile.open(path, "w:gz") as archive:
        for name, data in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
        for name, target in (links or {}).items():
            member = tarfile.TarInfo(name)
            member.type, member.linkname = tarfile.SYMTYPE, target
            archive.addfile(member)
    return digest(path.read_bytes())


def digest(data: bytes) -> str:
    return "sha512-" + base64.b64encode(hashlib.sha512(data).digest()).decode()
