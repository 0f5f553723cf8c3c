from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from PIL import Image

from mrhubo.errors import UserError
from mrhubo.view import contact_sheet, phi_histogram, save_png


def tile(color, size=(40, 30)) -> Image.Image:
    return Image.new("RGB", size, color)


def colored(sheet: Image.Image, color) -> tuple[np.ndarray, np.ndarray]:
    return np.nonzero((np.asarray(sheet) == color).all(axis=-1))


def test_contact_sheet_places_pictures_in_rows_and_columns():
    red, green, blue = (255, 0, 0), (0, 255, 0), (0, 0, 255)
    sheet = contact_sheet(
        [[tile(red), tile(green)], [tile(blue, (60, 50))]],
        ["one column", "another column whose title is too long for it"],
        ["first", "second"],
        "A caption that is long enough to need more than one line below this small table.",
    )
    places = {name: colored(sheet, color) for name, color in [("r", red), ("g", green), ("b", blue)]}
    assert len(places["r"][0]) == 40 * 30 and len(places["b"][0]) == 60 * 50
    assert places["r"][1].max() < places["g"][1].min(), "columns"
    assert places["r"][0].max() < places["b"][0].min(), "rows"
    assert np.mean(places["r"][1]) == pytest.approx(np.mean(places["b"][1]), abs=1), "centred"
    np.testing.assert_array_equal(np.unique(places["r"][0]), np.unique(places["g"][0]))
    assert (np.asarray(sheet)[: places["r"][0].min()] < 100).any(), "titles above"
    assert (np.asarray(sheet)[:, : places["b"][1].min()] < 100).any(), "titles on the left"
    assert (np.asarray(sheet)[places["b"][0].max() + 10 :] < 150).any(), "caption"
    assert (np.asarray(sheet)[:3] == 255).all() and (np.asarray(sheet)[:, -3:] == 255).all()


def test_contact_sheet_without_titles_holds_transparent_pictures_and_gaps():
    clear = Image.new("RGBA", (20, 20), (0, 0, 0, 0))
    sheet = contact_sheet([[clear, None], [None, tile((9, 9, 9), (20, 20))]], gap=4)
    assert sheet.size == (4 + 2 * 24, 4 + 2 * 24)
    assert len(colored(sheet, (9, 9, 9))[0]) == 400
    assert (np.asarray(sheet)[4:24, 4:24] == 255).all()


def test_contact_sheet_refuses_what_does_not_fit():
    with pytest.raises(ValueError, match="no picture"):
        contact_sheet([[None], []])
    with pytest.raises(ValueError, match="2 column titles for 1 columns"):
        contact_sheet([[tile("red")]], ["a", "b"])
    with pytest.raises(ValueError, match="1 row titles for 2 rows"):
        contact_sheet([[tile("red")], [tile("red")]], row_titles=["a"])


@pytest.mark.parametrize(
    "phi",
    [
        np.exp(np.random.default_rng(0).normal(-5, 1, 2000)),
        np.linspace(0.1, 0.2, 50),
        np.zeros(5),
        np.array([0.0, 1.0]),
    ],
)
@pytest.mark.parametrize("threshold", [0.0, 0.15])
def test_histogram_of_any_errors(phi, threshold):
    picture = phi_histogram(phi, threshold, size=(480, 300))
    assert picture.size == (480, 300)
    values = np.asarray(picture).astype(int)
    blue = (np.abs(values - [0x3B, 0x76, 0xAF]).max(axis=-1) < 8).sum()
    orange = (np.abs(values - [0xD9, 0x82, 0x2B]).max(axis=-1) < 8).sum()
    legend = 300  # pixels of a colour in the legend, about
    assert (blue > legend) == (phi <= threshold).any()
    assert (orange > legend) == (phi > threshold).any()


def test_histogram_leaves_pyplot_alone_and_refuses_nan():
    backend = (
        matplotlib.rcParams._get_backend_or_none() if hasattr(matplotlib.rcParams, "_get_backend_or_none") else None
    )
    phi_histogram(np.array([0.1, 0.2]), 0.15)
    after = matplotlib.rcParams._get_backend_or_none() if hasattr(matplotlib.rcParams, "_get_backend_or_none") else None
    assert after == backend
    for bad in (np.array([np.nan]), np.array([]), np.array([-1.0])):
        with pytest.raises(ValueError, match="phi_histogram"):
            phi_histogram(bad, 0.1)


def test_save_png_is_whole_or_absent(tmp_path, monkeypatch):
    path = save_png(tile("red"), tmp_path / "new" / "picture.png")
    assert Image.open(path).getpixel((0, 0)) == (255, 0, 0)
    before = path.read_bytes()

    def fail(self, target, format):
        with open(target, "wb") as stream:
            stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", fail)
    with pytest.raises(UserError, match="No space left"):
        save_png(tile("blue"), path)
    assert path.read_bytes() == before
    assert [item.name for item in path.parent.iterdir()] == ["picture.png"]
