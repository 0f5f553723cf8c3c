"""Writers of files as estimators of human pose lay them out, for tests: of made-up motions, with the libraries that the
estimators use.

Legend: T frames; a person's pose is axis-angle [rad] of SMPL's first 22 joints (T, 22, 3), the root first.
"""

from __future__ import annotations

import json
import pickle
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import torch
from scipy.spatial.transform import Rotation

GENERATOR = np.random.default_rng(0)


def made_up(frames: int, seed: int = 0, camera: bool = False) -> np.ndarray:
    """A pose (T, 22, 3) of somebody who stands and turns, in a world with y up, or as a camera sees them, y down."""
    generator = np.random.default_rng(seed)
    pose = generator.normal(0, 0.3, (frames, 22, 3))
    turn = Rotation.from_euler("y", np.linspace(0, 60, frames)[:, None], degrees=True)
    pose[:, 0] = (Rotation.from_euler("x", 180, degrees=True) * turn if camera else turn).as_rotvec()
    return pose.astype(np.float32)


def matrices(pose: np.ndarray) -> np.ndarray:
    """Axis-angle (..., 3) as matrices (..., 3, 3)."""
    return Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(*pose.shape, 3).astype(np.float32)


def padded(pose: np.ndarray, joints: int) -> np.ndarray:
    """A pose (T, 22, 3) with more joints, as a row (T, 3 joints)."""
    return np.pad(pose, ((0, 0), (0, joints - 22), (0, 0))).reshape(len(pose), -1)


def wham(path: Path, people: dict[int, np.ndarray], frames: dict[int, np.ndarray] | None = None, **dump: Any) -> None:
    results: dict[Any, Any] = defaultdict(dict)
    for person, pose in people.items():
        row = padded(pose, 24)
        camera = row.copy()
        camera[:, :3] = (Rotation.from_euler("x", 170, degrees=True) * Rotation.from_rotvec(row[:, :3])).as_rotvec()
        results[np.int64(person)] = {
            "pose": camera,
            "trans": np.ones((len(pose), 3), np.float32),
            "pose_world": row,
            "trans_world": np.tile(np.arange(len(pose), dtype=np.float32)[:, None] / 10, 3),
            "betas": np.tile(np.float32(0.1), (len(pose), 10)),
            "verts": np.zeros((len(pose), 20, 3), np.float32),
            "frame_ids": np.arange(len(pose)) if frames is None else frames[person],
        }
    joblib.dump(results, path, **dump)


def vibe(path: Path, people: dict[int, np.ndarray]) -> None:
    content = {
        person: {
            "pred_cam": np.zeros((len(pose), 3)),
            "pose": padded(pose, 24),
            "betas": np.zeros((len(pose), 10)),
            "bboxes": np.zeros((len(pose), 4)),
            "frame_ids": np.arange(len(pose)),
        }
        for person, pose in people.items()
    }
    joblib.dump(content, path)


def phalp(path: Path, people: dict[int, np.ndarray], seen: dict[int, set[int]] | None = None, **dump: Any) -> None:
    frames = max(map(len, people.values()))
    content: dict[str, Any] = {}
    for t in range(frames):
        here = [p for p, pose in people.items() if t < len(pose) and (seen is None or t in seen[p])]
        turned = {p: matrices(people[p][t]) for p in here}
        content[f"outputs/_DEMO/video/img/{t + 1:06}.jpg"] = {
            "time": t,
            "shot": 0,
            "tracked_ids": here,
            "tracked_bbox": [np.zeros(4)] * len(here),
            "tid": here,
            "bbox": [np.zeros(4)] * len(here),
            "tracked_time": [0] * len(here),
            "img_path": [f"{t:06}.jpg"] * len(here),
            "smpl": [
                {
                    "global_orient": turned[p][:1],
                    "body_pose": np.concatenate((turned[p][1:], np.tile(np.eye(3, dtype=np.float32), (2, 1, 1)))),
                    "betas": np.zeros(10, np.float32),
                }
                for p in here
            ],
            "camera": [np.zeros(3)] * len(here),
            "3d_joints": [np.zeros((45, 3))] * len(here),
        }
    joblib.dump(content, path, **dump)


def tram(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    turned = matrices(padded(pose, 24).reshape(len(pose), 24, 3))
    content = {
        "pred_cam": torch.zeros(len(pose), 3),
        "pred_pose": torch.zeros(len(pose), 144),
        "pred_shape": torch.zeros(len(pose), 10),
        "pred_rotmat": torch.from_numpy(turned),
        "pred_trans": torch.ones(len(pose), 1, 3),
        "frame": torch.arange(len(pose)) + 5,
    }
    with path.open("wb") as file:
        np.save(file, content)  # type: ignore[arg-type]


def romp(path: Path, people: dict[int, np.ndarray], tracked: bool = True) -> None:
    """People stand three metres from each other; in every second frame they come in the other order."""
    frames = max(map(len, people.values()))
    results, tracks = {}, {}
    for t in range(frames):
        here = [p for p, pose in people.items() if t < len(pose)][:: 1 if t % 2 else -1]
        frame = {
            "cam": np.zeros((len(here), 3), np.float32),
            "smpl_thetas": np.stack([padded(people[p][t : t + 1], 24)[0] for p in here]),
            "smpl_betas": np.zeros((len(here), 10), np.float32),
            "cam_trans": np.stack([np.array((1, 3 * p - 3 * max(people), 0), np.float32) for p in here]),
            "joints": np.zeros((len(here), 71, 3), np.float32),
        }
        if tracked:
            frame["track_ids"] = np.array(here, np.int32)
            for row, person in enumerate(frame["track_ids"]):
                track = tracks.setdefault(person, {"frame_id": []} | {key: [] for key in frame})
                track["frame_id"].append(t)
                for key, array in frame.items():
                    track[key].append(array[row])
        results[f"{t:08}.png"] = frame
    with path.open("wb") as file:
        np.savez(file, results=results, sequence_results=tracks)  # type: ignore[arg-type]


def pymaf(path: Path, people: dict[int, np.ndarray]) -> None:
    """The best seen come first, so that a number in a frame is now one and now the other."""
    frames = max(map(len, people.values()))
    rows = [(t, p) for t in range(frames) for p in list(people)[:: 1 if t % 2 else -1] if t < len(people[p])]
    pose = np.stack([padded(people[p][t : t + 1], 24)[0] for t, p in rows])
    content = {
        "pred_cam": np.zeros((len(rows), 3), np.float32),
        "smplx_verts": np.zeros((len(rows), 4, 3), np.float32),
        "pose": pose,
        "betas": np.zeros((len(rows), 10), np.float32),
        "bboxes": np.array([(200.0 * p + t, 300.0, 150.0, 150.0) for t, p in rows]),
        "frame_ids": np.array([t for t, _ in rows]),
        "person_ids": [f"video_f{t}_p{p}" for t, p in rows],
        "smplx_params": [{"shape": torch.zeros(2, 10), "body_pose": torch.eye(3).repeat(2, 22, 1, 1)}],
    }
    joblib.dump(content, path)


def gvhmr(path: Path, people: dict[int, np.ndarray], name: str = "smpl_params") -> None:
    ((_, pose),) = people.items()
    row = torch.from_numpy(pose.reshape(len(pose), 66))
    shared = {"body_pose": row[:, 3:], "betas": torch.zeros(len(pose), 10), "transl": torch.ones(len(pose), 3)}
    content = {
        f"{name}_incam": shared | {"global_orient": torch.zeros(len(pose), 3)},
        f"{name}_global": shared | {"global_orient": row[:, :3]},
        "K_fullimg": torch.eye(3).repeat(len(pose), 1, 1),
        "net_outputs": {"pred_x": torch.zeros(1, len(pose), 151)},
    }
    torch.save(content, path)


def genmo(path: Path, people: dict[int, np.ndarray]) -> None:
    gvhmr(path, people, "body_params")


def aist(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    content = {
        "smpl_loss": 1.0,
        "smpl_poses": padded(pose, 24),
        "smpl_trans": np.full((len(pose), 3), 90.0),
        "smpl_scaling": np.array([90.0]),
    }
    path.write_bytes(pickle.dumps(content))


def prompthmr(path: Path, people: dict[int, np.ndarray]) -> None:
    persons = {}
    for person, pose in people.items():
        params = {
            "pose": padded(pose, 55),
            "shape": np.zeros((len(pose), 10)),
            "trans": np.ones((len(pose), 3)),
            "rotmat": torch.zeros(len(pose), 55, 3, 3),
        }
        persons[person] = {
            "track_id": person,
            "frames": np.arange(len(pose)) + 7,
            "bboxes": np.zeros((len(pose), 4)),
            "smplx_cam": params | {"pose": np.zeros((len(pose), 165))},
            "smplx_world": params,
        }
    content = {"camera": {"img_focal": 1000.0}, "people": persons, "camera_world": {"Rwc": np.zeros((9, 3, 3))}}
    joblib.dump(content, path)


def hybrik(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    content = {
        "pred_xyz_17": np.zeros((len(pose), 17, 3)),
        "pred_thetas": matrices(padded(pose, 24).reshape(len(pose), 24, 3)).reshape(len(pose), 216),
        "pred_betas": np.zeros((len(pose), 10)),
        "transl_camsys": np.ones((len(pose), 3)),
        "img_path": [f"{t:06}.jpg" for t in range(len(pose))],
    }
    path.write_bytes(pickle.dumps(content))


def slahmr(path: Path, people: dict[int, np.ndarray]) -> None:
    poses = np.stack(list(people.values()))
    content = {
        "pose_body": poses[:, :, 1:].reshape(*poses.shape[:2], 63),
        "root_orient": poses[:, :, 0],
        "trans": np.ones((*poses.shape[:2], 3)),
        "betas": np.zeros((len(poses), 16)),
    }
    with path.open("wb") as file:
        np.savez(file, **content)


def phc(path: Path, people: dict[int, np.ndarray]) -> None:
    content = {
        f"0-clip_{person}": {
            "pose_aa": padded(pose, 24),
            "trans_orig": np.ones((len(pose), 3)),
            "beta": np.zeros(16),
            "gender": "neutral",
            "fps": 30,
        }
        for person, pose in people.items()
    }
    joblib.dump(content, path, compress=True)


def emdb(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    smpl = {
        "poses_root": pose[:, 0],
        "poses_body": padded(pose, 24)[:, 3:],
        "trans": np.ones((len(pose), 3)),
        "betas": np.zeros(10),
    }
    path.write_bytes(pickle.dumps({"gender": "female", "name": "P1", "n_frames": len(pose), "smpl": smpl}))


def smplx(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    content = {
        "global_orient": pose[:, 0],
        "body_pose": pose[:, 1:],
        "jaw_pose": np.zeros((len(pose), 3)),
        "transl": np.ones((len(pose), 3)),
    }
    with path.open("wb") as file:
        np.savez(file, **content)


def interhuman(path: Path, people: dict[int, np.ndarray]) -> None:
    """People as two more entries beside what goes for all."""
    content: dict[Any, Any] = {"mocap_framerate": 30.0, "frames": max(map(len, people.values()))}
    for person, pose in people.items():
        content[person] = {
            "trans": np.ones((len(pose), 3)),
            "root_orient": pose[:, 0],
            "pose_body": pose[:, 1:].reshape(len(pose), 63),
            "gender": "male",
        }
    path.write_bytes(pickle.dumps(content))


def glamr(path: Path, people: dict[int, np.ndarray]) -> None:
    persons = {
        person: {
            "smpl_pose": padded(pose, 24)[:, 3:],
            "smpl_orient_world": pose[:, 0],
            "smpl_orient_cam": np.zeros((len(pose), 3)),
            "root_trans_world": np.ones((len(pose), 3)),
            "root_trans_cam": np.zeros((len(pose), 3)),
            "smpl_beta": np.zeros((len(pose), 10)),
            "frames": np.arange(len(pose)),
        }
        for person, pose in people.items()
    }
    joblib.dump({"meta": {"algo": "glamr"}, "person_data": persons}, path)


def cliff(path: Path, people: dict[int, np.ndarray]) -> None:
    """A row a detection; in every second frame people come in the other order."""
    frames = max(map(len, people.values()))
    rows = [(t, p) for t in range(frames) for p in list(people)[:: 1 if t % 2 else -1] if t < len(people[p])]
    content = {
        "imgname": np.array([f"{t:06}.jpg" for t, _ in rows]),
        "pose": np.stack([padded(people[p][t : t + 1], 24)[0] for t, p in rows]),
        "shape": np.zeros((len(rows), 10)),
        "global_t": np.ones((len(rows), 3)),
        "detection_all": np.array([(t, 300 * p, 100, 300 * p + 100, 400, 1, 1, 0) for t, p in rows], np.float64),
    }
    with path.open("wb") as file:
        np.savez(file, **content)


def frame_list(path: Path, people: dict[int, np.ndarray]) -> None:
    """What HMR2 answers to each picture, appended."""
    ((_, pose),) = people.items()
    turned = matrices(padded(pose, 24).reshape(len(pose), 24, 3))
    frames = [
        {
            "pred_smpl_params": {"global_orient": turn[:1], "body_pose": turn[1:], "betas": np.zeros(10)},
            "pred_cam_t": np.ones(3),
        }
        for turn in turned
    ]
    path.write_bytes(pickle.dumps(frames))


def multi_hmr(path: Path, people: dict[int, np.ndarray]) -> None:
    """People of each frame as Multi-HMR finds them, three metres from each other, now in one order and now in the other."""
    frames = max(map(len, people.values()))
    content = [
        [
            {
                "scores": torch.tensor(0.9),
                "rotvec": torch.from_numpy(np.concatenate((people[p][t], np.zeros((31, 3), np.float32)))),
                "transl_pelvis": torch.tensor([[1.0, 3.0 * (p - max(people)), 0.0]]),
                "transl": torch.zeros(3),
                "shape": torch.zeros(10),
                "expression": torch.zeros(10),
                "v3d": torch.zeros(4, 3),
            }
            for p in list(people)[:: 1 if t % 2 else -1]
            if t < len(people[p])
        ]
        for t in range(frames)
    ]
    torch.save(content, path)


def hmr2_pictures(path: Path, people: dict[int, np.ndarray]) -> None:
    """What 4D-Humans' HMR2 answers to each picture, by its name: arrays with a row a person."""
    frames = max(map(len, people.values()))
    content = {}
    for t in range(frames):
        here = [p for p in list(people)[:: 1 if t % 2 else -1] if t < len(people[p])]
        turned = matrices(np.stack([padded(people[p][t : t + 1], 24).reshape(24, 3) for p in here]))
        content[f"video/{t:06}.jpg"] = {
            "pred_smpl_params": {
                "global_orient": turned[:, :1],
                "body_pose": turned[:, 1:],
                "betas": np.zeros((len(here), 10), np.float32),
            },
            "pred_cam_t": np.array([(1.0, 3.0 * (p - max(people)), 0.0) for p in here]),
            "pred_keypoints_3d": np.zeros((len(here), 44, 3)),
        }
    joblib.dump(content, path)


def nlf(path: Path, people: dict[int, np.ndarray]) -> None:
    """The body's pose of SMPL-X beside that of all joints."""
    content = {}
    for person, pose in people.items():
        row = padded(pose, 55)
        content[person] = {
            "pose": row,
            "betas": np.zeros((len(pose), 10)),
            "trans": np.ones((len(pose), 3)),
            "joints3d": np.zeros((len(pose), 127, 3)),
            "global_orient": row[:, :3],
            "body_pose": row[:, 3:66],
        }
    joblib.dump(content, path)


def nlf_batch(path: Path, people: dict[int, np.ndarray]) -> None:
    """What NLF answers to a batch of pictures: lists with an array a frame, which has a row a person, in any order."""
    frames = max(map(len, people.values()))
    here = [[p for p in list(people)[:: 1 if t % 2 else -1] if t < len(people[p])] for t in range(frames)]
    content = {
        "boxes": [torch.zeros(len(those), 5) for those in here],
        "pose": [
            torch.from_numpy(np.concatenate([padded(people[p][t : t + 1], 24) for p in those]))
            for t, those in enumerate(here)
        ],
        "betas": [torch.zeros(len(those), 10) for those in here],
        "trans": [torch.tensor([[1.0, 3.0 * (p - max(people)), 0.0] for p in those]) for those in here],
        "joints3d": [torch.zeros(len(those), 24, 3) for those in here],
    }
    torch.save(content, path)


def transpose(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    turned = matrices(padded(pose, 24).reshape(len(pose), 24, 3))
    torch.save((torch.from_numpy(turned), torch.ones(len(pose), 3)), path)


def finedance(path: Path, people: dict[int, np.ndarray], contacts: bool = False) -> None:
    ((_, pose),) = people.items()
    six = matrices(padded(pose, 52).reshape(len(pose), 52, 3))[:, :, :2].reshape(len(pose), 312)
    with path.open("wb") as file:
        np.save(file, np.concatenate([np.ones((len(pose), 7 if contacts else 3), np.float32), six], axis=1))


def talkshow_data(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    content = {
        "root_orient": pose[:, 0],
        "body_pose_axis": pose[:, 1:].reshape(len(pose), 63),
        "transl": np.ones((len(pose), 3)),
        "jaw_pose": np.zeros((len(pose), 3)),
        "left_hand_pose": np.zeros((len(pose), 12)),
        "expression": np.zeros((len(pose), 100)),
        "betas": np.zeros(300),
        "width": 1280,
    }
    path.write_bytes(pickle.dumps(content))


@dataclass(frozen=True)
class Writer:
    """A way of writing files, and what is known of them."""

    write: Callable[..., None]
    ending: str
    source: str
    """How the reader's words for it begin."""
    family: str
    camera: bool = False
    many: bool = False
    """Whether there may be several people."""
    position: float | None = 1.0
    """Where the root of the last frame is, along the x axis [m]."""


def meshcapade(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            codecVersion=np.int32(2),
            smplVersion=np.int32(2),
            gender=np.int32(0),
            shapeParameters=np.zeros(10, np.float32),
            frameCount=np.int32(len(pose)),
            bodyTranslation=np.ones((len(pose), 3), np.float32),
            bodyPose=pose,
        )


def fit3d(path: Path, people: dict[int, np.ndarray]) -> None:
    ((_, pose),) = people.items()
    content = {
        "transl": np.ones((len(pose), 3)),
        "global_orient": matrices(pose[:, :1]),
        "body_pose": matrices(pose[:, 1:]),
        "betas": np.zeros((len(pose), 10)),
        "jaw_pose": matrices(np.zeros((len(pose), 1, 3))),
    }
    path.write_text(json.dumps({key: array.tolist() for key, array in content.items()}))


def mdm(path: Path, people: dict[int, np.ndarray]) -> None:
    """What it fits to one of the motions that it made up: 6D numbers are the first two rows of matrices."""
    ((_, pose),) = people.items()
    theta = matrices(padded(pose, 24).reshape(len(pose), 24, 3))[:, :, :2].reshape(len(pose), 24, 6)
    motion = np.zeros((25, 6, len(pose)))
    motion[:24], motion[24, :3] = theta.transpose(1, 2, 0), 1
    content = {
        "motion": motion,
        "thetas": motion[:-1],
        "root_translation": motion[-1, :3],
        "faces": np.zeros((4, 3)),
        "vertices": np.zeros((6, 3, len(pose))),
        "text": "a person turns",
        "length": len(pose),
    }
    with path.open("wb") as file:
        np.save(file, content)  # type: ignore[arg-type]


def egoallo(path: Path, people: dict[int, np.ndarray]) -> None:
    poses = np.stack(list(people.values()))
    turn = Rotation.from_euler("x", 90, degrees=True) * Rotation.from_rotvec(poses[:, :, 0].reshape(-1, 3))
    root = np.ones((*poses.shape[:2], 7))
    root[..., :4] = np.roll(turn.as_quat(), 1, axis=1).reshape(*poses.shape[:2], 4)
    body = np.roll(Rotation.from_rotvec(poses[:, :, 1:].reshape(-1, 3)).as_quat(), 1, axis=1)
    content = {
        "Ts_world_cpf": np.zeros((poses.shape[1], 7)),
        "Ts_world_root": root,
        "body_quats": body.reshape(*poses.shape[:2], 21, 4),
        "left_hand_quats": np.zeros((*poses.shape[:2], 15, 4)),
        "betas": np.zeros((*poses.shape[:2], 16)),
        "frame_nums": np.arange(poses.shape[1]),
        "timestamps_ns": np.arange(poses.shape[1], dtype=np.int64) * 33_333_333 + 10**15,
    }
    with path.open("wb") as file:
        np.savez(file, **content)


WRITERS: dict[str, Writer] = {
    "wham": Writer(wham, ".pkl", "WHAM", "smpl", many=True, position=0.5),
    "vibe": Writer(vibe, ".pkl", "VIBE", "smpl", camera=True, many=True, position=None),
    "phalp": Writer(phalp, ".pkl", "4D-Humans or PHALP", "smpl", camera=True, many=True, position=None),
    "tram": Writer(tram, ".npy", "TRAM", "smpl", camera=True),
    "romp": Writer(romp, ".npz", "ROMP or BEV", "smpl", camera=True, many=True),
    "pymaf": Writer(pymaf, ".pkl", "PyMAF-X", "smplx", camera=True, many=True, position=None),
    "gvhmr": Writer(gvhmr, ".pt", "GVHMR", "smplx"),
    "genmo": Writer(genmo, ".pt", "GENMO or GEM", "smplx"),
    "aist": Writer(aist, ".pkl", "AIST++", "smpl"),
    "prompthmr": Writer(prompthmr, ".pkl", "SMPL parameters of people", "smplx", many=True),
    "hybrik": Writer(hybrik, ".pk", "HybrIK", "smpl", camera=True),
    "slahmr": Writer(slahmr, ".npz", "SMPL parameters", "", many=True),
    "phc": Writer(phc, ".pkl", "SMPL parameters of people", "smpl", many=True),
    "emdb": Writer(emdb, ".pkl", "SMPL parameters", "smpl"),
    "interhuman": Writer(interhuman, ".pkl", "SMPL parameters", "", many=True),
    "glamr": Writer(glamr, ".pkl", "SMPL parameters of people", "smpl", many=True),
    "cliff": Writer(cliff, ".npz", "CLIFF", "smpl", camera=True, many=True),
    "frame_list": Writer(frame_list, ".pkl", "SMPL parameters, frame by frame", "smpl", camera=True),
    "multi_hmr": Writer(multi_hmr, ".pt", "SMPL parameters, frame by frame", "smplx", camera=True, many=True),
    "hmr2_pictures": Writer(hmr2_pictures, ".pkl", "SMPL parameters, frame by frame", "smpl", camera=True, many=True),
    "nlf": Writer(nlf, ".pkl", "SMPL parameters of people", "smplx", camera=True, many=True),
    "nlf_batch": Writer(nlf_batch, ".pt", "SMPL parameters", "smpl", camera=True, many=True),
    "transpose": Writer(transpose, ".pt", "SMPL's pose and place", "smpl"),
    "finedance": Writer(finedance, ".npy", "FineDance's rows", "smplx"),
    "talkshow_data": Writer(talkshow_data, ".pkl", "SMPL parameters", "smplx"),
    "meshcapade": Writer(meshcapade, ".smpl", "SMPL parameters", "smplx"),
    "mdm": Writer(mdm, ".npy", "MDM's or MoMask's SMPL parameters", "smpl"),
    "egoallo": Writer(egoallo, ".npz", "EgoAllo", "smplh", many=True),
    "fit3d": Writer(fit3d, ".json", "SMPL parameters", "smplx"),
    "smplx": Writer(smplx, ".npz", "SMPL parameters", "smplx"),
}
