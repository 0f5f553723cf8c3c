"""What failures mean."""

from __future__ import annotations

import time

import pytest
import requests
from mlflow.exceptions import MlflowException
from mlflow.protos.databricks_pb2 import (
    INVALID_PARAMETER_VALUE,
    PERMISSION_DENIED,
    RESOURCE_DOES_NOT_EXIST,
    TEMPORARILY_UNAVAILABLE,
)

from mrhubo.errors import UserError
from mrhubo.runtime.failures import may_pass, reason_of, silence


def test_a_server_that_is_not_there_is_silent() -> None:
    start = time.monotonic()
    assert silence("http://127.0.0.1:9", 60.0) == "Connection refused" and time.monotonic() - start < 30
    assert silence("http://", 1.0) is not None


def http(status: int) -> requests.HTTPError:
    response = requests.Response()
    response.status_code = status
    return requests.HTTPError("said no", response=response)


@pytest.mark.parametrize(
    "error",
    [
        MlflowException("anything"), MlflowException("locked", TEMPORARILY_UNAVAILABLE), http(503), http(429),
        requests.ConnectionError("gone"), OSError("full"), RuntimeError("of a library"),
    ],
)  # fmt: skip
def test_what_may_pass(error: Exception) -> None:
    assert may_pass(error)


@pytest.mark.parametrize(
    "error",
    [
        MlflowException("no such run", RESOURCE_DOES_NOT_EXIST), MlflowException("deleted", INVALID_PARAMETER_VALUE),
        MlflowException("not you", PERMISSION_DENIED), http(404), http(403), UserError("wrong"), TypeError("a bug"),
    ],
)  # fmt: skip
def test_what_does_not(error: Exception) -> None:
    assert not may_pass(error)


def test_an_interrupt_does_not_pass() -> None:
    try:
        raise RuntimeError("a library's") from KeyboardInterrupt()
    except RuntimeError as error:
        assert not may_pass(error)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("failed at http://a: <HTTPConnection object at 0x7>: [Errno 111] Connection refused'))", "nobody answers (Connection refused)"),
        ("API request timed out", "nobody answers in time"),
        ("(sqlite3.OperationalError) database is locked\n[SQL: SELECT ...]", "(sqlite3.OperationalError) database is locked"),
        ("", "RuntimeError"),
    ],
)  # fmt: skip
def test_a_reason_is_short(text: str, reason: str) -> None:
    assert reason_of(RuntimeError(text)) == reason
