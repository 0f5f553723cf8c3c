"""Names that anybody gave (joints, clips, robots), as MLflow takes them in keys, artifacts and models.

A letter that MLflow refuses becomes its number: `neck(1)` is `neck_x28_1_x29_`, `/l/elbow` is `_x2F_l_x2F_elbow`, as in
Office Open XML (ST_Xstring, ECMA-376). `unescaped` gives the name back; only what is longer than MLflow or a file
system takes is cut, and told apart by a checksum.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from mrhubo.config import fingerprint
from mrhubo.config.secrets import redacted
from mrhubo.errors import UserError, shortened

_REFUSED = r"[^\w .-]"
_LOOKS_ESCAPED = re.compile(rf"_(?=x[0-9A-F]*(?:_|{_REFUSED}))")
_ESCAPED = re.compile(r"_x([0-9A-F]+)_")
_EMPTY = "_x_"
_LONGEST = 200
"""Bytes of an escaped name; keys and file names have up to 50 more."""
_VALUE = 250
"""Letters of a parameter's value, as old servers take it."""
_SHORT = 64


def escaped(name: str) -> str:
    """One name, for a part of a key between slashes or of a file name; other letters, digits and `_ .-` stay."""
    text = re.sub(_REFUSED, lambda found: _number(found[0]), _LOOKS_ESCAPED.sub(_number("_"), name))
    if set(text) <= {"."}:  # nothing, or a folder that is not meant
        text = text.replace(".", _number(".")) or _EMPTY
    if len(text.encode()) <= _LONGEST:
        return text
    start = text.encode()[: _LONGEST - 17].decode(errors="ignore")
    return f"{start}-{fingerprint(name.encode('utf-8', 'backslashreplace').hex())}"


def unescaped(text: str) -> str:
    """The name that `escaped` was given, if it was not cut."""
    return "" if text == _EMPTY else _ESCAPED.sub(lambda found: chr(int(found[1], 16)), text)


def key(path: str) -> str:
    """Each part of a path such as `test/<clip>/link_cm` escaped."""
    return "/".join(map(escaped, path.split("/")))


def model_name(robot: str) -> str:
    """Name of a robot's registered model; models have no dots either."""
    return f"mrhubo-{escaped(robot)}".replace(".", _number("."))


def parameters(plain: Mapping[str, Any]) -> dict[str, str]:
    """Nested plain values as parameters: `robot/ranges/<joint>`; long values are cut, passwords left out."""
    return {name: writable(redacted(str(value))[:_VALUE]) for name, value in _flat(plain, ())}


def writable(text: str) -> str:
    """Text that a database takes: what is no letter, as in a file name that is not UTF-8, becomes its number."""
    return text.encode("utf-8", "backslashreplace").decode()


def _flat(plain: Mapping[str, Any], above: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    for name, value in plain.items():
        parts = (*above, escaped(str(name)))
        if isinstance(value, Mapping):
            yield from _flat(value, parts)
        else:
            yield "/".join(parts), value


def check_name(setting: str, name: str) -> None:
    """Refuses what cannot be part of a folder's name.

    Raises:
        UserError: the name is empty, long, begins with a dot, or holds a slash, a backslash, a quotation mark, or a
            letter that cannot be printed.
    """
    faults = {
        "is empty": not name.strip(),
        f"is longer than {_SHORT} bytes": len(name.encode("utf-8", "surrogateescape")) > _SHORT,
        "begins with a dot": name.startswith("."),
        "holds a slash": "/" in name or "\\" in name,
        "holds a quotation mark": '"' in name,
        "holds a letter that cannot be printed": not name.isprintable(),
    }
    found = [fault for fault, there in faults.items() if there]
    if found:
        shown = shortened(name, _SHORT)
        raise UserError(f"{setting}: '{shown}' {found[0]}; folders are named after it, so take a short plain name")


def _number(letter: str) -> str:
    return f"_x{ord(letter):X}_"
