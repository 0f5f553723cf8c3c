"""Thousands of accidents a reader: `python -m tests.fuzz --accidents 10000`.

The suite tries some dozens on each reader; this tries as many as one likes, prints a row a reader, and names the seed
of each that went wrong: an exception that is not a `UserError`, a message of more than one line, numbers that are not
finite, too much time or memory.
`--reader NAME --first SEED --accidents 1` repeats one.
"""

from __future__ import annotations

import argparse
import json
import pickle
import re
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import savemat

import mrhubo
from mrhubo.body.joints import REST_K3
from mrhubo.body.skeleton import KEYPOINT_NAMES, Skeleton
from mrhubo.motion import trim
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.robot_motion import FORMATS, write_robot_motion
from tests.files.bounded import bounded
from tests.motion import gltf_writer
from tests.motion.bvh_writer import Style, write_bvh
from tests.motion.damage import altered_words, damaged_by, read_or_refused
from tests.motion.fbx_writer import Manner, write_fbx
from tests.motion.marker_writer import c3d, qualisys, vicon
from tests.motion.readers import (
    estimator_files,
    simulated_files,
    test_amc,
    test_deepmimic,
    test_frame_lists,
    test_humanml,
    test_keypoints,
    test_motive,
    test_mvnx,
    test_nymeria,
    test_opensim,
    test_parameter_table,
    test_point_folders,
    test_point_table,
    test_pose_folders,
    test_sam3d_folders,
    test_soma_and_points,
    test_table_header,
    test_trc_file,
)
from tests.motion.readers.markers import test_convert, test_recording, test_segments
from tests.robot_motion.motions import standing
from tests.robot_motion.test_broken_files import robot_motion_read_or_refused

_MOTION = Path(__file__).resolve().parents[1] / "data/motions/wave.npz"
_FRAMES = 4
_SECONDS, _MEGABYTES = 10.0, 400.0
"""What a file of some frames may take at most."""


def _bvh(style: Style) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        whole = mrhubo.read_motion(_MOTION)
        path.write_text(write_bvh(trim(whole, end=(_FRAMES - 1) / whole.frame_rate), style))

    return write


def _fbx(manner: Manner) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        whole = mrhubo.read_motion(_MOTION)
        short = trim(whole, end=(_FRAMES - 1) / whole.frame_rate)
        write_fbx(short, Style(t_pose_first=True, fingers=False), manner, path)

    return write


def _gltf(manner: gltf_writer.Manner, is_text: bool = False) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        whole = mrhubo.read_motion(_MOTION)
        short = trim(whole, end=(_FRAMES - 1) / whole.frame_rate)
        parts = gltf_writer.write_gltf(short, Style(unit=1.0, fingers=False), manner)
        path.write_bytes(parts.gltf() if is_text else parts.glb())

    return write


def _acclaim(path: Path) -> None:
    """A motion and the skeleton beside it, of which one is at the path."""
    path.with_name("07.asf").write_text(test_amc.asf())
    path.with_name("07_01.amc").write_text(test_amc.amc([{"lradius": [2.0 * i]} for i in range(_FRAMES)]))


def _points() -> np.ndarray:
    local = mrhubo.read_motion(_MOTION).local_TJ33[:_FRAMES]
    found = dict(zip(KEYPOINT_NAMES, Skeleton().keypoints_and_rotations(local)[0].unbind(1), strict=True))
    head = found["head"].numpy()
    return np.stack([found[n].numpy() if n in found else head for n in SETS["COCO"]], axis=1)


def _points_json(path: Path) -> None:
    path.write_text(json.dumps({"names": SETS["COCO"], "fps": 30, "keypoints": _points().round(3).tolist()}, indent=0))


def _bones() -> dict[str, np.ndarray]:
    """Places of bones by their names."""
    ours, point_TK3 = SETS["COCO"], _points()
    return {
        theirs: point_TK3[:, ours.index(name)]
        for name, theirs in test_keypoints.skeleton_names().items()
        if name in ours
    }


def _take(path: Path) -> None:
    bones = {name: place_T3.round(3).tolist() for name, place_T3 in _bones().items()}
    frames = [
        {
            "timestamp": frame / 30,
            "joints": {name: {"position": places[frame], "rotation": [0, 0, 0, 1]} for name, places in bones.items()},
        }
        for frame in range(_FRAMES)
    ]
    path.write_text(json.dumps({"frames": frames}, indent=0))


def _ntu(path: Path) -> None:
    """One person, of whom COCO's points stand in for the joints."""
    rows = [" ".join(f"{x:.4f}" for x in point) + " 1 1 1 1 1 0 0 0 2" for frame in _points() for point in frame]
    frames = [rows[17 * t : 17 * t + 17] + rows[17 * t : 17 * t + 8] for t in range(_FRAMES)]
    path.write_text("\n".join([str(_FRAMES), *("\n".join(["1", "7" + " 1" * 9, "25", *x]) for x in frames)]) + "\n")


def _features(path: Path) -> None:
    rows = np.zeros((_FRAMES, 263))
    rows[:, 3], rows[:, 4:67] = 0.9, np.tile((REST_K3[1:22] + [0, 0.9, 0]).reshape(63), (_FRAMES, 1))
    np.save(path, rows)


def _robot_motion(kind: str) -> Callable[[Path], None]:
    return lambda path: write_robot_motion(standing(), path, kind)


def _estimator(name: str) -> Callable[[Path], None]:
    writer = estimator_files.WRITERS[name]
    return lambda path: writer.write(path, {1: estimator_files.made_up(_FRAMES, camera=writer.camera)})


_FRAME = re.compile(r"[^0-9]*0*2(?:[^0-9].*)?")
"""The name of the file of a folder that meets with accidents: that of the third frame, and of the first person in it."""


def _pose_folder(name: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        people = {person: estimator_files.made_up(_FRAMES, person) for person in (0, 1)}
        places = {person: np.tile([4.0 * person, 0.9, 3.0], (_FRAMES, 1)) for person in people}
        test_pose_folders.WRITERS[name][0](folder, people, places, range(_FRAMES))

    return write


def _openpose_folder(folder: Path) -> None:
    rows = [np.pad(point_K3, ((0, 0), (0, 1)), constant_values=1.0) for point_K3 in _points()]
    test_keypoints.openpose(folder, [[row, row + [3, 0, 0, 0]] for row in rows], list(range(_FRAMES)))


def _easymocap_points_folder(folder: Path) -> None:
    for frame, point_K3 in enumerate(_points()):
        people = [{"id": 3, "keypoints3d": np.pad(point_K3, ((0, 0), (0, 1)), constant_values=1.0).tolist()}]
        (folder / f"{frame:06}.json").write_text(json.dumps(people, indent=1))


def _points_folder(write: test_point_folders.Write) -> Callable[[Path], None]:
    def write_all(folder: Path) -> None:
        for frame in range(test_point_folders.FRAMES):
            write(folder, frame)

    return write_all


def _answers_folder(form: str) -> Callable[[Path], None]:
    return lambda folder: test_sam3d_folders.write(folder, form, second=False)


def _point_table(path: Path) -> None:
    rows = test_point_table.lines(test_point_table.places())
    path.write_text("\n".join(["frame,landmark_id,x,y,z,visibility", *rows]) + "\n")


def _rows(width: int) -> Callable[[Path], None]:
    return lambda path: np.save(path, test_humanml.rows(width).astype(np.float32))


def _deepmimic(path: Path) -> None:
    test_deepmimic.write(path, test_deepmimic.rows(_FRAMES))


def _mimickit(path: Path) -> None:
    simulated_files.write_mimickit(path, simulated_files.humanoid((0, 1, 0)))


def _parameter_table(path: Path) -> None:
    path.write_text(test_parameter_table.table(test_parameter_table.columns(0, "flat", 24), rows=[*range(_FRAMES)]))


FOLDERS: dict[str, Callable[[Path], None]] = {
    **{f"folder of {name}": _pose_folder(name) for name in test_pose_folders.WRITERS},
    "folder of OpenPose": _openpose_folder,
    "folder of points": _easymocap_points_folder,
    **{f"folder of points, {name}": _points_folder(write) for name, write in test_point_folders.ALONE.items()},
    **{f"folder of SAM 3D Body's {form}": _answers_folder(form) for form in ("data", "lists", "files")},
    **{f"folder of people, {name}": _points_folder(write) for name, write in test_point_folders.BOTH.items()},
}
"""What writes a good folder with a file a frame, a reader."""

READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "amass": ("damaged.npz", lambda path: path.write_bytes(_MOTION.read_bytes())),
    "bvh": ("damaged.bvh", _bvh(Style())),
    "bvh, positions": ("damaged.bvh", _bvh(Style(names="nameless", axes="random", positions=True, doubled=True))),
    "fbx": ("damaged.fbx", _fbx(Manner(own_axes=True, version=7500))),
    "fbx, not packed": ("damaged.fbx", _fbx(Manner(packed=False, bind_poses=True, skin=False))),
    "fbx, text": ("damaged", _fbx(Manner(is_text=True, own_axes=True, weighted=True))),
    "fbx of 2009": ("damaged.fbx", _fbx(Manner(version=6100))),
    "fbx of 2009, text": ("damaged", _fbx(Manner(version=6100, is_text=True))),
    "glb": ("damaged.glb", _gltf(gltf_writer.Manner(skin="a", method="CUBICSPLINE"))),
    "gltf": ("damaged", _gltf(gltf_writer.Manner(vrm="VRM", matrices=True), is_text=True)),
    "amc": ("07_01.amc", _acclaim),
    "asf": ("07.asf", _acclaim),
    "points.json": ("damaged.json", _points_json),
    "skeleton": ("damaged.skeleton", _ntu),
    "features": ("damaged.npy", _features),
    "nymeria": ("damaged.npz", lambda path: test_nymeria.write(path, *test_nymeria.body())),
    **{f"features, {width}": ("damaged.npy", _rows(width)) for width in test_humanml.ORDERS},
    "parameters, a line each": ("damaged.csv", _parameter_table),
    "clips.json": ("damaged.json", lambda path: path.write_text(json.dumps(test_frame_lists.clips(24)))),
    "deepmimic": ("damaged.json", _deepmimic),
    "opensim": ("damaged.mot", lambda path: path.write_text(test_opensim.text(test_opensim.rows({})))),
    "poselib": ("damaged.npy", lambda path: simulated_files.write_poselib(path, simulated_files.smpl())),
    "mimickit": ("damaged.pkl", _mimickit),
    "mimickit, smpl": ("damaged.pkl", lambda path: simulated_files.write_mimickit(path, simulated_files.smpl())),
    "protomotions, packed": ("damaged.pt", lambda path: simulated_files.write_packed(path, simulated_files.smpl())),
    "protomotions": ("damaged.motion", lambda path: simulated_files.write_protomotions(path, simulated_files.smpl())),
    "points, a line each": ("damaged.csv", _point_table),
    "mvnx": ("damaged.mvnx", lambda path: path.write_text(test_mvnx.mvnx(test_mvnx.subject()))),
    "motive": ("damaged.csv", lambda path: path.write_text(test_motive.motive())),
    "c3d": ("damaged.c3d", lambda path: path.write_bytes(c3d(*test_convert.marked()))),
    "c3d, segments": (
        "damaged.c3d",
        lambda path: path.write_bytes(c3d(np.empty((60, 0, 3)), [], segmented=test_segments.theia())),
    ),
    "qualisys": ("damaged.csv", lambda path: path.write_text(qualisys(*test_convert.marked()))),
    "vicon": ("damaged.csv", lambda path: path.write_text(vicon(*test_convert.marked()))),
    "trc": ("damaged.trc", lambda path: path.write_text(test_trc_file.trc(test_trc_file.places()))),
    "points.pkl": ("damaged.pkl", lambda path: path.write_bytes(pickle.dumps({"keypoints3d": _points()}))),
    "take": ("damaged.json", _take),
    "matlab": ("damaged.mat", lambda path: savemat(path, {"fps": 30.0, **_bones()})),
    "matlab, packed": ("damaged.mat", lambda path: savemat(path, {"fps": 30.0, **_bones()}, do_compression=True)),
    "recording": ("damaged.mat", lambda path: savemat(path, {"take": test_recording.recording()})),
    "table under two lines": ("damaged.csv", lambda path: path.write_text(test_table_header.spreadsheet())),
    "table of triples": ("damaged.csv", lambda path: path.write_text(test_table_header.total_capture())),
    "points by joint": ("damaged.pkl", lambda path: path.write_bytes(pickle.dumps({"fps": 30.0, **_bones()}))),
    "points.npy": ("damaged.npy", lambda path: np.save(path, _points())),
    **{name: (f"damaged{w.ending}", _estimator(name)) for name, w in estimator_files.WRITERS.items()},
    **{name: ("damaged", write) for name, write in test_soma_and_points.WRITERS.items()},
    **{f"robot's {name}": (f"damaged{row.ending}", _robot_motion(name)) for name, row in FORMATS.items() if row.ending},
}
"""The name of a file and what writes a good one, a reader."""


def _read(name: str, path: Path) -> None:
    if name in FOLDERS:
        read_or_refused(path.parent, names=(path.parent.name,))
    elif name.startswith("robot's "):
        robot_motion_read_or_refused(path)
    elif name == "asf":
        read_or_refused(path.with_name("07_01.amc"), names=("07_01", "07.asf"))
    else:
        read_or_refused(path)


def fuzz(name: str, first: int, accidents: int, folder: Path) -> tuple[float, list[str]]:
    """The longest time [s] that one of the accidents of seeds first, first + 1, ... took, and what went wrong."""
    if name in FOLDERS:
        FOLDERS[name](folder)
        path = min(file for file in folder.iterdir() if _FRAME.fullmatch(file.stem))
    else:
        file, write = READERS[name]
        path = folder / file
        write(path)
    good, text = (
        path.read_bytes(),
        not path.suffix or path.suffix in {".bvh", ".amc", ".asf", ".json", ".csv", ".skeleton", ".trc", ".mvnx"},
    )
    slowest, wrong = 0.0, []
    for seed in range(first, first + accidents):
        alter = text and seed % 2
        path.write_bytes(altered_words(seed, good) if alter else damaged_by(seed, good, good))
        start = time.process_time()
        try:
            if seed % 20 == 0:  # counting memory makes a reader some ten times slower
                with bounded(_MEGABYTES, _SECONDS * 3):
                    _read(name, path)
            else:
                _read(name, path)
                slowest = max(slowest, took := time.process_time() - start)
                assert took < _SECONDS, "too slow"
        except Exception as error:
            wrong.append(f"seed {seed}: {type(error).__name__}: {str(error)[:300]}")
    return slowest, wrong


def main() -> int:
    """The table; 1 where something went wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--accidents", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--reader", choices=[*READERS, *FOLDERS], action="append")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    failed = 0
    print(f"{'reader':24} {'accidents':>9} {'wrong':>6} {'slowest [s]':>12}")
    for name in given.reader or [*READERS, *FOLDERS]:
        with tempfile.TemporaryDirectory() as folder:
            slowest, wrong = fuzz(name, given.first, given.accidents, Path(folder))
        failed += len(wrong)
        print(f"{name:24} {given.accidents:9,} {len(wrong):6} {slowest:12.2f}", *wrong[:10], sep="\n  ", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
