"""Shared fixtures. `external_dir` is the development data (original URDFs, CMU clips), which a user does not have."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

# Tests share the cores with each other and with the processes that they start. Threads that spin while they wait make
# all of them many times slower; read when torch is imported, after this.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository root."""
    return ROOT


@pytest.fixture(scope="session")
def external_dir() -> Path:
    """`data/external`; tests that need it skip where it is missing, unless MRHUBO_REQUIRE_EXTERNAL=1 (as in CI)."""
    path = ROOT / "data" / "external"
    if not (path / "robots").is_dir() or not (path / "cmu").is_dir():
        message = "data/external (original URDFs and CMU clips, development only) is not here"
        if os.environ.get("MRHUBO_REQUIRE_EXTERNAL") == "1":
            pytest.fail(message + ", and MRHUBO_REQUIRE_EXTERNAL=1 asks for it")
        pytest.skip(message)
    return path
