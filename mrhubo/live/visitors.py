"""Which requests of browsers and other programs a live server answers.

A page of a stranger, open in a browser on this machine, can open WebSockets to 127.0.0.1; the browser then tells the
page's origin, which is not ours. A stranger's domain name can be made to mean 127.0.0.1 (DNS rebinding); its page then
has our origin, but the browser tells that name as Host.
"""

from __future__ import annotations

import ipaddress
import mimetypes
import socket
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qs, unquote, urlsplit

from mrhubo.live.endpoints import Endpoint, token_fits
from mrhubo.video.models import FILES, models_folder

SOCKET_PATH = "/live"
ROBOT_PATH = "/robot.json"
POSE_PATH = "/pose/"
_TYPES = {".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm", ".html": "text/html",
          ".css": "text/css", ".json": "application/json", ".tflite": "application/octet-stream"}  # fmt: skip
SECURITY_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval';"
    " style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src 'self' data: blob:;"
    " media-src 'self' blob:; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True)
class Visitors:
    """Who may come to one endpoint."""

    endpoint: Endpoint
    token: str | None
    encrypted: bool = False
    """Whether the endpoint itself is one of https; if not, a proxy before it may be."""

    def fault(self, path: str, host: str | None, origin: str | None, given: str | None = None) -> str | None:
        """The kind of fault for which a request is refused; None: it is answered.

        Args:
            path: with its query.
            host: the header Host.
            origin: the header Origin, which browsers send.
            given: the token in the header Authorization, without "Bearer ".
        """
        try:
            parts = urlsplit(path)
        except ValueError:
            return "malformed"
        if host is None or not self._is_ours(host):
            return "host"
        if origin is not None and origin not in self._origins(host):
            return "origin"
        if parts.path not in (SOCKET_PATH, ROBOT_PATH):
            return None
        told = parse_qs(parts.query).get("token", [given])
        return None if token_fits(self.token, told[0]) else "token"

    def _origins(self, host: str) -> tuple[str, ...]:
        """What our own page's origin may be."""
        return (f"https://{host}",) if self.encrypted else (f"http://{host}", f"https://{host}")

    def _is_ours(self, host: str) -> bool:
        """Whether a Host names this machine by an address or a name of its own, and not by a stranger's."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port
        except ValueError:
            return False
        if port != self.endpoint.port and not (port is None and self.endpoint.port in (80, 443)):
            return False
        if name == "localhost":
            return True
        try:
            return ipaddress.ip_address(name).is_loopback or not self.endpoint.is_loopback
        except ValueError:
            own = socket.gethostname().lower()
            names = {self.endpoint.host.lower(), own, f"{own}.local"}
            return not self.endpoint.is_loopback and name in names


def find_model(path: str) -> tuple[Path, str] | None:
    """The file of the models that find a body in pictures which a path names, and its type; None where it names none,
    or they have not been fetched (`mrhubo models`).
    """
    name = urlsplit(path).path
    if not name.startswith(POSE_PATH) or name.removeprefix(POSE_PATH) not in FILES:
        return None
    return find_file(models_folder(), name.removeprefix(POSE_PATH))


def find_file(folder: Path, path: str) -> tuple[Path, str] | None:
    """The file of a page that a path names, and its type; None where there is none inside the folder."""
    name = unquote(urlsplit(path).path).lstrip("/") or "index.html"
    if "\0" in name or any(part.startswith(".") for part in name.split("/")):
        return None
    folder = folder.resolve()
    file = (folder / name).resolve()
    try:
        if not file.is_relative_to(folder) or not file.is_file():
            return None
    except OSError:  # a name that is too long
        return None
    kind = _TYPES.get(file.suffix.lower()) or mimetypes.guess_type(file.name)[0] or "application/octet-stream"
    return file, f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
