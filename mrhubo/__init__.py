"""mrhubo: human-to-humanoid motion retargeting that learns from robot poses (MR.HuBo)."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("mrhubo")
except PackageNotFoundError:  # run from a source tree that is not installed
    __version__ = "0.1.0"
