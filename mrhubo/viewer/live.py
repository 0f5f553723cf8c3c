"""A stage in the browser, for as long as somebody looks at it."""

from __future__ import annotations

import time
from collections.abc import Callable

from mrhubo.viewer.controls import Controls
from mrhubo.viewer.player import Player
from mrhubo.viewer.scene import Scene
from mrhubo.viewer.server import HOST, local_server
from mrhubo.viewer.stage import Stage

_TICK_S = 1 / 40
"""How often [s] figures are moved, at most: faster than what a page draws on most machines, and little work."""


def serve(
    stage: Stage,
    port: int,
    ready: Callable[[str], None] = print,
    ended: Callable[[], bool] = lambda: False,
) -> None:
    """Shows a stage in the browser until Ctrl-C.

    Args:
        stage: what is shown.
        port: where the page is; the next free one, if another program listens there.
        ready: told the page's address.
        ended: asked before every move whether that is enough.

    Raises:
        UserError: viser is not installed.
    """
    with local_server(port) as server:
        scene, player = Scene(server, stage), Player(stage.duration)
        controls = Controls(server, scene, player)
        ready(f"http://{HOST}:{server.get_port()}")
        last = time.perf_counter()
        try:
            while not ended():
                now = time.perf_counter()
                moment = player.advance(now - last)
                last = now
                scene.show(moment)
                controls.show(moment, now)
                time.sleep(max(0.0, _TICK_S - (time.perf_counter() - now)))
        except KeyboardInterrupt as stop:
            if type(stop) is not KeyboardInterrupt:  # asked to end from outside: the command says so
                raise
