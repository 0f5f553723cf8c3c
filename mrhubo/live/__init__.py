"""A robot follows a person who is seen now: frames come in, joint angles go out, safely (docs/live.md).

`run(LiveRobot.of_package("package", LiveConfig()), [UdpSource(Endpoint("127.0.0.1", 8766))], [sink])` is all of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.lazy import lazy_names

if TYPE_CHECKING:
    from mrhubo.config.live import LiveConfig
    from mrhubo.live.endpoints import Endpoint
    from mrhubo.live.inbox import Inbox
    from mrhubo.live.loop import Session, Sink, Source, run
    from mrhubo.live.messages import Message
    from mrhubo.live.output import Output
    from mrhubo.live.robot import LiveRobot
    from mrhubo.live.sources.replay import ReplaySource
    from mrhubo.live.sources.udp import UdpSource

__all__ = [
    "Endpoint",
    "Inbox",
    "LiveConfig",
    "LiveRobot",
    "Message",
    "Output",
    "ReplaySource",
    "Session",
    "Sink",
    "Source",
    "UdpSource",
    "run",
]
_HOMES = {
    "Endpoint": ".endpoints",
    "Inbox": ".inbox",
    "LiveConfig": "mrhubo.config.live",
    "LiveRobot": ".robot",
    "Message": ".messages",
    "Output": ".output",
    "ReplaySource": ".sources.replay",
    "Session": ".loop",
    "Sink": ".loop",
    "Source": ".loop",
    "UdpSource": ".sources.udp",
    "run": ".loop",
}
"""Module of each name, imported when it is first asked for."""

__getattr__ = lazy_names(__name__, _HOMES)
