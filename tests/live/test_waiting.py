"""What waits for the session is bounded, whoever sends it."""

from __future__ import annotations

from mrhubo.live.messages import MAX_BYTES
from mrhubo.live.waiting import MOST, Waiting


def test_the_newest_wait_and_the_rest_is_counted() -> None:
    waiting = Waiting()
    for number in range(MOST + 5):
        waiting.put("a", str(number))
    messages, gone, lost = waiting.take()
    assert [data for _, data in messages] == [str(number) for number in range(5, MOST + 5)]
    assert (gone, lost) == ([], 5) and waiting.take() == ([], [], 0)


def test_large_messages_are_fewer() -> None:
    waiting = Waiting()
    for _ in range(50):
        waiting.put("a", b"x" * MAX_BYTES)
    messages, _, lost = waiting.take()
    assert len(messages) == 2 and lost == 48
    waiting.put("a", b"x" * 10 * MAX_BYTES)
    assert len(waiting) == 1, "one always waits"


def test_a_client_that_has_gone_is_not_lost_in_a_flood() -> None:
    waiting = Waiting()
    waiting.end("gone")
    for number in range(1_000):
        waiting.put("a", str(number))
    assert waiting.take()[1] == ["gone"]
