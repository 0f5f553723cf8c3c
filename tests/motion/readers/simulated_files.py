"""Writers of files as simulators of characters keep motions, for tests: of made-up motions, with skeletons of their own
forward kinematics.

Legend: T frames, N joints.
"""

from __future__ import annotations

import pickle
from collections import OrderedDict
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation

FRAMES = 40


@dataclass(frozen=True)
class Figure:
    """Joints, the root first: names, parents' places and where each is on its parent [m]; x forward, y left, z up."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offset_N3: np.ndarray


def humanoid(arms: tuple[float, float, float]) -> Figure:
    """AMP's, whose left arm points so at rest."""
    rows: list[tuple[str, str, Any]] = [("pelvis", "", (0, 0, 1)), ("torso", "pelvis", (0, 0, 0.236151))]
    rows.append(("head", "torso", (0, 0, 0.223894)))
    for limb, above, start, bones, way in (
        (("upper_arm", "lower_arm", "hand"), "torso", (-0.02405, 0.18311, 0.2435), (0.274788, 0.258947), arms),
        (("thigh", "shin", "foot"), "pelvis", (0, 0.084887, 0), (0.421546, 0.40987), (0, 0, -1)),
    ):
        for side, mirror in (("right", (1, -1, 1)), ("left", (1, 1, 1))):
            places = [np.array(start), *(np.array(way) * bone for bone in bones)]
            carriers = [above, *(f"{side}_{name}" for name in limb)]
            for name, place, carrier in zip(limb, places, carriers, strict=False):
                rows.append((f"{side}_{name}", carrier, place * mirror))
    names = tuple(name for name, _, _ in rows)
    parents = tuple(names.index(above) if above else -1 for _, above, _ in rows)
    return Figure(names, parents, np.array([place for _, _, place in rows], np.float64))


SMPL_BODIES = (
    "Pelvis L_Hip L_Knee L_Ankle L_Toe R_Hip R_Knee R_Ankle R_Toe Torso Spine Chest Neck Head L_Thorax L_Shoulder"
    " L_Elbow L_Wrist L_Hand R_Thorax R_Shoulder R_Elbow R_Wrist R_Hand"
).split()


def smpl() -> Figure:
    """SMPL's joints in the simulators' order."""
    legs, arms = ((-0.01, 0.07, -0.09), (0, 0.03, -0.38), (-0.04, -0.01, -0.4), (0.12, 0, -0.03)), (
        (-0.03, 0.08, 0.12), (-0.01, 0.09, 0.03), (-0.03, 0.26, -0.01), (0, 0.25, 0.01), (-0.01, 0.08, -0.01)
    )  # fmt: skip
    trunk = ((-0.03, 0, 0.11), (0, 0, 0.14), (0.03, 0, 0.05), (-0.04, 0, 0.21), (0.05, 0, 0.07))
    right = np.array([1, -1, 1])
    offsets = [(0, 0, 0), *legs, *(np.array(legs) * right), *trunk, *arms, *(np.array(arms) * right)]
    parents = (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 11, 14, 15, 16, 17, 11, 19, 20, 21, 22)
    return Figure(tuple(SMPL_BODIES), parents, np.array(offsets, np.float64))


def moves(figure: Figure, seed: int = 0, frames: int = FRAMES) -> tuple[np.ndarray, np.ndarray]:
    """Axis times angle of every joint in its parent's axes (T, N, 3), and where the root is (T, 3): somebody who walks
    on, turns, and moves all joints; knees and elbows bend about their own axes alone.
    """
    generator, phase_T1 = np.random.default_rng(seed), np.linspace(0, 6, frames)[:, None]

    def wave(size: int, reach: float) -> np.ndarray:
        way = generator.uniform(-reach, reach, size)
        return way * np.sin(generator.uniform(0.5, 1.5, size) * phase_T1 + generator.uniform(0, 6, size))

    turn_TN3 = np.zeros((frames, len(figure.names), 3))
    for place, name in enumerate(figure.names):
        bend_T1 = 0.8 + wave(1, 0.6)
        if "shin" in name or "Knee" in name:
            turn_TN3[:, place, 1:2] = bend_T1
        elif "lower_arm" in name or "Elbow" in name:
            hangs, is_left = figure.offset_N3[place, 2] < -0.1, figure.offset_N3[place, 1] > 0
            turn_TN3[:, place, 1 if hangs else 2] = (-1 if hangs or is_left else 1) * bend_T1[:, 0]
        elif "hand" not in name.lower():
            turn_TN3[:, place] = wave(3, 0.4)
    turn_TN3[:, 0] += [0, 0, 0.5]
    return turn_TN3, np.array([0.2, 0.1, 0.9]) + phase_T1 * [0.2, 0.05, 0.0]


def pose(figure: Figure, turn_TN3: np.ndarray, root_T3: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Places of joints by their names, in the figure's world, and how all are turned there (T, N, 3, 3)."""
    local_TN33 = Rotation.from_rotvec(turn_TN3.reshape(-1, 3)).as_matrix().reshape(*turn_TN3.shape, 3)
    places: list[np.ndarray] = []
    turns: list[np.ndarray] = []
    for place, parent in enumerate(figure.parents):
        above = turns[parent] if parent >= 0 else np.eye(3)
        places.append(places[parent] + turns[parent] @ figure.offset_N3[place] if parent >= 0 else root_T3)
        turns.append(above @ local_TN33[:, place])
    return dict(zip(figure.names, places, strict=True)), np.stack(turns, axis=1)


def quaternions(matrix_X33: np.ndarray) -> np.ndarray:
    """W last."""
    turn_X4 = Rotation.from_matrix(matrix_X33.reshape(-1, 3, 3)).as_quat()
    return turn_X4.reshape(*matrix_X33.shape[:-2], 4).astype(np.float32)


def poselib(figure: Figure, turn_TN3: np.ndarray, root_T3: np.ndarray, is_local: bool = True) -> OrderedDict[str, Any]:
    """As `SkeletonMotion.to_file` keeps it."""

    def arr(values: Any, kind: type) -> dict[str, Any]:
        return {"arr": np.asarray(values, kind), "context": {"dtype": np.dtype(kind).name}}

    local_TN33 = Rotation.from_rotvec(turn_TN3.reshape(-1, 3)).as_matrix().reshape(*turn_TN3.shape, 3)
    turn_TN33 = local_TN33 if is_local else pose(figure, turn_TN3, root_T3)[1]
    speed_TN3 = np.zeros(turn_TN3.shape)
    skeleton = [("node_names", list(figure.names)), ("parent_indices", arr(figure.parents, np.int32))]
    skeleton.append(("local_translation", arr(figure.offset_N3, np.float32)))
    return OrderedDict(
        rotation=arr(quaternions(turn_TN33), np.float32),
        root_translation=arr(root_T3, np.float32),
        global_velocity=arr(speed_TN3, np.float32),
        global_angular_velocity=arr(speed_TN3, np.float32),
        skeleton_tree=OrderedDict(skeleton),
        is_local=is_local,
        fps=60,
        __name__="SkeletonMotion",
    )


def write_poselib(path: Path, figure: Figure, seed: int = 0, is_local: bool = True) -> None:
    np.save(path, poselib(figure, *moves(figure, seed), is_local), allow_pickle=True)  # type: ignore[arg-type]


def mimickit(figure: Figure, turn_TN3: np.ndarray, root_T3: np.ndarray) -> dict[str, Any]:
    """As MimicKit's `Motion.save` keeps it; hinges of AMP's humanoid have one number, hands none."""
    columns = [root_T3]
    for place, name in enumerate(figure.names):
        if "shin" in name:
            columns.append(turn_TN3[:, place, 1:2])
        elif "lower_arm" in name:
            columns.append(turn_TN3[:, place, 2:])
        elif not name.endswith("_hand"):
            columns.append(turn_TN3[:, place])
    return {"loop_mode": 0, "fps": 30, "frames": np.concatenate(columns, axis=1).tolist()}


def write_mimickit(path: Path, figure: Figure, seed: int = 0) -> None:
    path.write_bytes(pickle.dumps(mimickit(figure, *moves(figure, seed))))


class StateConversion(Enum):
    """ProtoMotions', of its own class: in which order bodies are."""

    COMMON = "common"


def protomotions(figure: Figure, turn_TN3: np.ndarray, root_T3: np.ndarray) -> dict[str, Any]:
    """As a `.motion` of ProtoMotions has it."""
    places, turn_TN33 = pose(figure, turn_TN3, root_T3)
    place_TN3 = torch.tensor(np.stack(list(places.values()), axis=1), dtype=torch.float32)
    angles = torch.tensor(turn_TN3[:, 1:].reshape(len(turn_TN3), -1), dtype=torch.float32)
    return {
        "state_conversion": StateConversion.COMMON,
        "fps": 30,
        "rigid_body_pos": place_TN3,
        "rigid_body_rot": torch.tensor(quaternions(turn_TN33)),
        "rigid_body_vel": torch.zeros_like(place_TN3),
        "rigid_body_ang_vel": torch.zeros_like(place_TN3),
        "dof_pos": angles,
        "dof_vel": torch.zeros_like(angles),
    }


def write_protomotions(path: Path, figure: Figure, seed: int = 0) -> None:
    torch.save(protomotions(figure, *moves(figure, seed)), path)


def write_packed(path: Path, figure: Figure) -> None:
    torch.save(packed_protomotions(figure), path)


def packed_protomotions(figure: Figure, count: int = 3) -> dict[str, Any]:
    """As ProtoMotions packs several motions, each half as long again as the one before."""
    motions = [protomotions(figure, *moves(figure, seed, FRAMES + 20 * seed)) for seed in range(count)]
    lengths = torch.tensor([len(motion["dof_pos"]) for motion in motions])
    names = {"gts": "rigid_body_pos", "grs": "rigid_body_rot", "dps": "dof_pos"}
    return {
        **{name: torch.cat([motion[key] for motion in motions]) for name, key in names.items()},
        "motion_num_frames": lengths,
        "length_starts": torch.cumsum(lengths, 0) - lengths,
        "motion_dt": torch.full((count,), 1 / 30),
        "motion_files": tuple(f"clip{number}.npz" for number in range(count)),
    }
