"""What of the messages that come is taken: the newest of one sender, in order and in time. The rest is counted."""

from __future__ import annotations

from collections import Counter, OrderedDict
from collections.abc import Callable

from mrhubo.live.body import SeenPose
from mrhubo.live.messages import Heartbeat, Landmarks, Message, Nobody, Refused, read_message

FAULTS = (
    "malformed", "version", "too_long", "host", "origin", "token",
    "repeated", "late", "other_sender", "superseded", "overflow",
)  # fmt: skip
"""Kinds of messages that change nothing: not what docs/live.md specifies; of another version; too long; of a web page
that is not ours, by its Host or its Origin; without the session's token; not newer than one that was taken; delayed; of
a sender while another one steers; a frame that a newer one replaced before it was needed; more at once than are kept.
"""
LEASE = 1.0
"""Seconds of silence after which another sender may take over."""
_SESSIONS = 64
"""So many senders are remembered, so that none of their messages is taken twice."""
_DRIFT = 1e-3
"""Two clocks run apart by less than this [s/s]."""
_LONG_AGO = -1e9

Frame = Landmarks | SeenPose | Nobody
Sender = tuple[str, str]
"""A connection or an address, and the session that its messages tell."""


class _Lane:
    """Who steers, by one kind of messages, and by how much that sender's clock is behind ours."""

    def __init__(self) -> None:
        self.owner: Sender | None = None
        self.at = _LONG_AGO
        """When it was heard of last [s], on our clock."""
        self._offset: float | None = None

    def delay(self, message: Message, who: Sender, now: float, late: float) -> float:
        """How much later [s] than the quickest a message came.

        Raises:
            Refused: another sender steers, or it is late.
        """
        silent = now - self.at > LEASE
        if who != self.owner and not silent:
            raise Refused("other_sender")
        fastest = now - message.time
        if who == self.owner and self._offset is not None and not silent:  # else its clock may have been set
            fastest = min(fastest, self._offset + _DRIFT * (now - self.at))
        delay = now - message.time - fastest
        if delay > late:
            raise Refused("late")
        self.owner, self.at, self._offset = who, now, fastest
        return delay


class Inbox:
    """The messages of a session. It holds one frame at most, however many come."""

    def __init__(self, late: float) -> None:
        """`late`: as `LiveConfig.late` [s]."""
        self.counts: Counter[str] = Counter(dict.fromkeys(("frames", "heartbeats", *FAULTS), 0))
        self.clock: Callable[[], float] | None = None
        """Our clock [s], which is read anew for each message, where one runs: a process that is held up between its
        period's beginning and its messages would take those for ones that came before they were sent, and all later
        ones for late. None: each message comes at the time that it is offered with.
        """
        self.held = False
        """Whether the last heartbeat told that the button is held."""
        self.heartbeat_at = self.frame_at = _LONG_AGO
        """When the last ones would have been here [s], on our clock, had they come as quickly as the quickest."""
        self._late = late
        self._frame: Frame | None = None
        self._frames, self._heartbeats = _Lane(), _Lane()
        self._numbers: OrderedDict[Sender, int] = OrderedDict()

    def offer(self, data: bytes | str | Message, sender: str, now: float) -> bool:
        """Takes a message, or counts why not.

        Args:
            data: as it came, or as a source made it.
            sender: which connection or address it came from.
            now: our clock [s] as the period began; not asked where there is a `clock`.
        """
        now = now if self.clock is None else self.clock()
        try:
            self._take(data if isinstance(data, Message) else read_message(data), sender, now)
        except Refused as fault:
            self.counts[str(fault)] += 1
            return False
        return True

    def gone(self, sender: str) -> None:
        """A connection has ended: if it held the button, nobody does now, and whatever it steered is free."""
        for lane in (self._frames, self._heartbeats):
            if lane.owner is not None and lane.owner[0] == sender:
                lane.at = _LONG_AGO
                self.held = self.held and lane is not self._heartbeats

    def take_frame(self) -> Frame | None:
        """The newest frame since the last call."""
        frame, self._frame = self._frame, None
        return frame

    def _take(self, message: Message, sender: str, now: float) -> None:
        who, content = (sender, message.session), message.content
        if message.number <= self._numbers.get(who, -1):
            raise Refused("repeated")
        beats = isinstance(content, Heartbeat)
        seen_at = now - (self._heartbeats if beats else self._frames).delay(message, who, now, self._late)
        self._numbers[who] = message.number
        self._numbers.move_to_end(who)
        while len(self._numbers) > _SESSIONS:
            self._numbers.popitem(last=False)
        if isinstance(content, Heartbeat):
            self.counts["heartbeats"] += 1
            self.held, self.heartbeat_at = content.held, seen_at
            return
        self.counts["frames"] += 1
        self.counts["superseded"] += self._frame is not None
        self._frame, self.frame_at = content, seen_at
