"""Keypoints: named or in the order of a known set, in any world and unit, some of them missing."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from scipy.io import savemat

import mrhubo
import mrhubo.rotation
from mrhubo import UserError
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, SIDES, Skeleton
from mrhubo.motion.orientations import rest_points
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import our_name
from tests.motion.damage import Step, accidents, damaged, read_or_refused

RATE = ReadOptions(rate=30.0)
FRAMES = 20


@pytest.fixture(scope="module")
def pose() -> torch.Tensor:
    """Rotations (T, 21, 3, 3) of arms, legs and head that move, and a back that does not bend."""
    generator = torch.Generator().manual_seed(1)
    turn = torch.zeros(FRAMES, 21, 3)
    wave = torch.linspace(0, 3, FRAMES)[:, None]
    for name in ("shoulder", "hip"):
        for side in SIDES:
            axis = torch.randn(3, generator=generator) * 0.5
            turn[:, POSED_JOINT_NAMES.index(f"{side}_{name}")] = torch.sin(wave + axis[:1]) * axis
    for side, sign in (("left", -1.0), ("right", 1.0)):
        bend = 0.8 + 0.5 * torch.sin(wave)
        turn[:, POSED_JOINT_NAMES.index(f"{side}_elbow")] = bend * torch.tensor([0.0, sign, 0.0])
        turn[:, POSED_JOINT_NAMES.index(f"{side}_knee")] = bend * torch.tensor([1.0, 0.0, 0.0])
        turn[:, POSED_JOINT_NAMES.index(f"{side}_wrist")] = 0.3 * torch.cos(wave) * torch.tensor([1.0, 0.0, 1.0])
    turn[:, POSED_JOINT_NAMES.index("head")] = 0.4 * torch.sin(wave) * torch.tensor([0.3, 1.0, 0.0])
    return mrhubo.rotation.axis_angle_to_matrix(turn.double())


@pytest.fixture(scope="module")
def points(pose: torch.Tensor) -> dict[str, np.ndarray]:
    """Points (T, 3) [m] by name, y up."""
    skeleton = Skeleton().double()
    point, turn = skeleton.keypoints_and_rotations(pose)
    found = dict(zip(KEYPOINT_NAMES, point.unbind(1), strict=True))
    rest, head = rest_points(), JOINT_NAMES.index("head")
    for name in ("nose", "left_ear", "right_ear", "head_top"):
        found[name] = found["head"] + turn[:, head] @ torch.from_numpy(rest[name] - rest["head"])[0]
    return {name: value.numpy() + [0.3, 1.0, -2.0] for name, value in found.items()}


def array_of(points: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    noise = np.random.default_rng(0)
    return np.stack([points[n] if n != "-" else noise.normal(size=(FRAMES, 3)) for n in names], axis=1)


def world(local: torch.Tensor, joint: str) -> torch.Tensor:
    return Skeleton().double().global_rotations(local.double())[:, JOINT_NAMES.index(joint)]


def bone_error(found: mrhubo.Motion, pose: torch.Tensor) -> float:
    """The largest angle [deg] between upper arms, forearms, thighs and shins."""
    rest = rest_points()
    worst = 0.0
    for joint, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
        for side in SIDES:
            bone = torch.from_numpy(rest[f"{side}_{end}"] - rest[f"{side}_{joint}"])[0]
            ways = [world(x, f"{side}_{joint}") @ bone for x in (found.local_TJ33, pose)]
            sine = torch.linalg.cross(*ways).norm(dim=-1)
            worst = max(worst, float(torch.rad2deg(torch.atan2(sine, (ways[0] * ways[1]).sum(-1))).max()))
    return worst


@pytest.mark.parametrize("name", SETS)
def test_sets_are_told_by_their_shape(
    name: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    path = tmp_path / "points.npy"
    np.save(path, array_of(points, SETS[name]))
    found = mrhubo.read_motion(path, RATE)
    assert f"as {name} has them" in found.source and found.frame_rate == 30.0
    assert bone_error(found, pose) < 0.2  # a straight back leaves nothing open
    if "nose" in SETS[name] and {"left_ear", "head_top"} & set(SETS[name]):
        error = mrhubo.rotation.geodesic_distance(world(found.local_TJ33, "head"), world(pose, "head"))
        assert float(torch.rad2deg(error).max()) < (0.5 if "left_ear" in SETS[name] else 2.0)
    else:
        assert found.confidence_TJ is not None and not found.confidence_TJ[:, POSED_JOINT_NAMES.index("head")].any()
    if "left_index" in SETS[name]:
        error = mrhubo.rotation.geodesic_distance(world(found.local_TJ33, "left_wrist"), world(pose, "left_wrist"))
        assert float(torch.rad2deg(error).max()) < 0.2


@pytest.mark.parametrize(
    ("axes", "unit", "words"),
    [
        (np.eye(3), 1.0, "metres, y up"),
        (np.diag([1.0, -1, -1]), 0.001, "millimetres, -y up"),
        (np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), 0.01, "centimetres, z up"),
        (np.diag([-1.0, 1, 1]), 1.0, "metres, y up"),  # left-handed
    ],
)
def test_any_world(
    axes: np.ndarray, unit: float, words: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    path = tmp_path / "points.npz"
    np.savez(path, keypoints=array_of(points, SETS["COCO"]) @ axes.T / unit, fps=25.0)
    found = mrhubo.read_motion(path)
    assert words in found.source and found.frame_rate == 25.0
    assert bone_error(found, pose) < 0.2
    assert ("left-handed" in " ".join(found.notes)) == (np.linalg.det(axes) < 0)
    assert found.root_position_T3 is not None
    if np.linalg.det(axes) > 0:
        height = found.root_position_T3[:, 1] - found.root_position_T3[0, 1]
        assert float(height.abs().max()) < 0.01


def test_json_with_names(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    names = [n for n in SETS["MediaPipe"] if n != "-"][::-1]
    array = array_of(points, tuple(names)).tolist()
    forms = {
        "lists": {"fps": 30, "names": [n.upper() for n in names], "keypoints": array},
        "dictionaries": {"fps": 30, "frames": [
            {n: {"x": x, "y": y, "z": z, "visibility": 0.9} for n, (x, y, z) in zip(names, frame, strict=True)}
            for frame in array
        ]},
        "mmpose": {"fps": 30, "meta_info": {"keypoint_id2name": {str(i): n for i, n in enumerate(names)}},
                   "instance_info": [{"frame_id": i, "instances": [{"keypoints": frame, "keypoint_scores": [0.9] * len(names)}]}
                                     for i, frame in enumerate(array)]},
    }  # fmt: skip
    for form, content in forms.items():
        path = tmp_path / f"{form}.json"
        path.write_text(json.dumps(content))
        found = mrhubo.read_motion(path, None if form != "mmpose" else RATE)
        assert bone_error(found, pose) < 0.2, form
        assert "by their names" in found.source


def test_missing_points_are_held_and_said(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    array = array_of(points, SETS["COCO"])
    sure = np.ones(array.shape[:2])
    wrist = SETS["COCO"].index("left_wrist")
    array[5:9, wrist] = [[np.nan] * 3, [0.0] * 3, [0.0] * 3, [np.nan] * 3]  # at the origin, alone
    sure[12:, wrist] = 0.1
    path = tmp_path / "points.npz"
    np.savez(path, keypoints=array, confidence=sure, fps=30.0)
    found = mrhubo.read_motion(path)
    assert "left elbow to left wrist is not seen in 12 of 20 frames" in " ".join(found.notes)
    assert found.confidence_TJ is not None
    elbow_T = found.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")]
    assert (elbow_T == 0).nonzero().flatten().tolist() == [5, 6, 7, 8, *range(12, 20)]
    assert bool((found.confidence_TJ[:, POSED_JOINT_NAMES.index("right_elbow")] == 1).all())
    turn = [world(found.local_TJ33, "spine3").mT @ world(found.local_TJ33, "left_elbow"),
            world(pose, "spine3").mT @ world(pose, "left_elbow")]  # fmt: skip
    way = [x[..., 0] for x in turn]
    torch.testing.assert_close(way[0][4], way[1][4], atol=3e-3, rtol=0)
    torch.testing.assert_close(way[0][19], way[0][11], atol=1e-5, rtol=0)  # stays as it was seen last
    middle = torch.nn.functional.normalize((3 * way[0][4] + 2 * way[0][9]) / 5, dim=0)
    torch.testing.assert_close(way[0][6], middle, atol=1e-5, rtol=0)


def test_what_cannot_be_told_is_asked_for(points: dict[str, np.ndarray], tmp_path: Path) -> None:
    path = tmp_path / "points.npy"
    np.save(path, array_of(points, SETS["COCO"]))
    with pytest.raises(UserError, match="--rate"):
        mrhubo.read_motion(path)
    path = tmp_path / "points.npz"
    np.savez(path, keypoints=np.random.default_rng(0).normal(size=(FRAMES, 17, 3)))
    with pytest.raises(UserError, match="'names'"):
        mrhubo.read_motion(path, RATE)
    np.savez(path, keypoints=array_of(points, SETS["SMPL's body"])[:, ::-1])  # an order that nobody knows
    with pytest.raises(UserError, match="'names'"):
        mrhubo.read_motion(path, RATE)
    np.savez(path, keypoints=array_of(points, SETS["COCO"])[:, :9], names=np.array(SETS["COCO"][:9]))
    with pytest.raises(UserError, match="left_hip"):
        mrhubo.read_motion(path, RATE)
    flat = array_of(points, SETS["COCO"]) * [300.0, 300.0, 0.0] + [0, 0, 0.8]
    np.savez(path, keypoints=flat)
    with pytest.raises(UserError, match="three dimensions"):
        mrhubo.read_motion(path, RATE)


@pytest.mark.parametrize(
    ("name", "ours"),
    [("LShoulder", "left_shoulder"), ("RIGHT_FOOT_INDEX", "right_toe"), ("left shoulder", "left_shoulder"),
     ("lsho", "left_shoulder"), ("RAnkle", "right_ankle"), ("spine1", "spine1"), ("Nose", "nose"), ("root", "pelvis"),
     ("mouth_left", None), ("left_eye_inner", None), ("neck_base", None), ("R_Hip", "right_hip"), ("tail", None)],
)  # fmt: skip
def test_names(name: str, ours: str | None) -> None:
    assert our_name(name) == ours


@given(steps=accidents)
@settings(max_examples=16, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_read_or_refused_in_a_sentence(
    points: dict[str, np.ndarray], steps: list[Step], tmp_path: Path
) -> None:
    array = array_of(points, SETS["COCO"])[:3].round(3)
    path = tmp_path / "points.json"
    path.write_text(json.dumps({"names": SETS["COCO"], "fps": 30, "keypoints": array.tolist()}))
    path.write_bytes(damaged(path.read_bytes(), steps))
    read_or_refused(path)


def test_points_are_read_from_pickles_and_torch_files(
    points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    coco, body = array_of(points, SETS["COCO"]), array_of(points, SETS["SMPL's body"])
    samples = np.stack([body, body[::-1]]).transpose(0, 2, 3, 1)  # as MDM has them, the time last
    made = {
        "aist.pkl": lambda path: path.write_bytes(
            pickle.dumps({"keypoints3d": np.full_like(coco, np.nan), "keypoints3d_optim": 100 * coco})
        ),
        "torch.pt": lambda path: torch.save({"joints": torch.from_numpy(coco[None])}, path),
        "list.pkl": lambda path: path.write_bytes(pickle.dumps(list(coco))),
        "people.pkl": lambda path: path.write_bytes(
            pickle.dumps({"a": {"joints3d": coco[:5] * np.nan}, "b": {"joints3d": coco, "fps": 30}})
        ),
        "results.npy": lambda path: np.save(path, {"motion": samples, "lengths": np.array([FRAMES, 3]), "text": "x"}),  # type: ignore[arg-type]
    }
    for name, write in made.items():
        write(tmp_path / name)
        found = mrhubo.read_motion(tmp_path / name, RATE)
        assert len(found) == FRAMES and bone_error(found, pose) < 0.01, name


def test_points_in_a_picture_are_told_by_their_shape_and_range(points: dict[str, np.ndarray], tmp_path: Path) -> None:
    flat, shares = tmp_path / "flat.npy", tmp_path / "shares.npy"
    np.save(flat, array_of(points, SETS["COCO"])[..., :2])
    named = array_of({n: x - points["pelvis"] for n, x in points.items()}, SETS["COCO"])
    np.save(shares, named * [0.2, -0.2, 0.2] + [0.5, 0.5, 0.0])
    for path, words in ((flat, "points in a picture"), (shares, "shares of a picture")):
        with pytest.raises(UserError, match=f"{path.name}.*{words}"):
            mrhubo.read_motion(path, RATE)


def test_points_around_the_hips_do_not_say_where_somebody_goes(points: dict[str, np.ndarray], tmp_path: Path) -> None:
    middle = (points["left_hip"] + points["right_hip"]) / 2
    path = tmp_path / "points.npy"
    np.save(path, array_of(points, SETS["COCO"]) - middle[:, None])
    found = mrhubo.read_motion(path, RATE)
    assert found.root_position_T3 is None and "centred on the hips" in "".join(found.notes)


def test_skeletons_of_ntu_are_read(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    joints = array_of(points, SETS["Kinect 2"])
    lines = [str(FRAMES + 1), "0"]  # nobody is there at first
    for frame in joints:
        for person in ("7205759", "1")[: 1 + (len(lines) > 40)]:
            lines += ["2" if len(lines) > 40 and person != "1" else "", f"{person} 0 1 1 1 1 0 -0.1 0.2 2", "25"]
            lines += [" ".join(f"{x:.6f}" for x in joint) + " 270 190 1000 500 1 0 0 0 2" for joint in frame]
    text = "\n".join(lines).replace("\n\n", "\n1\n")
    path = tmp_path / "S001.skeleton"
    path.write_text(text.replace("\n1\n1 0 1", "\n1 0 1"))
    found = mrhubo.read_motion(path)
    assert len(found) == FRAMES and found.frame_rate == 30 and bone_error(found, pose) < 0.01
    path.write_text(path.read_text()[:-2000])
    with pytest.raises(UserError, match=r"S001.skeleton: .*damaged"):
        mrhubo.read_motion(path)


@pytest.mark.parametrize("who", ["EasyMocap", "Panoptic"])
def test_a_folder_with_a_file_a_frame_is_a_motion(
    who: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    easy = who == "EasyMocap"
    rows = array_of(points, SETS["OpenPose's BODY_25" if easy else "CMU Panoptic"]) * (1 if easy else 100)
    for frame, row in enumerate(np.concatenate([rows, np.ones((*rows.shape[:2], 1))], axis=-1)):
        one = {"id": 3, "keypoints3d": row.tolist()} if easy else {"id": 3, "joints19": row.ravel().tolist()}
        (tmp_path / f"frame_{frame}.json").write_text(json.dumps([one] if easy else {"bodies": [one]}))
    assert mrhubo.motion.load.motion_files(tmp_path) == [tmp_path]
    found = mrhubo.read_motion(tmp_path, RATE)
    assert len(found) == FRAMES and bone_error(found, pose) < 0.01


def test_a_folder_of_openpose_holds_points_in_a_picture(tmp_path: Path) -> None:
    for frame in range(3):
        people = [{"person_id": [-1], "pose_keypoints_2d": [1.0, 2.0, 0.5] * 25, "pose_keypoints_3d": []}]
        (tmp_path / f"v_{frame}_keypoints.json").write_text(json.dumps({"version": 1.3, "people": people}))
    for path in (tmp_path, tmp_path / "v_0_keypoints.json"):
        with pytest.raises(mrhubo.motion.NoMotion, match="in a picture"):
            mrhubo.read_motion(path, RATE)


@pytest.mark.parametrize("form", ["dictionaries", "lists"])
def test_points_with_names_go_by_their_names(
    form: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """Each frame has another order, and some lack a joint, even the first."""
    names = [name for name in SETS["MediaPipe"] if name != "-"]
    array, random = array_of(points, tuple(names)), np.random.default_rng(0)
    frames: list[Any] = []
    for frame in range(FRAMES):
        missing = "left_wrist" if frame in (0, 7) else None
        shown = [place for place in random.permutation(len(names)).tolist() if names[place] != missing]
        frames.append({names[place]: array[frame, place].tolist() for place in shown})
    if form == "lists":
        frames = [[dict(zip("xyz", xyz, strict=True)) | {"name": name} for name, xyz in f.items()] for f in frames]
    path = tmp_path / "points.json"
    frames[3] = None  # nobody is seen
    path.write_text(json.dumps({"fps": 30, "frames": frames}))
    found = mrhubo.read_motion(path)
    seen = [frame for frame in range(FRAMES) if frame not in (0, 3, 7)]
    assert found.confidence_TJ is not None
    elbow_T = found.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")]
    assert elbow_T.nonzero().flatten().tolist() == seen
    kept = found.changed(local_TJ33=found.local_TJ33[seen], confidence_TJ=None)
    assert bone_error(kept, pose[seen]) < 0.2
    # the list of names has the order of the confidence's columns
    sure = np.ones((FRAMES, len(names)))
    sure[:, names.index("left_elbow")] = 0
    path.write_text(json.dumps({"fps": 30, "frames": frames, "names": names, "confidence": sure.tolist()}))
    found = mrhubo.read_motion(path)
    assert found.confidence_TJ is not None
    arms = [not found.confidence_TJ[:, POSED_JOINT_NAMES.index(f"{side}_shoulder")].any() for side in SIDES]
    assert arms == [True, False]


@pytest.mark.parametrize("form", ["objects", "lists", "lists of objects", "no key", "biomechanics"])
def test_points_of_a_skeleton_have_a_place_among_other_things(
    form: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """As Move's API writes them, or whoever dumps the bones of a game's character; times tell the rate."""
    names = skeleton_names()
    frames: list[Any] = []
    for frame in range(FRAMES):
        places = {theirs: points[ours][frame].round(5).tolist() for ours, theirs in names.items()}
        more = {"rotation": [0.0, 0.0, 0.0, 1.0], "type": "euler_xyz", "torques": [0.0] * 3}
        bones: Any = {name: {"position": place, **more, "confidence": 0.9} for name, place in places.items()}
        if form == "lists":
            bones = [{"joint": name, **bone} for name, bone in bones.items()]
        elif form == "lists of objects":
            as_axes = {name: dict(zip("XYZ", place, strict=True)) for name, place in places.items()}
            bones = [{"boneName": name, "worldPosition": place, **more} for name, place in as_axes.items()]
        own = {"timestamp": frame / 50, "label": "dance"}
        key = {"lists": "joints", "lists of objects": "bones", "biomechanics": "joint_data"}.get(form, "joints")
        frames.append({**own, **bones} if form == "no key" else {**own, key: bones})
    path = tmp_path / "take.json"
    path.write_text(json.dumps(frames if form == "biomechanics" else {"id": "take", "frames": frames}))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == 50 and "by their names" in found.source and len(found) == FRAMES
    assert bone_error(found, pose) < 5  # a chest that points tell, and hips
    sure = None if found.confidence_TJ is None else float(found.confidence_TJ[:, 0].max())
    assert sure == (pytest.approx(0.9) if form != "lists of objects" else 1.0)


def skeleton_names() -> dict[str, str]:
    """What an animation calls our points."""
    names = {"pelvis": "Hips", "spine1": "Spine", "spine3": "Chest", "neck": "Neck", "head": "Head"}
    parts = {"collar": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "hip": "UpLeg", "knee": "Leg",
             "ankle": "Foot", "foot": "ToeBase"}  # fmt: skip
    return names | {f"{side}_{ours}": f"{side.title()}{theirs}" for side in SIDES for ours, theirs in parts.items()}


@pytest.mark.parametrize(
    ("ending", "form"),
    [(".npz", "arrays"), *((ending, form) for ending in (".pkl", ".json") for form in ("arrays", "positions", "axes"))],
)
def test_a_joint_may_have_an_array_of_its_own(
    ending: str, form: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    path, array = tmp_path / f"take{ending}", {theirs: points[ours] for ours, theirs in skeleton_names().items()}
    joints: dict[str, Any] = dict(array)
    if form == "positions":
        sure_T = np.full(FRAMES, 0.8)
        joints = {name: {"positions": place_T3, "confidence": sure_T} for name, place_T3 in array.items()}
    elif form == "axes":
        joints = {name: dict(zip("xyz", place_T3.T, strict=True)) for name, place_T3 in array.items()}
    if ending == ".npz":
        np.savez(path, **joints, fps=50)
    elif ending == ".pkl":
        path.write_bytes(pickle.dumps({"fps": 50, **joints}))
    else:
        path.write_text(json.dumps({"fps": 50, "joints": joints}, default=lambda array: array.tolist()))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == 50 and "by their names" in found.source and len(found) == FRAMES
    assert bone_error(found, pose) < 5
    sure = None if found.confidence_TJ is None else float(found.confidence_TJ[:, 0].max())
    assert sure == (pytest.approx(0.8) if form == "positions" else 1.0)


@pytest.mark.parametrize("ending", [".npz", ".pkl", ".json"])
@pytest.mark.parametrize("keys", [("body_pos_w", "body_names"), ("data", "labels"), ("positions", "bones")])
def test_names_beside_an_array_tell_whatever_they_are_called(
    ending: str, keys: tuple[str, str], points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """Speeds and rotations have as many numbers."""
    path, ours = tmp_path / f"take{ending}", skeleton_names()
    array = np.stack([points[name] for name in ours], axis=1)
    told = {"body_lin_vel_w": np.gradient(array, axis=0), "angles": np.ones_like(array), keys[0]: array,
            keys[1]: list(ours.values()), "dt": 0.02}  # fmt: skip
    if ending == ".npz":
        np.savez(path, **{key: np.array(value) for key, value in told.items()})
    elif ending == ".pkl":
        path.write_bytes(pickle.dumps(told))
    else:
        path.write_text(json.dumps(told, default=lambda array: array.tolist()))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == 50 and f"'{keys[0]}'" in found.source and bone_error(found, pose) < 5


@pytest.mark.parametrize(
    "form", ["places", "places and rotations", "named", "of a scene", "joints in a list", "frames of joints"]
)
def test_frames_of_bones_in_other_containers(
    form: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    ours, path = skeleton_names(), tmp_path / "take.pkl"
    array = np.stack([points[name] for name in ours], axis=1)
    still = np.array([1.0, 0.0, 0.0, 0.0])
    value: Any = [dict(zip(ours.values(), place_K3, strict=True)) for place_K3 in array]
    if form == "places and rotations":
        value = [{name: (place_3, still) for name, place_3 in frame.items()} for frame in value]
    elif form == "named":
        value = {"frames": [{"joints": place_K3, "root": still} for place_K3 in array], "names": list(ours.values())}
    elif form == "of a scene":
        people = [[{"name": "Ann", "body": {n: {"position": x} for n, x in frame.items()}}] for frame in value]
        value = [{"scene": {"actors": here, "timestamp": 2 + place / 25}} for place, here in enumerate(people)]
    elif form == "joints in a list":
        value = {"joints": [{"name": n, "positions": array[:, i]} for i, n in enumerate(ours.values())]}
    elif form == "frames of joints":
        value = {"joints": [{"joint": n, "frames": array[:, i].tolist()} for i, n in enumerate(ours.values())]}
    path.write_bytes(pickle.dumps(value))
    found = mrhubo.read_motion(path, RATE)
    assert len(found) == FRAMES and bone_error(found, pose) < 5
    if form == "of a scene":
        path = tmp_path / "take.json"
        path.write_text(json.dumps(value, default=lambda array: array.tolist()))
        assert mrhubo.read_motion(path, RATE).checksum == found.checksum
        assert mrhubo.read_motion(path).frame_rate == pytest.approx(25)
        with pytest.raises(UserError, match="Ben"):
            mrhubo.read_motion(tmp_path / "take.pkl", ReadOptions(rate=30, person="Ben"))


@pytest.mark.parametrize("axes", ["frames first", "frames last", "axes first", "rows", "a structure"])
def test_matlab(axes: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    path, ours = tmp_path / "take.mat", skeleton_names()
    array = np.stack([points[name] for name in ours], axis=1)
    laid_out = {"frames last": array.transpose(1, 2, 0), "axes first": array.transpose(2, 1, 0),
                "rows": array.reshape(FRAMES, -1)}  # fmt: skip
    told = {
        "keypoints": laid_out.get(axes, array),
        "names": np.array(list(ours.values()), dtype=object),
        "fps": 50.0,
    }
    savemat(path, {"take": told} if axes == "a structure" else told)
    found = mrhubo.read_motion(path)
    assert found.frame_rate == 50 and len(found) == FRAMES and bone_error(found, pose) < 5


@pytest.mark.parametrize("frames_last", [False, True])
def test_an_array_alone_with_the_frames_last(
    frames_last: bool, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """As UTD-MHAD has it; and what fits no body is none."""
    path, array = tmp_path / "take.mat", array_of(points, SETS["Kinect 1 from the head"])
    savemat(path, {"d_skel": array.transpose((1, 2, 0) if frames_last else (2, 1, 0))})
    found = mrhubo.read_motion(path, RATE)
    assert "'d_skel', 20 points as Kinect 1 from the head has them" in found.source and bone_error(found, pose) < 0.2
    savemat(path, {"d_skel": np.random.default_rng(0).normal(size=(20, 3, FRAMES))})
    with pytest.raises(mrhubo.motion.NoMotion, match="no human motion that is known here"):
        mrhubo.read_motion(path, RATE)


@pytest.mark.parametrize("rows", [True, False])
@pytest.mark.parametrize("form", ["flat", "nested", "a key", "a list"])
def test_places_in_matrices(
    form: str, rows: bool, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """Of rows, or of columns, as iPhones' ARKit has them, by its names."""
    parts = {"shoulder": "arm", "elbow": "forearm", "wrist": "hand", "hip": "upLeg", "knee": "leg", "ankle": "foot"}
    names = {f"{side}_{ours}": f"{side}_{theirs}_joint" for side in SIDES for ours, theirs in parts.items()}
    names |= {"pelvis": "hips_joint", "neck": "neck_1_joint", "head": "head_joint"}
    turn_33 = np.array([[0.0, -1, 0], [0.8, 0, 0.6], [-0.6, 0, 0.8]])

    def matrix(name: str, frame: int) -> Any:
        matrix_44 = np.eye(4)
        matrix_44[:3, :3], matrix_44[:3, 3] = turn_33, points[name][frame]
        matrix_44 = matrix_44 if rows else matrix_44.T
        told = matrix_44.tolist() if form == "nested" else matrix_44.ravel().tolist()
        return {"name": names[name], "transform": told} if form == "a list" else told

    frames = []
    for frame in range(FRAMES):
        joints = {names[name]: matrix(name, frame) for name in names}
        frames.append(
            {"timestamp": frame / 50, "jointModelTransforms" if form == "a key" else "joints": [*joints.values()]}
            if form in ("a key", "a list")
            else {"timestamp": frame / 50, "joints": joints}
        )
    path = tmp_path / "take.json"
    path.write_text(json.dumps({"jointNames": list(names.values()), "frames": frames}))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == pytest.approx(50) and bone_error(found, pose) < 5
    assert found.root_position_T3 is not None


@pytest.mark.parametrize("rotation", ["random", "zero", "still"])
def test_rotations_by_joint_are_no_places(rotation: str, tmp_path: Path) -> None:
    random, still = np.random.default_rng(0), np.ones((FRAMES, 1))
    ways = {"random": lambda: np.cumsum(random.normal(0, 0.1, (FRAMES, 3)), 0), "zero": lambda: np.zeros((FRAMES, 3)),
            "still": lambda: still * random.normal(0, 0.5, (1, 3))}  # fmt: skip
    turns = {name: ways[rotation]() for name in skeleton_names().values()}
    np.savez(tmp_path / "take.npz", fps=50, **turns)
    with pytest.raises(mrhubo.motion.NoMotion, match="in which there is no human motion that is known here"):
        mrhubo.read_motion(tmp_path / "take.npz")


def test_names_that_are_numbers_are_places(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    array = array_of(points, SETS["COCO"])
    frames = [{str(place): array[frame, place].tolist() for place in range(16, -1, -1)} for frame in range(FRAMES)]
    path = tmp_path / "points.json"
    for more in ({}, {"names": list(SETS["COCO"])}):
        path.write_text(json.dumps({"fps": 30, "frames": frames} | more))
        assert bone_error(mrhubo.read_motion(path), pose) < 0.2


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"frames": [[{"name": "nose", "x": 1, "y": 2, "z": 3}, [1, 2, 3]]]}, "names 1 of the 2 points in frame 0"),
        ({"frames": [{"nose": [1, 2, 3]}, [[1, 2, 3]]]}, "without names in frame 1"),
        ({"frames": [[], [{"name": "nose"}, {"name": "nose"}]]}, "two points 'nose' in frame 1"),
        ({"keypoints": [*[[]] * 60_000, [[0, 0, 0]] * 20_000]}, "20,000 points a frame"),
        ({"keypoints": [*[[]] * 500_000, [[0, 0, 0]]]}, "500,001 frames"),
        ({"keypoints": [*[[]] * 60_000, [[0, 0, 0]] * 900]}, "60,001 frames of 900 points"),
        ({"frames": [{"999999999": [1, 2, 3]}]}, "1,000,000,000 points a frame"),
        ({"frames": [{"joints": {"Hips": {"rotation": [0, 0, 0, 1]}}}] * 3}, "tells of no point where it is"),
    ],
)
def test_json_that_is_refused(content: dict, words: str, tmp_path: Path) -> None:
    path = tmp_path / "points.json"
    path.write_text(json.dumps(content))
    with pytest.raises(UserError, match=rf"points\.json: .*{words}"):
        mrhubo.read_motion(path, RATE)


def openpose(folder: Path, people: list[list[np.ndarray]], numbers: list[int]) -> None:
    """Nobody has a number."""
    for number, here in zip(numbers, people, strict=True):
        content = [{"person_id": [-1], "pose_keypoints_3d": row_K4.ravel().tolist()} for row_K4 in here]
        (folder / f"v_{number:012d}_keypoints.json").write_text(json.dumps({"version": 1.3, "people": content}))


def mmpose(folder: Path, people: list[list[np.ndarray]], numbers: list[int]) -> None:
    frames = [
        {"frame_id": number, "instances": [{"keypoints": x[:, :3].tolist(), "keypoint_scores": [1.0] * 25} for x in here]}
        for number, here in zip(numbers, people, strict=True)
    ]  # fmt: skip
    (folder / "a.json").write_text(json.dumps({"meta_info": {}, "instance_info": frames}))


def inferencer(folder: Path, people: list[list[np.ndarray]], numbers: list[int]) -> None:
    """MMPose's as its inferencer writes it: a list, with boxes in the picture, of points around a hip."""
    mmpose(folder, people, numbers)
    frames = json.loads((folder / "a.json").read_text())["instance_info"]
    for frame in frames:
        for one in frame["instances"]:
            x, y = 100 * one["keypoints"][9][0], 500
            one["bbox"] = [[x, y, x + 100, y + 200]]
            one["keypoints"] = (np.array(one["keypoints"]) - one["keypoints"][9]).tolist()
    (folder / "a.json").write_text(json.dumps(frames))


@pytest.mark.parametrize("write", [openpose, mmpose, inferencer])
def test_people_without_numbers_are_followed(
    write, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """Two people three metres apart, of whom now one and now the other comes first; one stands still."""
    row_TK4 = np.pad(array_of(points, SETS["OpenPose's BODY_25"]), ((0, 0), (0, 0), (0, 1)), constant_values=1.0)
    still_TK4 = row_TK4[[0] * FRAMES] + [3, 0, 0, 0]
    people = [[a, b][:: 1 if t % 2 else -1] for t, (a, b) in enumerate(zip(row_TK4, still_TK4, strict=True))]
    write(tmp_path, people, list(range(FRAMES)))
    path = tmp_path if write is openpose else tmp_path / "a.json"
    for person, truth in (("1", pose), ("0", pose[[0] * FRAMES])):
        found = mrhubo.read_motion(path, ReadOptions(rate=30.0, person=person))
        assert bone_error(found, truth) < 0.01 and "does not say who is who" in found.notes[0]
    assert f"'0' ({FRAMES} frames), '1' ({FRAMES} frames)" in mrhubo.read_motion(path, RATE).notes[1]


@pytest.mark.parametrize("write", [openpose, mmpose])
def test_gaps_between_numbers_of_frames_stay(write, points: dict[str, np.ndarray], tmp_path: Path) -> None:
    row_TK4 = np.pad(array_of(points, SETS["OpenPose's BODY_25"]), ((0, 0), (0, 0), (0, 1)), constant_values=1.0)
    write(tmp_path, [[row] for row in row_TK4], [*range(10), *range(60, 70)])
    found = mrhubo.read_motion(tmp_path if write is openpose else tmp_path / "a.json", RATE)
    assert len(found) == 70 and found.confidence_TJ is not None
    elbow_T = found.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")]
    assert (elbow_T == 0).nonzero().flatten().tolist() == list(range(10, 60))


def test_files_of_frames_are_in_the_order_of_their_numbers(
    points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    for frame, row in enumerate(array_of(points, SETS["OpenPose's BODY_25"])):
        name = f"frame{5 * frame}_keypoints3d.json"
        (tmp_path / name).write_text(json.dumps([{"id": 0, "keypoints3d": row.tolist()}]))
    found = mrhubo.read_motion(tmp_path, RATE)
    assert len(found) == FRAMES and bone_error(found, pose) < 0.01
    (tmp_path / "copy5_keypoints3d.json").write_bytes((tmp_path / "frame5_keypoints3d.json").read_bytes())
    with pytest.raises(UserError, match=f"{tmp_path.name}: .*same number"):
        mrhubo.read_motion(tmp_path, RATE)


@pytest.mark.parametrize("open_one", [None, 0, float("nan"), [], "high"])
def test_a_confidence_in_json_that_is_left_open_is_none(
    tmp_path: Path, points: dict[str, np.ndarray], open_one: object
) -> None:
    names = tuple(points)
    content = {"fps": 30, "names": names, "keypoints": array_of(points, names).tolist()}
    for name, more in (("without", {}), ("with", {"confidence": open_one})):
        (tmp_path / f"{name}.json").write_text(json.dumps(content | more))
    found, expected = (mrhubo.read_motion(tmp_path / f"{name}.json") for name in ("with", "without"))
    np.testing.assert_array_equal(found.arrays.local_TJ33, expected.arrays.local_TJ33)


def _picture(array: np.ndarray) -> np.ndarray:
    """Points as they are in a picture of 1280 x 720 pixels, with a depth that is guessed."""
    return array * [200.0, -200.0, 0.3] + [640.0, 700.0, 0.0]


def _marked(point_K3: np.ndarray, names: list[str] | None = None) -> list[dict[str, Any]]:
    points = [dict(zip("xyz", point, strict=True)) | {"visibility": 0.9} for point in point_K3.tolist()]
    return points if names is None else [point | {"name": name} for point, name in zip(points, names, strict=True)]


@pytest.mark.parametrize("form", ["tfjs", "tfjs_alone", "tasks", "solutions", "azure", "numbered", "files", "zed"])
def test_json_of_programs(form: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    """As programs write it; those who have points in a picture beside those in space are taken at the latter."""
    mediapipe, names = array_of(points, SETS["MediaPipe"]), list(SETS["MediaPipe"])
    names = [f"other {place}" if name == "-" else name for place, name in enumerate(names)]
    flat, azure = _picture(mediapipe), 1000 * array_of(points, SETS["Azure Kinect"])
    both = [
        {"score": 0.9, "keypoints": _marked(flat[t], names), "keypoints3D": _marked(mediapipe[t], names)}
        for t in range(FRAMES)
    ]
    content: dict[str, Any] = {
        "tfjs": {"frames": [[one] for one in both]},
        "tfjs_alone": both,
        "tasks": [{"landmarks": [_marked(flat[t])], "worldLandmarks": [_marked(mediapipe[t])]} for t in range(FRAMES)],
        "solutions": {"frames": [{"poseLandmarks": _marked(flat[t]), "poseWorldLandmarks": _marked(mediapipe[t])}
                                 for t in range(FRAMES)]},
        "azure": {"frames": [{"bodies": [{"body_id": 7, "joint_positions": row}], "frame_id": t, "num_bodies": 1}
                             for t, row in enumerate(azure.tolist())],
                  "joint_names": [name if name != "-" else f"other {n}" for n, name in enumerate(SETS["Azure Kinect"])]},
        "numbered": {str(10 + t): _marked(mediapipe[t]) for t in range(FRAMES)},
        "files": {f"img_{t:04}.jpg": {"landmarks": _marked(mediapipe[t])} for t in range(FRAMES)},
        "zed": {str(t): {"is_new": True, "body_list": [{"id": 3, "keypoint": row}]}
                for t, row in enumerate(array_of(points, SETS["Human3.6M"]).tolist())},
    }  # fmt: skip
    path = tmp_path / "a.json"
    path.write_text(json.dumps(content[form]))
    found = mrhubo.read_motion(path, RATE)
    assert len(found) == FRAMES and bone_error(found, pose) < 0.2
    if isinstance(content[form], dict) and "frames" in content[form]:
        path.write_text(json.dumps(content[form] | {"frameRate": 25}))
        assert mrhubo.read_motion(path).frame_rate == 25


def test_gaps_in_json_stay_gaps(points: dict[str, np.ndarray], tmp_path: Path) -> None:
    array, path = array_of(points, SETS["COCO"]), tmp_path / "a.json"
    kept = [t for t in range(FRAMES) if t not in (4, 5)]
    listed = [{"frame": t, "keypoints": array[t].tolist()} for t in kept[::-1]]
    for content in (listed, {f"{t:03}": array[t].tolist() for t in kept}):
        path.write_text(json.dumps(content))
        found = mrhubo.read_motion(path, RATE)
        assert found.confidence_TJ is not None and len(found) == FRAMES
        elbow_T = found.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")]
        assert elbow_T.nonzero().flatten().tolist() == kept


def test_one_of_several_people_in_json(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    array, path = array_of(points, SETS["COCO"]), tmp_path / "a.json"
    frames = [{"bodies": [{"id": "still", "keypoints": array[0].tolist()}, {"id": "b", "keypoints": row}][:: 1 - 2 * (t % 2)]}
              for t, row in enumerate(array.tolist())]  # fmt: skip
    path.write_text(json.dumps({"frames": frames}))
    for person, truth in (("b", pose), ("still", pose[[0] * FRAMES])):
        assert bone_error(mrhubo.read_motion(path, ReadOptions(rate=30.0, person=person)), truth) < 0.2
    people = {f"person_{n}": {"keypoints": array.tolist()} for n in range(2)}
    path.write_text(json.dumps(people))
    with pytest.raises(UserError, match="as if each were a person"):
        mrhubo.read_motion(path, RATE)


@pytest.mark.parametrize("kind", ["O", "S", "U"])
def test_names_in_npz_may_be_objects_or_bytes(
    kind: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    names = [name for name in SETS["COCO"] if name != "-"][::-1]
    path = tmp_path / "a.npz"
    np.savez(path, keypoints=array_of(points, tuple(names)), names=np.array(names, dtype=kind))
    found = mrhubo.read_motion(path, RATE)
    assert bone_error(found, pose) < 0.2 and "by their names" in found.source
    np.savez(path, keypoints=array_of(points, tuple(names)), names=np.arange(len(names)))
    with pytest.raises(UserError, match="'names' is an array of shape .*; expected the names of the points"):
        mrhubo.read_motion(path, RATE)


def _table(point_TK3: np.ndarray, columns: str, separator: str = ",", point: str = ".") -> str:
    """A table of points, frame by frame; `columns` says how those of MediaPipe's point 0 are called, x for its axis."""
    names = [f"other_{place}" if name == "-" else name for place, name in enumerate(SETS["MediaPipe"])]
    header = [
        columns.replace("AXIS", axis).replace("NAME", name).replace("NUMBER", str(number))
        for number, name in enumerate(names)
        for axis in "xyz"
    ]
    rows = [[f"{x:.6f}".replace(".", point) for x in row.ravel()] for row in point_TK3]
    return "\n".join(separator.join(row) for row in (header, *rows)) + "\n"


@pytest.mark.parametrize(
    ("columns", "separator", "point", "how"),
    [
        ("NAME_AXIS", ",", ".", "by their names"),
        ("NAME.AXIS [m]", ";", ",", "by their names"),
        ("NAME AXIS", "\t", ".", "by their names"),
        ("AXISNUMBER", ",", ".", "as MediaPipe has them"),
        ("NUMBER_AXIS", ",", ".", "as MediaPipe has them"),
        ("landmark_NUMBER_AXIS", ",", ".", "as MediaPipe has them"),
        ("AXIS_NAME", ",", ".", "by their names"),
        ("NAME_TAXIS", ",", ".", "by their names"),
    ],
)
def test_tables(
    columns: str,
    separator: str,
    point: str,
    how: str,
    points: dict[str, np.ndarray],
    pose: torch.Tensor,
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.csv"
    text = _table(array_of(points, SETS["MediaPipe"]), columns, separator, point)
    for ends in ("\n", "\r\n"):
        path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", ends).encode())
        found = mrhubo.read_motion(path, RATE)
        assert len(found) == FRAMES and bone_error(found, pose) < 0.2 and how in found.source
    with pytest.raises(UserError, match="--rate"):
        mrhubo.read_motion(path)


@pytest.mark.parametrize(
    "columns", ["NAME_RAXIS NAME_TAXIS", "NAME_position_AXIS NAME_rotation_AXIS", "NAME.rotAXIS NAME.AXIS"]
)
def test_angles_beside_places_in_a_table_are_passed_over(
    columns: str, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """As Rokoko writes bones, with left-handed axes, or who exports channels."""
    names, header, value_XT = skeleton_names(), ["Timestamp"], [1000 / 60 * np.arange(FRAMES)]
    for ours, theirs in names.items():
        for group in columns.split():
            is_place = "rot" not in group and "_R" not in group
            for axis in range(3):
                header.append(group.replace("AXIS", "xyz"[axis]).replace("NAME", theirs))
                value_XT.append([-1, 1, 1][axis] * points[ours][:, axis] if is_place else np.full(FRAMES, 90.0 * axis))
    path = tmp_path / "bones.csv"
    rows = [",".join(f"{x:.4f}" for x in row) for row in zip(*value_XT, strict=True)]
    path.write_text("\n".join([",".join(header), *rows]))
    found = mrhubo.read_motion(path)
    assert found.frame_rate == 60 and "left-handed" in " ".join(found.notes)
    assert bone_error(found, pose) < 5


def test_tables_tell_their_rate_and_their_gaps(
    points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    path = tmp_path / "a.csv"
    header, *rows = _table(array_of(points, SETS["MediaPipe"]), "NAME_AXIS").splitlines()
    path.write_text("\n".join([f"time [s],{header}", *(f"{t / 30:.4f},{row}" for t, row in enumerate(rows))]))
    assert mrhubo.read_motion(path).frame_rate == 30
    path.write_text("\n".join([f"timestamp_ms,{header}", *(f"{t / 0.03:.3f},{row}" for t, row in enumerate(rows))]))
    assert mrhubo.read_motion(path).frame_rate == 30
    for step, unit in ((33.3, 1e-3), (20.0, 1e-3), (1 / 48, 1.0), (16_666.7, 1e-6)):  # of no other unit is it a frame's
        path.write_text("\n".join([f"Timestamp,{header}", *(f"{t * step:.4f},{row}" for t, row in enumerate(rows))]))
        assert mrhubo.read_motion(path).frame_rate == pytest.approx(1 / (step * unit), rel=1e-4)
    path.write_text("\n".join([f"time,{header}", *(f"{t},{row}" for t, row in enumerate(rows))]))
    with pytest.raises(UserError, match="--rate"):  # numbers of frames, or so it seems
        mrhubo.read_motion(path)
    kept = [t for t in range(FRAMES) if t not in (4, 5)]
    path.write_text("\n".join([f"frame,label,{header}", *(f"{100 + t},wave,{rows[t]}" for t in kept)]))
    found = mrhubo.read_motion(path, RATE)
    assert len(found) == FRAMES and found.confidence_TJ is not None
    assert found.confidence_TJ[:, POSED_JOINT_NAMES.index("left_elbow")].nonzero().flatten().tolist() == kept
    assert bone_error(found.changed(local_TJ33=found.local_TJ33[kept]), pose[kept]) < 0.2
    elbow = header.split(",").index("left_elbow_x")
    blank = [",".join(["" if x in range(elbow, elbow + 3) else word for x, word in enumerate(row.split(","))])
             for row in rows]  # fmt: skip
    path.write_text("\n".join([header, *blank[:3], *rows[3:]]))
    assert "left shoulder to left elbow is not seen in 3" in " ".join(mrhubo.read_motion(path, RATE).notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: [rows[0]], "a header and no frames"),
        (lambda rows: [*rows[:3], rows[3].rpartition(",")[0]], "frame 2 has 98 columns, and the header 99"),
        (lambda rows: [*rows[:3], rows[3].replace("0.", "O.", 1)], "frame 2 holds 'O"),
    ],
)
def test_tables_that_are_refused(change, words: str, points: dict[str, np.ndarray], tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("\n".join(change(_table(array_of(points, SETS["MediaPipe"]), "NAME_AXIS").splitlines())))
    with pytest.raises(UserError, match=words):
        mrhubo.read_motion(path, RATE)


@given(steps=accidents)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_tables_are_read_or_refused_in_a_sentence(
    points: dict[str, np.ndarray], steps: list[Step], tmp_path: Path
) -> None:
    path = tmp_path / "points.csv"
    path.write_bytes(damaged(_table(array_of(points, SETS["MediaPipe"])[:3], "NAME_AXIS").encode(), steps))
    read_or_refused(path)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("ending", [".npy", ".npz", ".pkl"])
def test_people_along_an_axis_of_an_array(
    axis: int, ending: str, points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """As InterGen writes two of them; the second is seen in the first frames only."""
    one = array_of(points, SETS["SMPL's body"])
    other = one + [1.0, 0.0, 0.5]
    other[len(one) // 2 :] = 0
    both, path = np.stack([other, one], axis=axis), tmp_path / f"a{ending}"
    if ending == ".npy":
        np.save(path, both)
    elif ending == ".npz":
        np.savez(path, keypoints=both, confidence=np.ones(both.shape[:3]))
    else:
        path.write_bytes(pickle.dumps({"joints": both}))
    longest, second = (mrhubo.read_motion(path, ReadOptions(rate=30.0, person=person)) for person in (None, "0"))
    np.save(tmp_path / "one.npy", one)
    alone = mrhubo.read_motion(tmp_path / "one.npy", RATE)
    assert torch.equal(longest.local_TJ33, alone.local_TJ33) and "'1' is seen longest" in longest.notes[0]
    assert second.confidence_TJ is not None and not second.confidence_TJ[len(one) // 2 :].any()
    half = len(one) // 2
    torch.testing.assert_close(second.local_TJ33[: half - 1], alone.local_TJ33[: half - 1], atol=1e-5, rtol=0)


def test_what_ntus_script_makes_of_a_skeleton_file(points: dict[str, np.ndarray], tmp_path: Path) -> None:
    """Bodies that are not there are all 0."""
    body = array_of(points, SETS["Kinect 2"])
    content: dict[str, Any] = {"file_name": "S001C001P001R001A002", "nbodys": [1] * len(body), "njoints": 25}
    for number in range(4):
        content[f"skel_body{number}"] = body if number == 1 else np.zeros_like(body)
        content[f"rgb_body{number}"] = body[..., :2]
    np.save(tmp_path / "a.skeleton.npy", content, allow_pickle=True)
    motion = mrhubo.read_motion(tmp_path / "a.skeleton.npy")
    assert motion.frame_rate == 30.0 and "'skel_body1'" in motion.source and "Kinect 2" in motion.source
    with pytest.raises(UserError, match="there is no person '3'"):
        mrhubo.read_motion(tmp_path / "a.skeleton.npy", ReadOptions(person="3"))


def test_named_points_may_stand_in_rows(points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path) -> None:
    rows = array_of(points, tuple(JOINT_NAMES)).reshape(FRAMES, -1)
    np.savez(tmp_path / "a.npz", joints=rows, fps=30)
    assert bone_error(mrhubo.read_motion(tmp_path / "a.npz"), pose) < 0.01
    np.savez(tmp_path / "a.npz", joints=np.random.default_rng(0).normal(size=(FRAMES, 66)), fps=30)
    with pytest.raises(UserError, match="fit no body"):
        mrhubo.read_motion(tmp_path / "a.npz")


@pytest.mark.parametrize("name", ["MediaPipe", "Human3.6M", "Kinect 2", "COCO"])
@pytest.mark.parametrize("fourth", [False, True])
def test_points_in_rows_without_a_name(
    name: str, fourth: bool, points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    array = array_of(points, SETS[name])
    array = np.pad(array, ((0, 0), (0, 0), (0, int(fourth))), constant_values=0.9)
    np.save(tmp_path / "a.npy", array.reshape(FRAMES, -1))
    found = mrhubo.read_motion(tmp_path / "a.npy", RATE)
    assert bone_error(found, pose) < 0.2 and f"as {name} has them" in found.source
    np.save(tmp_path / "a.npy", np.random.default_rng(0).normal(size=(FRAMES, array[0].size)))
    with pytest.raises(UserError, match="no human motion"):
        mrhubo.read_motion(tmp_path / "a.npy", RATE)


def test_lists_of_detections_are_people_of_pictures(
    points: dict[str, np.ndarray], pose: torch.Tensor, tmp_path: Path
) -> None:
    """As COCO has them: an entry is a person in a picture, and points stand in a row."""
    array, path = array_of(points, SETS["COCO"]), tmp_path / "a.json"
    entries = [
        {"image_id": f"{t}.jpg", "category_id": 1, "keypoints": (array[t] + [shift, 0, 0]).reshape(-1).tolist()}
        for t in range(FRAMES)
        for shift in ((0.0, 3.0) if t % 2 else (3.0, 0.0))
    ]
    path.write_text(json.dumps(entries))
    for person in ("0", "1"):
        found = mrhubo.read_motion(path, ReadOptions(rate=30.0, person=person))
        assert len(found) == FRAMES and bone_error(found, pose) < 0.2
        assert found.root_position_T3 is not None and float(found.root_position_T3[:, 0].std()) < 0.1
    flat = array * [300.0, 300.0, 0.0] + [400.0, 500.0, 0.8]
    path.write_text(json.dumps([{"image_id": 7, "keypoints": row.reshape(-1).tolist()} for row in flat]))
    with pytest.raises(UserError, match="points in a picture"):
        mrhubo.read_motion(path, RATE)
    path.write_text(json.dumps([{"keypoints": row[:, :2].tolist()} for row in flat]))
    with pytest.raises(UserError, match="points in a picture"):
        mrhubo.read_motion(path, RATE)


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [("SPINE_NAVAL", "spine1"), ("SPINE_CHEST", "spine2"), ("SPINE_1", "spine1"), ("spine3", "spine3"),
     ("SpineBase", "pelvis"), ("CLAVICLE_LEFT", "left_collar"), ("NAVAL_SPINE", "spine1")],
)  # fmt: skip
def test_names_of_the_spine(theirs: str, ours: str) -> None:
    assert our_name(theirs) == ours
