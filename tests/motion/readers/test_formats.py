"""Which reader takes a file, and what is said of one that nobody reads."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body.joints import JOINT_NAMES, REST_K3
from mrhubo.errors import UserError
from mrhubo.motion import ReadOptions, find_motions, read_folder, read_motion, trim, write_motion
from tests.motion.bvh_writer import Style, write_bvh

_SHIPPED = Path(__file__).resolve().parents[3] / "data" / "motions" / "wave.npz"


def write(path: Path) -> Path:
    write_motion(path, np.zeros((3, 63)), np.zeros((3, 3)), np.zeros((3, 3)), 30.0, "stands")
    return path


@pytest.mark.parametrize("name", ["a.npz", "a", "a.txt", "a.bvh"])
def test_the_ending_does_not_matter(tmp_path: Path, name: str) -> None:
    write(tmp_path / "made.npz").rename(tmp_path / name)
    assert len(read_motion(tmp_path / name)) == 3
    assert [motion.name for motion in read_folder(tmp_path)] == ["a"] and find_motions([tmp_path]) == tmp_path


@pytest.mark.parametrize(
    ("start", "said"),
    [
        (b"\x89PNG\r\n\x1a\n" + bytes(99), r"is a picture \(PNG\), and no human motion"),
        (b"\xff\xd8\xff\xe0" + bytes(99), "is a picture"),
        (b"RIFF" + bytes(4) + b"WAVE" + bytes(99), "is a sound or a picture"),
        (b"# Notes\n\nwalks", "is text that begins with '# Notes'"),
        ("Spaziergänge".encode("latin1"), "is text that begins with"),
        (b"\x00\x01\x02\x03", "is of no kind that is known"),
        (b"version https://git-lfs.github.com/spec/v1\n", "pointer of Git LFS"),
    ],
)
def test_what_nobody_reads_is_called_what_it_is(tmp_path: Path, start: bytes, said: str) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(start)
    with pytest.raises(UserError, match=said) as caught:
        read_motion(path)
    assert str(caught.value).startswith(str(path)) and "expected one of: AMASS" in str(caught.value)


def test_an_empty_file_is_no_motion(tmp_path: Path) -> None:
    (tmp_path / "a.npz").touch()
    with pytest.raises(UserError, match="is empty; was it copied"):
        read_motion(tmp_path / "a.npz")


def test_a_folder_passes_over_what_nobody_reads_but_not_what_is_damaged(tmp_path: Path) -> None:
    write(tmp_path / "a.npz")
    (tmp_path / "readme.md").write_text("# A walk")
    (tmp_path / "a.png").write_bytes(b"\x89PNG")
    assert [motion.name for motion in read_folder(tmp_path)] == ["a"]
    (tmp_path / "b.npz").write_bytes(b"PK\x03\x04, and no more")
    with pytest.raises(UserError, match=r"b\.npz"):
        read_folder(tmp_path)


def test_the_rate_is_asked_for_and_never_guessed(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, pose_body=np.zeros((3, 63)))
    with pytest.raises(UserError, match="--rate"):
        read_motion(path)
    assert read_motion(path, ReadOptions(rate=25)).frame_rate == 25.0
    motion = read_motion(write(path), ReadOptions(rate=25))
    assert motion.frame_rate == 30.0 and "25" in motion.notes[0] and "30" in motion.notes[0]


@pytest.mark.parametrize("rate", [0, -3.0, float("nan"), float("inf"), 1e9, 10**400, "fast"])
def test_a_rate_that_is_none_is_refused(rate) -> None:
    with pytest.raises(UserError, match="frames per second"):
        ReadOptions(rate=rate)


def test_reading_imports_no_pytorch(tmp_path: Path) -> None:
    """Importing it takes longer than answering a minute of motion."""
    write(tmp_path / "a.npz")
    with (tmp_path / "b.pkl").open("wb") as file:
        pickle.dump({"smpl_poses": np.zeros((3, 72), np.float32), "fps": 30}, file)
    parameters = {"body_pose": torch.zeros(3, 63), "global_orient": torch.zeros(3, 3), "transl": torch.zeros(3, 3)}
    torch.save({"smpl_params_global": parameters, "smpl_params_incam": parameters}, tmp_path / "c.pt")
    code = (
        "import sys; from pathlib import Path; import mrhubo; from mrhubo.motion import ReadOptions\n"
        f"for path in sorted(Path({str(tmp_path)!r}).iterdir()):\n"
        "    assert len(mrhubo.read_motion(path, ReadOptions(rate=30))) == 3\n"
        "    assert 'torch' not in sys.modules, path\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300)


@pytest.mark.parametrize("name", ["amass.npz", "rows.npy", "features.npy", "joints.npy", "table.csv", "a.bvh"])
def test_a_person_who_is_asked_for_where_there_is_one_is_said(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if name == "amass.npz":
        np.savez(path, poses=np.zeros((4, 66)), fps=30.0)
    elif name == "rows.npy":
        np.save(path, np.zeros((4, 322)))
    elif name == "features.npy":
        rows = np.zeros((4, 263))
        rows[:, 3], rows[:, 4:67] = 0.9, np.tile((REST_K3[1:22] + [0, 0.9, 0]).reshape(63), (4, 1))
        np.save(path, rows)
    elif name == "joints.npy":
        np.save(path, np.tile(REST_K3[:22], (4, 1, 1)))
    elif name == "table.csv":
        columns = [f"{joint}_{axis}" for joint in JOINT_NAMES for axis in "xyz"]
        row = ",".join(f"{x:.3f}" for x in REST_K3[:22].reshape(-1))
        path.write_text("\n".join([",".join(columns), *[row] * 4]))
    else:
        path.write_text(write_bvh(trim(read_motion(_SHIPPED), end=0.1), Style()))
    notes = [read_motion(path, ReadOptions(rate=30.0, person=person)).notes for person in (None, "2")]
    said = "the person '2' that was asked for is left out: there is one only"
    assert said in notes[1] and not any("asked for" in note for note in notes[0])
