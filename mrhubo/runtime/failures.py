"""What a failure of a tracking server or database means: whether it may pass, and why it is, in a few words."""

from __future__ import annotations

import re
import socket

import requests
from mlflow.exceptions import MlflowException

from mrhubo.config.faults import machine_fault
from mrhubo.errors import UserError, first_line, was_interrupted

_FINAL = frozenset({
    "RESOURCE_DOES_NOT_EXIST", "RESOURCE_ALREADY_EXISTS", "INVALID_PARAMETER_VALUE", "INVALID_STATE", "BAD_REQUEST",
    "PERMISSION_DENIED", "UNAUTHENTICATED", "NOT_FOUND", "ENDPOINT_NOT_FOUND", "CUSTOMER_UNAUTHORIZED",
})  # fmt: skip
"""Answers that asking again does not change."""
BUGS = (TypeError, AttributeError, NameError, AssertionError)
"""Errors of a program, which are nobody's bad day."""
ANSWER_SECONDS = 5.0
"""How long a server may take for a first sign of life, where nothing waits for it."""
_PORTS = {"postgresql": 5432, "mysql": 3306, "mariadb": 3306, "mssql": 1433}
"""Of database servers, where the address names none."""
_SYSTEM = re.compile(r"\[Errno -?\d+\] ([^'\"()]+)")
"""What the operating system says, in an error of a library."""


def silence(uri: str, seconds: float) -> str | None:
    """Why the server at an address does not answer; None if it does, whatever it says, or if there is none to ask."""
    if not uri.startswith(("http://", "https://")):
        return _silent_port(uri, seconds)
    try:
        requests.get(uri, timeout=seconds, stream=True, allow_redirects=False).close()
    except requests.exceptions.SSLError:  # somebody is there; MLflow knows whom to trust
        return None
    except requests.Timeout:
        return f"nothing within {seconds:g} seconds"
    except (requests.RequestException, ValueError) as error:
        system = _SYSTEM.search(str(error))
        return system[1].strip() if system else type(error).__name__
    return None


def _silent_port(uri: str, seconds: float) -> str | None:
    """The same of a database: MLflow would try for minutes to connect to it."""
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(uri)
    except (ArgumentError, ValueError):
        return None  # whoever opens it says what is wrong
    port = url.port or next((port for name, port in _PORTS.items() if url.drivername.startswith(name)), None)
    if url.host is None or port is None:
        return None
    try:
        socket.create_connection((url.host, port), seconds).close()
    except TimeoutError:
        return f"nothing within {seconds:g} seconds"
    except (OSError, UnicodeError) as error:
        return getattr(error, "strerror", None) or str(error)
    return None


def may_pass(error: Exception) -> bool:
    """Whether the same call may succeed later."""
    if was_interrupted(error) or isinstance(error, (UserError, *BUGS)):
        return False
    if isinstance(error, requests.HTTPError) and error.response is not None:
        return error.response.status_code >= 500 or error.response.status_code in (408, 429)
    return not (isinstance(error, MlflowException) and error.error_code in _FINAL)


def reason_of(error: Exception) -> str:
    """What an error says, without the addresses of objects that libraries quote."""
    fault = machine_fault(error)
    text = fault or str(error)
    system = _SYSTEM.search(text)
    if system is not None and "://" in text:
        return f"nobody answers ({system[1].strip()})"
    if "timed out" in text or "timeout" in text:
        return "nobody answers in time"
    return fault or first_line(error)
