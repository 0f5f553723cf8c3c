"""Pictures -> sheets: tables of pictures with labels, the histogram of phi, and files that are whole or not there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

from mrhubo.files.atomic import atomic_path

_INK = (38, 43, 51)
_GREY = (108, 115, 125)
_LINE = (222, 225, 230)
_KEPT, _DROPPED = "#3b76af", "#d9822b"
_GIF_COLORS = 128


def contact_sheet(
    rows: Sequence[Sequence[Image.Image | None]],
    column_titles: Sequence[str] = (),
    row_titles: Sequence[str] = (),
    caption: str = "",
    gap: int = 10,
    font_size: int = 17,
) -> Image.Image:
    """A table of pictures on white: titles above the columns and beside the rows, thin lines between rows, a caption
    below.

    ``rows``: pictures, row by row; a row may be shorter than others or hold None: the cell stays empty. A column is as
    wide as its widest picture, a row as high as its highest; pictures are centred. ``gap``, ``font_size``: pixels.
    Long titles wrap.
    """
    columns = max((len(row) for row in rows), default=0)
    if columns == 0 or not any(picture is not None for row in rows for picture in row):
        raise ValueError("contact_sheet: there is no picture")
    if column_titles and len(column_titles) != columns:
        raise ValueError(f"contact_sheet: {len(column_titles)} column titles for {columns} columns")
    if row_titles and len(row_titles) != len(rows):
        raise ValueError(f"contact_sheet: {len(row_titles)} row titles for {len(rows)} rows")
    cells = [[*row, *[None] * (columns - len(row))] for row in rows]
    heights = [max((cell.height for cell in row if cell is not None), default=0) for row in cells]
    font, small = ImageFont.load_default(font_size), ImageFont.load_default(max(8, round(0.82 * font_size)))

    widths = [
        max((cell.width for cell in column if cell is not None), default=0) for column in zip(*cells, strict=True)
    ]
    for column, title in enumerate(column_titles):  # a word is never broken
        longest = max((font.getlength(word) for word in title.split()), default=0.0)
        widths[column] = max(widths[column], int(np.ceil(longest)))
    heads = [_wrap(title, font, width) for title, width in zip(column_titles, widths, strict=False)]
    sides = [_wrap(title, font, 9 * font_size) for title in row_titles]
    head = max((_size(text, font)[1] for text in heads), default=0)
    side = max((_size(text, font)[0] for text in sides), default=0)
    left, top = gap + (side + gap if side else 0), gap + (head + gap if head else 0)
    total = left + sum(widths) + gap * columns
    foot = _wrap(caption, small, total - 2 * gap)
    foot_height = _size(foot, small)[1] + 2 * gap if caption else 0
    sheet = Image.new("RGB", (total, top + sum(heights) + gap * len(rows) + foot_height), "white")
    pen = ImageDraw.Draw(sheet)

    x = left
    for text, width in zip(heads, widths, strict=False):
        _write(pen, (x + width / 2, gap + head / 2), text, font, _INK, "center")
        x += width + gap
    y = top
    for index, (row, height) in enumerate(zip(cells, heights, strict=True)):
        if index or head:
            pen.line([(gap, y - gap // 2), (total - gap, y - gap // 2)], fill=_LINE)
        if sides:
            _write(pen, (gap + side / 2, y + height / 2), sides[index], font, _INK, "center")
        x = left
        for picture, width in zip(row, widths, strict=True):
            if picture is not None:
                place = (x + (width - picture.width) // 2, y + (height - picture.height) // 2)
                sheet.paste(picture, place, picture if picture.mode == "RGBA" else None)
            x += width + gap
        y += height + gap
    if caption:
        pen.line([(gap, y - gap // 2), (total - gap, y - gap // 2)], fill=_LINE)
        _write(pen, (total / 2, y + (foot_height - gap) / 2), foot, small, _GREY, "center")
    return sheet


Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


def _wrap(text: str, font: Font, width: int) -> str:
    """The text with line breaks so that no line is wider than ``width`` pixels, unless a single word is."""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        line = ""
        for word in paragraph.split():
            longer = f"{line} {word}".strip()
            if line and font.getlength(longer) > width:
                lines.append(line)
                longer = word
            line = longer
        lines.append(line)
    return "\n".join(lines)


def _size(text: str, font: Font) -> tuple[int, int]:
    left, top, right, bottom = ImageDraw.Draw(Image.new("L", (1, 1))).multiline_textbbox((0, 0), text, font=font)
    return int(np.ceil(right - left)), int(np.ceil(bottom - min(top, 0.0)))


def _write(
    pen: ImageDraw.ImageDraw, centre: tuple[float, float], text: str, font: Font, ink: tuple[int, int, int], align: str
) -> None:
    pen.multiline_text(centre, text, fill=ink, font=font, anchor="mm", align=align)


def phi_histogram(
    phi: np.ndarray,
    threshold: float,
    title: str = "Reconstruction error of the pairs",
    size: tuple[int, int] = (720, 420),
) -> Image.Image:
    """Histogram of reconstruction errors with the threshold above which pairs are extreme.

    ``phi`` (B,) and ``threshold``: mean squares of 6D numbers. The error axis is logarithmic where the errors span more
    than a factor of 30. The title tells the share that is kept. ``size``: pixels.
    """
    phi_B = np.asarray(phi, float).reshape(-1)
    if len(phi_B) == 0 or not np.isfinite(phi_B).all() or phi_B.min() < 0.0 or not np.isfinite(threshold):
        raise ValueError("phi_histogram: phi must hold finite numbers >= 0, at least one, and the threshold be finite")
    kept_B = phi_B <= threshold
    edges, logarithmic = _edges(phi_B, threshold)
    values_B = np.clip(phi_B, edges[0], edges[-1])
    counts = np.histogram(values_B[kept_B], edges)[0], np.histogram(values_B[~kept_B], edges)[0]

    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    kept, whole = counts[0], counts[0] + counts[1]
    axes.stairs(kept, edges, fill=True, color=_KEPT, label="kept")  # bars, each for itself, take ten times as long
    axes.stairs(whole, edges, baseline=kept, fill=True, color=_DROPPED, label="extreme: dropped")
    axes.axvline(threshold, color="#262b33", linewidth=1.2, linestyle="--")
    right = float(np.searchsorted(edges, threshold)) > 0.75 * len(edges)
    axes.annotate(
        f"threshold {threshold:.3g}",
        (threshold, 0.98),
        xycoords=("data", "axes fraction"),
        xytext=(-6 if right else 6, 0),
        textcoords="offset points",
        ha="right" if right else "left",
        va="top",
    )
    if logarithmic:
        axes.set_xscale("log")
    axes.set_xlim(float(edges[0]), float(edges[-1]))
    axes.set_ylim(0.0, 1.18 * float(whole.max()))
    axes.set_xlabel("phi: mean squared error of the 6D pose")
    axes.set_ylabel("pairs")
    axes.set_title(f"{title}: {100.0 * kept_B.mean():.1f}% kept of {len(phi_B):,}", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper left" if float(threshold) > float(np.median(phi_B)) else "upper right")
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())


def _edges(phi_B: np.ndarray, threshold: float) -> tuple[np.ndarray, bool]:
    """Edges of about 60 bins of equal width on the axis, one edge at the threshold; whether the axis is logarithmic."""
    positive_B = phi_B[phi_B > 0.0]
    logarithmic = threshold > 0.0 and len(positive_B) > 0 and bool(positive_B.max() / positive_B.min() > 30.0)
    shown_B = np.log(np.maximum(positive_B, 1e-8 * positive_B.max())) if logarithmic else phi_B
    cut = float(np.log(threshold)) if logarithmic else threshold
    low, high = min(float(shown_B.min()), cut), max(float(shown_B.max()), cut)
    step = max((high - low) / 60.0, 1e-3 * abs(cut), 1e-9)
    edges = cut + step * np.arange(-np.ceil((cut - low) / step) - 1, np.ceil((high - cut) / step) + 2)
    return (np.exp(edges) if logarithmic else edges), logarithmic


def save_png(image: Image.Image, path: str | Path, software: str | None = None) -> Path:
    """Write a PNG so that ``path`` is either the whole new picture or what it was before; makes missing folders.

    ``software``: what the file names as its maker (`Software` in its text).
    """
    path, more = Path(path), {}
    if software is not None:
        more["pnginfo"] = PngInfo()
        more["pnginfo"].add_text("Software", software)
    with atomic_path(path) as temporary:
        image.save(temporary, format="PNG", **more)
    return path


def save_gif(frames: Sequence[Image.Image], path: str | Path, frame_rate: float) -> Path:
    """Write an endless GIF of pictures of one size, atomically as `save_png` does; ``frame_rate``: frames per second.

    All frames share one palette, taken from a few of them: a palette a frame would flicker.
    """
    if not frames:
        raise ValueError("save_gif: there is no frame")
    few = [frames[round(place)] for place in np.linspace(0, len(frames) - 1, min(4, len(frames)))]
    samples = Image.fromarray(np.concatenate([np.asarray(frame.convert("RGB")) for frame in few]))
    palette = samples.quantize(_GIF_COLORS)
    first, *rest = [frame.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    colors = np.asarray(palette.getpalette()).reshape(-1, 3)
    colors[colors.min(axis=1) >= 250] = 255  # Pillow's white is greyish
    for frame in (first, *rest):
        frame.putpalette(colors.ravel().tolist())
    path, duration_ms = Path(path), round(1000 / frame_rate)
    with atomic_path(path) as temporary:
        first.save(temporary, format="GIF", save_all=True, append_images=rest, duration=duration_ms, loop=0)
    return path
