"""What every benchmark prints: machine, commit, command, and a table."""

from __future__ import annotations

import platform
import shlex
import sys
from collections.abc import Sequence

import torch

from mrhubo.locations import project_root
from mrhubo.tracking import git_commit


def print_header() -> None:
    """Machine, commit and command."""
    processor = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo") as lines:
            processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    device = torch.cuda.get_device_name() if torch.cuda.is_available() else "no GPU"
    print(f"machine: {processor}, {torch.get_num_threads()} threads, {device}, torch {torch.__version__}")
    print(f"commit:  {git_commit(project_root())}")
    print(f"command: python {shlex.join(sys.argv)}\n")


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A Markdown table with aligned columns."""
    table = [list(columns), *[list(row) for row in rows]]
    widths = [max(len(row[i]) for row in table) for i in range(len(columns))]
    lines = ["| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |" for row in table]
    lines.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    print("\n".join(lines))
