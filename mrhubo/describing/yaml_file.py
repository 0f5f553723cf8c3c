"""The config of a robot that was described: short, with how sure every entry is, what told it, and what else it may be.

It is a file for people: they look at the picture, change what is wrong, and never come back to the detection.
"""

from __future__ import annotations

import math
import os
import shlex
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from mrhubo.config import flow_yaml
from mrhubo.errors import listed, printable
from mrhubo.robot.discovery import Discovery, FoundEnd
from mrhubo.robot.discovery.ranges import NOUGHT
from mrhubo.robot.entries import DEFAULT_AXES
from mrhubo.robot.keypoints import entry_names
from mrhubo.robot.parts import CHEST, PARTS, UPPER_BODY, BodyPart

_WIDTH = 120
_FINE = 1e5
"""Parts of a metre or a radian that are written."""
_HEAD = """\
# What `mrhubo describe` found in {source}. Look at {picture}, beside this file, first. Every entry may be changed:
#   mrhubo describe {file}  # draws the picture anew
#   {next}
#
# {points} are joint centres, where axes meet: {{link: NAME, offset: [x, y, z]}} is a point [m] in
# the frame of that link, and a link's name alone is the origin of its frame. Directions are in the frame of their link.
# With every entry: how sure it is, from 0 to 1, and what told it.
"""


def described_yaml(found: Discovery, urdf: Path, file: Path, picture: Path, source: str) -> str:
    """The text of a config.

    Args:
        found: what was found out about the robot.
        urdf: its URDF.
        file: where the text is going to be; the path of the URDF is written relative to it.
        picture: where its picture is going to be.
        source: what the user named, for the comment at the top.
    """
    words = {
        "source": source,
        "picture": picture.name,
        "file": shlex.quote(str(file)),
        "next": next_command(found, file),
    }
    words["points"] = "Hips, knees, elbows, ..." if found.whole_body else "Shoulders, elbows and wrists"
    head = _HEAD.format(**{word: printable(text) for word, text in words.items()})
    lines = [*head.splitlines(), *_questions(found), "robot:"]
    lines += [f"  name: {flow_yaml(file.stem)}", f"  urdf: {flow_yaml(relative(urdf, file))}"]
    lines += [*_joints(found), "  keypoints:", *_keypoints(found)]
    lines += _wrapped("  key_links: [", map(flow_yaml, found.key_links), "]")
    if found.ranges:
        lines.append("  ranges:  # [rad]")
        for joint, limits in found.ranges.items():
            lines += _entry(f"    {flow_yaml(joint)}: {flow_yaml(_inward(limits.lower, limits.upper))}", limits.why)
    if doubts := unsure(found):
        lines += _comments(2, "Guesses: look at these entries, and take their names out when they are right.")
        lines.append(f"  unsure: {flow_yaml(list(doubts))}")
    return "\n".join([*lines, *_others(found)]) + "\n"


def next_command(found: Discovery, file: Path) -> str:
    """What makes a robot of this config move: a fit, or, for a whole body, the optimiser, which needs none."""
    word = shlex.quote(str(file))
    if found.whole_body:
        return f"mrhubo retarget --robot {word} --motion walk.npz --out robot.npz"
    return f"mrhubo fit {word}"


def _table(found: Discovery) -> tuple[BodyPart, ...]:
    """The rows of the table of body parts that a config is about."""
    return PARTS if found.whole_body else UPPER_BODY


def unsure(found: Discovery) -> dict[str, str]:
    """The entries of the config that are guesses, and what was asked about each."""
    ours, theirs = set(entry_names(_table(found))), {*found.points, *found.ends, *found.chains}
    chains = {chain for chain, joints in found.chains.items() if set(joints) & set(found.joints)}
    doubts: dict[str, list[str]] = {}
    for question in found.questions:
        if question.about in ours | chains or question.about not in theirs:
            about = CHEST.name if question.about in CHEST.words else question.about
            doubts.setdefault(about, []).append(question.text)
    return {about: " ".join(texts) for about, texts in doubts.items()}


def keypoint_entries(found: Discovery) -> dict[str, Any]:
    """What was found, as `robot.keypoints` of a config."""
    ends = {name: end_entry(end) for name, end in found.ends.items()}
    entries = {name: point_entry(point.link, point.offset_3) for name, point in found.points.items()} | ends
    return {name: entries[name] for name in entry_names(_table(found)) if name in entries}


def relative(path: Path, file: Path) -> str:
    """A path as a config in `file` names it: relative to it, unless the two have nothing in common."""
    path, folder = Path(os.path.abspath(path)), Path(os.path.abspath(file)).parent
    shared = Path(os.path.commonpath([path, folder]))
    return str(path) if shared == Path(shared.anchor) else os.path.relpath(path, folder)


def _questions(found: Discovery) -> Iterator[str]:
    if not found.questions and not found.notes:
        return
    yield "#"
    for note in found.notes:
        yield from _comments(0, f"Note: {note}")
    for question in found.questions:
        among = f"; candidates: {listed(question.candidates)}" if question.candidates else ""
        yield from _comments(0, f"To answer: {question.about}: {question.text}{among}")


def _joints(found: Discovery) -> Iterator[str]:
    """The joints, a line or more a chain."""
    yield "  joints: ["
    rest = list(found.joints)
    for chain, members in found.chains.items():
        moved = [joint for joint in members if joint in rest]
        rest = [joint for joint in rest if joint not in moved]
        if moved:
            way = "from the pelvis to the chest" if chain == "waist" else "from the body outwards"
            yield f"    # {printable(chain.replace('_', ' '))}, {way}"
            yield from _wrapped("    ", map(flow_yaml, moved), ",")
    yield from _wrapped("    ", map(flow_yaml, rest), ",") if rest else ()
    yield "  ]"


def _keypoints(found: Discovery) -> Iterator[str]:
    for name, entry in keypoint_entries(found).items():
        part = found.ends.get(name) or found.points[name]
        yield from _entry(f"    {name}: {flow_yaml(entry)}", f"{part.confidence:.2f}: {part.cue}")
        for other in part.candidates:
            if isinstance(part, FoundEnd):
                choice: Any = {"link": other.link, **_axes(part)}
            else:
                choice = point_entry(other.link, other.offset_3)
            yield f"    # {name}: {flow_yaml(choice)}  # or: {printable(other.why)}"


def point_entry(link: str, offset_3: Sequence[float]) -> str | dict[str, Any]:
    """The entry of a joint's centre."""
    offset = [_number(metres) for metres in offset_3]
    return {"link": link, "offset": offset} if any(offset) else link


def end_entry(end: FoundEnd) -> str | dict[str, Any]:
    """The entry of an oriented part."""
    axes = _axes(end)
    axes = {} if all(axes[word] == list(DEFAULT_AXES.get(word, ())) for word in axes) else axes
    sole = {} if end.sole_3 is None else {"sole": list(end.sole_3)}
    return {"link": end.link, **axes, **sole} if axes or sole else end.link


def _axes(end: FoundEnd) -> dict[str, list[float]]:
    return {
        word: [_number(number) if abs(number) > NOUGHT else 0.0 for number in axis] for word, axis in end.axes.items()
    }


def _inward(lower: float, upper: float) -> list[float]:
    """A range as short numbers, none of which leaves it: a limit of the URDF may be one of its ends."""
    return [math.ceil(lower * _FINE) / _FINE, math.floor(upper * _FINE) / _FINE]


def _number(value: float) -> float:
    """Hundredths of a millimetre, or of a milliradian."""
    return round(float(value) * _FINE) / _FINE + 0.0  # no -0.0


def _others(found: Discovery) -> Iterator[str]:
    """What the robot has besides, for the reader to know that it was seen."""
    for title, joints in (("Held, as nothing here tells them", found.held), ("No part of the body", found.left_out)):
        by_reason: dict[str, list[str]] = {}
        for joint, why in joints.items():
            by_reason.setdefault(why, []).append(joint)
        for why, names in by_reason.items():
            yield from _comments(2, f"{title}: {listed(names)} ({why}).")


def _entry(text: str, told: str) -> Iterator[str]:
    """An entry with its comment: behind it where there is room, else above it."""
    told = printable(told)
    if len(text) + 4 + len(told) <= _WIDTH:
        yield f"{text}  # {told}"
        return
    yield from _comments(len(text) - len(text.lstrip()), told)
    yield text


def _comments(indent: int, text: str) -> Iterator[str]:
    lines = textwrap.wrap(printable(text), _WIDTH - indent - 2, break_on_hyphens=False)
    yield from (f"{' ' * indent}# {line}" for line in lines)


def _wrapped(start: str, items: Iterable[str], end: str) -> Iterator[str]:
    """``start item, item, ... end`` on as many lines as it needs."""
    line = start
    for place, item in enumerate(items):
        more = f"{', ' if place else ''}{item}"
        if place and len(line) + len(more) + len(end) + 1 > _WIDTH:
            yield f"{line},"
            line = " " * len(start) + item
        else:
            line += more
    yield line + end
