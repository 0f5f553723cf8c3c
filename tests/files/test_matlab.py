"""MATLAB's files, which SciPy writes and reads; what is too much for it, or damaged, is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from scipy.io import savemat
from scipy.sparse import csc_array

from mrhubo import UserError
from mrhubo.files import matlab
from mrhubo.files.tree import read_tree
from tests.motion.damage import Step, accidents, damaged

_VALUES = {
    "places": np.arange(24.0).reshape(4, 2, 3),
    "fps": 30,
    "names": np.array(["LeftArm", "RightArm"], dtype=object),
    "take": {"subject": "Ann", "weights": np.array([0.5, 0.25])},
}


@pytest.mark.parametrize("packed", [False, True])
def test_variables_come_back(packed: bool, tmp_path: Path) -> None:
    path = tmp_path / "take.mat"
    savemat(path, _VALUES, do_compression=packed)
    tree = read_tree(path)
    assert set(tree.keys) == set(_VALUES)
    np.testing.assert_array_equal(tree["places"].array(), _VALUES["places"])
    assert tree["names"].texts() == ["LeftArm", "RightArm"] and tree["fps"].number() == 30
    assert tree["take"]["subject"].text() == "Ann"
    np.testing.assert_array_equal(tree["take"]["weights"].array(), [0.5, 0.25])


def test_what_is_refused_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "take.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF")
    with pytest.raises(UserError, match=r"take\.mat: is a MATLAB file of version 7\.3; save it as one of version 7"):
        read_tree(path)
    savemat(path, _VALUES)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(UserError, match=r"take\.mat: is a MATLAB file that is damaged"):
        read_tree(path)
    savemat(path, {"structure": {"zeros": np.zeros(10**6)}}, do_compression=True)  # a thousandth of it
    monkeypatch.setattr(matlab, "_MAX_BYTES", 10**6)
    with pytest.raises(UserError, match=r"take\.mat: has more than 1,000,000 bytes when it is unpacked; cut it"):
        read_tree(path)
    monkeypatch.setattr(matlab, "_MAX_BYTES", 200)
    with pytest.raises(UserError, match="at most 200 bytes are read"):
        read_tree(path)


def test_what_is_no_number_and_no_text_is_nothing(tmp_path: Path) -> None:
    """Sparse and complex numbers, and lists of more than one kind."""
    path = tmp_path / "take.mat"
    cells = np.array([1.5, "x", np.array([1.0, 2.0])], dtype=object)
    savemat(path, {"sparse": csc_array(np.eye(3)), "complex": np.ones(3) * 1j, "cells": cells, "is": np.array([True])})
    tree = read_tree(path)
    assert tree["sparse"].is_none and tree["complex"].is_none
    assert [child.text() or child.shape() for child in tree["cells"]] == [(), "x", (2,)]


@given(steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_or_refused_in_a_sentence(steps: list[Step], tmp_path: Path) -> None:
    path = tmp_path / "take.mat"
    savemat(path, _VALUES)
    path.write_bytes(damaged(path.read_bytes(), steps))
    try:
        tree = read_tree(path)
        for _, child in tree.items():
            child.shape()
    except UserError as error:
        assert "take.mat" in str(error)
