"""Films have the frames that they should, and move."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from mrhubo.errors import UserError
from mrhubo.robot import Robot
from mrhubo.viewer import Stage, arrange, perform
from mrhubo.viewer import pictures as room
from mrhubo.viewer.film import save_mp4
from mrhubo.viewer.pictures import film_times, save_pictures
from tests.viewer.conftest import random_motion


def test_a_film_has_every_frame_that_it_tells(stage: Stage, tmp_path: Path) -> None:
    path = tmp_path / "more" / "boxing.mp4"
    count = save_pictures(stage, path, "boxing")
    assert [file.name for file in path.parent.iterdir()] == ["boxing.mp4"]
    with av.open(str(path)) as film:
        assert film.streams.video[0].average_rate == 30
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) == count == len(film_times(stage, room.FILM_RATE)[0]) == 4  # of 7 frames at 60 a second
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 100


def test_a_gif_and_a_sheet(stage: Stage, tmp_path: Path) -> None:
    assert save_pictures(stage, tmp_path / "a.GIF", "boxing") == 2
    with Image.open(tmp_path / "a.GIF") as picture:
        assert picture.format == "GIF" and picture.n_frames == 2  # pyright: ignore[reportAttributeAccessIssue]
    assert save_pictures(stage, tmp_path / "a.png", "boxing") == 6
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.format == "PNG" and picture.width > 6 * 200 and picture.height > 3 * 250


def test_odd_sizes_and_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_text("what was there before")
    assert save_mp4((Image.new("RGB", (33, 21), color) for color in ("red", "blue")), path, 29.97) == 2
    with av.open(str(path)) as film:
        assert (film.streams.video[0].width, film.streams.video[0].height) == (34, 22)

    def broken():  # noqa: ANN202
        yield Image.new("RGB", (32, 32))
        raise UserError("no more")

    before = path.read_bytes()
    with pytest.raises(UserError, match="no more"):
        save_mp4(broken(), path, 30.0)
    assert path.read_bytes() == before and [file.name for file in tmp_path.iterdir()] == ["a.mp4"]


def test_a_gif_that_is_too_long(nao: Robot, tmp_path: Path) -> None:
    stage = arrange(None, [perform("nao", nao, random_motion(nao, 700, frame_rate=10.0))])
    with pytest.raises(UserError, match=r"700 frames are more than a GIF of 600; name an \.mp4 file, or give --to"):
        save_pictures(stage, tmp_path / "a.gif", "long")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["av", "viser"])
def test_an_extra_that_is_missing(name: str, stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    from mrhubo.viewer.page import save_page

    monkeypatch.setitem(sys.modules, name, None)
    save = save_pictures if name == "av" else save_page
    with pytest.raises(UserError, match=rf"needs the package {name}: pip install 'mrhubo\[view\]'"):
        save(stage, tmp_path / ("a.mp4" if name == "av" else "a.html"), "title")
    assert not list(tmp_path.iterdir())
