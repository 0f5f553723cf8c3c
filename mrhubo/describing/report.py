"""What a description says in the terminal: every choice, how sure it is, what told it; then what is to be answered."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrhubo.config import flow_yaml
from mrhubo.describing.yaml_file import keypoint_entries, unsure
from mrhubo.errors import printable
from mrhubo.robot.discovery import Discovery, FoundAxis

_WIDTH = 120


def report(found: Discovery, file: Path) -> str:
    """The choices of a discovery, and what `file`, its config, leaves open."""
    return "\n".join([*_choices(found), "", *_chains(found), *_notes(found), *_questions(found, file)])


def _choices(found: Discovery) -> Iterator[str]:
    yield f"faces {_direction(found.forward)}"
    yield f"up is {_direction(found.up)}"
    yield ""
    entries = keypoint_entries(found)
    width = max(map(len, entries), default=0)
    for name, entry in entries.items():
        part = found.ends.get(name) or found.points[name]
        yield f"{name:<{width}}  {flow_yaml(entry)}"
        told, indent = f"{part.confidence:.2f}: {printable(part.cue)}", " " * (width + 4)
        yield from textwrap.wrap(told, _WIDTH, initial_indent=indent, subsequent_indent=f"{indent}      ")


def _direction(axis: FoundAxis) -> str:
    """``+x of the root's frame (0.90: the knees bend backwards)``."""
    vector_3 = np.array(axis.root_3)
    main = int(np.abs(vector_3).argmax())
    exact = abs(vector_3[main]) > 0.999
    shown = f"{'-' if vector_3[main] < 0 else '+'}{'xyz'[main]}" if exact else str([round(x, 3) for x in axis.root_3])
    return f"{shown} of the root link's frame ({axis.confidence:.2f}: {printable(axis.cue)})"


def _chains(found: Discovery) -> Iterator[str]:
    moved = set(found.joints)
    parts = [
        f"{name.replace('_', ' ')} {sum(joint in moved for joint in joints)}"
        for name, joints in found.chains.items()
        if moved & set(joints)
    ]
    held, others = len(found.held), len(found.left_out)
    yield f"{len(found.joints)} joints move ({', '.join(parts)}); {held} are held, {others} are no part of the body"
    for joint, limits in found.ranges.items():
        yield f"{printable(joint)}: {limits.lower:.4g} .. {limits.upper:.4g} rad: {printable(limits.why)}"


def _notes(found: Discovery) -> Iterator[str]:
    for note in found.notes:
        yield f"note: {printable(note)}"


def _questions(found: Discovery, file: Path) -> Iterator[str]:
    doubts = unsure(found)
    if not doubts:
        return
    yield ""
    yield f"Not decided. Correct or confirm these entries in {file}, and take their names out of `unsure` there:"
    for about, text in doubts.items():
        yield from textwrap.wrap(f"{about}: {printable(text)}", _WIDTH, initial_indent="  ", subsequent_indent="    ")
