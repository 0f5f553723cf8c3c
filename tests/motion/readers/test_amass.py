"""Motion files: what is read, what is refused, and that a refusal is always a UserError."""

from __future__ import annotations

import io
import pickle
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes
from scipy.spatial.transform import Rotation

from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError
from mrhubo.files.npz import open_npz
from mrhubo.motion import Motion, find_motions, read_folder, read_motion, write_motion
from mrhubo.motion.readers import amass
from mrhubo.rotation import axis_angle_to_matrix

GENERATOR = np.random.default_rng(0)
POSE_T63 = GENERATOR.normal(0, 0.5, (7, 63)).astype(np.float32)
RATE = {"mocap_frame_rate": np.array(30.0)}


def _save(path: Path, **arrays_: np.ndarray) -> Path:
    np.savez(path, **arrays_)  # type: ignore[arg-type]
    return path


def _write(path: Path, description: str = "a test") -> Path:
    write_motion(path, POSE_T63, np.zeros((7, 3)), np.zeros((7, 3)), 30.0, description)
    return path


def _member(header: dict | bytes, content: bytes = b"") -> bytes:
    """An .npy member with any header."""
    text = header if isinstance(header, bytes) else repr(header).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + content


def _archive(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def _expected(pose_T63: np.ndarray) -> torch.Tensor:
    return axis_angle_to_matrix(torch.from_numpy(pose_T63).double().unflatten(-1, (21, 3))).float()


def _accepts_or_refuses(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.npz"
        path.write_bytes(content)
        try:
            motion = read_motion(path)
        except UserError as error:
            assert str(path) in str(error)
        else:
            assert motion.local_TJ33.shape[1:] == (21, 3, 3) and torch.isfinite(motion.local_TJ33).all()
            assert 1 <= motion.frame_rate <= 1000


def test_round_trip(tmp_path: Path) -> None:
    motion = read_motion(_write(tmp_path / "wave.npz", "waves\n  twice"))
    assert (motion.name, motion.frame_rate, motion.description) == ("wave", 30.0, "waves twice")
    assert motion.local_TJ33.dtype == torch.float32
    torch.testing.assert_close(motion.local_TJ33, _expected(POSE_T63))


def test_writing_is_deterministic_and_has_amass_keys(tmp_path: Path) -> None:
    a, b = _write(tmp_path / "a.npz"), _write(tmp_path / "b.npz")
    assert a.read_bytes() == b.read_bytes()
    with zipfile.ZipFile(a) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    with np.load(a, allow_pickle=False) as content:
        assert set(content) == {
            "pose_body", "root_orient", "trans", "mocap_frame_rate", "betas", "gender", "surface_model_type", "description",
            "rest_directions",
        }  # fmt: skip
        assert content["pose_body"].dtype == np.float32 and str(content["gender"]) == "neutral"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.npz", "b.npz"]


@pytest.mark.parametrize(
    ("shapes", "frame_rate"),
    [(((6, 63), (7, 3), (7, 3)), 30.0), (((0, 63), (0, 3), (0, 3)), 30.0), (((7, 66), (7, 3), (7, 3)), 30.0)],
)
def test_writing_refuses_wrong_shapes(tmp_path: Path, shapes: tuple, frame_rate: float) -> None:
    with pytest.raises(ValueError, match="expected shape"):
        write_motion(tmp_path / "a.npz", *(np.zeros(shape) for shape in shapes), frame_rate=frame_rate, description="")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("width", [66, 72, 156, 165])
@pytest.mark.parametrize("key", ["mocap_frame_rate", "mocap_framerate"])
def test_poses_with_the_root_first(tmp_path: Path, width: int, key: str) -> None:
    poses = GENERATOR.normal(0, 0.4, (5, width))
    rate = np.array([120.0]) if width == 72 else np.array(120)
    motion = read_motion(_save(tmp_path / "13_28_poses.npz", poses=poses, **{key: rate}, gender=np.array([b"male"])))
    assert motion.name == "13_28" == motion.description
    assert motion.frame_rate == 120.0
    family = {66: "", 72: "smpl", 156: "smplh", 165: "smplx"}[width]
    assert motion.family == family
    expected = _expected(poses[:, 3:66]).numpy()
    wanted = torch.from_numpy(from_family(expected, family) if family else expected)
    torch.testing.assert_close(motion.local_TJ33, wanted)


def test_pose_body_goes_before_poses_and_unread_pickles_do_not_matter(tmp_path: Path) -> None:
    """AMASS's stage II files carry object arrays (labels and the like) beside the numbers."""
    path = _save(
        tmp_path / "a_stageii.npz",
        pose_body=POSE_T63,
        poses=np.zeros((7, 165)),
        labels=np.array([{}, {}], dtype=object),
        **RATE,
    )
    motion = read_motion(path)
    assert motion.name == "a"
    torch.testing.assert_close(motion.local_TJ33, torch.from_numpy(from_family(_expected(POSE_T63).numpy(), "smplx")))


@pytest.mark.parametrize("dtype", [np.float16, np.float64, np.longdouble, np.int8, ">f4"])
def test_any_type_of_number(tmp_path: Path, dtype) -> None:
    pose_T63 = np.round(POSE_T63).astype(dtype)
    motion = read_motion(_save(tmp_path / "a.npz", pose_body=np.asfortranarray(pose_T63), **RATE))
    torch.testing.assert_close(motion.local_TJ33, _expected(np.round(POSE_T63)))


@pytest.mark.parametrize("key", ["pose_body", "poses"])
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("matrices", [False, True])
def test_joints_with_an_axis_of_their_own_and_matrices(tmp_path: Path, key: str, order: str, matrices: bool) -> None:
    root_T3 = np.tile((0.0, 1.0, 0.0), (7, 1))
    joints_TK3 = POSE_T63.reshape(7, 21, 3)
    if key == "poses":
        joints_TK3 = np.concatenate((root_T3[:, None], joints_TK3), axis=1)
    rotation = Rotation.from_rotvec(joints_TK3.reshape(-1, 3)).as_matrix().reshape(*joints_TK3.shape, 3)
    root = Rotation.from_rotvec(root_T3).as_matrix() if matrices else root_T3
    array = np.asarray(rotation if matrices else joints_TK3, order=order)  # type: ignore[call-overload]
    motion = read_motion(_save(tmp_path / "a.npz", **{key: array}, root_orient=root, trans=np.ones((7, 3)), **RATE))
    torch.testing.assert_close(motion.local_TJ33, _expected(POSE_T63), atol=1e-6, rtol=0)
    expected = torch.from_numpy(Rotation.from_rotvec(root_T3).as_matrix()).float()
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    torch.testing.assert_close(motion.root_rotation_T33, expected, atol=1e-6, rtol=0)


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.diag((1.0, 1.0, -1.0)), 2 * np.eye(3), np.full((3, 3), np.nan)])
def test_matrices_that_are_no_rotations_are_refused(tmp_path: Path, bad: np.ndarray) -> None:
    pose = np.tile(np.eye(3), (7, 21, 1, 1))
    pose[5, 3] = bad
    with pytest.raises(UserError, match=r"'pose_body' is (not finite|no rotation matrix) in frame 5, joint 3"):
        read_motion(_save(tmp_path / "a.npz", pose_body=pose, **RATE))
    motion = read_motion(_save(tmp_path / "a.npz", pose_body=POSE_T63, root_orient=pose[:, 3], **RATE))
    assert motion.root_rotation_T33 is None and "'root_orient' is left out" in motion.notes[0]


def _with(row: int, column: int, value: float) -> np.ndarray:
    pose_T63 = POSE_T63.copy()
    pose_T63[row, column] = value
    return pose_T63


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"pose_body": _with(3, 5, np.nan), **RATE}, "'pose_body' is not finite in frame 3, number 5: nan"),
        ({"pose_body": _with(6, 0, -np.inf), **RATE}, "'pose_body' is not finite in frame 6, number 0: -inf"),
        (
            {"poses": np.pad(_with(2, 1, np.nan), ((0, 0), (3, 0))), **RATE},
            "'poses' is not finite in frame 2, number 4",
        ),
        ({"pose_body": _with(1, 2, 90.0), **RATE}, r"degrees\?\) in frame 1, number 2: 90"),
        ({"pose_body": POSE_T63[:, :60], **RATE}, r"'pose_body' has shape \(7, 60\); expected \(frames, 63\)"),
        ({"pose_body": POSE_T63.reshape(7, 3, 21), **RATE}, r"'pose_body' has shape \(7, 3, 21\)"),
        ({"poses": POSE_T63, **RATE}, r"'poses' has shape \(7, 63\); expected \(frames, 66\)"),
        ({"pose_body": POSE_T63[:0], **RATE}, r"'pose_body' is empty: shape \(0, 63\)"),
        ({"pose_body": POSE_T63.astype(complex), **RATE}, "'pose_body' has type complex128; expected numbers"),
        ({"pose_body": POSE_T63.astype("U5"), **RATE}, "'pose_body' has type <U5; expected numbers"),
        ({"pose_body": POSE_T63}, "holds no frame rate; .*--rate 30.*ReadOptions"),
        ({"pose_body": POSE_T63, "mocap_framerate": np.array(1001)}, "'mocap_framerate' is 1001 frames per second"),
        ({"pose_body": POSE_T63, "mocap_frame_rate": np.array([30.0, 60.0])}, r"an array of shape \(2,\).*--rate 30"),
        (
            {"betas": np.zeros(16), **RATE},
            "is an .npz file with betas, mocap_frame_rate, in which there is no human motion",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, content: dict[str, np.ndarray], message: str) -> None:
    path = _save(tmp_path / "bad.npz", **content)
    with pytest.raises(UserError, match=message) as caught:
        read_motion(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    "description",
    [np.array(b"wave"), np.zeros(1), np.array({"a": 1}, dtype=object), np.array(["a", "b"]), np.array([])],
)
def test_what_is_not_needed_is_left_out(tmp_path: Path, description: np.ndarray) -> None:
    path = _save(tmp_path / "wave.npz", pose_body=POSE_T63, description=description, **RATE)
    motion = read_motion(path)
    assert motion.description == "wave"
    assert description.dtype.kind == "U" or motion.notes[0].startswith("'description' is left out: ")
    torch.testing.assert_close(motion.local_TJ33, _expected(POSE_T63))


@pytest.mark.parametrize("largest", [180.0, 90.0, 45.0, 20.0, 12.0])
@pytest.mark.parametrize("key", ["pose_body", "poses"])
def test_degrees_are_told_from_radians_however_small(root: Path, tmp_path: Path, largest: float, key: str) -> None:
    """Shipped motions scaled until their joints turn so many degrees at most; in radians they are read."""
    for file in sorted((root / "data" / "motions").glob("*.npz")):
        with np.load(file) as content:
            pose_T63 = content["pose_body"][:: len(content["pose_body"]) // 40]
        scaled_T63 = pose_T63 * largest / np.linalg.norm(pose_T63.reshape(-1, 21, 3), axis=-1).max()
        for unit, turned_T63 in (("rad", np.radians(scaled_T63)), ("deg", scaled_T63)):
            array = turned_T63 if key == "pose_body" else np.pad(turned_T63, ((0, 0), (3, 0)))
            path = _save(tmp_path / "a.npz", **{key: array}, **RATE)
            if unit == "rad":
                read_motion(path)
            else:
                with pytest.raises(UserError, match=rf"'{key}' is no axis-angle .*\(degrees\?\)"):
                    read_motion(path)


def test_joints_that_turn_too_far_now_and_then_are_read(tmp_path: Path) -> None:
    """Trackers that follow a joint from frame to frame pass half a turn; one may be told the long way round."""
    pose_T63 = np.tile(POSE_T63, (20, 1))
    pose_T63[:, 45:48] = (3.9, 0.0, 0.0)
    pose_T63[3, 0:3] = (0.0, 9.0, 0.0)
    path = _save(tmp_path / "a.npz", pose_body=pose_T63, **RATE)
    torch.testing.assert_close(read_motion(path).local_TJ33, _expected(pose_T63))


def test_numpys_advice_and_warnings_are_not_passed_on(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (7L, 63L), }"
    members = {
        "pose_body.npy": _member(header + b"\n", POSE_T63.tobytes()),
        "mocap_frame_rate.npy": _npy(RATE["mocap_frame_rate"]),
    }
    motion = read_motion(_archive(tmp_path / "python2.npz", members))
    torch.testing.assert_close(motion.local_TJ33, _expected(POSE_T63))
    members["pose_body.npy"] = _member(header + b" " * 20_000 + b"\n", POSE_T63.tobytes())
    with pytest.raises(UserError, match="its header is not one of an .npy array$"):
        read_motion(_archive(tmp_path / "long.npz", members))
    members["pose_body.npy"] = _npy(np.full((7, 63), 1e300, np.longdouble))
    members["betas.npy"] = _npy(np.full(3, 1e4000, np.longdouble))
    with pytest.raises(UserError, match="no axis-angle"):
        read_motion(_archive(tmp_path / "large.npz", members))
    assert [str(warning.message) for warning in recwarn] == []


@pytest.mark.parametrize("shape", [f"({'9' * 400}, 63)", f"(0, {'9' * 400})", f"({2**70}, {2**70})", "(True, 63)"])
def test_shapes_beyond_any_number_are_refused(tmp_path: Path, shape: str) -> None:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': %s}\n" % shape.encode()
    members = {"pose_body.npy": _member(header, bytes(252)), "mocap_frame_rate.npy": _npy(RATE["mocap_frame_rate"])}
    path = _archive(tmp_path / "a.npz", members)
    if shape == "(True, 63)":
        assert len(read_motion(path)) == 1
    else:
        with pytest.raises(UserError, match="'pose_body'"):
            read_motion(path)


def test_a_long_motion_is_read_block_by_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pose_T63 = GENERATOR.normal(0, 0.3, (25, 63))
    content = {"trans": np.tile(np.arange(25.0)[:, None] / 32, 3), "root_orient": np.zeros((25, 3)), **RATE}
    for order in ("C", "F"):
        path = _save(tmp_path / "a.npz", pose_body=np.asarray(pose_T63, order=order), **content)
        monkeypatch.setattr(amass, "BLOCK", 1_000)
        whole = read_motion(path)
        monkeypatch.setattr(amass, "BLOCK", 10)
        found = read_motion(path)
        assert torch.equal(found.local_TJ33, whole.local_TJ33)
        assert found.root_position_T3 is not None and (32 * found.root_position_T3)[:, 1].tolist() == list(range(25))
        bad_T63 = pose_T63.copy()
        bad_T63[17, 4] = np.nan
        with pytest.raises(UserError, match="not finite in frame 17, number 4"):
            read_motion(_save(tmp_path / "b.npz", pose_body=np.asarray(bad_T63, order=order), **content))


def test_a_pickle_is_never_opened(tmp_path: Path) -> None:
    witness = tmp_path / "executed"

    class Attack:
        def __reduce__(self):
            return Path.touch, (witness,)

    attack = np.array([Attack()], dtype=object)
    pose = _npy(POSE_T63)
    for key in ("pose_body", "poses"):
        members = {"pose_body.npy": pose, "mocap_frame_rate.npy": _npy(np.array(30.0))} | {f"{key}.npy": _npy(attack)}
        if key == "poses":
            del members["pose_body.npy"]
        with pytest.raises(UserError, match=f"'{key}' holds pickled Python objects"):
            read_motion(_archive(tmp_path / f"{key}.npz", members))
    rate = _archive(tmp_path / "rate.npz", {"pose_body.npy": pose, "mocap_frame_rate.npy": _npy(attack)})
    with pytest.raises(UserError, match="'mocap_frame_rate' tells no frame rate"):
        read_motion(rate)
    members = {"pose_body.npy": pose, "mocap_frame_rate.npy": _npy(np.array(30.0)), "description.npy": _npy(attack)}
    assert "never opened" in read_motion(_archive(tmp_path / "unneeded.npz", members)).notes[0]
    raw = _archive(tmp_path / "raw.npz", {"pose_body.npy": pickle.dumps(Attack()), "mocap_frame_rate.npy": pose})
    with pytest.raises(UserError, match="'pose_body' cannot be read"):
        read_motion(raw)
    bare = tmp_path / "bare.npz"
    bare.write_bytes(pickle.dumps(Attack()))
    with pytest.raises(UserError, match="in which there is no human motion"):
        read_motion(bare)
    assert not witness.exists()


@pytest.mark.parametrize(
    ("shape", "descr", "message"),
    [
        ((10**12, 63), "<f4", "at most 2000000 frames and 4 GiB"),
        ((2, 2**40), "<f8", "at most 2000000 frames and 4 GiB"),
        ((1_000_000, 63), "<f4", r"claims shape \(1000000, 63\), 252000000 bytes, but holds \d+; the file is damaged"),
        ((-1, 63), "<f4", "'pose_body'"),
        ((7, 63), "|V252", "'pose_body' has type"),
        ((7, 63), "nonsense", "'pose_body' cannot be read"),
    ],
)
def test_headers_that_lie(tmp_path: Path, shape: tuple, descr: str, message: str) -> None:
    member = _member({"descr": descr, "fortran_order": False, "shape": shape}, bytes(7 * 63 * 4))
    path = _archive(tmp_path / "lie.npz", {"pose_body.npy": member, "mocap_frame_rate.npy": _npy(np.array(30.0))})
    with pytest.raises(UserError, match=message):
        read_motion(path)


@pytest.mark.filterwarnings("ignore:Reading `.npy`")  # numpy, of headers that Python 2 wrote
@pytest.mark.parametrize(
    "header", [b"(" * 9_000, b"{" * 60_000, b"\xff\xfe", b"", b"__import__('os')\n", b"{'descr': 1L}\n"]
)
def test_headers_that_are_none(tmp_path: Path, header: bytes) -> None:
    with pytest.raises(UserError, match="'pose_body' cannot be read"):
        read_motion(_archive(tmp_path / "bad.npz", {"pose_body.npy": _member(header)}))


def test_a_name_of_an_array_is_said_on_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"'pos\\n_body'") as caught:
        with open_npz(_archive(tmp_path / "a.npz", {"pos\n_body.npy": b"no array"})) as archive:
            archive.read("pos\n_body")
    assert "\n" not in str(caught.value)


def test_missing_files_and_a_bare_array(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is no such file"):
        read_motion(tmp_path / "none.npz")
    bare = tmp_path / "bare.npz"
    bare.write_bytes(_npy(POSE_T63))
    with pytest.raises(UserError, match="is a single NumPy array .* of an array of shape"):
        read_motion(bare)
    with pytest.raises(UserError, match="is an empty zip archive"):
        read_motion(_archive(tmp_path / "empty.npz", {}))


@given(st.binary(max_size=300))
@settings(max_examples=60, deadline=None)
def test_random_bytes(content: bytes) -> None:
    _accepts_or_refuses(content)
    _accepts_or_refuses(b"PK\x03\x04" + content)


def _whole(compressed: bool) -> bytes:
    buffer = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(buffer, pose_body=POSE_T63, **RATE, description=np.array("x"))  # type: ignore
    return buffer.getvalue()


@given(st.booleans(), st.floats(0, 1, exclude_max=True))
@settings(max_examples=60, deadline=None)
def test_truncated_files(compressed: bool, share: float) -> None:
    whole = _whole(compressed)
    _accepts_or_refuses(whole[: int(share * len(whole))])


@given(
    st.booleans(),
    st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.binary(min_size=1, max_size=6)), min_size=1, max_size=4),
)
@settings(max_examples=60, deadline=None)
def test_altered_files(compressed: bool, changes: list[tuple[float, bytes]]) -> None:
    altered = bytearray(_whole(compressed))
    for share, new in changes:
        start = int(share * (len(altered) - len(new)))
        altered[start : start + len(new)] = new
    _accepts_or_refuses(bytes(altered))


ARRAYS = scalar_dtypes().flatmap(
    lambda dtype: arrays(dtype, array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3))
)
POSES = st.sampled_from(["<f2", "<f4", "<f8", "<i8", "<c8"]).flatmap(
    lambda dtype: arrays(dtype, st.sampled_from([(1, 63), (2, 63), (1, 66), (1, 72)]))
)


@given(
    st.dictionaries(
        st.sampled_from(["pose_body", "poses", "mocap_frame_rate", "mocap_framerate", "description"]), ARRAYS | POSES
    )
)
@settings(max_examples=100, deadline=None)
def test_random_arrays(content: dict[str, np.ndarray]) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, **content)  # type: ignore[arg-type]
    _accepts_or_refuses(buffer.getvalue())


def test_read_folder_sorts_and_passes_over_what_is_no_motion(tmp_path: Path) -> None:
    for name in ("b_poses", "a", "c_stageii"):
        _write(tmp_path / f"{name}.npz")
    for name in (".a.npz.123.tmp", ".hidden.npz", "notes.txt", "shape.npz", "neutral_stagei.npz"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "sub.npz").mkdir()
    motions = read_folder(tmp_path)
    assert [motion.name for motion in motions] == ["a", "b", "c"]
    assert all(isinstance(motion, Motion) for motion in motions)


def test_read_folder_refuses(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no motion file"):
        read_folder(tmp_path)
    with pytest.raises(UserError, match="there is no such folder"):
        read_folder(tmp_path / "none")
    _write(tmp_path / "a.npz")
    _write(tmp_path / "a_poses.npz")
    with pytest.raises(UserError, match="a.npz and a_poses.npz are both named 'a'"):
        read_folder(tmp_path)


def test_find_motions_takes_the_first_that_holds_any(tmp_path: Path) -> None:
    empty, full, later = tmp_path / "empty", tmp_path / "full", tmp_path / "later"
    for folder in (empty, full, later):
        folder.mkdir()
    _write(full / "a.npz")
    _write(later / "a.npz")
    assert find_motions([tmp_path / "none", empty, full, later]) == full
    with pytest.raises(UserError, match="none, .*empty"):
        find_motions([tmp_path / "none", empty])
    with pytest.raises(UserError, match="no folder given"):
        find_motions([])


def test_a_file_in_place_of_a_folder_is_named_with_its_folder(tmp_path: Path) -> None:
    file = _write(tmp_path / "a.npz")
    for read in (read_folder, lambda path: find_motions([path])):
        with pytest.raises(UserError, match=rf"a.npz: is a file; name the folder that holds it: {tmp_path}"):
            read(file)
    with pytest.raises(UserError, match="is a folder; name a file"):
        read_motion(tmp_path)


def test_evaluation_clips_are_read(external_dir: Path) -> None:
    motions = {motion.name: motion for motion in read_folder(external_dir / "cmu" / "evaluation")}
    assert len(motions) == 11
    assert motions["13_28"].local_TJ33.shape == (824, 21, 3, 3) and motions["13_28"].frame_rate == 24.0
    assert motions["13_28"].description == "direct traffic, wave, point"


@pytest.mark.parametrize("z_up", [False, True])
@pytest.mark.parametrize("key", ["root_orient", "poses"])
def test_the_root_comes_out_with_y_up(tmp_path: Path, z_up: bool, key: str) -> None:
    """A person who turns about the vertical and walks up a ramp, in a world whose y or z axis is up."""
    turns = np.linspace(0, 170, 7)
    position_T3 = np.stack((np.linspace(0, 2, 7), np.linspace(0.9, 1.1, 7), np.linspace(0, 1, 7)), axis=-1)
    world = Rotation.from_euler("x", 90 if z_up else 0, degrees=True)  # takes y to z
    root = [(world * Rotation.from_euler("y", turn, degrees=True)).as_rotvec() for turn in turns]
    arrays_ = {"pose_body": POSE_T63, "root_orient": np.array(root)}
    if key == "poses":
        arrays_ = {"poses": np.concatenate((np.array(root), POSE_T63), axis=1)}
    motion = read_motion(_save(tmp_path / "a.npz", trans=world.apply(position_T3), **arrays_, **RATE))
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None and not motion.notes
    expected = Rotation.from_euler("y", turns[:, None], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.root_rotation_T33, expected, atol=1e-6)
    np.testing.assert_allclose(motion.root_position_T3, position_T3, atol=1e-6)
    assert ("z up;" if z_up else "y up;") in motion.source and len(motion) == 7


def test_shape_and_root_of_a_shipped_motion(root: Path) -> None:
    motion = read_motion(root / "data" / "motions" / "bow_and_greet.npz")
    assert motion.betas == (0.0,) * 16 and motion.confidence_TJ is None
    assert motion.root_position_T3 is not None and 0.7 < float(motion.root_position_T3[:, 1].min()) < 1.1  # the pelvis
    assert float(motion.root_position_T3[:, [0, 2]].abs().max()) < 0.5  # who bows stays where they are


@pytest.mark.parametrize(
    ("arrays_", "said"),
    [
        ({"root_orient": np.zeros((6, 3)), "trans": np.zeros((7, 3))}, "'root_orient' is left out"),
        ({"root_orient": np.full((7, 3), np.nan), "trans": np.zeros((7, 3))}, "'root_orient' is left out"),
        ({"root_orient": np.array([{}]), "trans": np.zeros((7, 3))}, "'root_orient' is left out"),
        ({"root_orient": np.zeros((7, 3)), "trans": np.full((7, 3), 1e9)}, "'trans' is left out"),
        ({"root_orient": np.zeros((7, 3)), "trans": np.zeros((7, 3)), "betas": np.array("?")}, "'betas' is left out"),
        ({"trans": np.zeros((7, 3))}, "'trans' is left out"),
    ],
)
def test_what_arms_do_not_need_is_left_out_with_a_note(tmp_path: Path, arrays_: dict, said: str) -> None:
    motion = read_motion(_save(tmp_path / "a.npz", pose_body=POSE_T63, **arrays_, **RATE))
    (note,) = [note for note in motion.notes if said in note]
    assert len(motion) == 7 and note
    assert (motion.root_position_T3 is None) == ("betas" not in said)


def test_a_file_of_the_body_alone_has_no_root(tmp_path: Path) -> None:
    motion = read_motion(_save(tmp_path / "a.npz", pose_body=POSE_T63, **RATE))
    assert motion.root_rotation_T33 is None and motion.root_position_T3 is None and not motion.notes


@pytest.mark.parametrize("own", ["dmpls", "markers_latent", "latent_labels"])
@pytest.mark.parametrize("turn", [[90, 0, 0], [-90, 0, 0], [0, 90, 0], [180, 0, 0]])
def test_amass_has_z_up_also_where_nobody_stands(own: str, turn: list[float], tmp_path: Path) -> None:
    """Who lies with the head along y from the first frame to the last, or stands on the hands, does not say so."""
    stands = Rotation.from_euler("x", 90, degrees=True)
    root = (Rotation.from_euler("xyz", turn, degrees=True) * stands).as_rotvec()
    poses, place = np.zeros((5, 156)), np.tile([1.0, 2.0, 0.15], (5, 1))
    poses[:, :3] = root
    path = _save(
        tmp_path / "a.npz", poses=poses, trans=place, mocap_framerate=np.array(60.0), **{own: np.zeros((5, 8))}
    )
    motion = read_motion(path)
    assert "z up;" in motion.source and motion.root_position_T3 is not None and motion.root_rotation_T33 is not None
    np.testing.assert_allclose(motion.root_position_T3[0], [1.0, 0.15, -2.0], atol=1e-6)
    up = Rotation.from_euler("x", -90, degrees=True).apply(Rotation.from_rotvec(root).apply([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(motion.root_rotation_T33[0, :, 1], up, atol=1e-6)


@pytest.mark.parametrize("z_up", [False, True])
@pytest.mark.parametrize("heading", range(0, 360, 45))
@pytest.mark.parametrize("lying", [-90, 90])
def test_who_lies_longer_than_he_stands_does_not_turn_the_world(
    z_up: bool, heading: float, lying: float, tmp_path: Path
) -> None:
    """A third of the time he stands, then he lies on his back or his face; the pelvis goes straight down."""
    share = np.concatenate((np.zeros(20), np.linspace(0, 1, 11), np.ones(40)))
    turns = [Rotation.from_euler("YX", [heading, lying * part], degrees=True) for part in share]
    low = [0.12 if part == 1 else 0.12 + 0.8 * np.cos(np.radians(90 * part)) for part in share]
    position_T3 = np.stack((np.full(71, 0.3), low, np.full(71, -0.4)), axis=-1)
    world = Rotation.from_euler("x", 90 if z_up else 0, degrees=True)
    root_T3 = np.array([(world * turn).as_rotvec() for turn in turns])
    pose_T63 = np.zeros((71, 63))
    pose_T63[:, [3 * 15 + 2, 3 * 16 + 2]] = np.radians((-75, 75))  # arms hang
    path = _save(tmp_path / "a.npz", pose_body=pose_T63, root_orient=root_T3, trans=world.apply(position_T3), **RATE)
    motion = read_motion(path)
    assert ("z up;" if z_up else "y up;") in motion.source and motion.root_position_T3 is not None
    np.testing.assert_allclose(motion.root_position_T3, position_T3, atol=1e-6)


@pytest.mark.parametrize("root, place", [("root_orient", "trans"), ("global_orient", "transl"), ("root_pose", "trans")])
@pytest.mark.parametrize("key, joints", [("pose_body", 21), ("pose_body", 23), ("body_pose", 23), ("poses", 23)])
def test_a_root_beside_the_pose_is_read_whatever_it_is_called(
    key: str, joints: int, root: str, place: str, tmp_path: Path
) -> None:
    pose = np.random.default_rng(0).normal(0, 0.2, (6, 3 * joints))
    arrays: dict[str, Any] = {key: pose, root: np.tile([0.0, 0.5, 0.0], (6, 1)), place: np.ones((6, 3)), "fps": 30}
    np.savez(tmp_path / "clip.npz", **arrays)
    motion = read_motion(tmp_path / "clip.npz")
    assert motion.family == ("smpl" if joints == 23 else "")
    assert motion.root_position_T3 is not None and bool((motion.root_position_T3 == 1).all())
    turn_T33 = motion.arrays.root_rotation_T33
    assert turn_T33 is not None
    np.testing.assert_allclose(turn_T33[:, 0, 2], np.sin(0.5), atol=1e-5)
