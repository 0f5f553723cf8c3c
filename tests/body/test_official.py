"""Skeletons of SMPL, SMPL-H and SMPL-X: files of exactly their layouts with random numbers, and what may be wrong with them."""

from __future__ import annotations

import pickle
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.body import JOINT_NAMES, KEYPOINT_NAMES, Skeleton, build_skeleton, open_skeleton, save_skeleton
from mrhubo.body.skeleton import PARENTS
from mrhubo.config import BodyConfig
from mrhubo.errors import UserError
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.rotation import axis_angle_to_matrix

VERTICES = 60


@pytest.fixture
def chumpy(monkeypatch: pytest.MonkeyPatch) -> Iterator[types.ModuleType]:
    """Stand-ins that pickle as chumpy's classes do; gone again when the file is read."""
    package, ch, reordering = (types.ModuleType(n) for n in ("chumpy", "chumpy.ch", "chumpy.reordering"))
    for module, name in ((ch, "Ch"), (reordering, "Select"), (ch, "Sum")):
        setattr(module, name, type(name, (), {"__module__": module.__name__}))
    for module in (package, ch, reordering):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    package.ch, package.reordering = ch, reordering  # type: ignore[attr-defined]
    yield package


def made(cls: type, **state: Any) -> Any:
    instance = cls()
    instance.__dict__.update(state)
    return instance


def model(joints: int, shapes: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Random numbers in the layout of a body model with that many joints."""
    draw = np.random.default_rng(seed)
    regressor = draw.random((joints, VERTICES))
    parents = np.arange(-1, joints - 1)
    parents[:22] = PARENTS
    return {
        "v_template": draw.normal(0, 0.3, (VERTICES, 3)),
        "shapedirs": draw.normal(0, 0.03, (VERTICES, 3, shapes)),
        "J_regressor": regressor / regressor.sum(1, keepdims=True),
        "kintree_table": np.stack([np.where(parents < 0, 2**32 - 1, parents), np.arange(joints)]).astype(np.uint32),
        "weights": draw.random((VERTICES, joints)),
    }


def joints_by_hand(arrays: dict[str, np.ndarray], betas: list[float]) -> np.ndarray:
    """The same joints, one vertex and one coefficient at a time."""
    joints = np.zeros((len(arrays["J_regressor"]), 3))
    for v in range(VERTICES):
        vertex = arrays["v_template"][v].copy()
        for b, beta in enumerate(betas):
            vertex += beta * arrays["shapedirs"][v, :, b]
        for j in range(len(joints)):
            joints[j] += arrays["J_regressor"][j, v] * vertex
    return joints


def keypoints(skeleton: Skeleton, local: torch.Tensor) -> dict[str, np.ndarray]:
    return dict(zip(KEYPOINT_NAMES, skeleton.keypoints(local)[0].numpy(), strict=True))


def posed_by_hand(rest: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Forward kinematics, joint after joint."""
    turn, position = [np.eye(3)], [np.zeros(3)]
    for j in range(1, 22):
        parent = PARENTS[j]
        position.append(position[parent] + turn[parent] @ (rest[j] - rest[parent]))
        turn.append(turn[parent] @ local[j - 1])
    return np.stack(position)


def write_smpl_pickle(path: Path, arrays: dict[str, Any], chumpy: Any, protocol: int = 2) -> None:
    content = {
        **arrays,
        "shapedirs": made(chumpy.ch.Ch, x=arrays["shapedirs"], _dirty_vars=set(), _itr=None),
        "v_template": made(
            chumpy.reordering.Select,
            a=made(chumpy.ch.Ch, x=arrays["v_template"]),
            idxs=np.arange(VERTICES * 3),
            preferred_shape=(VERTICES, 3),
        ),
        "J_regressor": scipy.sparse.csc_matrix(arrays["J_regressor"]),
        "bs_style": "lbs",
        "bs_type": "lrotmin",
    }
    written = pickle.dumps(content, protocol=protocol)
    # NumPy 1 called it numpy.core; later protocols count the bytes of a name.
    path.write_bytes(written.replace(b"numpy._core", b"numpy.core") if protocol < 4 else written)


@pytest.mark.parametrize(("joints", "shapes"), [(24, 10), (52, 16), (55, 400), (55, 20)])
def test_npz_joints_equal_the_sum_over_vertices(tmp_path: Path, joints: int, shapes: int) -> None:
    arrays, betas = model(joints, shapes), [1.5, -2.0, 0.3]
    np.savez(tmp_path / "model.npz", part2num=np.array({"a": 1}, dtype=object), **arrays)
    skeleton = open_skeleton(tmp_path / "model.npz", betas)
    expected = joints_by_hand(arrays, betas)
    draw = np.random.default_rng(1)
    local = axis_angle_to_matrix(torch.from_numpy(draw.normal(0, 0.8, (1, 21, 3))).float())
    found = skeleton.keypoints(local)[0, :22].numpy()
    np.testing.assert_allclose(found, posed_by_hand(expected, local[0].double().numpy()), atol=1e-5)
    rest = keypoints(skeleton, torch.eye(3).expand(1, 21, 3, 3))
    if joints > 24:
        first = 22 if joints == 52 else 25
        for name, index in (("left_index", first), ("right_pinky", first + 15 + 6), ("left_thumb", first + 13)):
            np.testing.assert_allclose(rest[name], expected[index] - expected[0], atol=1e-5)
    if joints == 55:
        np.testing.assert_allclose(rest["right_eye"], expected[24] - expected[0], atol=1e-5)
    ours = Skeleton()
    np.testing.assert_allclose(skeleton.point_offsets_E3[-4:], ours.point_offsets_E3[-4:])


@pytest.mark.parametrize("protocol", [0, 1, 2, 4, 5])
@pytest.mark.parametrize(("joints", "shapes"), [(24, 10), (52, 16)])
def test_pickles_with_chumpy_arrays_and_sparse_matrices(
    tmp_path: Path, chumpy: Any, protocol: int, joints: int, shapes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    arrays, betas = model(joints, shapes, seed=3), [0.5, 1.0]
    arrays["weights"] = arrays["weights"].astype(">f8")
    arrays["J_regressor"][arrays["J_regressor"] < 0.01] = 0
    write_smpl_pickle(tmp_path / "model.pkl", arrays, chumpy, protocol)
    for name in ("chumpy", "chumpy.ch", "chumpy.reordering"):
        monkeypatch.delitem(sys.modules, name)
    skeleton = open_skeleton(tmp_path / "model.pkl", betas)
    expected = joints_by_hand(arrays, betas)[:22]
    found = skeleton.rest_K3[:22].numpy()
    np.testing.assert_allclose(found, expected - expected[0], atol=1e-5)


def test_a_fortran_ordered_and_a_big_endian_array_are_read(tmp_path: Path, chumpy: Any) -> None:
    arrays = model(24, 10)
    changed = {**arrays, "v_template": np.asfortranarray(arrays["v_template"])}
    changed["shapedirs"] = arrays["shapedirs"].astype(">f8")
    (tmp_path / "model.pkl").write_bytes(pickle.dumps(changed, protocol=2))
    expected = joints_by_hand(arrays, [1.0])[:22]
    found = open_skeleton(tmp_path / "model.pkl", [1.0]).rest_K3[:22].numpy()
    np.testing.assert_allclose(found, expected - expected[0], atol=1e-5)


def test_a_saved_skeleton_comes_back(tmp_path: Path) -> None:
    np.savez(tmp_path / "model.npz", **model(55, 20))
    skeleton = open_skeleton(tmp_path / "model.npz", [1.0])
    save_skeleton(tmp_path / "skeleton.safetensors", skeleton)
    again = open_skeleton(tmp_path / "skeleton.safetensors")
    assert again.checksum == skeleton.checksum != Skeleton().checksum
    torch.testing.assert_close(again.rest_K3, skeleton.rest_K3)


def test_the_config_chooses_the_skeleton(tmp_path: Path) -> None:
    np.savez(tmp_path / "model.npz", **model(55, 20))
    config = BodyConfig(model_path=tmp_path / "model.npz", betas=[0.5])
    assert build_skeleton(config).checksum == open_skeleton(tmp_path / "model.npz", [0.5]).checksum
    assert build_skeleton(BodyConfig()).checksum == Skeleton().checksum
    with pytest.raises(UserError, match="body.model_path, which is not given"):
        build_skeleton(BodyConfig(betas=[1.0]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"J_regressor": np.zeros((16, VERTICES))}, "expected .joints, vertices., where SMPL has 24"),
        ({"J_regressor": np.zeros((24, VERTICES + 1))}, "'v_template' has shape"),
        ({"v_template": np.zeros((VERTICES, 2))}, "'v_template' has shape"),
        ({"shapedirs": np.zeros((VERTICES, 3))}, "'shapedirs' has shape"),
        ({"kintree_table": np.zeros((2, 24), np.int64)}, "not the tree"),
        ({"kintree_table": np.zeros((2, 23), np.int64)}, "'kintree_table' has shape"),
        ({"v_template": np.full((VERTICES, 3), np.nan)}, "not finite"),
        ({"v_template": np.random.default_rng(0).normal(0, 300, (VERTICES, 3))}, "shorter than 2 m"),
        ({"shapedirs": None}, "has no 'shapedirs'"),
        ({"v_template": np.array([{"a": 1}], dtype=object)}, "v_template"),
    ],
)
@pytest.mark.parametrize("ending", ["npz", "pkl"])
def test_wrong_models_are_refused(tmp_path: Path, change: dict[str, Any], message: str, ending: str) -> None:
    arrays = {k: v for k, v in {**model(24, 10), **change}.items() if v is not None}
    path = tmp_path / f"model.{ending}"
    np.savez(path, **arrays) if ending == "npz" else path.write_bytes(pickle.dumps(arrays, protocol=2))
    with pytest.raises(UserError, match=message) as caught:
        open_skeleton(path)
    assert str(path) in str(caught.value)


def test_betas_are_checked(tmp_path: Path) -> None:
    np.savez(tmp_path / "smplx.npz", **model(55, 20))
    open_skeleton(tmp_path / "smplx.npz", [0.1] * 10)
    with pytest.raises(UserError, match="has 10 shape directions, but body.betas gives 11"):
        open_skeleton(tmp_path / "smplx.npz", [0.1] * 11)
    with pytest.raises(UserError, match="from -20 to 20"):
        open_skeleton(tmp_path / "smplx.npz", [float("nan")])


@pytest.mark.parametrize("ending", ["npz", "pkl"])
def test_truncated_and_missing_files_are_refused(tmp_path: Path, chumpy: Any, ending: str) -> None:
    path = tmp_path / f"model.{ending}"
    with pytest.raises(UserError, match="no such file"):
        open_skeleton(path)
    arrays = model(24, 10)
    np.savez(path, **arrays) if ending == "npz" else write_smpl_pickle(path, arrays, chumpy)
    whole = path.read_bytes()
    for share in (0.0, 0.1, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(UserError, match="model"):
            open_skeleton(path)


@given(data=st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_altered_pickles_never_do_more_than_name_an_error(tmp_path: Path, chumpy: Any, data: st.DataObject) -> None:
    path = tmp_path / "model.pkl"
    write_smpl_pickle(path, model(24, 10), chumpy)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    try:
        skeleton = open_skeleton(path)
    except UserError as error:
        assert str(path) in str(error)
    else:
        assert bool(skeleton.rest_K3.isfinite().all())


def test_a_saved_skeleton_that_is_none_is_refused(tmp_path: Path) -> None:
    path, good = tmp_path / "a.safetensors", Skeleton()
    save_skeleton(path, good)
    tensors, metadata = read_tensors(path)
    for change, message in (
        ({"offsets": torch.zeros(21, 3)}, "must be longer than 1 mm"),
        ({"offsets": good.offsets_J3 * torch.nan}, "must be finite"),
        ({"offsets": good.offsets_J3.bool()}, "must be finite"),
        ({"offsets": good.offsets_J3[:3]}, "must have the shape"),
        ({"offsets": None}, "is no skeleton of mrhubo: 'offsets' is missing"),
    ):
        write_tensors(path, {k: v for k, v in {**tensors, **change}.items() if v is not None}, metadata)
        with pytest.raises(UserError, match=f"a.safetensors: .*{message}"):
            open_skeleton(path)


def test_other_endings_are_refused(tmp_path: Path) -> None:
    (tmp_path / "SMPLX_NEUTRAL.ply").write_text("")
    with pytest.raises(UserError, match="expected a body model"):
        open_skeleton(tmp_path / "SMPLX_NEUTRAL.ply")


@pytest.mark.parametrize("name", JOINT_NAMES[1:4])
def test_limbs_have_the_models_lengths(tmp_path: Path, name: str) -> None:
    arrays = model(24, 10)
    np.savez(tmp_path / "m.npz", **arrays)
    j = JOINT_NAMES.index(name)
    rest = joints_by_hand(arrays, [])
    found = open_skeleton(tmp_path / "m.npz").offsets_J3[j - 1].norm()
    assert float(found) == pytest.approx(np.linalg.norm(rest[j] - rest[PARENTS[j]]), rel=1e-5)
