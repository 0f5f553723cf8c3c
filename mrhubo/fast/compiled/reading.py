"""Kernels that numba has kept are read without what numba needs to compile.

Before numba looks into its cache, it imports all that it can compile, and SciPy where it is installed, and makes tables
of it: a quarter of a second, which is a third of a process's time to its first answer. Machine code needs none of that,
only the memory management that it calls. What is missing in the cache is compiled as ever; numba gets ready then.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba.core.runtime.nrt import rtsys  # pyright: ignore[reportMissingImports]

_NEEDED = ("load_overload", "_load_overload", "_guard_against_spurious_io_errors")
"""Of numba's cache; what is not there in some version of it leaves its own way."""


def read_quickly(kernel: Any) -> Any:
    """The same kernel."""
    cache = getattr(kernel, "_cache", None)
    if all(hasattr(cache, name) for name in _NEEDED) and hasattr(rtsys, "initialize"):
        cache.load_overload = partial(_load, cache)  # pyright: ignore[reportOptionalMemberAccess]
    return kernel


def _load(cache: Any, signature: Any, target_context: Any) -> Any:
    """As numba's `load_overload`, but for the target's refreshing."""
    rtsys.initialize(target_context)
    with cache._guard_against_spurious_io_errors():
        return cache._load_overload(signature, target_context)
