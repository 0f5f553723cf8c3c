"""Nested arrays come back from every container alike, and hostile ones run nothing and take little."""

from __future__ import annotations

import argparse
import bz2
import datetime
import enum
import gzip
import io
import lzma
import os
import pickle
import sys
import types
import zlib
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.errors import UserError
from mrhubo.files import array_pickle, tree
from mrhubo.files.tree import Tree, read_tree
from tests.files.bounded import bounded
from tests.files.test_safe_pickle import BOMBS, attacks

ARRAY = np.arange(12, dtype=np.float32).reshape(2, 6)
CONTENT: dict[str, Any] = {
    "people": defaultdict(
        dict, {np.int64(3): {"pose": ARRAY, "fortran": np.asfortranarray(ARRAY)}, 4: {"pose": ARRAY}}
    ),
    "rows": [ARRAY, ARRAY],
    "tensor": torch.from_numpy(ARRAY).T.double(),
    "number": np.float32(3),
    "plain": 2.5,
    "text": "a",
    "texts": np.array(["ab", "c"]),
    "objects": np.array([{"pose": ARRAY}, None], dtype=object),
    "empty": [],
}


def check(found: Tree) -> None:
    people = found.get("people")
    assert people is not None and people.keys == ("3", "4")
    for name, node in people.items():
        assert node.where.endswith(f"people[{name}]") or node.where == f"all[people][{name}]"
        for _, array in node.items():
            np.testing.assert_array_equal(array.array(), ARRAY)
    np.testing.assert_array_equal(found["rows"].array(), np.stack((ARRAY, ARRAY)))
    np.testing.assert_array_equal(found["tensor"].array(), ARRAY.T)
    assert found["number"].array() == 3 and found["plain"].array() == 2.5 and found["text"].text() == "a"
    np.testing.assert_array_equal(next(iter(found["objects"]))["pose"].array(), ARRAY)
    assert found["texts"].shape() is None and found["empty"].shape() is None and found.get("none") is None
    with pytest.raises(UserError, match="expected an array"):
        found["empty"].array()


@pytest.mark.parametrize("packed", [0, 3, ("gzip", 3), ("bz2", 3), ("lzma", 3), ("xz", 3)])
def test_what_joblib_dumps(tmp_path: Path, packed: Any) -> None:
    joblib.dump(CONTENT, tmp_path / "a.pkl", compress=packed)
    check(read_tree(tmp_path / "a.pkl"))


def test_what_joblib_before_1_2_dumped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It did not align arrays, and put no padding before them."""
    monkeypatch.setattr(joblib.numpy_pickle.NumpyArrayWrapper.__init__, "__defaults__", (False, None))
    joblib.dump(CONTENT, tmp_path / "a.pkl")
    check(read_tree(tmp_path / "a.pkl"))


@pytest.mark.parametrize("protocol", range(6))
def test_what_pickle_dumps(tmp_path: Path, protocol: int) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(CONTENT, protocol))
    check(read_tree(tmp_path / "a.pkl"))


def test_what_torch_and_numpy_save(tmp_path: Path) -> None:
    torch.save(CONTENT, tmp_path / "a.pt")
    check(read_tree(tmp_path / "a.pt"))
    np.save(tmp_path / "a.npy", CONTENT)  # type: ignore[arg-type]
    check(read_tree(tmp_path / "a.npy"))
    np.savez(tmp_path / "a.npz", all=CONTENT, rows=ARRAY)  # type: ignore[arg-type]
    found = read_tree(tmp_path / "a.npz")
    assert found.keys == ("all", "rows")
    np.testing.assert_array_equal(found["rows"].array(), ARRAY)
    check(found["all"])


@pytest.mark.parametrize("dump", [torch.save, lambda value, path: path.write_bytes(pickle.dumps(value))])
def test_tensors_keep_their_types(dump: Any, tmp_path: Path) -> None:
    """Times since 1970, in seconds and nanoseconds, are not exact in less."""
    times = {"s": torch.arange(5, dtype=torch.float64) / 30 + 1.7e9, "ns": torch.arange(5) * 33_333_333 + 1700 * 10**15}
    dump(times | {"half": torch.ones(2).half(), "yes": torch.tensor([True, False])}, tmp_path / "a.pt")
    found = read_tree(tmp_path / "a.pt")
    for name, tensor in times.items():
        np.testing.assert_array_equal(found[name].array(), tensor.numpy())
    assert found["half"].array().tolist() == [1, 1] and found["yes"].array().tolist() == [1, 0]


@pytest.mark.parametrize("value", [10**400, [10**400], [[0.5], [-(10**400)]]])
def test_whole_numbers_that_no_float_is_as_large_as(tmp_path: Path, value: Any) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"pose": value}))
    found = read_tree(tmp_path / "a.pkl")
    assert found["pose"].shape() is None
    with pytest.raises(UserError, match=r"a\.pkl: 'pose.*' holds a whole number of more than 300 digits"):
        found["pose"].array()


def test_one_finite_number(tmp_path: Path) -> None:
    given = {"a": 3, "b": [[4.5]], "c": np.float32(2), "d": np.array([1])}
    bad = {
        "nan": np.nan,
        "inf": -np.inf,
        "two": [1, 2],
        "none": None,
        "text": "1",
        "empty": np.zeros(0),
        "huge": 10**400,
    }
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({**given, **bad}))
    found = read_tree(tmp_path / "a.pkl")
    assert [found[name].number() for name in given] == [3, 4.5, 2, 1]
    for name in bad:
        with pytest.raises(UserError, match=rf"a\.pkl: '{name}' (is|has|holds) "):
            found[name].number()


def test_bytes_beyond_the_end_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    joblib.dump({"pose": np.zeros((100, 72))}, path)
    whole = path.read_bytes()
    for end in (len(whole) // 2, len(whole) - 400):
        path.write_bytes(whole[:end])
        with pytest.raises(UserError, match=r"a.pkl: (it ends in the midst of an array|it is no readable pickle)"):
            read_tree(path)
    joblib.dump({"pose": np.zeros((100, 72))}, path, compress=3)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(UserError, match="truncated or damaged"):
        read_tree(path)


@pytest.mark.parametrize("which", range(8))
@pytest.mark.parametrize("dump", ["pickle", "joblib", "packed", "inside", "torch", "npy", "npz"])
def test_nothing_runs(tmp_path: Path, which: int, dump: str) -> None:
    marker = tmp_path / "ran.npy"
    attack, path = attacks(marker)[which], tmp_path / "a.pkl"
    content = {"pose": attack, "pose_world": ARRAY}
    inside = np.array([attack], dtype=object)
    write: dict[str, Callable[[], Any]] = {
        "pickle": lambda: path.write_bytes(pickle.dumps(content)),
        "joblib": lambda: joblib.dump(content, path),
        "packed": lambda: joblib.dump(content, path, compress=3),
        "inside": lambda: joblib.dump({"pose": inside}, path),
        "torch": lambda: torch.save(content, path),
        "npy": lambda: np.save(path.open("wb"), inside),
        "npz": lambda: np.savez(path.open("wb"), pose=inside),
    }
    write[dump]()
    with pytest.raises(UserError, match=r"a\.pkl"):
        read_tree(path)["pose"].array()
    assert not marker.exists() and sorted(file.name for file in tmp_path.iterdir()) == ["a.pkl"]


@pytest.mark.parametrize("name", ["eval", "exec", "getattr", "__import__", "open", "compile"])
def test_only_harmless_builtins_may_be_named(tmp_path: Path, name: str) -> None:
    for module in ("builtins", "__builtin__", "os", "posix"):
        (tmp_path / "a.pkl").write_bytes(f"c{module}\n{name}\n.".encode())
        with pytest.raises(UserError, match="nothing was run"):
            read_tree(tmp_path / "a.pkl")


@pytest.mark.parametrize("dump", ["pickle", "joblib", "torch", "npy"])
def test_what_a_programs_own_classes_keep_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dump: str
) -> None:
    """Such as an enum of the simulator, which nobody else has; none of it is imported."""
    theirs = types.ModuleType("somebodys_simulator")
    monkeypatch.setitem(sys.modules, theirs.__name__, theirs)
    made = {
        "Order": enum.Enum("Order", {"COMMON": "common"}, module=theirs.__name__),
        "Settings": type("Settings", (), {"__module__": theirs.__name__}),
        "Entries": type("Entries", (dict,), {"__module__": theirs.__name__}),
    }
    for name, kind in made.items():
        setattr(theirs, name, kind)
    kept, path = made["Settings"](), tmp_path / "a.pkl"
    kept.path, kept.entries = Path("x"), made["Entries"](a=1)
    content = {
        "order": made["Order"]("common"), "settings": kept, "args": argparse.Namespace(a=1),
        "at": datetime.datetime(2026, 1, 1), "poses": ARRAY,
    }  # fmt: skip
    write: dict[str, Callable[[], Any]] = {
        "pickle": lambda: path.write_bytes(pickle.dumps(content)),
        "joblib": lambda: joblib.dump(content, path),
        "torch": lambda: torch.save(content, path),
        "npy": lambda: np.save(path.open("wb"), content, allow_pickle=True),  # type: ignore[arg-type]
    }
    write[dump]()
    monkeypatch.delitem(sys.modules, theirs.__name__)
    tree = read_tree(path)
    np.testing.assert_array_equal(tree["poses"].array(), ARRAY)
    assert tree["order"].shape() is None and "somebodys_simulator" in tree["settings"].described
    assert theirs.__name__ not in sys.modules


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_take_little(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.pkl").write_bytes(BOMBS[name])
    with bounded(100, 4):
        try:
            read_tree(tmp_path / "a.pkl").array()
        except UserError:
            pass


PACKERS = [gzip.compress, zlib.compress, bz2.compress, lzma.compress, lambda c: lzma.compress(c, lzma.FORMAT_ALONE)]


@pytest.mark.parametrize("pack", PACKERS)
def test_what_unpacks_to_too_much_is_not_unpacked(tmp_path: Path, pack: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree, "MAX_BYTES", 2**22)
    (tmp_path / "a.pkl").write_bytes(pack(bytes(2**24)))
    with bounded(60, 4), pytest.raises(UserError, match="unpacks to more than"):
        read_tree(tmp_path / "a.pkl")


def test_lists_that_repeat_each_other_make_no_large_array(tmp_path: Path) -> None:
    """A list of a thousand times the same list of a thousand times the same ... is some thousands of bytes."""
    node: Any = np.zeros(1000)
    for _ in range(3):
        node = [node] * 1000
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"a": node}))
    with bounded(700, 8), pytest.raises(UserError, match="more than"):
        read_tree(tmp_path / "a.pkl")["a"].array()


def test_a_list_of_itself_is_no_array(tmp_path: Path) -> None:
    node: list[Any] = []
    node.append(node)
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(node))
    with pytest.raises(UserError, match="list of lists"):
        read_tree(tmp_path / "a.pkl").array()


def test_pickles_in_pickles_end(tmp_path: Path) -> None:
    node: Any = {"a": 1}
    for _ in range(6):
        buffer = io.BytesIO()
        joblib.dump({"x": np.array([node], dtype=object)}, buffer)
        node = joblib.load(io.BytesIO(buffer.getvalue()))
    header = pickle.dumps(0, 2)[:2]
    wrapper = b"cjoblib.numpy_pickle\nNumpyArrayWrapper\n)\x81}(X\x05\x00\x00\x00shape)X\x05\x00\x00\x00dtypecnumpy\ndtype\n(X\x02\x00\x00\x00O8tRub"  # noqa: E501
    (tmp_path / "a.pkl").write_bytes(header + wrapper * 50 + b".")
    with pytest.raises(UserError, match="pickles in pickles"):
        read_tree(tmp_path / "a.pkl")


def whole(write: Callable[[io.BytesIO], Any]) -> bytes:
    buffer = io.BytesIO()
    write(buffer)
    return buffer.getvalue()


FILES = [
    whole(lambda b: joblib.dump(CONTENT, b)),
    whole(lambda b: joblib.dump(CONTENT, b, compress=3)),
    whole(lambda b: pickle.dump(CONTENT, b)),
    whole(lambda b: torch.save(CONTENT, b)),
    whole(lambda b: np.savez(b, all=CONTENT, rows=ARRAY)),  # type: ignore[arg-type]
    whole(lambda b: np.save(b, CONTENT)),  # type: ignore[arg-type]
]


@settings(max_examples=150)
@given(st.data())
def test_damaged_files_are_refused_by_name(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from(FILES)))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    content = content[: data.draw(st.integers(1, len(content)))] if data.draw(st.booleans()) else content
    path = Path(os.fspath(tmp_path_factory.getbasetemp())) / "damaged"
    path.write_bytes(content)
    try:
        visit(read_tree(path), 6)
    except UserError as error:
        assert str(path) in str(error)


def visit(node: Tree, deepest: int) -> None:
    node.shape()
    assert node.described
    for child in [child for _, child in node.items()] + list(node) if deepest else []:
        visit(child, deepest - 1)


@pytest.mark.parametrize("pack", PACKERS)
def test_what_is_packed_but_no_pickle_is_to_be_unpacked(tmp_path: Path, pack: Any) -> None:
    (tmp_path / "a.bvh.gz").write_bytes(pack(b"HIERARCHY\nROOT Hips\n"))
    with pytest.raises(UserError, match="what is in it is no pickle; unpack it first"):
        read_tree(tmp_path / "a.bvh.gz")


def test_large_arrays_are_read_when_they_are_asked_for(tmp_path: Path) -> None:
    """Estimators write the mesh of every frame beside the pose."""
    large = np.arange(4_000_000, dtype=np.float64).reshape(1000, 4000)
    path = tmp_path / "a.pkl"
    joblib.dump({"verts": large, "fortran": np.asfortranarray(large), "pose": ARRAY}, path)
    with bounded(10, 5):
        found = read_tree(path)
        np.testing.assert_array_equal(found["pose"].array(), ARRAY)
        assert found["verts"].shape() == large.shape and "an array of shape" in found["verts"].described
    np.testing.assert_array_equal(found["verts"].array(), large)
    np.testing.assert_array_equal(found["fortran"].array(), large)
    found = read_tree(path)
    os.truncate(path, 2_000_000)
    with pytest.raises(UserError, match="was changed while it was read"):
        found["verts"].array()


def test_steps_are_in_proportion_to_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array_pickle, "_FEW_STEPS", 1_000)
    (tmp_path / "a.pkl").write_bytes(b"\x80\x04" + b"N0" * 5_000 + b"N.")
    with pytest.raises(UserError, match="takes more than 3,501 steps"):
        read_tree(tmp_path / "a.pkl")
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"poses": np.zeros((300, 72)).tolist()}))
    assert read_tree(tmp_path / "a.pkl")["poses"].shape() == (300, 72)
