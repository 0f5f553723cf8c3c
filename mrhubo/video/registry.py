"""Downloads from npm's registry, or from the mirror that the user's npm is set to.

npm's settings: https://docs.npmjs.com/cli/v10/using-npm/config. The environment and the user's `.npmrc` are read, and
no credentials: who needs them fetches by npm itself.
"""

from __future__ import annotations

import http.client
import os
import re
import urllib.error
import urllib.request
from pathlib import Path

from mrhubo.errors import Unreachable, UserError

_REGISTRY = "https://registry.npmjs.org"
_TIMEOUT = 30.0
"""Seconds that a server may be silent."""
_PIECE = 2**20
_MAX_SETTINGS = 2**20


def registry_url(package: str) -> str:
    """Where npm would look for a package, without a slash at the end: the registry of its scope, else the default one,
    each by the environment (`npm_config_registry`) or the user's `.npmrc`.

    Raises:
        UserError: what is set is no address of a web server.
    """
    scope = package.partition("/")[0]
    environment = {name.lower(): value for name, value in os.environ.items()}
    file = _user_settings(environment)
    for key in (f"{scope}:registry", "registry"):
        url = environment.get(f"npm_config_{key}") or file.get(key)
        if url and not re.match(r"https?://[^/\s]+", url):
            raise UserError(f"npm's setting {key} is '{url}'; expected an address that begins with https://")
        if url:
            return url.rstrip("/")
    return _REGISTRY


def _user_settings(environment: dict[str, str]) -> dict[str, str]:
    """What the user's `.npmrc` says, as far as it can be read."""
    path = Path(environment.get("npm_config_userconfig") or os.path.expanduser("~/.npmrc"))
    try:
        with open(path, encoding="utf-8", errors="replace") as handle:
            lines = handle.read(_MAX_SETTINGS).splitlines()
    except OSError:
        return {}
    pairs = (line.partition("=")[::2] for line in lines if not line.lstrip().startswith(("#", ";")))
    return {key.strip(): os.path.expandvars(value.strip().strip("\"'")) for key, value in pairs}


def download(url: str, max_bytes: int) -> bytes:
    """The bytes at an address.

    Raises:
        Unreachable: the server does not answer, refuses, or breaks off.
        UserError: there is nothing of that name, or it is larger than `max_bytes`.
    """
    advice = "; without a network, name the archive by --from"
    pieces, size = [], 0
    try:
        with urllib.request.urlopen(url, timeout=_TIMEOUT) as answer:
            while piece := answer.read(_PIECE):
                pieces.append(piece)
                size += len(piece)
                if size > max_bytes:
                    raise UserError(f"{url}: is larger than {max_bytes:,} bytes")
            expected = answer.headers.get("Content-Length")
    except urllib.error.HTTPError as error:
        raise Unreachable(f"{url}: the registry answers {error.code} {error.reason}{advice}") from error
    except (OSError, http.client.HTTPException) as error:
        reason = getattr(error, "reason", None) or error
        raise Unreachable(f"{url}: cannot be fetched: {reason}{advice}") from error
    if expected is not None and expected.isdigit() and int(expected) != size:
        raise Unreachable(f"{url}: broke off after {size:,} of {int(expected):,} bytes{advice}")
    return b"".join(pieces)
