"""A package whose files do not belong together is refused; one from before the checksums is compared by its content."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.body import BodyPrior
from mrhubo.errors import UserError
from mrhubo.files.atomic import checksum_file
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.integrity import check_content, check_files, file_checksums
from tests.chain import ROOT, new_package

WEIGHTS, OTHERS = (
    "retargeter.safetensors",
    ("robot.urdf", "config.yaml", "body_prior.safetensors", "skeleton.safetensors"),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "package"
    return new_package(ROOT / "conf" / "nao.yaml", folder, "model.hidden=8", prior=BodyPrior(hidden=8).eval())


@pytest.fixture(scope="module")
def opened(made: Path) -> Retargeter:
    return Retargeter.load(made)


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made, tmp_path / "package")


def rewrite(folder: Path, change: Callable[[dict[str, torch.Tensor], dict[str, str]], object]) -> None:
    """Changes weights or header, under a fresh checksum."""
    tensors, metadata = read_tensors(folder / WEIGHTS)
    change(tensors, metadata)
    write_tensors(folder / WEIGHTS, tensors, metadata)


def edit(file: Path, *pairs: tuple[str, str]) -> None:
    text = file.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)


def without_checksums(folder: Path) -> None:
    """As packages were before."""
    rewrite(folder, lambda _, header: header.pop("files_xxh3"))


def refused(folder: Path, message: str) -> None:
    with pytest.raises(UserError, match=message) as caught:
        Retargeter.load(folder)
    assert str(folder) in str(caught.value)


def answer(folder: Path) -> torch.Tensor:
    return Retargeter.load(folder).predict(torch.eye(3).expand(1, 21, 3, 3))


def swap(file: Path, a: str, b: str) -> None:
    edit(file, (a, "\0"), (b, a), ("\0", b))


NARROW = ('lower="-2.08567" upper="2.08567" effort="1.329"', 'lower="-0.5" upper="0.5" effort="1.329"')
EDITS: dict[str, Callable[[Path], object]] = {
    "limits narrowed": lambda p: edit(p / "robot.urdf", NARROW),
    "two joints exchanged": lambda p: swap(p / "config.yaml", "LShoulderPitch", "RShoulderPitch"),
    "two joints renamed": lambda p: swap(p / "robot.urdf", 'joint name="LElbowYaw"', 'joint name="RElbowYaw"'),
    "a narrower range": lambda p: edit(p / "config.yaml", ("ranges: {}", "ranges: {LElbowYaw: [-0.1, 0.1]}")),
    "other inputs": lambda p: edit(p / "config.yaml", ("input_joints: null", "input_joints: [left_elbow, right_elbow, head]"), ("input_frame: directions", "input_frame: local")),
    "another name": lambda p: edit(p / "config.yaml", ("name: nao", "name: oan")),
}  # fmt: skip


@pytest.mark.parametrize("what", EDITS)
def test_an_edited_file_is_named(folder: Path, what: str) -> None:
    EDITS[what](folder)
    refused(
        folder,
        r"(robot.urdf|config.yaml): is not the file that this package was made with.*take the whole package anew",
    )


@pytest.mark.parametrize("what", [what for what in EDITS if what != "two joints renamed"])  # the next test's
def test_older_packages_are_compared_by_content(folder: Path, what: str) -> None:
    without_checksums(folder)
    EDITS[what](folder)
    refused(folder, "disagree|other joints|other things|do not fit|two robots|no limb|moves no body part|turns no")


def test_older_packages_whose_content_agrees_are_read(made: Path, folder: Path) -> None:
    without_checksums(folder)
    assert torch.equal(answer(folder), answer(made))


def test_older_packages_of_a_fit_tell_the_checksum_of_their_urdf_and_prior(folder: Path) -> None:
    urdf = checksum_file(folder / "robot.urdf")
    without_checksums(folder)
    rewrite(folder, lambda _, header: header.update(urdf_xxh3=urdf))
    Retargeter.load(folder)
    rewrite(folder, lambda _, header: header.update(prior_xxh3="0" * 16))
    refused(folder, "its body prior is not the one")
    rewrite(folder, lambda _, header: header.pop("prior_xxh3"))
    EDITS["two joints renamed"](folder)
    refused(folder, "robot.urdf: is not the file")


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_of_another_package_is_named(folder: Path, tmp_path: Path, name: str) -> None:
    other = new_package(ROOT / "conf" / "reachy.yaml", tmp_path / "other", "model.hidden=8")
    if (other / name).read_bytes() == (folder / name).read_bytes():
        (other / name).write_bytes((folder / name).read_bytes() + b" ")
    shutil.copy(other / name, folder / name)
    refused(folder, f"{name}: is not the file that this package was made with")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t, h: t.update({"limited.upper_N": t["limited.upper_N"] + 1}), "weights and URDF have other limits"),
        (lambda t, h: t.update({"limited.lower_N": t["limited.lower_N"] * torch.nan}), "NaN"),
        (lambda t, h: t.update({"post.parts.0.last.bias": t["post.parts.0.last.bias"].double() + 1e300}), "infinite"),
        (lambda t, h: t.update({"post.parts.0.last.bias": t["post.parts.0.last.bias"].long()}), "do not fit"),
        (lambda t, h: h.update(phi_threshold="nan"), "phi_threshold"),
        (lambda t, h: h.update(joint_names=json.dumps(json.loads(h["joint_names"])[::-1])), "in another order"),
    ],
)
def test_a_header_or_weights_with_a_fresh_checksum_must_still_fit(
    folder: Path, change: Callable[..., object], message: str
) -> None:
    rewrite(folder, change)
    refused(folder, message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"phi_threshold": "1e30"}, "phi_threshold"),
        ({"phi_threshold": "much"}, "phi_threshold"),
        ({"upper_rad": "[9, 9, 9]"}, "tells no limits"),
        ({"upper_rad": json.dumps([9.0] * 8)}, "disagree on a limit of 'LShoulderPitch'"),
        ({"upper_rad": json.dumps([float("nan")] * 8)}, "disagree on a limit of 'LShoulderPitch'"),
        ({"upper_rad": "[1" + 400 * "0" + 7 * ", 1.0" + "]"}, "tells no limits"),
        ({"lower_rad": "7"}, "tells no limits"),
        ({"joint_names": "[" * 5_000}, "tells nothing of 'joint_names'"),
        ({"joint_names": ""}, "tells nothing of 'joint_names'"),
        ({"seen": "[]"}, "other things"),
        ({"robot": "oan"}, "name two robots, 'oan' and 'nao'"),
        ({"files_xxh3": "{}"}, "does not tell the checksum of every file"),
        ({"files_xxh3": "[1]"}, "does not tell the checksum of every file"),
        ({"files_xxh3": "nothing"}, "tells nothing of 'files_xxh3'"),
    ],
)
def test_what_a_header_says_is_compared(made: Path, opened: Retargeter, change: dict[str, str], message: str) -> None:
    header = read_tensors(made / WEIGHTS)[1]
    robot, inputs = opened.body_map.robot, opened.network.features.names
    check_files(made, OTHERS, header)
    assert check_content(made, header, robot, inputs) == opened.phi_threshold
    with pytest.raises(UserError, match=message):
        check_files(made, OTHERS, header | change)
        check_content(made, header | change, robot, inputs)


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ((("urdf: robot.urdf", "urdf: ../other.urdf"),), r"name '.*other.urdf' in place of its own robot.urdf"),
        ((("prior_path: body_prior.safetensors", "prior_path: /etc/passwd"),), "in place of its own body_prior"),
        ((("model_path: skeleton.safetensors", "model_path: null"),), "in place of its own skeleton"),
        ((("name: nao", "name: ${oc.env:HOME}"),), "the environment is not read for a file"),
        ((("hidden: 8", "hidden: 8000"), ("layers: 4", "layers: 64")), "model.hidden: 8,000 units"),
    ],
)
def test_settings_reach_for_nothing_outside(folder: Path, edits: tuple[tuple[str, str], ...], message: str) -> None:
    edit(folder / "config.yaml", *edits)
    rewrite(folder, lambda _, header: header.update(file_checksums(folder, OTHERS)))
    with pytest.raises(UserError, match=message):
        Retargeter.load(folder)


@settings(max_examples=12, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_damage_is_one_sentence_or_none_at_all(made: Path, folder: Path, data: st.DataObject) -> None:
    """Flipped bits and lost ends, of any file."""
    name = data.draw(st.sampled_from([WEIGHTS, *OTHERS]))
    content = bytearray((made / name).read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    (folder / name).write_bytes(content)
    try:
        found = answer(folder)
    except UserError as error:
        assert re.search(name, str(error))
    else:  # a blank that pads a header
        assert torch.equal(found, answer(made))
    finally:
        shutil.copy(made / name, folder / name)


def test_a_file_in_place_of_the_folder(folder: Path) -> None:
    with pytest.raises(UserError, match=f"robot.urdf: is a file; a package is a folder: name {folder}"):
        Retargeter.load(folder / "robot.urdf")
