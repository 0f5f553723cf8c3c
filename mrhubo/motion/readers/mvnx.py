"""Recordings of Xsens MVN in XML (.mvnx): how a body's segments are turned, where they begin, and planted feet.

A `subject` has a `frameRate`, `segments` with a label each, and `frames`; a frame's `orientation` and `position` have
four and three numbers a segment. Frames of another type than `normal` are poses for calibration (Xsens MVN User Manual,
"MVNX"). World: z up [m].

Legend: T frames, S segments of the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.regular import open_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate, told_rate
from mrhubo.motion.readers.tracks import Person, choose
from mrhubo.motion.readers.xsens import SEGMENTS, segments_motion

_MAX_BYTES = 8 * 2**30
_MAX_FRAMES = 500_000
_MAX_SEGMENTS = 200
_START = re.compile(r"\s*+(?:<\?xml[^>]{0,400}+>)?\s*+(?:<!--.{0,2000}?-->\s*+)*<(?:\w+:)?mvnx\b", re.DOTALL)
_POINTS = ("LeftFoot_Heel", "LeftFoot_Toe", "RightFoot_Heel", "RightFoot_Toe")
"""What the file calls `mrhubo.motion.motion.SOLE_POINTS`."""
_TURNS, _PLACES = "orientation", "position"


@dataclass
class _Subject:
    """Somebody who was recorded."""

    label: str
    rate: str | None
    segments: list[str] = field(default_factory=list)
    contacts: dict[str, int] = field(default_factory=dict)
    """Places of contacts in a frame's list, by their names."""
    rows: dict[str, list[np.ndarray]] = field(default_factory=lambda: {_TURNS: [], _PLACES: [], "footContacts": []})


def is_mvnx(content: Content) -> bool:
    """Whether a file begins as MVNX does."""
    return content.text is not None and bool(_START.match(content.text))


def read_mvnx(path: Path, options: ReadOptions) -> Motion:
    """Reads the motion of one of those who were recorded.

    Raises:
        NoMotion: of nobody the whole body was recorded.
        UserError: the file is missing, damaged or too large, or the frame rate is not known.
    """
    with open_regular(path, _MAX_BYTES) as handle:
        try:
            subjects = list(_subjects(path, handle))
        except (etree.XMLSyntaxError, ValueError) as error:
            raise UserError(f"{path}: is damaged: {shortened(error, 100)}; export it from MVN again") from error
    found = [subject for subject in subjects if subject.rows[_TURNS] or subject.rows[_PLACES]]
    if not found:
        raise NoMotion(f"{path}: is an MVNX file without frames of how segments are turned; export it with them")
    notes: list[str] = []
    people = {
        subject.label
        if sum(other.label == subject.label for other in found) < 2
        else f"{subject.label} {i + 1}": subject
        for i, subject in enumerate(found)
    }
    tracks = [Person(name, len(subject.rows[_TURNS])) for name, subject in people.items()]
    if len(tracks) > 1:
        subject = people[choose(path, tracks, options, notes).person]
    else:
        notes += options.of_one()
        subject = found[0]
    return _motion(path, subject, options, notes)


def _motion(path: Path, subject: _Subject, options: ReadOptions, notes: list[str]) -> Motion:
    """What was recorded of somebody."""
    missing = [name for name in SEGMENTS if name.lower() not in subject.segments]
    if missing:
        raise NoMotion(
            f"{path}: the whole body is needed, and segments {shortened(listed(missing), 100)} were not recorded"
        )
    frames, count = len(subject.rows[_TURNS]), len(subject.segments)
    if len(subject.rows[_PLACES]) != frames:
        raise UserError(
            f"{path}: has {frames:,} frames with an <{_TURNS}> and {len(subject.rows[_PLACES]):,} with a <{_PLACES}>;"
            " export both for all frames"
        )
    order = [subject.segments.index(name.lower()) for name in SEGMENTS]
    turn_TS4, place_TS3 = (
        _stacked(path, subject.rows[name], name, width * count).reshape(frames, count, width)[:, order]
        for name, width in ((_TURNS, 4), (_PLACES, 3))
    )
    rate = _rate(path, subject, options, notes)
    source = f"MVNX file of Xsens, {count} segments, z up"
    motion = segments_motion(path, turn_TS4, place_TS3, rate, source, tuple(notes), f"<{_PLACES}>")
    contacts = subject.rows["footContacts"]
    if len(contacts) == frames and all(name in subject.contacts for name in _POINTS):
        contact_TX = _stacked(path, contacts, "footContacts", len(contacts[0]))
        columns = [subject.contacts[name] for name in _POINTS]
        if max(columns) < contact_TX.shape[1]:
            motion = motion.changed(contact_T4=contact_TX[:, columns] > 0)
    return motion


def _rate(path: Path, subject: _Subject, options: ReadOptions, notes: list[str]) -> float:
    """Frames per second."""
    try:
        rate = float(subject.rate or "")
    except ValueError:
        return asked_rate(path, options, "its subject tells no frameRate")
    return told_rate(path, "'frameRate' is", rate, options, notes)


def _stacked(path: Path, rows: list[np.ndarray], name: str, width: int) -> np.ndarray:
    """Rows (T, width) of as many numbers each."""
    wrong = next((frame for frame, row in enumerate(rows) if len(row) != width), None)
    if wrong is not None:
        raise UserError(f"{path}: <{name}> of frame {wrong} holds {len(rows[wrong])} numbers; expected {width}")
    return np.stack(rows)


def _subjects(path: Path, handle: BinaryIO) -> Iterator[_Subject]:
    """Those who were recorded, with numbers a frame.

    Raises:
        UserError: there are too many frames, or something is no number.
    """
    subject = _Subject("", None)
    is_motion = is_body = False
    events = etree.iterparse(
        handle, events=("start", "end"), resolve_entities=False, no_network=True, load_dtd=False, huge_tree=True
    )
    for event, element in events:
        tag = etree.QName(element).localname if isinstance(element.tag, str) else ""
        if event == "start":
            if tag == "subject":
                subject = _Subject(element.get("label", ""), element.get("frameRate"))
            elif tag == "frame":
                is_motion = element.get("type", "normal").strip().lower() in ("normal", "")
            elif tag == "segments":
                is_body = True
            continue
        if tag == "segments":
            is_body = False  # fingers' segments come in lists of their own
        elif tag == "segment" and is_body and len(subject.segments) < _MAX_SEGMENTS:
            subject.segments.append(element.get("label", "").strip().lower())
        elif tag == "contactDefinition":
            subject.contacts.setdefault(element.get("label", ""), len(subject.contacts))
        elif tag in subject.rows and is_motion:
            rows = subject.rows[tag]
            try:
                rows.append(np.array((element.text or "").split(), dtype=np.float32))
            except ValueError as error:
                raise UserError(f"{path}: <{tag}> of frame {len(rows)} holds what is no number") from error
            if len(rows) > _MAX_FRAMES:
                raise UserError(f"{path}: has more than {_MAX_FRAMES:,} frames; cut it")
        elif tag == "subject":
            yield subject
            subject = _Subject("", None)
        if tag in ("frame", "segment", "sensor", "joint"):
            element.clear()
            while (before := element.getprevious()) is not None and before.tag == element.tag:
                element.getparent().remove(before)
    if subject.rows[_TURNS]:
        yield subject
