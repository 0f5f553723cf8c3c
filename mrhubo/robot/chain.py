"""pytorch-kinematics' kinematic chain, without the plotting library that its import asks for.

Its package imports `matplotlib.pyplot`, for one picture of its inverse kinematics, which nothing here calls. That is 30
MB and most of a second which a robot's computer has no use for, so matplotlib need not be there, and is not loaded.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pytorch_kinematics.chain import Chain


def build_chain(xml: bytes) -> Chain:
    """The chain of a URDF's joints and links."""
    with _without_matplotlib():
        import pytorch_kinematics

    return pytorch_kinematics.build_chain_from_urdf(xml)


@contextmanager
def _without_matplotlib() -> Iterator[None]:
    """Empty modules in its place while something is imported, unless it has been imported already."""
    if "matplotlib" in sys.modules or "pytorch_kinematics" in sys.modules:
        yield
        return
    names = ("matplotlib", "matplotlib.pyplot", "matplotlib.cm")
    top, pyplot, cm = (ModuleType(name) for name in names)
    top.__dict__.update(pyplot=pyplot, cm=cm)
    sys.modules.update(zip(names, (top, pyplot, cm), strict=True))
    try:
        yield
    finally:
        for name in names:
            del sys.modules[name]
