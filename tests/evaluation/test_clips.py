"""Which motions measure: what a config names must be there."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import Motions, load_motions
from mrhubo.fitting.preparation import prepare


@pytest.fixture
def folder(root: Path, tmp_path: Path) -> Path:
    for name in ("drinking", "wave", "boxing"):
        shutil.copy(root / "data" / "motions" / f"{name}.npz", tmp_path)
    return tmp_path


def load(root: Path, *overrides: str) -> Motions:
    return load_motions(load_config(root / "conf" / "nao.yaml", overrides))


def test_a_clip_that_is_not_there_is_named_with_the_nearest(root: Path, folder: Path) -> None:
    motions = f"evaluation.motions=[{folder}]"
    found = load(root, motions, "evaluation.validation=[drinking, wave]")
    assert [m.name for m in found.validation] == ["drinking", "wave"] and [m.name for m in found.test] == ["boxing"]
    with pytest.raises(UserError, match=r"^evaluation.validation: clip 'wvae' does not exist in .*; nearest: 'wave'"):
        load(root, motions, "evaluation.validation=[drinking, wvae]")
    with pytest.raises(UserError, match="'zzz' does not exist.*available: boxing, drinking, wave"):
        load(root, motions, "evaluation.validation=[zzz]")


def test_the_default_names_clips_of_two_folders(root: Path, folder: Path) -> None:
    assert [m.name for m in load(root, f"evaluation.motions=[{folder}]").validation] == ["drinking"]
    config = load_config(
        root / "conf" / "nao.yaml", [f"evaluation.motions=[{folder}]", "evaluation.validation=[other]"]
    )
    assert len(load_motions(config, split=False).all) == 3  # who measures answers to them needs no split


def test_a_file_in_place_of_a_folder_is_named_with_the_key_and_its_place(root: Path, folder: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", [f"evaluation.motions=[{folder / 'wave.npz'}]"])
    sentence = (
        f"command line: evaluation.motions: {folder / 'wave.npz'}: is a file; name the folder that holds it: {folder}"
    )
    with pytest.raises(UserError, match=re.escape(sentence)):
        prepare(config)


def test_a_clip_without_a_frame_rate_is_told_what_to_do_here(root: Path, folder: Path) -> None:
    np.savez(folder / "boxing.npz", poses=np.zeros((9, 66)), trans=np.zeros((9, 3)))
    with pytest.raises(UserError, match=r"boxing\.npz: holds no frame rate; clips tell it themselves") as refused:
        load(root, f"evaluation.motions=[{folder}]", "evaluation.validation=[drinking]")
    assert "--rate" not in str(refused.value)
