"""What a stranger's pickle is read as: records of objects; and a stream for who finds other things in its midst."""

from __future__ import annotations

from typing import Any, Protocol

from mrhubo.errors import UserError


class RecordedObject:
    """What a pickled object was called, made with, and given as its state; it does nothing."""

    __slots__ = ("args", "state")
    module = ""
    args: tuple[Any, ...]
    state: Any

    def __new__(cls, *args: Any, **_: Any) -> RecordedObject:
        """Records what the pickle calls the class with."""
        self = object.__new__(cls)
        self.args, self.state = args, None
        return self

    @property
    def kind(self) -> str:
        """Module and name."""
        return f"{self.module}.{type(self).__name__}"


class UnreadablePickle(UserError):
    """What is no pickle at all, or a damaged one."""


class Stream(Protocol):
    """A pickle that is being read, for who finds something else in the midst of it."""

    def take(self, size: int) -> bytes:
        """The next bytes of the file, behind what was unpickled so far; fewer at its end."""
        ...

    def passed(self, size: int) -> int | None:
        """Passes over the next bytes of a file on disk, and gives the place where they begin; None, and nothing is
        passed, where there is no such file, or it has not so many.
        """
        ...

    def nested(self) -> Any:
        """What the pickle that comes next in the file holds."""
        ...
