"""YAML text -> a tree of nodes that remember where they were written, and how.

YAML 1.1 (PyYAML, and OmegaConf on top of it) reads ``13_28`` as the number 1328, ``02_05`` as 133, ``1:30`` as 90 and
``no`` as false; clips and joints have such names. So a node keeps its text, and the schema decides what it is.
"""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mrhubo.errors import UserError, shortened, unknown_name
from mrhubo.files.regular import MissingFile, check_regular, read_regular

MAX_BYTES = 1_000_000
MAX_NODES = 100_000
MAX_DEPTH = 50

NULL_WORDS = ("", "~", "null", "Null", "NULL")
BOOL_WORDS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
INT_PATTERN = re.compile(r"[-+]?(0|[1-9][0-9]{0,399})")
FLOAT_PATTERN = re.compile(
    r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"
)


@dataclass(frozen=True)
class Source:
    """What a value was read from: a name for messages, and the folder that relative paths start from."""

    name: str
    folder: Path
    typed: bool = False
    """Whether it is the command line, what the user himself has written."""


@dataclass
class Node:
    """One value of the tree. `text` is what stood there, if it was an unquoted scalar."""

    content: Any
    """None, bool, int, float, str, list[Node] or dict[str, Node]."""
    source: Source
    line: int | None = None
    text: str | None = None

    @property
    def where(self) -> str:
        """The place for messages, for instance ``conf/nao.yaml, line 3``."""
        return self.source.name if self.line is None else f"{self.source.name}, line {self.line}"

    def error(self, sentence: str) -> UserError:
        """A sentence about this value, with its place in front if it has one."""
        return UserError(f"{self.where}: {sentence}" if self.where else sentence)

    def walk(self) -> Iterator[Node]:
        """This value and all in it."""
        yield self
        inner = self.content.values() if isinstance(self.content, dict) else self.content
        for child in inner if isinstance(self.content, dict | list) else ():
            yield from child.walk()

    def plain(self) -> Any:
        """The value without its origin."""
        if isinstance(self.content, dict):
            return {key: child.plain() for key, child in self.content.items()}
        if isinstance(self.content, list):
            return [child.plain() for child in self.content]
        return self.content


def command_line() -> Source:
    """The source of what is typed: relative paths start from the current directory."""
    return Source("command line", Path.cwd(), typed=True)


def scalar(text: str) -> Any:
    """What an unquoted scalar means where the schema does not say (YAML 1.2's core rules)."""
    if text in NULL_WORDS:
        return None
    if text in BOOL_WORDS:
        return BOOL_WORDS[text]
    if INT_PATTERN.fullmatch(text):
        return int(text)
    if FLOAT_PATTERN.fullmatch(text):
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return text


def read_file(file: Path) -> Node:
    """The tree of a YAML file, a mapping at the top."""
    source = Source(str(file), Path(os.path.abspath(file)).parent)
    if os.path.isdir(file):
        raise UserError(f"{file} is a folder, not a YAML file")
    try:
        if check_regular(file) > MAX_BYTES:
            raise UserError(f"{file} is larger than {MAX_BYTES // 1_000_000} MB, which no config is")
        data = read_regular(file)
    except MissingFile:
        raise UserError(_missing_file(file)) from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(f"{file} is not a YAML file: byte {error.start} is not UTF-8 text") from None
    if text.lstrip().startswith("<"):
        raise UserError(f"{file} is XML, as a URDF is; a config is a YAML file that names the URDF under robot.urdf")
    node = parse(text, source)
    if node is None:
        raise UserError(f"{file} is empty")
    if not isinstance(node.content, dict):
        raise UserError(f"{node.where}: a config is a mapping of `key: value` lines, found {describe(node)}")
    return node


def parse(text: str, source: Source, lines: bool = True) -> Node | None:
    """The tree of a YAML text; None where it holds nothing."""
    try:
        root = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{source.name}, line {mark.line + 1}" if lines and mark else source.name
        raise UserError(f"{place}: not valid YAML: {error.problem or error.context}") from None
    except yaml.reader.ReaderError as error:
        if source.typed:
            raise UserError(f"{source.name}: '{shortened(text)}' has letters that are not printable") from None
        raise UserError(f"{source.name}: not a text file: character {error.position} is not printable") from None
    except RecursionError:
        raise UserError(f"{source.name}: nested more than {MAX_DEPTH} levels deep") from None
    except (ValueError, OverflowError) as error:
        raise UserError(f"{source.name}: not valid YAML: {error}") from None
    return None if root is None else _Converter(source, lines).convert(root, 0)


def parse_typed(text: str) -> Node:
    """The node of a value from the command line: YAML if it starts with a bracket or a quote, else taken literally."""
    source = command_line()
    text = text.strip()
    if text[:1] in ("[", "{", "'", '"'):
        return parse(text, source, lines=False) or Node(None, source)
    return Node(scalar(text), source, text=text)


def from_plain(value: Any) -> Node:
    """The tree of values that Python code gives: dataclasses, mappings, sequences, anything with `tolist`, scalars.

    Raises:
        UserError: a value or a key is of another type.
    """
    source = Source("", Path.cwd())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        given = {
            field.name: getattr(value, field.name) for field in dataclasses.fields(value) if is_given(value, field)
        }
        return from_plain(given)
    value = getattr(value, "tolist", lambda: value)()
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise UserError(f"a key must be text, found {next(key for key in value if not isinstance(key, str))!r}")
        return Node({key: from_plain(item) for key, item in value.items()}, source)
    if isinstance(value, list | tuple):
        return Node([from_plain(item) for item in value], source)
    if isinstance(value, Path):
        value = str(value)
    if value is not None and not isinstance(value, bool | int | float | str):
        raise UserError(f"a value must be text, a number, true or false, a list or a mapping, found {value!r}")
    return Node(value, source)


def is_given(section: Any, field: dataclasses.Field[Any]) -> bool:
    """Whether YAML shows this field of a dataclass: all of them, but defaults of those that are `left_out`."""
    return not field.metadata.get("left_out") or getattr(section, field.name) != field.default


def describe(node: Node) -> str:
    """What was found, short enough for a sentence."""
    content = node.content
    if isinstance(content, dict):
        return "a mapping" if content else "an empty mapping"
    if isinstance(content, list):
        return "a list" if content else "an empty list"
    if content is None:
        return "nothing"
    shown = repr(content) if isinstance(content, str) else node.text or str(content)
    return shortened(shown, 60)


def shown(node: Node) -> str:
    """As `describe`, but a short list of single values in full."""
    if isinstance(node.content, list) and not any(isinstance(item.content, dict | list) for item in node.content):
        text = f"[{', '.join(map(describe, node.content))}]"
        if len(text) <= 60:
            return text
    return describe(node)


class _Loader(yaml.SafeLoader):
    """No implicit types: `scalar` and the schema decide."""

    yaml_implicit_resolvers = {}


class _Converter:
    """PyYAML's nodes -> ours; counts them, because aliases can make a small file expand without end."""

    def __init__(self, source: Source, lines: bool):
        self.source = source
        self.lines = lines
        self.count = 0

    def convert(self, found: yaml.Node, depth: int) -> Node:
        node = Node(None, self.source, found.start_mark.line + 1 if self.lines else None)
        self.count += 1
        if self.count > MAX_NODES:
            raise UserError(f"{self.source.name}: more than {MAX_NODES} values, which no config has")
        if depth > MAX_DEPTH:
            raise UserError(f"{node.where}: nested more than {MAX_DEPTH} levels deep")
        if not found.tag.startswith("tag:yaml.org,2002:") or found.tag[18:] not in ("str", "seq", "map"):
            raise UserError(f"{node.where}: the YAML tag '{found.tag}' is not supported")
        if isinstance(found, yaml.ScalarNode) and not _is_text(found.value):
            raise UserError(f"{node.where}: {found.value!r} holds half of a letter, which is no text")
        if isinstance(found, yaml.MappingNode):
            node.content = {}
            for key, value in found.value:
                name = self.key(key)
                if name == "<<" and isinstance(key, yaml.ScalarNode) and key.style is None:
                    raise UserError(f"{self.where(key)}: merge keys ('<<') are not supported; write the keys out")
                if name in node.content:
                    raise UserError(f"{self.where(key)}: key '{name}' is given twice")
                node.content[name] = self.convert(value, depth + 1)
                if self.lines:
                    node.content[name].line = key.start_mark.line + 1
        elif isinstance(found, yaml.SequenceNode):
            node.content = [self.convert(value, depth + 1) for value in found.value]
        elif isinstance(found, yaml.ScalarNode) and found.style is None:
            node.content, node.text = scalar(found.value), found.value
        else:
            node.content = found.value
        return node

    def key(self, found: yaml.Node) -> str:
        if not isinstance(found, yaml.ScalarNode):
            raise UserError(f"{self.where(found)}: a key must be text, found a list or a mapping")
        if not _is_text(found.value):
            raise UserError(f"{self.where(found)}: key {found.value!r} holds half of a letter, which is no text")
        return found.value

    def where(self, found: yaml.Node) -> str:
        return Node(None, self.source, found.start_mark.line + 1 if self.lines else None).where


def _is_text(value: str) -> bool:
    """Whether a file or a database can hold it; halves of letters that stand for a byte of a file's name are typed."""
    try:
        value.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        return False
    return True


def _missing_file(file: Path) -> str:
    folder = file.parent
    try:
        others = [str(folder / other.name) for other in folder.iterdir() if other.suffix in (".yaml", ".yml")]
    except OSError:
        return f"config file '{file}' does not exist, nor does its folder"
    return unknown_name("config file", str(file), others, telling=lambda path: Path(path).stem)
