"""Capsules of meshes are found once for the same meshes, and anew wherever what is kept is not theirs, or not whole."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mrhubo.robot import hulls
from mrhubo.robot.kept_capsules import Mesh, kept_capsules

MESHES: list[Mesh] = [
    (np.asarray(trimesh.creation.box((0.1, 0.2, 0.3)).vertices), False),
    (np.asarray(trimesh.creation.cylinder(0.05, 0.3).vertices), True),
]


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "mrhubo"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """How many vertices each mesh had that was looked at."""
    found, real = list[int](), hulls.capsules_of
    monkeypatch.setattr(hulls, "capsules_of", lambda v_V3, alone: found.append(len(v_V3)) or real(v_V3, alone))
    yield found


def test_the_same_meshes_are_looked_at_once(cache_folder: Path, asked: list[int]) -> None:
    first, second = kept_capsules(MESHES), kept_capsules(MESHES)
    assert asked == [len(vertices_V3) for vertices_V3, _ in MESHES] and len(list(cache_folder.iterdir())) == 1
    for one, other in zip(first, second, strict=True):
        assert len(one) == len(other) >= 1
        for (a_3, b_3, r), (c_3, d_3, s) in zip(one, other, strict=True):
            assert np.array_equal(a_3, c_3) and np.array_equal(b_3, d_3) and r == s
    assert kept_capsules([]) == []


def test_other_meshes_are_others(asked: list[int]) -> None:
    kept_capsules(MESHES)
    count = len(asked)
    moved = [(MESHES[0][0] + 1e-9, False), MESHES[1]]
    for changed in (moved, MESHES[::-1], [(MESHES[0][0], True), MESHES[1]]):
        kept_capsules(changed)
        count += 2
        assert len(asked) == count


@pytest.mark.parametrize(
    "told",
    ["", "{}", "[]", "[[], []]", "[[[1, 2, 3]], [[1, 2, 3]]]", "[1, 2]", "[" * 5000, "[[[0,0,0,1,0,0,-1]],[[0,0,0,1,0,0,1]]]",
     "[[[0,0,0,1,0,0,NaN]],[[0,0,0,1,0,0,1]]]", "[[[0,0,0,1,0,0,1]]]", "\ud800"],
)  # fmt: skip
def test_what_is_not_ours_is_passed_over(cache_folder: Path, asked: list[int], told: str) -> None:
    wanted = kept_capsules(MESHES)
    (path,) = cache_folder.iterdir()
    path.write_bytes(told.encode("utf-8", "surrogatepass"))
    found = kept_capsules(MESHES)
    assert len(asked) == 4 and [len(one) for one in found] == [len(one) for one in wanted]
    assert json.loads(path.read_text())  # and is written anew


def test_where_nothing_can_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: list[int]) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(kept_capsules(MESHES)) == 2 == len(asked)
