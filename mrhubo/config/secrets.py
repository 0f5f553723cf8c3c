"""Passwords in addresses: whatever is stored, logged or printed goes without them."""

from __future__ import annotations

import copy
import dataclasses
import re
from typing import Any, TypeVar
from urllib.parse import unquote

T = TypeVar("T")

HIDDEN = "***"
"""What stands in a password's place."""
_ADDRESS = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*)://(?P<rest>\S+)")
_SECRET_KEY = re.compile(r"pass|pwd|token|secret|credential|signature|^sig$|api_?key|access_?key|auth", re.I)
_PARAMETER = re.compile(r"([?&;])([^=&;]+)=([^&;#]*)")
_CONNECTION = re.compile(r"(pwd|password)\s*=", re.I)
"""In the value of a parameter that is a whole connection string."""


def redacted(text: str, *addresses: str) -> str:
    """The text with a placeholder for every password in an address.

    That is what stands before the last @ behind the first colon, what `?password=...` and its likes say, and, in an
    http address, a lone name before the @, which mostly is a token.

    Args:
        text: a sentence, or an address alone.
        addresses: their passwords are hidden in the text wherever they stand: errors quote parts of an address.
    """
    text = _ADDRESS.sub(lambda found: f"{found['scheme']}://{_split(found['scheme'], found['rest'])[0]}", text)
    for address in addresses:
        for found in _ADDRESS.finditer(address):
            for secret in _split(found["scheme"], found["rest"])[1]:
                for spelling in {secret, unquote(secret)}:
                    if len(spelling) > 3:  # shorter ones are part of ordinary words
                        text = text.replace(spelling, HIDDEN)
    return text


def has_hidden(address: str) -> bool:
    """Whether a password of an address was left out by `redacted`."""
    return any(HIDDEN in _split(found["scheme"], found["rest"])[1] for found in _ADDRESS.finditer(address))


def credentials(address: str) -> tuple[str, str, str]:
    """An address without its user, and user and password, decoded; both are empty unless it has both."""
    found = _ADDRESS.fullmatch(address)
    user, host = (None, "") if found is None else _user_and_host(found["rest"])
    name, _, password = (user or "").partition(":")
    if found is None or not name or not password:
        return address, "", ""
    return f"{found['scheme']}://{host}", unquote(name), unquote(password)


def without_secrets(config: T) -> T:
    """A copy of a config, for eyes other than the user's."""
    clean = copy.deepcopy(config)
    _clean(clean)
    return clean


def _clean(section: Any) -> None:
    for field in dataclasses.fields(section):
        value = getattr(section, field.name)
        if isinstance(value, str):
            setattr(section, field.name, redacted(value))
        elif dataclasses.is_dataclass(value):
            _clean(value)


def _split(scheme: str, rest: str) -> tuple[str, list[str]]:
    """What follows `://` without its secrets, and these."""
    secrets: list[str] = []

    def parameter(found: re.Match[str]) -> str:
        before, key, value = found.groups()
        if not value or not (value == HIDDEN or _SECRET_KEY.search(key) or _CONNECTION.search(unquote(value))):
            return found[0]
        secrets.append(value)
        return f"{before}{key}={HIDDEN}"

    user, host = _user_and_host(rest)
    host = _PARAMETER.sub(parameter, host)
    if user is None:
        return host, secrets
    name, colon, password = user.partition(":")
    if not colon and scheme.lower() in ("http", "https"):
        name, colon, password = "", "", name
    if not password:
        return f"{user}@{host}", secrets
    return f"{name}{colon}{HIDDEN}@{host}", [password, *secrets]


def _user_and_host(rest: str) -> tuple[str | None, str]:
    """User with password, and what follows: the password may hold @, and where it was not encoded / ? and # too."""
    authority = re.split(r"[/?#]", rest, maxsplit=1)[0]
    if "@" not in authority:
        port = authority.rpartition(":")[2]
        looks_like_a_host = ":" not in authority or port.isdecimal() or not port or authority.endswith("]")
        if looks_like_a_host or "@" not in rest:
            return None, rest
        authority = rest
    user = authority.rpartition("@")[0]
    return user, rest[len(user) + 1 :]
