"""The XML of a URDF file: read within bounds, without entities and network, and told apart from what is taken for one.

A URDF may come from anywhere: what it makes the parser do is bounded before it is parsed, unpacked or not.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError, nearest

_MAX_BYTES = 50_000_000
"""Of the text, once it is unpacked."""
_MAX_MARKS = 3_000_000
"""Of elements and attributes together: the tree in memory is many times larger than the text."""
_XACRO = "this is a xacro file, from which a URDF is made; expand it, `xacro {name} > robot.urdf`, and name the result"
_NO_URDF_ROOTS = {
    "mujoco": "an MJCF model of MuJoCo",
    "mujocoinclude": "a part of an MJCF model of MuJoCo",
    "sdf": "an SDF model of Gazebo",
    "gazebo": "an SDF model of Gazebo",
    "COLLADA": "a COLLADA mesh",
    "html": "a web page",
}
_NO_XML = {
    b"version https://git-lfs": "is a pointer of Git LFS, the file itself was not fetched: `git lfs pull`",
    b"PK\x03\x04": "is a zip archive; unpack it and name the URDF in it",
    b"<!doctype html": "is a web page; save the file itself (on GitHub: Raw)",
    b"<html": "is a web page; save the file itself (on GitHub: Raw)",
}
_LISTS = ("xyz", "rpy", "size", "scale")
"""Attributes of several numbers."""
_STRANGE_VERSION = re.compile(rb"""\A(\s*<\?xml\s+version\s*=\s*["'])(?!1\.0)[^"']*""")
"""Simulators write, and take, a version 0.0 of XML, and a zero at the end of a file."""
_UNDEFINED_PREFIX = etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE


@dataclass(frozen=True)
class Document:
    """A file whose root element is <robot>; elements and attributes have no namespaces any more."""

    path: Path
    robot: etree._Element
    lines_before: int
    """Empty lines above the XML, which the parser did not see."""

    def place(self, element: etree._Element) -> str:
        """``robot.urdf: toy.urdf, line 12``, for the beginning of a sentence."""
        return f"robot.urdf: {self.path}, {self.line(element)}"

    def line(self, element: etree._Element) -> str:
        """``line 12``."""
        return f"line {(element.sourceline or 1) + self.lines_before}"


def read_document(path: Path, text: bytes | None = None) -> Document:
    """The XML of a URDF file, plain or packed by gzip; of its text (`read_text`), where that has been read already.

    Raises:
        UserError: the file is missing, too large, or no URDF; says what it is where that can be told.
    """
    text = read_text(path) if text is None else text
    start = text.find(b"<")
    lines_before = 0
    if text[:start].isspace() and text[start : start + 5] == b"<?xml":
        lines_before, text = text.count(b"\n", 0, start), text[start:]
    robot = _parse(path, text)
    _remove_namespaces(path, robot)
    _separate(robot)
    if robot.tag != "robot":
        raise UserError(f"robot.urdf: {path} is no URDF: {_root(robot.tag)}")
    if robot.find("link") is None:
        other = robot.find("disable_collisions") is not None or robot.find("group") is not None
        hint = (
            "an SRDF of MoveIt, which belongs to a URDF; name that" if other else "a robot is made of links and joints"
        )
        raise UserError(f"robot.urdf: {path} has no <link>: {hint}")
    return Document(path, robot, lines_before)


def read_text(path: Path) -> bytes:
    """The text of a URDF file, plain or packed by gzip.

    Raises:
        UserError: the file is missing, cannot be read, or is too large.
    """
    try:
        if not path.exists():
            raise UserError(f"robot.urdf: {path} does not exist; name a URDF file, relative to the YAML")
        if path.is_dir():
            raise UserError(f"robot.urdf: {path} is a folder; name the URDF file in it")
        if not path.is_file():
            raise UserError(f"robot.urdf: {path} is no regular file, and others are not read")
        with path.open("rb") as file:
            text = file.read(_MAX_BYTES + 1)
        packed = text.startswith(b"\x1f\x8b")
        if packed:
            with gzip.open(io.BytesIO(text)) as file:
                text = file.read(_MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"robot.urdf: {path} cannot be read: {reason}") from error
    if len(text) > _MAX_BYTES:
        unpacked = " unpacked" if packed else ""
        raise UserError(
            f"robot.urdf: {path} has more than {_MAX_BYTES:,} bytes{unpacked}, which is the most that is read"
        )
    if text.count(b"<") + text.count(b"=") > _MAX_MARKS:
        raise UserError(
            f"robot.urdf: {path} has more than {_MAX_MARKS:,} elements and attributes, which is the most that is read"
        )
    return text


def _parse(path: Path, text: bytes) -> etree._Element:
    options = {"resolve_entities": False, "no_network": True, "remove_comments": True, "remove_pis": True}
    parser = etree.XMLParser(**options)
    try:
        return etree.fromstring(text, parser)
    except etree.XMLSyntaxError as error:
        for beginning, what in _NO_XML.items():
            if text[:1000].lstrip().lower().startswith(beginning.lower()):
                raise UserError(f"robot.urdf: {path} {what}") from error
        # Simulators' tags whose prefix nobody has explained, which ROS's parser takes too.
        if len(parser.error_log) and all(entry.type == _UNDEFINED_PREFIX for entry in parser.error_log):
            robot = etree.fromstring(text, etree.XMLParser(**options, recover=True))
            if robot is not None:
                return robot
        if (usual := _STRANGE_VERSION.sub(rb"\g<1>1.0", text.rstrip(b"\0"))) != text:
            return _parse(path, usual)
        if (as_meant := _as_latin(text)) is not None:
            return _parse(path, as_meant)
        reason = "it is empty" if not text.strip() else error
        raise UserError(f"robot.urdf: {path} is no well-formed XML: {reason}") from error


def _as_latin(text: bytes) -> bytes | None:
    """UTF-8 in place of Latin letters, such as those of an author's name; None if the text is UTF-8, or neither."""
    try:
        text.decode()
    except UnicodeDecodeError:
        return None if b"\0" in text else text.decode("latin-1").encode()
    return None


def _remove_namespaces(path: Path, robot: etree._Element) -> None:
    """Leaves the names of elements alone where they have no prefix, and takes away those of foreign namespaces: they
    belong to simulators. A file with xacro's is no URDF yet.
    """
    own = _split(robot)[0]
    foreign = []
    for element in robot.iter(etree.Element):
        namespace, prefix, name = _split(element)
        if prefix == "xacro" or namespace.endswith("/xacro"):
            raise UserError(f"robot.urdf: {path}: {_XACRO.format(name=path.name)}")
        if prefix and namespace != own:
            foreign.append(element)
        elif namespace:
            element.tag = name
    for element in foreign:
        if element.getparent() is not None:
            element.getparent().remove(element)


def _separate(robot: etree._Element) -> None:
    """Puts blanks for commas between the three numbers of a list, as simulators read them too. Decimal commas would
    give another count: such a list stays as it is, and is told as any other wrong one.
    """
    for element in robot.iter("origin", "axis", "box", "mesh"):
        for word in _LISTS:
            text = element.get(word, "")
            if "," in text and len(text.replace(",", " ").split()) == 3:
                element.set(word, text.replace(",", " "))


def _split(element: etree._Element) -> tuple[str, str, str]:
    """Namespace, prefix and name of an element, ``""`` for none; a prefix that nobody explains is part of the tag."""
    namespace, _, name = element.tag.rpartition("}")
    prefix, _, name = name.rpartition(":")
    return namespace.removeprefix("{"), element.prefix or prefix, name


def _root(tag: str) -> str:
    if tag in _NO_URDF_ROOTS:
        convert = "`mrhubo describe` makes one of it" if tag == "mujoco" else "convert it to one"
        return f"it is {_NO_URDF_ROOTS[tag]} (its root element is <{tag}>); name the robot's URDF, or {convert}"
    near = ", not <robot>" if nearest(tag, ["robot"]) is None else "; write it <robot>"
    return f"its root element is <{tag}>{near}"
