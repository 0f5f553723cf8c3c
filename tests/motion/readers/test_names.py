"""How those in a file are named in sentences."""

from __future__ import annotations

from mrhubo.motion.readers.names import several


def test_a_few_are_all_told() -> None:
    told = [("walk", "2 s"), ("x" * 50, "1 s")]
    assert several(told, "wal") == f"'walk' (2 s), '{'x' * 37}...' (1 s)"


def test_of_many_the_nearest_is_told() -> None:
    told = [(f"take{number}", f"{20 - number} s") for number in range(12)] + [("walk", "1 s")]
    assert several(told).startswith("'take0' (20 s), ") and several(told).endswith("'take9' (11 s), and 3 more")
    assert several(told, "wlak").endswith("'take9' (11 s), and 3 more; nearest: 'walk'")
    assert several(told, "something else") == several(told)
