"""Hostile pickles: whatever they ask for, nothing is imported, called, or taken for an array that is none."""

from __future__ import annotations

import io
import os
import pickle
import zipfile
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import example, given
from hypothesis import strategies as st

from mrhubo.body import VPoser, open_skeleton
from mrhubo.errors import UserError
from mrhubo.files import unpickler
from mrhubo.files.checkpoint import read_checkpoint, to_tensor
from mrhubo.files.records import RecordedObject
from mrhubo.files.safe_pickle import to_array
from mrhubo.files.unpickler import unpickle
from tests.files.bounded import bounded

MODULES = ("numpy", "scipy", "collections", "_codecs", "__builtin__")


class Attack:
    """Pickles as a call of any function."""

    def __init__(self, function: Any, *args: Any) -> None:
        self.call = (function, args)

    def __reduce__(self) -> Any:
        return self.call


def attacks(marker: Path) -> list[Any]:
    return [
        Attack(os.system, f"touch {marker}"),
        Attack(eval, f"open({str(marker)!r}, 'w')"),
        Attack(exec, f"open({str(marker)!r}, 'w')"),
        Attack(open, str(marker), "w"),
        Attack(np.save, str(marker), np.zeros(3)),
        Attack(np.testing.assert_equal, 0, Attack(os.system, f"touch {marker}")),
        Attack(getattr, Attack(__import__, "os"), "system"),
        Attack(__import__, "antigravity"),
    ]


@pytest.mark.parametrize("which", range(8))
@pytest.mark.parametrize("protocol", [0, 2, 4])
def test_nothing_runs(tmp_path: Path, which: int, protocol: int) -> None:
    marker = tmp_path / "ran.npy"
    attack = attacks(marker)[which]
    for content in (attack, {"v_template": attack, "shapedirs": 1, "J_regressor": 1, "kintree_table": 1}):
        path = tmp_path / "SMPL_NEUTRAL.pkl"
        path.write_bytes(pickle.dumps(content, protocol=protocol))
        with pytest.raises(UserError, match="SMPL_NEUTRAL.pkl"):
            open_skeleton(path)
    checkpoint = tmp_path / "V02_05.ckpt"
    torch.save({"state_dict": {"vp_model.decoder_net.0.weight": attack}}, checkpoint)
    with pytest.raises(UserError, match="V02_05.ckpt"):
        VPoser.open(checkpoint)
    assert list(tmp_path.iterdir()).count(marker) == 0 and not (tmp_path / "ran").exists()


def test_names_of_other_modules_are_named_in_the_error(tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(Attack(os.system, "true")))
    with pytest.raises(UserError, match=rf"asks for '{os.system.__module__}.system'.*nothing was run"):
        open_skeleton(tmp_path / "a.pkl")


@given(st.binary(max_size=300))
@example(b"cnumpy\nndarray\n(I1\ntR.")
@example(b"\x80\x02cnumpy\nndarray\n)\x81}b.")
@example(b"cnumpy\nndarray\nN}X\x01\x00\x00\x00aK\x01s\x86b.")
@example(b"ccollections\nOrderedDict\n)R(X\x01\x00\x00\x00aK\x01u.")
def test_any_bytes_give_plain_objects_or_a_named_error(content: bytes) -> None:
    try:
        found = unpickle(io.BytesIO(content), MODULES)
    except UserError:
        return
    with pytest.raises(UserError) if not isinstance(found, RecordedObject) else _maybe():
        to_array(found)


class _maybe:
    def __enter__(self) -> None: ...
    def __exit__(self, kind: Any, *_: Any) -> bool:
        return kind is None or issubclass(kind, UserError)


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "i1", "i4", "i8", "u1", "u4", "b1", ">f4", ">i8"])
@pytest.mark.parametrize("protocol", range(6))
def test_arrays_come_back(dtype: str, protocol: int) -> None:
    array = (np.arange(24).reshape(2, 3, 4) % 100).astype(dtype)
    for given_array in (array, np.asfortranarray(array), array[:, ::2], array[:0]):
        found = unpickle(io.BytesIO(pickle.dumps(given_array, protocol=protocol)), MODULES)
        np.testing.assert_array_equal(to_array(found), given_array)


def test_arrays_that_claim_too_much_are_refused() -> None:
    array = pickle.loads(pickle.dumps(np.zeros(3)))
    content = pickle.dumps(array, protocol=2)
    for old, new in ((b"K\x03\x85", b"K\x04\x85"), (b"f8", b"O8"), (b"f8", b"f9")):
        assert old in content
        with pytest.raises(UserError):
            to_array(unpickle(io.BytesIO(content.replace(old, new)), MODULES))


def test_tensors_that_reach_beyond_their_storage_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ckpt"
    torch.save({"w": torch.arange(6.0).reshape(2, 3).T, "n": torch.nn.Parameter(torch.ones(2))}, path)
    content, storages = read_checkpoint(path)
    torch.testing.assert_close(to_tensor(content["w"], storages), torch.arange(6.0).reshape(2, 3).T)
    torch.testing.assert_close(to_tensor(content["n"], storages), torch.ones(2))
    for args in ((0, (3, 3), (1, 3)), (5, (3, 2), (1, 3)), (0, (2, 3), (-3, 1)), (-1, (2,), (1,)), (0, (10**9,), (0,))):
        content["w"].args = (content["w"].args[0], *args)
        with pytest.raises(UserError):
            to_tensor(content["w"], storages)


def test_checkpoints_may_mention_lightning_but_not_the_system(tmp_path: Path) -> None:
    path = tmp_path / "a.ckpt"
    torch.save({"state_dict": OrderedDict(a=torch.zeros(1))}, path)
    content, storages = read_checkpoint(path)
    assert set(content) == {"state_dict"} and len(storages) == 1
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/data.pkl", pickle.dumps({"x": Attack(os.system, "true")}))
    with pytest.raises(UserError, match="a.ckpt: it asks for"):
        read_checkpoint(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/other", b"")
    with pytest.raises(UserError, match="no data.pkl"):
        read_checkpoint(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/data.pkl", pickle.dumps([1, 2]))
    with pytest.raises(UserError, match="expected a dictionary, found list"):
        read_checkpoint(path)


HUGE = (160 * 10**9).to_bytes(8, "little")
PAIRS = b"K\x01" + b"2\x86" * 60
"""A pair of a pair of a pair ...: two bytes for each, and twice as long to hash."""
BOMBS = {
    "a place in the memo far away": b"\x80\x02]r\xff\xff\xff\x1f.",
    "one that is a number in text": b"]p99999999999999999999\n.",
    "bytes that are not there": b"\x80\x05\x8e" + HUGE + b".",
    "an array of bytes that is not there": b"\x80\x05\x96" + HUGE + b".",
    "a frame that is not there": b"\x80\x04\x95" + HUGE + b".",
    "a key that takes for ever to hash": b"\x80\x02}" + PAIRS + b"K\x01s.",
    "one of several": b"\x80\x02}(" + PAIRS + b"K\x01u.",
    "one of a dictionary": b"\x80\x02(" + PAIRS + b"K\x01d.",
    "one of an ordered dictionary": b"\x80\x02ccollections\nOrderedDict\n(](" + PAIRS + b"K\x01\x86etR.",
    "a member of a set": b"\x80\x04\x8f(" + PAIRS + b"\x90.",
    "one of a frozen set": b"\x80\x04(" + PAIRS + b"\x91.",
    "lists without end": b"\x80\x02" + b"]" * 100_000 + b".",
    "names without end": b"".join(b"cnumpy\nn%d\n" % n for n in range(2_000)) + b".",
    "a number of many digits": b"I" + b"9" * 500_000 + b"\n.",
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_small_pickle_takes_little(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpickler, "MAX_STEPS", 50_000)
    with bounded(20, 2):
        try:
            unpickle(io.BytesIO(BOMBS[name]), MODULES)
        except UserError:
            pass


def record(module: str, name: str, *args: Any, state: Any = None) -> Any:
    kind = type(name, (RecordedObject,), {"module": module, "__slots__": ()})
    made = kind(*args)
    made.state = state
    return made


DOUBLE = record("numpy", "dtype", "f8", state=(3, "<"))


def dense(content: Any, shape: Any, dtype: Any = DOUBLE) -> Any:
    return record("numpy", "_reconstruct", state=(1, shape, dtype, False, content))


def nested(depth: int) -> Any:
    """Arrays that select from arrays, each twice."""
    found = dense(bytes(8), (1,))
    for _ in range(depth):
        found = record("chumpy", "Select", state={"a": found, "idxs": found, "preferred_shape": (1,)})
    return found


def pair(depth: int) -> Any:
    found: Any = "f8"
    for _ in range(depth):
        found = (found, found)
    return found


@pytest.mark.parametrize(
    "value",
    [
        dense(160 * 10**9, (20 * 10**9,)),
        dense(bytes(8), (10**12,)),
        dense(bytes(8), (pair(60),)),
        dense(bytes(8), (1,), record("numpy", "dtype", pair(60))),
        record("scipy", "csc_matrix", state={"_shape": (10**6, 10**6), "data": 1, "indices": 1, "indptr": 1}),
        record("scipy", "csc_matrix", state={"_shape": pair(60), "data": 1, "indices": 1, "indptr": 1}),
        nested(60),
        record("chumpy", "Ch", state={"x": pair(60)}),
    ],
)  # fmt: skip
def test_a_small_record_makes_no_large_array(value: Any) -> None:
    with bounded(20, 2), pytest.raises(UserError):
        to_array(value)


def test_an_array_of_itself_is_none() -> None:
    value = record("chumpy", "Ch", state={})
    value.state["x"] = value
    with pytest.raises(UserError, match="arrays of arrays"):
        to_array(value)


@pytest.mark.parametrize("args", [(0, (pair(60),), (1,)), (0, (2,), (pair(60),)), (pair(60), (2,), (1,))])
def test_a_small_record_makes_no_large_tensor(args: Any) -> None:
    kind = type("FloatStorage", (RecordedObject,), {"module": "torch"})
    value = record("torch", "_rebuild_tensor_v2", ("storage", kind, "0", "cpu", 2), *args)
    with bounded(20, 2), pytest.raises(UserError):
        to_tensor(value, {"0": bytes(8)})
    reference = ("storage", kind, pair(60), "cpu", 2)
    with bounded(20, 2), pytest.raises(UserError):
        to_tensor(record("torch", "_rebuild_tensor_v2", reference, 0, (2,), (1,)), {"0": bytes(8)})


def test_files_of_torch_before_1_6_are_named(tmp_path: Path) -> None:
    path = tmp_path / "old.pt"
    for state, said in (
        ({"bodyprior_enc_fc1.weight": torch.zeros(2, 63)}, "is VPoser version 1"),
        ({"vp_model.decoder_net.0.weight": torch.zeros(4, 2)}, "torch before 1.6"),
    ):
        torch.save(state, path, _use_new_zipfile_serialization=False)
        with pytest.raises(UserError, match=said) as caught:
            VPoser.open(path)
        assert str(caught.value).startswith(f"{path}: ")
    path.write_bytes(bytes(257) + b"ustar" + bytes(1_000))
    with pytest.raises(UserError, match="torch before 0.2"):
        VPoser.open(path)
    torch.jit.script(torch.nn.Linear(1, 1)).save(str(path))
    with pytest.raises(UserError, match="is a TorchScript program"):
        VPoser.open(path)


def test_a_huge_layer_is_not_made_of_one_that_is_there(tmp_path: Path) -> None:
    path = tmp_path / "a.ckpt"
    torch.save({"state_dict": {"vp_model.decoder_net.0.weight": torch.zeros(300_000, 1)}}, path)
    with pytest.raises(UserError, match="has num_neurons 300000"):
        VPoser.open(path)
