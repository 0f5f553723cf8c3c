"""Messages for live sessions, as senders write them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from mrhubo.live.messages import VERSION

REST = [[0.0, 0.0, 0.0]] * 21


def message(number: int, kind: str = "rotations", time: float = 0.0, session: str = "s", **more: Any) -> bytes:
    """One message; rotations are of a person at rest unless given."""
    if kind == "rotations":
        more.setdefault("rotations", REST)
    told = {"mrhubo": VERSION, "session": session, "number": number, "time": time, "kind": kind, **more}
    return json.dumps(told).encode()


def beat(number: int, time: float = 0.0, held: bool = True, session: str = "h") -> bytes:
    return message(number, "heartbeat", time, session, held=held)


def landmarks(number: int, points: Mapping[str, Any], time: float = 0.0, **more: Any) -> bytes:
    """Named points."""
    rows = [np.asarray(point, float).tolist() for point in points.values()]
    return message(number, "landmarks", time, set="named", names=list(points), points=rows, **more)
