"""YAML and overrides -> typed config: what is accepted, what is refused, and in which words."""

from __future__ import annotations

import dataclasses
import math
import os
import subprocess
import sys
import textwrap
import typing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.config import (
    Config,
    SweepConfig,
    bounded,
    choice,
    field_docs,
    fingerprint,
    load_config,
    to_plain,
    to_yaml,
    typed_value,
)
from mrhubo.config.entries import FrameEntry
from mrhubo.config.fields import left_out
from mrhubo.config.kinds import Key, Rule, fields_of, optional_kind, union_of, walk, without_rule
from mrhubo.errors import UserError


@dataclass
class Inner:
    """The inner section."""

    rate: float = bounded(0.5, 0.0, 1.0)
    """A rate,
    in words."""
    steps: int = bounded(10, 1, None)
    """Steps."""
    word: str = choice("a", "a", "b", "32")
    """A word."""


Word = Annotated[str, Rule("a word")]
Vector = Annotated[list[int | float], Rule("three numbers [x, y, z]", low=-10.0, high=10.0, length=3)]
Span = Annotated[list[float], Rule("two numbers [low, high], low below high", length=2, rising=True)]


@dataclass
class Point:
    """A point."""

    link: str
    """Its link."""
    offset: Vector | None = left_out()
    """Its offset."""


@dataclass
class Frame:
    """A frame."""

    link: str
    """Its link."""
    up: Vector
    """Where up is."""
    flipped: bool = left_out(False)
    """Whether it is turned."""


@dataclass
class Mean:
    """A mean."""

    links: dict[str, float]
    """Weights."""
    offset: Vector | None = left_out()
    """Its offset."""


@dataclass
class Fixed:
    """A constant."""

    offset: Vector
    """Where."""


@dataclass
class Outer:
    """A schema with every supported type."""

    name: str
    """The name: of something."""
    source: Path
    """A file."""
    inner: Inner = field(default_factory=Inner)
    on: bool = False
    title: str | None = None
    place: Path | None = None
    places: list[Path] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    ranges: dict[str, list[float]] = field(default_factory=dict)
    numbers: list[float] = bounded(None, 0.0, 10.0)
    loose: Any = None
    maybe: Inner | None = None
    entry: str | Point | Frame | None = None
    entries: dict[str, Word | Point | Mean | Fixed] = field(default_factory=dict)
    sections: list[Inner] = field(default_factory=list)
    vector: Vector | None = None
    spans: dict[str, Span] = field(default_factory=dict)
    either: list[Any] | Inner | None = None


REQUIRED = "name: n\nsource: s\n"


def load(tmp_path: Path, text: str, *overrides: str, schema: type = Outer) -> Any:
    file = tmp_path / "test.yaml"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return load_config(file, overrides, schema)


def refusal(tmp_path: Path, text: str | bytes, *overrides: str, schema: type = Outer) -> str:
    """The sentence, with the file's folder left out."""
    with pytest.raises(UserError) as caught:
        load(tmp_path, text, *overrides, schema=schema)  # type: ignore[arg-type]
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence.replace(f"{tmp_path}/", "")


# What is accepted


def test_every_type(tmp_path):
    text = """
        name: n
        source: s
        inner: {rate: 1e-4, steps: 50_000, word: 32}
        on: yes
        title: 1.10
        place: null
        places: [p, /q]
        names: [13_28, 02_05, 1:30, no, 2024-01-01, 0x1f, 007, 1e5]
        ranges: {1: [0, .5], 1e3: [-1, +2.]}
        numbers: [0, 10]
        loose: {a: [1, 2.5, true, null, text, 13_28]}
    """
    config = load(tmp_path, text)
    assert config.inner == Inner(1e-4, 50_000, "32")
    assert config.on is True
    assert config.title == "1.10"
    assert config.place is None
    assert config.places == [tmp_path / "p", Path("/q")]
    assert config.names == ["13_28", "02_05", "1:30", "no", "2024-01-01", "0x1f", "007", "1e5"]
    assert config.ranges == {"1": [0.0, 0.5], "1e3": [-1.0, 2.0]}
    assert all(type(number) is float for pair in config.ranges.values() for number in pair)
    assert config.loose == {"a": [1, 2.5, True, None, "text", "13_28"]}


def test_defaults(tmp_path):
    assert load(tmp_path, REQUIRED) == Outer("n", tmp_path / "s", numbers=None)  # type: ignore[arg-type]
    assert load(tmp_path, REQUIRED + "inner:\n").inner == Inner()
    assert load(tmp_path, REQUIRED + "maybe: {steps: 3}").maybe == Inner(steps=3)


def test_no_file():
    assert load_config(None, ["rate=0.25"], Inner) == Inner(0.25)
    with pytest.raises(
        UserError, match=r"^command line: 2 required keys are missing: name \(The name\); source \(A file"
    ):
        load_config(None, schema=Outer)


def test_paths(tmp_path, monkeypatch):
    here = tmp_path / "here"
    (tmp_path / "conf").mkdir()
    here.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    config = load(tmp_path / "conf", "name: n\nsource: ../data/s\nplace: ~/p\nplaces: [a, ./b/]", "places=[c, ~/d]")
    assert config.source == tmp_path / "data" / "s"
    assert config.place == tmp_path / "home" / "p"
    assert config.places == [here / "c", tmp_path / "home" / "d"]
    assert load_config(Path("../conf/test.yaml"), ["source=x"], Outer).source == here / "x"
    assert load_config("../conf/test.yaml", (), Outer).source == tmp_path / "data" / "s"


def test_overrides(tmp_path):
    text = REQUIRED + "inner: {rate: 0.1, steps: 2}\nranges: {a: [0, 1]}"
    config = load(
        tmp_path,
        text,
        "inner.rate=1",
        "title=a: b # c",
        "ranges={'b.c': [1, 2]}",
        "names=[13_28, x]",
        "inner.steps=3",
        "inner.steps=4",
    )
    assert config.inner == Inner(1.0, 4)
    assert config.title == "a: b # c"
    assert config.ranges == {"b.c": [1.0, 2.0]}
    assert config.names == ["13_28", "x"]
    assert load(tmp_path, text, "ranges.b=[3, 4]").ranges == {"a": [0.0, 1.0], "b": [3.0, 4.0]}
    assert load(tmp_path, text, "inner={rate: 1}").inner == Inner(1.0)
    assert load(tmp_path, text, "title=null").title is None
    assert load(tmp_path, text, "title='null'").title == "null"
    assert load(tmp_path, text, "title=").title is None
    assert load(tmp_path, text, "title=a=b").title == "a=b"
    assert load(tmp_path, text, "loose.x.y=1").loose == {"x": {"y": 1}}


def test_interpolation(tmp_path, monkeypatch):
    monkeypatch.setenv("MRHUBO_TEST", "7")
    text = (
        REQUIRED
        + "inner: {rate: '${loose.r}', steps: 3}\nloose: {r: 0.25}\ntitle: ${name}-${inner.steps}\nplace: ${name}.urdf"
    )
    config = load(tmp_path, text, "name=changed")
    assert config.inner.rate == 0.25
    assert config.title == "changed-3"
    assert config.place == tmp_path / "changed.urdf"
    assert load(tmp_path, REQUIRED, "title=${oc.env:MRHUBO_TEST}").title == "7"
    assert load(tmp_path, REQUIRED + r"title: \${name}").title == "${name}"
    assert load(tmp_path, REQUIRED + "loose: {rate: 0.75, word: b}\ninner: ${loose}").inner == Inner(0.75, 10, "b")
    assert load(tmp_path, REQUIRED + "inner: {steps: 32, word: '${inner.steps}'}").inner.word == "32"


def test_unions_choose_by_kind_and_by_keys(tmp_path):
    text = """
        entry: {link: a, up: [0, 0, 1.0]}
        entries: {a: 13_28, b: {link: l}, c: {links: {x: 1}}, d: {offset: [1, 2, .5]}, e: {link: l, offset: [0, 0, 0]}}
        sections: [{rate: 1}, {}, {steps: 3, word: b}]
        vector: [0, 1, -2.5]
        spans: {a.b: [0, 1]}
        either: {steps: 3}
    """
    config = load(tmp_path, REQUIRED + textwrap.dedent(text))
    assert config.entry == Frame("a", [0, 0, 1.0])
    assert config.entries == {
        "a": "13_28", "b": Point("l"), "c": Mean({"x": 1.0}), "d": Fixed([1, 2, 0.5]), "e": Point("l", [0, 0, 0])
    }  # fmt: skip
    assert config.sections == [Inner(1.0), Inner(), Inner(steps=3, word="b")]
    assert [type(number) for number in config.vector] == [int, int, float]
    assert config.spans == {"a.b": [0.0, 1.0]} and type(config.spans["a.b"][0]) is float
    assert config.either == Inner(steps=3) and load(tmp_path, REQUIRED + "either: [a, 1]").either == ["a", 1]
    assert load(tmp_path, REQUIRED, "entry={link: a, up: [1, 0, 0]}").entry == Frame("a", [1, 0, 0])
    assert load(tmp_path, REQUIRED + "entry: {link: a}", "entry.offset=[1, 2, 3]").entry == Point("a", [1, 2, 3])
    assert load(tmp_path, REQUIRED + "entry: {link: a}", "entry=null").entry is None


def test_entries_show_what_was_given_alone(tmp_path):
    config = load(tmp_path, REQUIRED + "entry: {link: a}\nentries: {b: {link: b, offset: [0, 0, 0.5]}}\n")
    assert to_plain(config.entry) == {"link": "a"}
    assert to_plain(config.entries) == {"b": {"link": "b", "offset": [0, 0, 0.5]}}
    assert to_plain(Frame("a", [0, 0, 1])) == {"link": "a", "up": [0, 0, 1]}
    assert to_plain(Frame("a", [0, 0, 1], flipped=True))["flipped"] is True
    assert fingerprint(config.entries) == fingerprint({"b": {"link": "b", "offset": [0, 0, 0.5]}})
    assert fingerprint(Point("a", [0, 0, 1])) != fingerprint(Point("a", [0.0, 0.0, 1.0]))


def test_interpolation_in_entries(tmp_path):
    text = REQUIRED + "loose: {x: 1, v: [1, 2.5, 3]}\nvector: ['${loose.x}', 0, '${loose.x}']\n"
    text += "entry: ${entries.a}\nentries: {a: {link: '${name}', offset: '${loose.v}'}, b: '${name}'}\n"
    config = load(tmp_path, text)
    assert config.vector == [1, 0, 1]
    assert config.entry == Point("n", [1, 2.5, 3]) and config.entries == {"a": Point("n", [1, 2.5, 3]), "b": "n"}
    sentence = "test.yaml, line 3: vector[1] must be a number from -10.0 to 10.0, found 'n'"
    assert refusal(tmp_path, REQUIRED + "vector: [0, '${name}', 0]") == sentence
    assert "entry.nope" in refusal(tmp_path, REQUIRED + "entry: ${entry.nope}")


def test_plain_values_are_typed_like_those_of_a_file():
    assert typed_value(str | Point | Frame, {"link": "a", "offset": (1, 2, 3)}, "e") == Point("a", [1, 2, 3])
    assert typed_value(str | Point, Point("a", [1, 2, 3]), "e") == Point("a", [1, 2, 3])
    assert typed_value(str | Point, "a", "e") == "a"
    assert typed_value(Vector, np.array([1.0, 2.0, 3.0]), "v") == [1.0, 2.0, 3.0]
    for value, sentence in (
        ([1, 2], "v must be three numbers [x, y, z], found [1, 2]"),
        ([1, 2, math.nan], "v[2] must be a number from -10.0 to 10.0, found nan"),
        (object, "v: a value must be text, a number, true or false, a list or a mapping, found <class 'object'>"),
        ({1: 2}, "v: a key must be text, found 1"),
    ):
        with pytest.raises(UserError) as caught:
            typed_value(Vector, value, "v")
        assert str(caught.value) == sentence
    with pytest.raises(UserError, match=r"^key 'e.ofset' does not exist; nearest: 'e.offset'"):
        typed_value(str | Point, Point("a", [1, 2, 3]) and {"link": "a", "ofset": 1}, "e")


def test_aliases_are_copies(tmp_path):
    config = load(tmp_path, REQUIRED + "ranges: {a: &r [0, 1], b: *r}")
    assert config.ranges == {"a": [0.0, 1.0], "b": [0.0, 1.0]}
    assert config.ranges["a"] is not config.ranges["b"]


# What is refused


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("inner: {rate: fast}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found 'fast'"),
        ("inner:\n  rate: 1.5", "test.yaml, line 4: inner.rate must be a number from 0.0 to 1.0, found 1.5"),
        ("inner: {rate: .nan}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found .nan"),
        ("inner: {rate: -.inf}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found -.inf"),
        ("inner: {rate: 1e999}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found 1e999"),
        ("inner: {rate: true}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found true"),
        ("inner: {rate: '1'}", "test.yaml, line 3: inner.rate must be a number from 0.0 to 1.0, found '1'"),
        ("inner: {steps: 2000.0}", "test.yaml, line 3: inner.steps must be a whole number of at least 1, found 2000.0"),
        ("inner: {steps: 0}", "test.yaml, line 3: inner.steps must be a whole number of at least 1, found 0"),
        ("inner: {steps: 1e3}", "test.yaml, line 3: inner.steps must be a whole number of at least 1, found 1e3"),
        ("inner: {steps: false}", "test.yaml, line 3: inner.steps must be a whole number of at least 1, found false"),
        ("inner: {steps: }", "test.yaml, line 3: inner.steps must be a whole number of at least 1, found nothing"),
        ("inner: {word: c}", "test.yaml, line 3: inner.word must be one of a, b, 32, found 'c'"),
        ("inner: {word: [a]}", "test.yaml, line 3: inner.word must be one of a, b, 32, found a list"),
        ("inner: 5", "test.yaml, line 3: inner must be a section of `key: value` lines, found 5"),
        ("inner: []", "test.yaml, line 3: inner must be a section of `key: value` lines, found an empty list"),
        ("on: 1", "test.yaml, line 3: on must be true or false, found 1"),
        ("title: {a: b}", "test.yaml, line 3: title must be text, found a mapping"),
        ("place: ''", "test.yaml, line 3: place must be a path, found ''"),
        ('place: "a\\0b"', "test.yaml, line 3: place must be a path, found 'a\\x00b'"),
        (
            "place: ~nobody-here/x",
            "test.yaml, line 3: place names the home folder of an unknown user, '~nobody-here/x'",
        ),
        ("places: p", "test.yaml, line 3: places must be a list of paths, found 'p'"),
        ("places:\n- p\n- ''", "test.yaml, line 5: places[1] must be a path, found ''"),
        ("names: [a, null]", "test.yaml, line 3: names[1] must be text, found nothing"),
        ("ranges: [1]", "test.yaml, line 3: ranges must be a mapping of name to list of numbers, found a list"),
        ("ranges: {a: 1}", "test.yaml, line 3: ranges.a must be a list of numbers, found 1"),
        ("ranges: {a: [0, x]}", "test.yaml, line 3: ranges.a[1] must be a number, found 'x'"),
        ("numbers: [1, 11]", "test.yaml, line 3: numbers[1] must be a number from 0.0 to 10.0, found 11"),
        ("loose: {a: [.inf]}", "test.yaml, line 3: loose.a[0] must be finite, found .inf"),
        ("title: ???", "test.yaml, line 3: title has no value yet: replace '???' by text"),
        ("on: true\non: true", "test.yaml, line 4: key 'on' is given twice"),
        ("inner: {rate: 1, 'rate': 1}", "test.yaml, line 3: key 'rate' is given twice"),
        ("[a]: b", "test.yaml, line 3: a key must be text, found a list or a mapping"),
        ("title: !!python/name:os.system x", "the YAML tag 'tag:yaml.org,2002:python/name:os.system' is not supported"),
        ("title: !mine x", "test.yaml, line 3: the YAML tag '!mine' is not supported"),
        ("title: *x", "test.yaml, line 3: not valid YAML: found undefined alias 'x'"),
        ("title: [a", "not valid YAML: expected ',' or ']', but got '<stream end>'"),
        ("\ttitle: a", "test.yaml, line 3: not valid YAML: found character '\\t' that cannot start any token"),
        ("---\na: b", "not valid YAML: but found another document"),
        (
            "title: ${nope}",
            "test.yaml, line 3: title, '${nope}', cannot be resolved: Interpolation key 'nope' not found",
        ),
        (
            "title: ${title}",
            "test.yaml, line 3: title, '${title}', cannot be resolved: Recursive interpolation detected",
        ),
        ("title: ${", "test.yaml, line 3: title, '${', cannot be resolved: "),
        ("names: [a, '${oc.env:MRHUBO_NOPE}']", "names[1], '${oc.env:MRHUBO_NOPE}', cannot be resolved: "),
        ("titel: x", "test.yaml, line 3: key 'titel' does not exist; nearest: 'title'"),
        ("inner: {rat: 1}", "test.yaml, line 3: key 'inner.rat' does not exist; nearest: 'inner.rate'"),
        ("steps: 1", "test.yaml, line 3: key 'steps' does not exist; nearest: 'inner.steps'"),
        ("stepz: 1", "test.yaml, line 3: key 'stepz' does not exist; nearest: 'inner.steps'"),
        ("inner.rate: 1", "test.yaml, line 3: key 'inner.rate' has a section of its own: write rate below inner"),
        ("inner: {learning_rate: 1}", "key 'inner.learning_rate' does not exist; available: inner.rate, inner.steps"),
        ("entry: [a]", "test.yaml, line 3: entry must be text, {link, offset} or {link, up, flipped}, found a list"),
        (
            "entry: {}",
            "test.yaml, line 3: entry must be text, {link, offset} or {link, up, flipped}, found an empty map",
        ),
        ("entry: ???", "test.yaml, line 3: entry has no value yet: replace '???' by text, {link, offset} or"),
        ("entry: {link: 3, upp: 1}", "test.yaml, line 3: key 'entry.upp' does not exist; nearest: 'entry.up'"),
        ("entry:\n  link: a\n  colour: 1", "line 5: key 'entry.colour' does not exist; available: entry.flipped, "),
        ("entry:\n  up: [0, 0, 1]", "test.yaml, line 3: a required key is missing: entry.link (Its link)"),
        ("entry: {link: }", "test.yaml, line 3: entry.link must be text, found nothing"),
        ("entry: {link: a, up: up}", "test.yaml, line 3: entry.up must be three numbers [x, y, z], found 'up'"),
        (
            "entry: {link: a, offset: [0, 0, 1], up: [0, 0, 1]}",
            "entry: 'offset' and 'up' do not go together; give {link, ",
        ),
        ("entries: {a: 1, b: {offset: [0, 0]}}", "entries.b.offset must be three numbers [x, y, z], found [0, 0]"),
        (
            "entries:\n  a: x\n  b: {link: l, offset: [0, .nan, 0]}",
            "test.yaml, line 5: entries.b.offset[1] must be a number from -10.0 to 10.0, found .nan",
        ),
        ("entries: {a: {links: {x: y}}}", "test.yaml, line 3: entries.a.links.x must be a number, found 'y'"),
        (
            "entries: {a: {links: {x: 1}, link: y}}",
            "entries.a: 'link' and 'links' do not go together; give {link, offset}, ",
        ),
        ("entries: {a: }", "entries.a must be a word, {link, offset}, {links, offset} or {offset}, found nothing"),
        ("entries: [a]", "test.yaml, line 3: entries must be a mapping of name to a word, {link, offset}, "),
        ("sections:\n- {}\n- rate: 2", "test.yaml, line 5: sections[1].rate must be a number from 0.0 to 1.0, found 2"),
        ("sections: [{}, x]", "test.yaml, line 3: sections[1] must be {rate, steps, word}, found 'x'"),
        (
            "sections: [{rat: 1}]",
            "test.yaml, line 3: key 'sections[0].rat' does not exist; nearest: 'sections[0].rate'",
        ),
        ("sections: {rate: 1}", "test.yaml, line 3: sections must be a list of {rate, steps, word}, found a mapping"),
        ("vector: [0, 0, '1']", "test.yaml, line 3: vector[2] must be a number from -10.0 to 10.0, found '1'"),
        ("vector: [0, 0, true]", "test.yaml, line 3: vector[2] must be a number from -10.0 to 10.0, found true"),
        ("vector: [0, 0, 11]", "test.yaml, line 3: vector[2] must be a number from -10.0 to 10.0, found 11"),
        ("vector: 1", "test.yaml, line 3: vector must be three numbers [x, y, z], found 1"),
        ("spans: {a: [1, 1]}", "spans.a must be two numbers [low, high], low below high, found [1, 1]"),
        ("spans: {a: [2, 1]}", "spans.a must be two numbers [low, high], low below high, found [2, 1]"),
        ("spans: {a: [1]}", "spans.a must be two numbers [low, high], low below high, found [1]"),
        ("either: x", "test.yaml, line 3: either must be list of any value or {rate, steps, word}, found 'x'"),
        ("either: {rate: 2}", "test.yaml, line 3: either.rate must be a number from 0.0 to 1.0, found 2"),
        (
            "qqq: 1",
            "test.yaml, line 3: key 'qqq' does not exist; available: either, entries, entry, inner, loose, maybe, name, names, ",
        ),
        ("<<: {on: true}", "test.yaml, line 3: merge keys ("),
        ("? {a: b}\n: c", "test.yaml, line 3: a key must be text"),
        ('either: "\\ud800"', "test.yaml, line 3: '\\ud800' holds half of a letter"),
        ('"a\\udfff": 1', "test.yaml, line 3: key 'a\\udfff' holds half of a letter"),
    ],
)
def test_sentences(tmp_path, text, sentence):
    assert sentence in refusal(tmp_path, REQUIRED + text)


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("inner.rate=2", "command line: inner.rate must be a number from 0.0 to 1.0, found 2"),
        ("inner.rate=nan", "command line: inner.rate must be a number from 0.0 to 1.0, found 'nan'"),
        ("inner.rat=1", "command line: key 'inner.rat' does not exist; nearest: 'inner.rate'"),
        ("iner.rate=1", "command line: key 'iner' does not exist; nearest: 'inner'"),
        ("inner.rate.x=1", "command line: inner.rate must be a number from 0.0 to 1.0, found a mapping"),
        ("names.0=x", "command line: names must be a list of text, found a mapping"),
        ("names=[a", "command line: not valid YAML: "),
        ("names=[w\udce4lle]", "command line: '[w\\udce4lle]' has letters that are not printable"),
        ("inner", "command line: 'inner' is not KEY=VALUE, for instance inner.rate=0.5"),
        ("=1", "command line: '=1' is not KEY=VALUE"),
        ("inner..rate=1", "command line: 'inner..rate=1' is not KEY=VALUE"),
        ("inner={rate: 1, rate: 1}", "command line: key 'rate' is given twice"),
        ("place.x=1", "command line: place.x cannot be set, because place is an interpolation (test.yaml, line 3)"),
    ],
)
def test_override_sentences(tmp_path, override, sentence):
    assert refusal(tmp_path, REQUIRED + "place: ${name}", override).startswith(sentence)


def test_missing_keys_are_named_together(tmp_path):
    sentence = "test.yaml: 2 required keys are missing: name (The name); source (A file)"
    assert refusal(tmp_path, "on: true") == sentence
    assert refusal(tmp_path, "name: n") == "test.yaml: a required key is missing: source (A file)"


def test_missing_keys_of_a_missing_section(tmp_path):
    sentence = refusal(tmp_path, "trainer: {}", schema=Config)
    required = [
        key
        for key in walk(Config)
        if key.required and not key.is_section and ".manual" not in key.name and ".search" not in key.name
    ]
    assert required and all(f"{key.name} (" in sentence for key in required)


def test_wrong_comes_before_missing(tmp_path):
    assert "inner.rate must be" in refusal(tmp_path, "inner: {rate: 3}")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "test.yaml is empty"),
        (b"# nothing\n", "test.yaml is empty"),
        (b"- a\n- b\n", "test.yaml, line 1: a config is a mapping of `key: value` lines, found a list"),
        (b'\xef\xbb\xbf <?xml version="1.0"?><robot/>', "test.yaml is XML, as a URDF is; a config is a YAML file"),
        (b"hello", "test.yaml, line 1: a config is a mapping of `key: value` lines, found 'hello'"),
        (b"name: \xff\xfe", "test.yaml is not a YAML file: byte 6 is not UTF-8 text"),
        (b"name: \x00\x01", "test.yaml: not a text file: character 6 is not printable"),
        (b"a: " + b"x" * 1_000_000, "test.yaml is larger than 1 MB, which no config is"),
        (b"loose: " + b"[" * 1000, "test.yaml: nested more than 50 levels deep"),
        (b"loose: " + b"[" * 60 + b"]" * 60, "test.yaml, line 1: nested more than 50 levels deep"),
        (b"loose: &a [*a]", "test.yaml, line 1: nested more than 50 levels deep"),
        (b'name: "\\UFFFFFFFF"', "test.yaml: not valid YAML: "),
    ],
)
def test_files_that_are_no_config(tmp_path, content, sentence):
    file = tmp_path / "test.yaml"
    file.write_bytes(content)
    with pytest.raises(UserError) as caught:
        load_config(file, schema=Outer)
    assert str(caught.value).replace(f"{tmp_path}/", "").startswith(sentence)


def test_aliases_cannot_expand_without_end(tmp_path):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    assert refusal(tmp_path, "\n".join(lines)) == "test.yaml: more than 100000 values, which no config has"


def test_windows_files(tmp_path):
    text = "# \u00e4\r\nname: n\r\nsource: s\r\ninner:\r\n  rate: 0.25\r\nnames:\r\n- a\r\nloose: |\r\n  x\r\n  y\r\n"
    config = load(tmp_path, b"\xef\xbb\xbf" + text.encode())
    assert config.inner == Inner(0.25) and config.names == ["a"] and config.loose == "x\ny\n"
    assert refusal(tmp_path, text.replace("0.25", "2")).startswith("test.yaml, line 5: inner.rate must be")
    assert refusal(tmp_path, text.encode("utf-16")) == "test.yaml is not a YAML file: byte 0 is not UTF-8 text"


def test_bom_is_skipped(tmp_path):
    file = tmp_path / "bom.yaml"
    file.write_bytes(b"\xef\xbb\xbfrate: 1")
    assert load_config(file, schema=Inner) == Inner(1.0)


def test_files_that_cannot_be_opened(tmp_path):
    (tmp_path / "nao.yaml").write_text("rate: 1")
    with pytest.raises(UserError, match=r"config file '.*/nap.yaml' does not exist; nearest: '.*/nao.yaml'"):
        load_config(tmp_path / "nap.yaml", schema=Inner)
    with pytest.raises(UserError, match="does not exist, nor does its folder"):
        load_config(tmp_path / "no" / "nao.yaml", schema=Inner)
    with pytest.raises(UserError, match="is a folder, not a YAML file"):
        load_config(tmp_path, schema=Inner)
    with pytest.raises(UserError, match="cannot be read: Not a directory"):
        load_config(tmp_path / "nao.yaml" / "x.yaml", schema=Inner)
    if os.geteuid() != 0:
        (tmp_path / "nao.yaml").chmod(0)
        with pytest.raises(UserError, match="cannot be read: Permission denied"):
            load_config(tmp_path / "nao.yaml", schema=Inner)


# Properties


def values(key: Key) -> st.SearchStrategy[Any]:
    """Valid values of one field."""
    metadata = key.field.metadata
    strategy = _values(key.kind, metadata)
    return st.none() | strategy if key.optional and key.kind is not Any else strategy


texts = st.text(max_size=20).filter(lambda text: text != "???") | st.sampled_from(
    [
        "13_28",
        "1e-4",
        "no",
        "null",
        "~",
        "${a}",
        "\\${a}",
        "a: b",
        "- x",
        "0x1",
        " a ",
        "1.10",
        "true",
        "\x85\n",
        "a\\",
        "\\\\${",
    ]
)
paths = st.lists(st.from_regex(r"[^/\0]{1,8}", fullmatch=True).filter(lambda p: p not in (".", "..")), max_size=4).map(
    lambda parts: Path("/" + "/".join(parts))
)
plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


def _values(kind: Any, metadata: Any) -> st.SearchStrategy[Any]:
    kind, optional = optional_kind(kind)
    if optional and kind is not Any:
        return st.none() | _values(kind, metadata)
    kind, rule = without_rule(kind)
    metadata = metadata if rule is None else rule.metadata
    low, high = metadata.get("low"), metadata.get("high")
    if "choices" in metadata:
        return st.sampled_from(metadata["choices"])
    if dataclasses.is_dataclass(kind):
        found = st.builds(kind, **{key.field.name: values(key) for key in fields_of(kind)})  # type: ignore[arg-type]
        return found.filter(lambda made: not isinstance(made, FrameEntry) or made.forward or made.up)  # else a point
    if typing.get_origin(kind) is list:
        length = metadata.get("length")
        if metadata.get("rising"):
            return st.lists(_values(float, {}), min_size=length, max_size=length, unique=True).map(sorted)
        if length is not None:
            return st.lists(_values(typing.get_args(kind)[0], metadata), min_size=length, max_size=length)
        return st.lists(_values(typing.get_args(kind)[0], metadata), max_size=3)
    if typing.get_origin(kind) is dict:
        return st.dictionaries(st.text(max_size=8), _values(typing.get_args(kind)[1], metadata), max_size=3)
    if members := union_of(kind):
        return st.one_of([_values(member, metadata) for member in members])
    simple: dict[Any, Any] = {
        int: st.integers(None if low is None else math.ceil(low), None if high is None else math.floor(high)),
        float: st.floats(low, high, allow_nan=False, allow_infinity=False),
        bool: st.booleans(),
        str: texts,
        Path: paths,
        Any: plain,
    }
    return simple[kind]


def relaxed(max_examples: int = 100) -> settings:
    """No deadline; every example may write the same file."""
    allowed = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
    return settings(max_examples=max_examples, deadline=None, suppress_health_check=allowed)


@pytest.mark.parametrize("schema", [Outer, Config, Inner, SweepConfig])
@relaxed(max_examples=12)
@given(data=st.data())
def test_round_trip(tmp_path, schema, data):
    config = data.draw(st.builds(schema, **{key.field.name: values(key) for key in fields_of(schema)}))
    if schema is Outer and config.numbers is None:
        config.numbers = []
    file = tmp_path / "round.yaml"
    file.write_text(to_yaml(config), encoding="utf-8")
    again = load_config(file, schema=schema)
    assert again == config
    assert to_plain(again) == to_plain(config)
    assert fingerprint(again) == fingerprint(config)


def outcome(file: Path, overrides: list[str], schema: type) -> None:
    try:
        load_config(file, overrides, schema)
    except UserError as error:
        assert str(error).strip()


yaml_pieces = st.lists(
    st.sampled_from(
        [
            *"[]{}:,-?&*!|>'\"#%@`~\n \t\\$",
            "a",
            "inner",
            "rate",
            "link",
            "up",
            "offset",
            "[0, 0, 1]",
            "${",
            "}",
            "<<",
            "!!",
            ": ",
            "\n  ",
            "- ",
            "&x",
            "*x",
            "1",
            "...",
        ]
    ),
    max_size=30,
).map("".join)


@relaxed(max_examples=100)
@given(junk=st.binary(max_size=200) | st.text(max_size=200).map(lambda t: t.encode()) | yaml_pieces.map(str.encode))
def test_junk_is_a_user_error(tmp_path, junk):
    file = tmp_path / "junk.yaml"
    for content in (
        junk,
        *(key + junk for key in (b"loose: ", b"inner:\n  ", b"entry: ", b"entries: {a: ", b"vector: ")),
    ):
        file.write_bytes(content)
        outcome(file, [], Outer)


@relaxed(max_examples=100)
@given(
    override=st.text(max_size=40)
    | st.tuples(
        st.sampled_from(["", "loose=", "inner.", "entry=", "entry.", "entries=", "sections="]), yaml_pieces
    ).map("".join)
)
def test_junk_overrides_are_a_user_error(tmp_path, override):
    file = tmp_path / "good.yaml"
    file.write_text(REQUIRED)
    outcome(file, [override], Outer)


@relaxed(max_examples=40)
@given(value=plain, key=st.sampled_from([key.name for key in walk(Config)]))
def test_any_value_under_any_key_is_a_user_error_or_typed(tmp_path, value, key):
    tree: Any = value
    for part in reversed(key.split(".")):
        tree = {part: tree}
    file = tmp_path / "typed.yaml"
    file.write_text(to_yaml(tree), encoding="utf-8")
    with pytest.raises(UserError):  # at least the required keys are missing
        load_config(file)


@relaxed(max_examples=60)
@given(data=st.data())
def test_a_slip_of_one_letter_names_a_nearest_key(tmp_path, data):
    leaves = [key for key in walk(Config) if not key.is_section]
    key = data.draw(st.sampled_from(leaves))
    name, place = key.field.name, data.draw(st.integers(0, len(key.field.name) - 1))
    letter = data.draw(st.sampled_from("abcxyz_"))
    slip = data.draw(
        st.sampled_from(
            [
                name[:place] + letter + name[place:],
                name[:place] + letter + name[place + 1 :],
                name[:place] + name[place + 1 :],
            ]
        )
    )
    section = key.name[: -len(name)]
    if not slip or f"{section}{slip}" in [other.name for other in leaves]:
        return
    with pytest.raises(UserError) as caught:
        load_config(None, [f"{section}{slip}=1"])
    assert str(caught.value).startswith(f"command line: key '{section}{slip}' does not exist; nearest: '")
    if len(name) > 3:
        assert f"nearest: '{section}" in str(caught.value)


# Plain values and fingerprints


def test_plain(tmp_path):
    config = load(tmp_path, REQUIRED + "places: [/a]")
    assert to_plain(config)["places"] == ["/a"]
    assert to_plain(config)["inner"] == {"rate": 0.5, "steps": 10, "word": "a"}
    for bad in (math.nan, object(), {1: 2}, {"a": {1, 2}}):
        with pytest.raises(TypeError):
            to_plain(bad)


def test_fingerprint():
    assert fingerprint({"a": 1, "b": [0.1, None]}) == fingerprint({"b": [0.1, None], "a": 1})
    assert fingerprint({"a": 0.1}) != fingerprint({"a": math.nextafter(0.1, 1)})
    assert fingerprint(["ab", "c"]) != fingerprint(["a", "bc"])
    assert fingerprint(Inner()) == fingerprint(to_plain(Inner()))
    assert fingerprint({"rate": 0.5, "steps": 10}) == "5985eca7af877bd8"  # stored beside pairs: must never change
    assert len(fingerprint(None)) == 16


def test_field_docs():
    assert field_docs(Inner) == {"rate": "A rate, in words.", "steps": "Steps.", "word": "A word."}
    undocumented = [
        key.name for key in walk(Config) if not key.is_section and not field_docs(key.owner).get(key.field.name)
    ]
    assert not undocumented


def test_yaml_keeps_what_looks_like_an_interpolation(tmp_path):
    config = Outer("${a}", Path("/${b}"), title="\\\\${", ranges={"${c}": []}, numbers=[], loose={"${": ["\\${d}"]})
    assert load(tmp_path, to_yaml(config)) == config


def test_import_is_light():
    code = "import sys, mrhubo.config; print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "mrhubo.config.loading" in modules
    assert not {"torch", "mlflow", "lightning", "numpy", "omegaconf"} & set(modules)
