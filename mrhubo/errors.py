"""The exceptions that mean "the user can fix this": printed as one sentence, exit code 2, no traceback; the warning
that means "look at this"; and what sentences are made of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable


class UserError(Exception):
    """A mistake in a config, a file or a command line: what is wrong, where, and what to do about it."""


class Unreachable(UserError):
    """A server or a database did not answer, or refused: nothing is wrong with the work, and the same command goes on
    when it does.
    """


class InputWarning(UserWarning):
    """Something in a config or a file that is odd but may be meant: one sentence, and the work goes on."""


def unknown_name(
    kind: str, name: str, available: Iterable[str], where: str = "", telling: Callable[[str], str] = str
) -> str:
    """One sentence: ``link 'Hed' does not exist in nao.urdf; nearest: 'Head'``, or what is available where no name is
    near.

    Args:
        kind: what is named, for instance ``link``.
        name: the name that does not exist.
        available: those that do.
        where: what was searched, if that has to be said, for instance ``nao.urdf``.
        telling: function of a name that gives what tells it from others, for instance of a path its stem.
    """
    names = sorted(available)
    missing = f"{kind} '{name}' does not exist" + (f" in {where}" if where else "")
    of = {telling(other): other for other in names}
    near = nearest(telling(name), of)
    if near is not None:
        return f"{missing}; nearest: '{of[near]}'"
    return f"{missing}; available: {listed(names)}"


def shortened(text: object, most: int = 80) -> str:
    """What a stranger wrote, fit for a sentence: not too long, and without letters that a terminal would obey."""
    shown = printable(str(text)[: most + 1])
    return shown if len(shown) <= most else shown[: most - 3] + "..."


def printable(text: str) -> str:
    """The text with an escape for every letter that a terminal would obey."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def encodable(text: str) -> str:
    """The text as a file can hold it in UTF-8: what a file's name has that the system could not read is read as UTF-8,
    and where it is none, a mark stands in its place.
    """
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    except UnicodeEncodeError:  # halves of letters that stand for no byte
        return text.encode("utf-8", "replace").decode("utf-8")


def first_line(error: BaseException) -> str:
    """What an error says, without what libraries write below it; its type, if it says nothing."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def listed(names: Iterable[str]) -> str:
    """The first thirty names in order, with commas; ``none`` if there are none."""
    names = sorted(names)
    return (", ".join(names[:30]) + (", ..." if len(names) > 30 else "")) or "none"


def nearest(name: str, available: Iterable[str]) -> str | None:
    """The name that was most likely meant; None where no name is so near that it is more than a guess.

    Near is: the same but for capitals, hyphens and underscores; one letter (in long names two or three) that is wrong,
    missing, too many, or swapped with the next; the beginning or a word of one name and of no other; or the name and
    more behind it.
    """
    names, wanted = list(available), _bare(name)
    distances = {other: _edits(wanted, _bare(other)) for other in names if abs(len(other) - len(name)) <= 6}
    allowed = min(1 + len(wanted) // 6, 3)
    close = [other for other, distance in distances.items() if distance <= allowed]
    if close:
        return min(close, key=lambda other: (distances[other], other))
    words = name.lower().replace("-", "_")
    for test in (
        lambda other: len(wanted) >= 3 and _bare(other).startswith(wanted),
        lambda other: len(wanted) >= 2 and f"_{words}_" in f"_{other.lower().replace('-', '_')}_",
        lambda other: len(other) >= 3 and words.startswith(f"{other.lower()}_"),
    ):
        found = [other for other in names if test(other)]
        if len(found) == 1:
            return found[0]
    return None


def _bare(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter not in "-_ ")


def _edits(a: str, b: str) -> int:
    """Letters to replace, add or take away, or neighbours to swap, until one text is the other (optimal string
    alignment distance).
    """
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, start=1):
        before, last, row = row, before, [i]
        for j, y in enumerate(b, start=1):
            cost = min(before[j] + 1, row[-1] + 1, before[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
    return row[-1]


def was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is at the root of an error: libraries make errors of their own of an interrupt in their midst."""
    seen: list[BaseException] = []
    while error is not None and error not in seen:
        if isinstance(error, KeyboardInterrupt):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__
    return False
