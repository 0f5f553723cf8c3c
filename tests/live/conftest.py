"""What several tests of live sessions need."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def open_server() -> Iterator[object]:
    """A server of the page that listens."""
    from mrhubo.live.endpoints import Endpoint
    from mrhubo.live.server import Server

    found = Server(Endpoint("127.0.0.1", 0))
    found.open()
    yield found
    found.close()
