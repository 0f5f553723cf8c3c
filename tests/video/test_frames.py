"""Frames of videos: all of them, upright, each at its time; and a sentence where there are none to be had."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.video import frames as module
from mrhubo.video.frames import Frame, as_shown, frames, video_kind
from tests.video.films import numbered, write_video

pytest.importorskip("av", reason="PyAV is not installed")


def darkness(image_HW3: np.ndarray) -> float:
    """Of the lower right quarter."""
    height, width = image_HW3.shape[:2]
    return float(image_HW3[height // 2 + 4 :, width // 2 + 4 :].mean())


@pytest.mark.parametrize("ending", ["mp4", "mov", "mkv", "avi"])
def test_every_frame_comes_at_its_time(tmp_path: Path, ending: str) -> None:
    path = write_video(tmp_path / f"film.{ending}", numbered(12))
    os.rename(path, tmp_path / "film.xyz")  # its ending tells nothing
    found = list(frames(tmp_path / "film.xyz"))
    assert [frame.time for frame in found] == pytest.approx(np.arange(12) / 25, abs=0.0011)
    assert [darkness(frame.image_HW3) for frame in found] == pytest.approx(20 + 8 * np.arange(12), abs=3)
    assert found[0].image_HW3.shape == (64, 96, 3) and found[0].image_HW3[:28, :44].min() > 240


def test_raw_video_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "film.y4m"
    path.write_bytes(
        b"YUV4MPEG2 W4 H4 F10:1 C444\n" + b"".join(b"FRAME\n" + bytes([90] * 16 + [128] * 32) for _ in range(3))
    )
    assert [frame.time for frame in frames(path)] == pytest.approx([0, 0.1, 0.2])


def test_frames_that_come_when_they_like_keep_their_times(tmp_path: Path) -> None:
    times_ms = [0, 33, 70, 200, 233, 266]
    path = write_video(tmp_path / "film.mkv", numbered(6), times_ms)
    assert [1000 * frame.time for frame in frames(path)] == pytest.approx(times_ms, abs=1)


def test_a_film_of_a_phone_is_turned_upright(tmp_path: Path) -> None:
    path = write_video(tmp_path / "film.mp4", numbered(2))
    data = path.read_bytes()
    plain = struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)
    place = data.index(plain, data.index(b"tkhd"))
    turned = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 0, 0, 1 << 30)  # shown a quarter turn clockwise
    path.write_bytes(data[:place] + turned + data[place + len(turned) :])
    first = next(iter(frames(path))).image_HW3
    assert first.shape == (96, 64, 3)
    assert first[:44, 36:].min() > 240 and first[:44, :28].max() < 40, "the upper left corner is now the upper right"


def test_what_breaks_off_is_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (12, 64, 96, 3), dtype=np.uint8)
    whole = write_video(tmp_path / "film.avi", list(noise)).read_bytes()
    for share in (0.001, 0.01, 0.1, 0.5, 0.8):
        path = tmp_path / "part"
        path.write_bytes(whole[: max(20, int(share * len(whole)))])
        with pytest.raises(UserError, match="part: "):
            list(frames(path))


def test_a_film_that_tells_no_number_of_frames_may_not_break_off_either(tmp_path: Path) -> None:
    path = write_video(tmp_path / "film.mkv", numbered(12) * 5)
    whole = path.read_bytes()
    assert len(list(frames(path))) == 60
    path.write_bytes(whole[: len(whole) // 3])
    with pytest.raises(UserError, match="breaks off after .* of 2.4 s|damaged"):
        list(frames(path))


def test_damage_gives_a_sentence_or_frames(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    for ending in ("mp4", "mkv"):
        whole = write_video(tmp_path / f"film.{ending}", numbered(4)).read_bytes()
        for _ in range(25):
            data = bytearray(whole)
            for place in random.integers(0, len(data), 30):
                data[place] = random.integers(256)
            (tmp_path / "damaged").write_bytes(data)
            try:
                found = list(frames(tmp_path / "damaged"))
            except UserError as error:
                assert "damaged: " in str(error)
            else:
                assert all(a.time < b.time for a, b in zip(found, found[1:], strict=False))


def test_frames_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_video(tmp_path / "film.mp4", numbered(5))
    monkeypatch.setattr(module, "MAX_FRAMES", 4)
    with pytest.raises(UserError, match="more than 4 frames"):
        list(frames(path))
    monkeypatch.setattr(module, "_MAX_PIXELS", 64 * 96 - 1)
    with pytest.raises(UserError, match="96 x 64 pixels"):
        list(frames(path))


def test_what_names_other_files_is_no_video(tmp_path: Path) -> None:
    path = tmp_path / "list.m3u8"
    path.write_text("#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n")
    with pytest.raises(UserError, match="no video that is read here"):
        list(frames(path))
    assert video_kind(b"\0\0\0\x18ftypM4A ") is None, "sound alone"
    assert video_kind(b"RIFF....WAVE") is None


def test_without_pyav_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with pytest.raises(UserError, match=r"film.mp4: .*pip install 'mrhubo\[video\]'"):
        list(frames(tmp_path / "film.mp4"))


@pytest.mark.parametrize("work", [0.0, 0.01, 0.05, 0.31])
def test_a_film_is_shown_at_its_own_pace_and_slow_eyes_miss_frames(work: float) -> None:
    images = numbered(10)
    clock = 100.0

    def sleep(seconds: float) -> None:
        nonlocal clock
        clock += seconds

    found = []
    for frame in as_shown((Frame(number / 10, image) for number, image in enumerate(images)), lambda: clock, sleep):
        found.append((round(10 * (frame.time - 100.0)), clock - frame.time))
        assert frame.image_HW3 is images[found[-1][0]]
        sleep(work)
    numbers, late = zip(*found, strict=True)
    assert list(numbers) == sorted(set(numbers)) and numbers[0] == 0 and numbers[-1] == 9
    assert 0.0 <= min(late) + 1e-9 and max(late) <= 0.1 + 1e-9, "no frame is shown when the next one is due"
    assert len(numbers) == (10 if work < 0.1 else 4)


def test_a_film_that_is_read_slowly_is_shown_slowly() -> None:
    """A large one on a slow machine: no frame would ever come in time."""
    clock = 100.0

    def sleep(seconds: float) -> None:
        nonlocal clock
        clock += seconds

    def film() -> Iterator[Frame]:
        for number in range(60):
            sleep(0.05 if number < 40 else 0.001)
            yield Frame(number / 30, np.full((2, 2, 3), number, np.uint8))

    found = [(clock, frame.time, int(frame.image_HW3[0, 0, 0])) for frame in as_shown(film(), lambda: clock, sleep)]
    shown, due, numbers = zip(*found, strict=True)
    assert list(numbers) == sorted(set(numbers)) and numbers[-1] == 59
    assert np.diff(shown).max() < 0.08, "there is never a gap in which a robot would stop"
    assert max(np.subtract(shown, due)) < 0.05
    assert np.diff(shown)[-15:] == pytest.approx(1 / 30), "once it is read fast enough it has its own pace"
