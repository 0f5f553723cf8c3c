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
from mrhubo.files.safe_pickle import RecordedObject, read_checkpoint, to_array, to_tensor, unpickle

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
