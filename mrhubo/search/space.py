"""A search space over config keys: read from YAML, checked against the schema, drawn from by an Optuna trial."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mrhubo.config import Config, SpaceEntry, SpaceRange, keys_of, typed_value
from mrhubo.errors import UserError, unknown_name

if TYPE_CHECKING:
    from optuna import Trial

_FIXED_SECTIONS = {
    "tracking": "it decides where runs go, not what they give",
    "evaluation": "trials are compared by it",
}


@dataclass(frozen=True)
class Dimension:
    """One config key and the values that it may take."""

    key: str
    choices: tuple[str, ...] = ()
    """Values as they are written on the command line; empty for a range."""
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    whole: bool = False

    def draw(self, trial: Trial) -> str:
        """`key=value` of a trial's value."""
        if self.choices:
            value: Any = trial.suggest_categorical(self.key, self.choices)
        elif self.whole:
            value = trial.suggest_int(self.key, int(self.low), int(self.high), log=self.log)
        else:
            value = trial.suggest_float(self.key, self.low, self.high, log=self.log)
        return f"{self.key}={value}"

    @property
    def extremes(self) -> list[str]:
        """`key=value` of all choices, or of both ends of the range."""
        numbers = (int(self.low), int(self.high)) if self.whole else (self.low, self.high)
        return [f"{self.key}={value}" for value in self.choices or numbers]

    def describe(self) -> str:
        """The dimension in a few words."""
        if self.choices:
            return ", ".join(self.choices)
        low, high = self.extremes
        return f"{low.split('=')[1]} .. {high.split('=')[1]}{', logarithmic' if self.log else ''}"


def read_space(space: Mapping[str, Any], check: Callable[[str], object], schema: type = Config) -> list[Dimension]:
    """The dimensions of `space`, as `SweepConfig.space` describes it.

    Args:
        space: what is to vary.
        check: loads the config with a `key=value`, and raises UserError if that is impossible.
        schema: of that config.

    Raises:
        UserError: a key does not exist or cannot vary, an entry is none of the forms, or a value is impossible; the
            sentence begins with the entry's key.
    """
    if not space:
        raise UserError("space: is empty; name the keys that are to vary")
    kinds = keys_of(schema)
    dimensions = []
    for key, entry in space.items():
        section = key.split(".")[0]
        if section in _FIXED_SECTIONS:
            raise UserError(f"space.{key}: cannot vary: {_FIXED_SECTIONS[section]}")
        if key not in kinds:
            raise UserError(f"space.{key}: {unknown_name('key', key, kinds)}")
        dimension = _read_entry(key, typed_value(SpaceEntry, entry, f"space.{key}"), kinds[key])
        for text in dimension.extremes:
            _check(f"space.{key}", text, check)
        dimensions.append(dimension)
    return dimensions


def check_fixed(fixed: Mapping[str, Any], check: Callable[[str], object]) -> None:
    """Refuses settings of `SweepConfig.fixed` that the config cannot have; `check` as for `read_space`.

    Raises:
        UserError: a key does not exist or its value is impossible; the sentence begins with the entry's key.
    """
    for key, value in fixed.items():
        _check(f"fixed.{key}", override(key, value), check)


def refuse_fixed(space: Sequence[Dimension], overrides: Sequence[str]) -> None:
    """Refuses what varies though `key=value` says that it does not: no trial would have that value.

    Raises:
        UserError: there is such a key.
    """
    for text in overrides:
        fixed = text.partition("=")[0].strip()
        for key in (dimension.key for dimension in space):
            if fixed == key or fixed.startswith(f"{key}."):
                raise UserError(
                    f"space.{key}: is to vary, and {text} is to hold for all trials; take one of them out, of the"
                    " sweep's file (space, fixed) or of the command line"
                )


def _check(name: str, text: str, check: Callable[[str], object]) -> None:
    try:
        check(text)
    except UserError as error:
        raise UserError(f"{name}: {str(error).removeprefix('command line: ')}") from error


def override(key: str, value: Any) -> str:
    """`key=value` as it would be typed, of a value that YAML gave."""
    return f"{key}={value if isinstance(value, str) else json.dumps(value)}"


def _read_entry(key: str, entry: list[Any] | SpaceRange, kind: Any) -> Dimension:
    if isinstance(entry, list):
        choices = tuple(dict.fromkeys(override(key, value).partition("=")[2] for value in entry))
        if len(choices) < 2:
            raise UserError(f"space.{key}: a choice needs two values or more")
        return Dimension(key, choices)
    low, high, log = entry.low, entry.high, entry.log
    if kind not in (int, float):
        raise UserError(f"space.{key}: is no number, so it has no range; give a list of choices")
    if kind is int and not (isinstance(low, int) and isinstance(high, int)):
        raise UserError(f"space.{key}: low and high must be whole numbers, found {low!r}, {high!r}")
    if not low < high:
        raise UserError(f"space.{key}: low must be below high, found {low} and {high}")
    if log and low <= 0:
        raise UserError(f"space.{key}: a logarithmic range starts above 0, found {low}")
    return Dimension(key, (), low, high, log, kind is int)
