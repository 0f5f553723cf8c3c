"""References between keys: what they stand for, that they end, and who reads the environment."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.config import load_config, to_yaml
from mrhubo.errors import UserError
from tests.files.bounded import bounded


@dataclass
class Schema:
    loose: dict[str, Any] = field(default_factory=dict)
    """Anything."""
    title: str | None = None
    """A text."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.yaml"


def load(file: Path, text: str, *overrides: str) -> Schema:
    file.write_text(text)
    return load_config(file, overrides, Schema)


def test_values_keep_their_type_and_places_may_be_relative(file: Path) -> None:
    text = r"""
        loose: {n: 3, f: 0.25, t: true, none: null, list: [1, {z: q}], same: "${loose.n}", half: "${ .f }", z: "${.list[1].z}",
                first: "${loose.list.0}", words: "${.n}/${.f}/${.t}/${.none}", up: "${..title}", whole: "${.list}",
                kept: "\\${.n}", slash: "\\\\${.n}"}
        title: a-${loose.z}
    """
    found = load(file, text.replace("\n        ", "\n"))
    expected = {
        "n": 3, "f": 0.25, "t": True, "none": None, "list": [1, {"z": "q"}], "same": 3, "half": 0.25, "z": "q", "first": 1,
        "words": "3/0.25/True/None", "up": "a-q", "whole": [1, {"z": "q"}], "kept": "${.n}", "slash": "\\3",
    }  # fmt: skip
    assert found.loose == expected and found.title == "a-q"
    assert load(file, to_yaml(found)) == found


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("title: ${nope.x}", "title, '${nope.x}', cannot be resolved: Interpolation key 'nope.x' not found"),
        ("title: ${...x}", "Error resolving key '...x'"),
        (
            "loose: {a: ['${loose.a[1]}']}",
            "loose.a[0], '${loose.a[1]}', cannot be resolved: Interpolation key 'loose.a[1]'",
        ),
        ("title: ${title}", "Recursive interpolation detected"),
        ("loose: {a: '${.b}', b: '${.c}', c: '${.a}'}", "Recursive interpolation detected"),
        ("loose: {a: '${loose}'}", "Interpolation to parent node detected"),
        ("loose: {a: {x: '${loose.b}'}, b: {y: '${loose.a}'}}", "it refers to itself"),
        ("title: ${a${b}}", "one reference inside another is not supported"),
        ("title: ${", "cannot be resolved"),
        ("title: ${oc.decode:x}", "of OmegaConf's resolvers only oc.env is supported"),
        ("loose: {x: '???', y: '${.x}'}", "Missing mandatory value: loose.x"),
    ],
)
def test_what_leads_nowhere_is_named(file: Path, text: str, reason: str) -> None:
    with pytest.raises(UserError) as caught:
        load(file, text)
    assert reason in str(caught.value) and str(caught.value).startswith(f"{file}, line ")


def test_a_file_of_a_package_reads_no_environment(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("A_SECRET", "s3cret")
    for text in (
        "title: ${oc.env:A_SECRET}",
        "title: '${ oc.env : A_SECRET, x}'",
        "loose: {a: ['x${oc.env:A_SECRET}']}",
    ):
        file.write_text(text)
        with pytest.raises(
            UserError, match="the environment is not read for a file that came with a package"
        ) as caught:
            load_config(file, (), Schema, environment=False)
        assert "s3cret" not in str(caught.value)
    assert load(file, "title: ${oc.env:A_SECRET}").title == "s3cret", "the user's own"
    assert load(file, "{}", "title=${oc.env:A_SECRET_NOT, or this}").title == "or this"
    with pytest.raises(UserError, match="Environment variable 'A_SECRET_NOT' not found"):
        load(file, "{}", "title=${oc.env:A_SECRET_NOT}")


def chain(first: str, following: str, count: int) -> str:
    lines = [f"a0: {first}", *(f"a{n + 1}: {following.format(n)}" for n in range(count))]
    return "loose:\n" + "".join(f"  {line}\n" for line in lines)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (chain("0123456789", "${{loose.a{0}}}${{loose.a{0}}}", 40), "would make more than 30,000 letters"),
        (chain("[x, y]", "['${{loose.a{0}}}', '${{loose.a{0}}}']", 40), "would make more than 30,000 letters"),
        (chain("{x: 1, y: 2}", "{{x: '${{.a{0}}}', y: '${{..a{0}}}'}}", 40), "not found"),
        (chain("{x: 1, y: 2}", "{{x: '${{..a{0}}}', y: '${{loose.a{0}}}'}}", 40), "would make more than 30,000 letters"),
        (chain("{x: 1, y: 2}", "{{x: '${{loose.a{0}.x}}', y: '${{loose.a{0}.x}}${{..a{0}.x}}'}}", 40), "30,000 letters"),
        ("title: '" + "${loose.a}" * 900 + f"'\nloose: {{a: {'x' * 500}}}", "would make more than 30,000 letters"),
        ("loose:\n" + "".join(f"  b{n}: ${{loose.b{n + 1}}}\n" for n in range(300)), "more than 50 references lead"),
        ("title: " + "\\" * 50_000 + "${x", "it has more than 30,000 letters"),
        ("title: '" + "${" * 10_000 + "'", "one reference inside another"),
        ("title: '${" + "a." * 10_000 + "a}'", "cannot be resolved"),
    ],
)  # fmt: skip
def test_small_files_stay_small(file: Path, text: str, sentence: str) -> None:
    with bounded(150, 20), pytest.raises(UserError) as caught:
        load(file, text)
    assert sentence in str(caught.value) and len(str(caught.value)) < 600


PIECES = st.sampled_from(
    ["${", "}", "\\", ".", "a", "b", "[0]", "loose", "title", "x", "oc.env:HOME", ",", " ", "${a}", "$"]
)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.lists(PIECES, max_size=8).map("".join)), max_size=5))
@settings(max_examples=80, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_a_value_or_a_sentence(file: Path, entries: list[tuple[str, str]]) -> None:
    loose = dict(entries)
    text = "loose: {" + ", ".join(f"{key}: '{value}'" for key, value in loose.items()) + "}"
    try:
        found = load(file, text)
    except UserError:
        return
    assert set(found.loose) == set(loose)
    assert all(found.loose[key] == value for key, value in loose.items() if "${" not in value)
    assert load(file, to_yaml(found)) == found
