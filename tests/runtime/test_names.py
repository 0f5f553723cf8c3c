"""Anybody's names in MLflow, and back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mlflow.utils.validation import (
    _validate_logged_model_name,
    _validate_metric_name,
    _validate_model_name,
    _validate_param,
    _validate_tag_name,
)

from mrhubo.errors import UserError
from mrhubo.runtime.names import check_name, escaped, key, model_name, parameters, unescaped

NAMES = st.text(max_size=40) | st.text("_x04AF(/. ", max_size=12)
"""Any, and those that look like what `escaped` makes."""


@pytest.mark.parametrize("name", ["LShoulderPitch", "left_x1", "l.elbow-2", "wave 3", "__init__", "ナオ"])
def test_plain_names_stay(name: str) -> None:
    assert escaped(name) == name


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("neck(1)", "neck_x28_1_x29_"), ("/l/elbow", "_x2F_l_x2F_elbow"), ("", "_x_"), ("..", "_x2E__x2E_"),
        ("_x28_", "_x5F_x28_"), ("50%", "50_x25_"),
    ],
)  # fmt: skip
def test_other_letters_become_numbers(name: str, text: str) -> None:
    assert escaped(name) == text


@given(NAMES)
def test_names_come_back(name: str) -> None:
    assert unescaped(escaped(name)) == name


@given(NAMES, NAMES)
def test_mlflow_takes_them(name: str, other: str) -> None:
    for entry, value in parameters({"robot": {"ranges": {name: [0, 1]}, other: 3}}).items():
        _validate_param(entry, value)
    text = key(f"test/{name.replace('/', '')}/link_cm")
    _validate_metric_name(text)
    _validate_tag_name(text)
    _validate_model_name(model_name(name))
    _validate_logged_model_name(model_name(name))


@given(NAMES, NAMES)
def test_two_names_stay_two(name: str, other: str) -> None:
    if name != other:
        assert len(parameters({"hold": {name: 0, other: 1}})) == 2 and model_name(name) != model_name(other)


@given(st.text(min_size=150, max_size=400))
def test_long_names_are_cut_and_stay_apart(name: str) -> None:
    assert len(escaped(name).encode()) <= 200 and len(key(f"test/{escaped(name)}/link_cm")) <= 250
    if len(escaped(name).encode()) == 200:
        assert escaped(name) != escaped(name + "x")


def test_parameters_are_those_that_lightning_made() -> None:
    """Runs of earlier versions are compared with new ones."""
    plain = {"a": 1, "b": {"c": [1, 2], "d": {}, "e": None}, "f": "x" * 300}
    assert parameters(plain) == {"a": "1", "b/c": "[1, 2]", "b/e": "None", "f": "x" * 250}


def test_no_password_becomes_a_parameter() -> None:
    assert parameters({"a": ["http://b:s3cret@c"]}) == {"a": "['http://b:***@c']"}


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("../../../esc", "begins with a dot"), ("a/b", "holds a slash"), ("a\\b", "holds a slash"), ("", "is empty"),
        (" ", "is empty"), ("n" * 300, "is longer than 64 bytes"), ("ナ" * 30, "is longer than 64 bytes"),
        ("a\0", "cannot be printed"), ("a\nb", "cannot be printed"), ("a\udcff", "cannot be printed"), ('a"', "quotation"),
    ],
)  # fmt: skip
def test_what_cannot_name_a_folder_is_refused(name: str, fault: str) -> None:
    with pytest.raises(UserError, match=rf"^robot.name: .* {fault}") as error:
        check_name("robot.name", name)
    assert len(str(error.value)) < 250


@pytest.mark.parametrize("name", ["nao", "g1:29dof (v1.2)", "it's", "ナオ", "-x", "100%"])
def test_other_names_are_taken(name: str) -> None:
    check_name("robot.name", name)
