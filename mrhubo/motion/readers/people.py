"""Dictionaries of people, or of clips: SMPL parameters of each, whatever else lies beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mrhubo.errors import listed, shortened
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.key_words import without_world, words_of
from mrhubo.motion.readers.smpl_names import Found, find_here, first_entries, search
from mrhubo.motion.readers.tracks import Track

_BESIDE = {
    "camera",
    "cameras",
    "cam",
    "intrinsics",
    "extrinsics",
    "meta",
    "metadata",
    "info",
    "config",
    "settings",
    "args",
}
"""Words in names of what lies beside people, and is nobody."""


@dataclass(frozen=True)
class People:
    """Who is in a dictionary."""

    found: tuple[tuple[str, Found], ...]
    """Names, and where each one's parameters are."""
    notes: tuple[str, ...] = ()
    """Which entries look like people and are left out."""

    @property
    def tracks(self) -> list[Track]:
        """Of all of them."""
        return [track for name, found in self.found for track in found.tracks(name)]


def people_in(node: Tree) -> People | None:
    """SMPL parameters of each entry of a dictionary of people, with their names; None where it is none.

    An entry has them itself, or in dictionaries one deeper, the numbers of frames beside those. Two entries that have
    some are two people, unless they are one's, in the world and as a camera sees them; a single one is a person where
    it is alone, or called by a number. Whatever else is in the dictionary goes for all, or is left out.
    """
    if not node.is_mapping:
        return None
    likely = _holders(list(first_entries(node)))
    if not likely or _are_twins(likely):
        return None
    if len(likely) == 1:
        ((name, found),) = likely
        if not name.isdecimal() and len(node) > 1:
            return None
        inner = people_in(found.outer) if found.outer is not None and found.node is not found.outer else None
        deeper = [] if inner is None else [inner_name for inner_name, _ in inner.found]
        if len(deeper) > 1 or (any(map(str.isdecimal, deeper)) and not name.isdecimal()):
            return None
    entries = list(node.items())
    people = tuple(_holders(entries))
    names = {name for name, _ in people}
    rest = [name for name, child in entries if child.is_mapping and name not in names]
    others = [name for name in rest if not _BESIDE & set(words_of(name))]
    note = f"left out, as there are no SMPL parameters of frames in them: {shortened(listed(others), 200)}"
    return People(people, (note,) if others else ())


def has_twins(node: Tree) -> bool:
    """Whether a dictionary has the parameters of one person in the world and as a camera sees them."""
    return _are_twins(_holders(list(first_entries(node))))


def holds_parameters(node: Tree) -> bool:
    """Whether a dictionary has SMPL parameters, itself or one deeper."""
    return _of_person(node) is not None


def _holders(entries: list[tuple[str, Tree]]) -> list[tuple[str, Found]]:
    """Entries that have parameters; only those that have them themselves, where two do."""
    found = [(name, place) for name, child in entries if (place := _of_person(child)) is not None]
    direct = [(name, place) for name, place in found if place.node is place.outer]
    return direct if len(direct) > 1 else found


def _are_twins(holders: list[tuple[str, Found]]) -> bool:
    """Whether several entries are one person's, in the world and as a camera sees them."""
    return len(holders) > 1 and len({without_world(name) for name, _ in holders}) == 1


def _of_person(node: Tree) -> Found | None:
    found = search(node, find_here, deepest=1) if node.is_mapping else None
    return None if found is None else replace(found, outer=node)
