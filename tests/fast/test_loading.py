"""A package is read without PyTorch, and refused when it is not what it says."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

import mrhubo
from mrhubo import rotation
from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter
from mrhubo.fast.description import FILE, Description
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.motion import Motion
from mrhubo.retargeter import Retargeter
from tests.fast.altered import Altered


@pytest.fixture(scope="module")
def nao(make: Callable[[str], Retargeter]) -> Retargeter:
    return make("nao")


@pytest.fixture(scope="module")
def package(nao: Retargeter, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return nao.save(tmp_path_factory.mktemp("packages") / "nao", {})


@pytest.fixture(scope="module")
def fast(package: Path) -> FastRetargeter:
    return mrhubo.load_fast(package, "numpy")


def test_a_package_answers_without_pytorch(
    package: Path, fast: FastRetargeter, array: np.ndarray, tmp_path: Path
) -> None:
    """Also where only its one file is."""
    shutil.copy(package / FILE, tmp_path / "robot.safetensors")
    np.save(tmp_path / "poses.npy", array)
    script = (
        "import sys; sys.modules.update(torch=None, lightning=None, scipy=None, yourdfpy=None, pytorch_kinematics=None)\n"
        "import mrhubo, numpy\n"
        f"for place in ({str(package)!r}, 'robot.safetensors'):\n"
        "    answer = mrhubo.load_fast(place, 'numpy')(numpy.load('poses.npy'))\n"
        "numpy.save('q.npy', answer.q); answer.robot.name == 'nao' or sys.exit('name')\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(np.load(tmp_path / "q.npy"), fast(array).q)


def test_every_form_of_poses(fast: FastRetargeter, poses: torch.Tensor, array: np.ndarray) -> None:
    wanted = fast.predict(array)
    for given in (rotation.matrix_to_sixd(poses), rotation.matrix_to_axis_angle(poses).flatten(1), poses.double()):
        np.testing.assert_allclose(fast.predict(given.numpy()), wanted, atol=5e-5)
    assert fast(array.reshape(4, 11, 21, 3, 3)).collision.shape == (4, 11)
    assert fast(array[:0]).q.shape == (0, 8)


def test_a_motion_is_answered_frame_by_frame(fast: FastRetargeter, nao: Retargeter, poses: torch.Tensor) -> None:
    motion = Motion("some", poses, 30.0)
    found, wanted = fast(motion, together=False), nao(motion, together=False)
    assert (found.frame_rate, found.name) == (30.0, "some")
    assert float(np.median(np.abs(found.q - wanted.q.numpy()))) < 2e-6
    assert float(np.abs(found.confidence - wanted.confidence.numpy()).max()) < 5e-3


def test_the_answer_can_be_saved(fast: FastRetargeter, array: np.ndarray, tmp_path: Path) -> None:
    found = fast(array[:8], frame_rate=30.0)
    mrhubo.write_robot_motion(found, tmp_path / "answer.npz")
    back = mrhubo.read_robot_motion(tmp_path / "answer.npz")
    np.testing.assert_array_equal(back.q, found.q)
    assert back.robot.checksum == fast.facts.checksum and back.branch_names == found.branch_names


@pytest.mark.parametrize("form", ["numpy", "compiled"])
def test_what_is_no_pose_is_refused(nao: Retargeter, array: np.ndarray, form: str) -> None:
    if form == "compiled":
        pytest.importorskip("numba")
    fast = FastRetargeter(nao.describe(), form)
    for change, said in ((np.nan, "pose 3 holds NaN"), (1.5, "pose 3 holds a matrix that is no rotation")):
        wrong = array.copy()
        wrong[3, 4, 0, 0] = change
        with pytest.raises(UserError, match=said):
            fast(wrong)
    mirrored = array.copy()
    mirrored[2, 5, :, 2] *= -1
    with pytest.raises(UserError, match="pose 2 holds a matrix"):
        fast.predict(mirrored)
    for given, said in (
        (array[0, 0], "must have the shape"), (["a"], "array of numbers"), (np.full((2, 63), 90.0), "degrees"),
        (np.zeros((2, 21, 6)), "pose 0 holds six numbers"),
    ):  # fmt: skip
        with pytest.raises(UserError, match=said):
            fast(given)
    with pytest.raises(UserError, match="polish"):
        fast(array, polish=-1)
    with pytest.raises(UserError, match="frame rate"):
        fast(array, frame_rate=0.0)
    with pytest.raises(UserError, match="form must be"):
        FastRetargeter(nao.describe(), "fortran")


def test_an_older_package_is_described_anew(
    package: Path, array: np.ndarray, fast: FastRetargeter, tmp_path: Path
) -> None:
    folder = shutil.copytree(package, tmp_path / "older")
    (folder / FILE).unlink()
    np.testing.assert_allclose(mrhubo.load_fast(folder, "numpy").predict(array), fast.predict(array), atol=2e-6)


def test_a_version_in_the_registry_is_taken_too(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrhubo.fitting.record.registry.fetch_package", lambda uri: package)
    assert (
        mrhubo.load_fast("models:/mrhubo-nao/1", "numpy").joint_names == mrhubo.load_fast(package, "numpy").joint_names
    )


def test_a_file_of_another_package_is_refused(package: Path, make: Callable[[str], Retargeter], tmp_path: Path) -> None:
    folder = shutil.copytree(package, tmp_path / "mixed")
    other = make("coman").save(tmp_path / "coman", {})
    shutil.copy(other / FILE, folder / FILE)
    with pytest.raises(UserError, match="another package"):
        mrhubo.load_fast(folder)
    (folder / FILE).write_bytes((package / FILE).read_bytes()[:-100])
    with pytest.raises(UserError, match="cannot be read"):
        mrhubo.load_fast(folder)


def test_places_outside_an_array_are_refused(package: Path) -> None:
    """Compiled functions would read what is not theirs."""
    altered = Altered(package / FILE)
    whole = [name for name, array in altered.arrays.items() if array.dtype.kind != "f" and array.size]
    free = {"kinematics.rotary_A", "kinematics.limb_D", "cost.partial_D", "cost.cell_CU", "reading.mirror_T",
            "trust.column_XD", "trust.slot_XT"}  # fmt: skip
    assert len(whole) > 30 and free < set(whole)
    for name in sorted(set(whole) - free):
        for wrong in (-7, 10**6):
            altered.refused_with(name, wrong)
        altered.refused(name, altered.arrays[name].astype(np.float64))
    for name, array in altered.arrays.items():
        if name not in ("trust.measured", "capsules.pair_Y2") and len(array) > 1:  # these may be any
            altered.refused(name, array[:-1])


@pytest.mark.parametrize(
    ("name", "change", "sentence"),
    [
        ("cost.velocity_N", lambda array: -array, "cost.velocity_N lets a joint not turn"),
        ("cost.upper_N", lambda array: array - 10, "cost.lower_N is above cost.upper_N"),
        ("cost.block_N", lambda array: 0 * array, "cost.block_N leaves a block without a joint"),
    ],
)
def test_numbers_that_no_robot_has_are_refused(
    package: Path, tmp_path: Path, name: str, change: Callable[[torch.Tensor], torch.Tensor], sentence: str
) -> None:
    """Answers would be no numbers."""
    tensors, metadata = read_tensors(package / FILE)
    write_tensors(tmp_path / "changed.safetensors", {**tensors, name: change(tensors[name])}, metadata)
    with pytest.raises(UserError, match=sentence):
        Description.read(tmp_path / "changed.safetensors")
