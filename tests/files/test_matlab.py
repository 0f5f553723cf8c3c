"""MATLAB's files, which SciPy writes, and reads alike; what is too much, or damaged, is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from scipy.io import loadmat, savemat
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


@pytest.mark.parametrize("packed", [False, True])
def test_kinds_are_those_that_scipy_reads(packed: bool, tmp_path: Path) -> None:
    """Numbers of every size, tables of letters, lists of structures, and what is empty or alone."""
    path = tmp_path / "take.mat"
    kinds = {name: np.arange(-3, 9).astype(name).reshape(2, 2, 3) for name in ("f4", "i1", "u1", "i2", "u4", "i8")}
    values: dict[str, object] = {
        **kinds,
        "none": np.zeros((0, 3)),
        "letters": np.array(["left", "right hand"]),
        "text": "Ärmel 手",
        "empty": "",
        "table": np.arange(6.0).reshape(2, 3),
        "persons": np.array([{"name": "Ann", "heights": np.arange(3)}, {"name": "Bob", "heights": 2}], dtype=object),
        "cells": np.array([["a", 1.5], [np.arange(4), "b"]], dtype=object),
        "deep": {"a": {"b": {"c": [1, 2, 3]}}},
    }
    savemat(path, values, do_compression=packed)
    ours, theirs = matlab.read_matlab(path), loadmat(path, simplify_cells=True)
    assert set(ours) == set(values)

    def compare(own: object, other: object) -> None:
        if isinstance(own, dict):
            assert isinstance(other, dict) and set(own) == set(other)
            for name in own:
                compare(own[name], other[name])
        elif isinstance(own, list):
            assert len(own) == len(other)  # type: ignore[arg-type]
            for one, another in zip(own, other, strict=True):  # type: ignore[call-overload]
                compare(one, another)
        elif isinstance(own, str):
            assert own == (str(other).rstrip() if np.size(other) else "")
        elif np.size(own) or np.size(other):  # type: ignore[arg-type]
            np.testing.assert_array_equal(np.squeeze(own), np.squeeze(other))  # type: ignore[arg-type]
            assert np.asarray(own).dtype.kind == np.asarray(other).dtype.kind

    for name in values:
        compare(ours[name], theirs[name])
    assert ours["i1"].shape == (2, 2, 3) and ours["i1"].dtype == np.int8
    savemat(path, {"bits": np.array([True, False])})
    assert matlab.read_matlab(path)["bits"].tolist() == [True, False]


def test_axes_of_one_are_kept_where_there_are_three(tmp_path: Path) -> None:
    """MATLAB knows no lists of numbers, so of two axes one says nothing; of three, a film of one frame has one."""
    path = tmp_path / "take.mat"
    savemat(path, {"film": np.zeros((1, 4, 3)), "row": np.zeros(4), "number": 1.0})
    assert {name: value.shape for name, value in matlab.read_matlab(path).items()} == {
        "film": (1, 4, 3), "row": (4,), "number": ()
    }  # fmt: skip


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
    savemat(path, {"numbers": np.ones(200_000, dtype=np.uint8)})
    content = bytearray(path.read_bytes())
    content[144] = 6  # doubles, of which MATLAB writes bytes where they do as well
    path.write_bytes(content)
    with pytest.raises(UserError, match="more than 1,000,000 bytes when it is unpacked"):
        read_tree(path)
    monkeypatch.setattr(matlab, "_MAX_BYTES", 200)
    with pytest.raises(UserError, match="at most 200 bytes are read"):
        read_tree(path)
    monkeypatch.undo()
    monkeypatch.setattr(matlab, "_MAX_VALUES", 1000)
    savemat(path, {"cells": np.full((40, 40), 1.0, dtype=object)}, do_compression=True)
    with pytest.raises(UserError, match=r"take\.mat: has more than 1,000 arrays, texts and cells"):
        read_tree(path)
    deep: object = 1.0
    for _ in range(40):
        deep = {"a": deep}
    savemat(path, {"deep": deep})
    with pytest.raises(UserError, match=r"take\.mat: has structures in structures, more than 32 deep"):
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
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
