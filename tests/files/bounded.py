"""How much memory and time something may take at most."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def bounded(megabytes: float, seconds: float) -> Iterator[None]:
    """Fails where what Python and NumPy allocate inside peaks higher, or where this process works longer: on a busy
    machine time passes that nobody works.
    """
    tracemalloc.start()
    start = time.process_time()
    try:
        yield
    finally:
        took, peak = time.process_time() - start, tracemalloc.get_traced_memory()[1] / 1e6
        # A thread that allocates while it waits for the interpreter, as one that starts does, would note that in what
        # is gone once tracing has ended, and the process with it (CPython gh-128679): it is let go first.
        time.sleep(1e-3)
        tracemalloc.stop()
    assert peak < megabytes, f"took {peak:.0f} MB"
    assert took < seconds, f"took {took:.1f} s"
