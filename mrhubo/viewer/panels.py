"""What stands beside the figures, as SVG: how sure the answer is over time, when feet are planted, and joint
angles against their limits.

A line of class `now` marks the moment, and dots of class `mark` the angles at it, so that a saved page moves both
without Python. Legend: T frames, N joints, F feet.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

import numpy as np

from mrhubo.fast.masks import stretches

WIDTH = 300
"""Of all panels, in the units of their drawing."""
_STRIP, _CURVE, _ROW = 16, 110, 15
"""Heights: of the confidence's strip, of a curve, of a joint's row."""
_BINS = 150
"""Most colours of a strip, and twice as many points of a curve."""
LEFT, RIGHT = 132, 286
"""Where a joint's range begins and ends in its row."""
AT_LIMIT = 0.01
"""Share of its range within which an angle is at a limit."""
INSIDE, AT_END = "#3b76af", "#d9822b"
"""Colours of an angle inside its limits, and of one at a limit."""
_GRID, _INK, _DARK = "#d9dde3", "#4a515c", "#1c2026"
_LOW, _MIDDLE, _HIGH = np.array([192, 57, 43]), np.array([232, 178, 60]), np.array([79, 154, 87])
"""Colours of confidence 0, 0.5 and 1."""


def confidence_strip(confidence_T: np.ndarray, now: float = 0.0) -> str:
    """Red where the answer is not to be trusted, green where it is; of several frames in one place the least counts.

    Args:
        confidence_T: 0..1.
        now: share of the time that has gone.
    """
    edges = np.unique(np.linspace(0, len(confidence_T), min(_BINS, len(confidence_T)) + 1).round().astype(int))
    least = [float(confidence_T[a:b].min()) for a, b in zip(edges, edges[1:], strict=False)]
    width = WIDTH / len(least)
    cells = "".join(
        f'<rect x="{n * width:.2f}" y="0" width="{width + 0.3:.2f}" height="{_STRIP}" fill="{_shade(value)}"/>'
        for n, value in enumerate(least)
    )
    return _svg(_STRIP, cells + _line(now, _STRIP))


def contact_strips(contact_TF: np.ndarray, names: Sequence[str], now: float = 0.0) -> str:
    """A strip a foot, orange where it is planted.

    Args:
        contact_TF: whether each foot is planted (T, F).
        names: of the feet.
        now: share of the time that has gone.
    """
    parts, width = list[str](), WIDTH / len(contact_TF)
    for row, name in enumerate(names):
        top = row * (_STRIP + 2)
        parts.append(f'<rect x="0" y="{top}" width="{WIDTH}" height="{_STRIP}" fill="{_GRID}"/>')
        for run in stretches(contact_TF[:, row]):
            place = f'x="{run.start * width:.2f}" y="{top}" width="{(run.stop - run.start) * width:.2f}"'
            parts.append(f'<rect {place} height="{_STRIP}" fill="{AT_END}"/>')
        parts.append(f'<text x="4" y="{top + _STRIP - 4.5}" fill="{_DARK}">{html.escape(_short(name))}</text>')
    height = len(names) * (_STRIP + 2) - 2
    return _svg(height, "".join(parts) + _line(now, height))


def _shade(confidence: float) -> str:
    share = float(np.clip(2 * confidence, 0, 2))
    color = _LOW + (_MIDDLE - _LOW) * share if share < 1 else _MIDDLE + (_HIGH - _MIDDLE) * (share - 1)
    red, green, blue = color.round().astype(int).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"


def joint_curve(q_T: np.ndarray, lower: float, upper: float, now: float = 0.0) -> str:
    """One joint's angle [rad] over time in degrees, and its limits [rad] as dashed lines.

    Args:
        q_T: the angle in every frame.
        lower: its lower limit; -inf: there is none.
        upper: its upper limit.
        now: share of the time that has gone.
    """
    known = [limit for limit in (lower, upper) if math.isfinite(limit)]
    low, high = min([float(q_T.min()), *known]), max([float(q_T.max()), *known])
    spare = 0.08 * max(high - low, 0.1)
    low, high = low - spare, high + spare

    def height(value: float) -> float:
        return _CURVE * (high - value) / (high - low)

    shown = np.unique(np.linspace(0, len(q_T) - 1, min(2 * _BINS, len(q_T))).round().astype(int))
    last = max(len(q_T) - 1, 1)
    points = " ".join(f"{WIDTH * frame / last:.1f},{height(float(q_T[frame])):.1f}" for frame in shown)
    dashes = "".join(
        f'<line x1="0" x2="{WIDTH}" y1="{height(v):.1f}" y2="{height(v):.1f}" stroke="{AT_END}" '
        f'stroke-dasharray="4 3"/>'
        f'<text x="{WIDTH - 2}" y="{height(v) + (9 if v == upper else -3):.1f}" text-anchor="end" fill="{AT_END}">'
        f"{math.degrees(v):.0f}&#176;</text>"
        for v in known
    )
    frame = f'<rect x="0.5" y="0.5" width="{WIDTH - 1}" height="{_CURVE - 1}" fill="none" stroke="{_GRID}"/>'
    curve = f'<polyline points="{points}" fill="none" stroke="{INSIDE}" stroke-width="1.6"/>'
    return _svg(_CURVE, frame + dashes + curve + _line(now, _CURVE))


def joint_bars(names: Sequence[str], lower_N: np.ndarray, upper_N: np.ndarray, q_N: np.ndarray) -> str:
    """A row a joint: its range, and where in it the angle [rad] is, orange at a limit; one without limits has the range
    of one turn.
    """
    rows = []
    for row, (name, q) in enumerate(zip(names, q_N.tolist(), strict=True)):
        low, high = range_of(float(lower_N[row]), float(upper_N[row]))
        middle, share = _ROW * (row + 0.5), float(np.clip((q - low) / max(high - low, 1e-9), 0, 1))
        color = AT_END if min(share, 1 - share) < AT_LIMIT else INSIDE
        rows.append(
            f'<text x="{LEFT - 8}" y="{middle + 3.5:.1f}" text-anchor="end" fill="{_INK}">'
            f"{html.escape(_short(name))}</text>"
            f'<line x1="{LEFT}" x2="{RIGHT}" y1="{middle}" y2="{middle}" stroke="{_GRID}" stroke-width="4" '
            f'stroke-linecap="round"/>'
            f'<circle class="mark" cx="{LEFT + share * (RIGHT - LEFT):.1f}" cy="{middle}" r="4" fill="{color}"/>'
        )
    return _svg(_ROW * len(rows), "".join(rows))


def range_of(lower: float, upper: float) -> tuple[float, float]:
    """The range [rad] that a row shows."""
    low = lower if math.isfinite(lower) else -math.pi
    high = upper if math.isfinite(upper) else math.pi
    return (low, high) if high > low else (low, low + 1e-9)


def _short(name: str, most: int = 22) -> str:
    return name if len(name) <= most else f"{name[: most - 3]}..."


def _line(now: float, height: int) -> str:
    x = WIDTH * float(np.clip(now, 0, 1))
    return f'<line class="now" x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{height}" stroke="{_DARK}" stroke-width="1.5"/>'


def _svg(height: float, content: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="100%" '
        f'style="display:block" font-family="sans-serif" font-size="9.5">{content}</svg>'
    )
