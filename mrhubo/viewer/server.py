"""A viser server that only this machine reaches."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

from mrhubo.errors import UserError
from mrhubo.lazy import import_optional

if TYPE_CHECKING:
    import viser

HOST = "127.0.0.1"


@contextlib.contextmanager
def local_server(port: int = 0) -> Iterator[viser.ViserServer]:
    """A server, until the work in here ends.

    Args:
        port: where it listens; the next free one, if another program does already. 0: any that is free.

    Raises:
        UserError: viser is not installed, or nothing can listen on 127.0.0.1.
    """
    library = import_optional("viser", "a viewer in the browser needs the package viser: pip install 'mrhubo[view]'")
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it tells of itself
            server = library.ViserServer(host=HOST, port=port, verbose=False)
    except OSError as error:
        raise UserError(f"{HOST}: nothing can listen there: {error.strerror or error}") from error
    server.request_share_url = _stays_here
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _stays_here(verbose: bool = True) -> None:
    """Stands in for viser's tunnel through a server on the internet, for which any page that finds ours could ask."""
