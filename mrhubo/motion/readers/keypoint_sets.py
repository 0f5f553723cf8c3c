"""Which point of a body each keypoint is: by its name, or by its place in a set that is known.

Orders of the sets: COCO https://cocodataset.org/#format-data; OpenPose's BODY_25 and COCO-18
https://cmu-perceptual-computing-lab.github.io/openpose/web/html/doc/md_doc_02_output.html; MediaPipe
https://ai.google.dev/edge/mediapipe/solutions/vision/pose_landmarker; Human3.6M with 17 points
https://github.com/facebookresearch/VideoPose3D; SMPL https://smpl.is.tue.mpg.de; Halpe
https://github.com/Fang-Haoshu/Halpe-FullBody; Kinect 2 as in NTU RGB+D https://github.com/shahroudy/NTURGB-D; Azure
Kinect https://learn.microsoft.com/azure/kinect-dk/body-joints; MPI-INF-3DHP https://vcai.mpi-inf.mpg.de/3dhp-dataset;
CMU Panoptic http://domedb.perception.cs.cmu.edu; SPIN's https://github.com/nkolot/SPIN/blob/master/constants.py, of
which 4D-Humans keeps the first 44; the 45 of the package smplx https://github.com/vchoutas/smplx. FreeMoCap and others
put MediaPipe's points of hands and face after those of the body.

Legend: F frames, K keypoints.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES, SIDES

_FACE = "nose left_eye right_eye left_ear right_ear"
_LIMBS = " ".join(f"left_{n} right_{n}" for n in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"))
_COCO = f"{_FACE} {_LIMBS}"
_RIGHT_LEFT_ARMS = "right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist"
_RIGHT_LEG, _LEFT_LEG = "right_hip right_knee right_ankle", "left_hip left_knee left_ankle"
_EYES_EARS = "right_eye left_eye right_ear left_ear"
_TOES_HEELS = "left_toe - left_heel right_toe - right_heel"
_BODY_25 = f"nose - {_RIGHT_LEFT_ARMS} - {_RIGHT_LEG} {_LEFT_LEG} {_EYES_EARS} {_TOES_HEELS}"
_MEDIAPIPE = (
    "nose - left_eye - - right_eye - left_ear right_ear - - left_shoulder right_shoulder left_elbow right_elbow "
    "left_wrist right_wrist left_pinky right_pinky left_index right_index left_thumb right_thumb left_hip right_hip "
    "left_knee right_knee left_ankle right_ankle left_heel right_heel left_toe right_toe"
)

# "-" is a point that is not used
SETS: dict[str, tuple[str, ...]] = {
    name: tuple(points.split())
    for name, points in {
        "COCO": _COCO,
        "Human3.6M": f"pelvis {_RIGHT_LEG} {_LEFT_LEG} spine2 - nose head_top left_shoulder left_elbow left_wrist "
        "right_shoulder right_elbow right_wrist",
        "OpenPose's COCO-18": f"nose - {_RIGHT_LEFT_ARMS} {_RIGHT_LEG} {_LEFT_LEG} {_EYES_EARS}",
        "SMPL's body": " ".join(JOINT_NAMES),
        "SMPL": f"{' '.join(JOINT_NAMES)} - -",
        "SMPL-H": f"{' '.join(JOINT_NAMES)}{' -' * 30}",
        "SMPL-X": f"{' '.join(JOINT_NAMES)}{' -' * 33}",
        "SMPL with points of the skin": f"{' '.join(JOINT_NAMES)} - - nose {_EYES_EARS} {_TOES_HEELS}"
        f"{' -' * 10}",
        "OpenPose's BODY_25": _BODY_25,
        "4D-Humans' 44": f"{_BODY_25}{' -' * 19}",
        "SPIN's 49": f"{_BODY_25}{' -' * 24}",
        "MPI-INF-3DHP": f"head_top neck {_RIGHT_LEFT_ARMS} {_RIGHT_LEG} {_LEFT_LEG} pelvis spine2 -",
        "Human3.6M with 32": f"pelvis {_RIGHT_LEG} - - {_LEFT_LEG} - - - spine2 - nose head_top - left_shoulder "
        "left_elbow left_wrist - - - - - right_shoulder right_elbow right_wrist - - - -",
        "CMU Panoptic": "neck nose pelvis left_shoulder left_elbow left_wrist left_hip left_knee left_ankle "
        "right_shoulder right_elbow right_wrist right_hip right_knee right_ankle left_eye left_ear right_eye right_ear",
        "Azure Kinect": "pelvis spine1 spine2 neck left_collar left_shoulder left_elbow left_wrist - - left_thumb "
        "right_collar right_shoulder right_elbow right_wrist - - right_thumb left_hip left_knee left_ankle left_foot "
        "right_hip right_knee right_ankle right_foot - nose left_eye left_ear right_eye right_ear",
        "Kinect 2": "pelvis spine2 - - left_shoulder left_elbow left_wrist - right_shoulder right_elbow right_wrist - "
        "left_hip left_knee left_ankle left_foot right_hip right_knee right_ankle right_foot - - - - -",
        "Halpe 26": f"{_COCO} - - - left_toe right_toe - - left_heel right_heel",
        "MediaPipe": _MEDIAPIPE,
        "MediaPipe with hands": f"{_MEDIAPIPE}{' -' * 42}",
        "MediaPipe with hands and face": f"{_MEDIAPIPE}{' -' * 510}",
        "MediaPipe with hands, face and irises": f"{_MEDIAPIPE}{' -' * 520}",
        "COCO-WholeBody": f"{_COCO} {_TOES_HEELS}{' -' * 110}",
    }.items()
}  # fmt: skip
"""Our names of the points of each set, in its order."""

_PARTS = {
    "shoulder": "shoulder sho shldr upperarm uparm", "elbow": "elbow elb forearm lowerarm", "wrist": "wrist wri",
    "hip": "hip upleg upperleg thigh", "knee": "knee kne lowerleg shin calf", "ankle": "ankle ank", "heel": "heel",
    "toe": "toe bigtoe footindex toes", "foot": "foot toebase ball", "index": "index indexfinger",
    "pinky": "pinky pinkyfinger little", "thumb": "thumb", "middle": "middle middlefinger", "ear": "ear", "eye": "eye",
    "collar": "collar clavicle",
}  # fmt: skip
_CENTRAL = {
    "pelvis": "pelvis root midhip hips hip", "spine2": "spine torso belly spinemid", "neck": "neck", "nose": "nose",
    "head_top": "headtop tophead top",
}  # fmt: skip
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_LEFT, _RIGHT = ("left", "l", "lft"), ("right", "r", "rgt")
_PROPORTIONS = (
    ("knee", "hip", 1.0), ("elbow", "shoulder", 0.83), ("shoulder", "hip", 0.75), ("trunk", "hip", 1.2),
    ("slant", "hip", 1.25),
)  # fmt: skip
"""Bones, by where they start, other bones, and their ratio (Winter, as in `mrhubo.motion.readers.tree.limbs`)."""
_BONES = tuple(
    (side, start, f"{side}_{start}", f"{side}_{end}")
    for side in SIDES
    for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
)
_TRUNK = (
    *((side, "trunk", f"{side}_shoulder", f"{side}_hip") for side in SIDES),
    *((side, "slant", f"{side}_shoulder", f"{other}_hip") for side, other in (SIDES, SIDES[::-1])),
    *(("", width, f"left_{width}", f"right_{width}") for width in ("shoulder", "hip")),
)
"""Ways between points that hardly change while people move: side, name, and the points."""


_DEVIATIONS = 1.4826
"""Standard deviations in a median distance from the median, which single wild frames do not change."""
NONSENSE = 0.2
"""From this misfit on points are no body in the order of a set: errors of 6 cm a point give 0.14, and a body's points
in an order that is another's 0.2 or more, but for one order in thirty."""
_HEAD_AWAY = 0.35
"""How far a head is from the lowest joint of its spine at least, as a share of the farthest point: in motions 0.41
to 0.47. Rotations of SMPL's joints, which may be laid out as points are, are hardly any in a spine."""
_FLABBY = 0.2
"""Half of the frames are farther from a bone's usual length than this share of it: of points drawn by chance."""


def our_name(name: str) -> str | None:
    """Our name of a point that somebody calls `LShoulder`, `left shoulder`, `RIGHT_FOOT_INDEX`; None where there is
    none.
    """
    bare = name.rpartition(":")[2].strip()
    plain = bare.lower().replace(" ", "_").replace("-", "_")
    if plain in KEYPOINT_NAMES:
        return plain
    words = [word.lower() for word in _WORD.findall(bare)]
    side = next((our for our, theirs in (("left", _LEFT), ("right", _RIGHT)) if set(words) & set(theirs)), None)
    rest = "".join(word for word in words if word not in (*_LEFT, *_RIGHT) and not word.isdigit())
    if side is None:
        central = next((our for our, theirs in _CENTRAL.items() if rest in theirs.split()), None)
        if central is not None or not rest or rest[0] not in "lr":
            return central
        side, rest = {"l": "left", "r": "right"}[rest[0]], rest[1:]
    part = next((our for our, theirs in _PARTS.items() if rest in theirs.split()), None)
    return None if part is None else f"{side}_{part}"


def by_names(names: Sequence[str]) -> dict[str, int]:
    """Our points among named ones, by place; feet where there are no ankles, as in Human3.6M, are the ankles."""
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        ours = our_name(name)
        if ours is not None:
            found.setdefault(ours, place)
    for side in SIDES:
        if f"{side}_ankle" not in found and f"{side}_foot" in found:
            found[f"{side}_ankle"] = found.pop(f"{side}_foot")
    return found


def fitting_sets(point_FK3: np.ndarray) -> list[tuple[float, str]]:
    """The sets of as many points, those that fit a body best first, each with how badly it fits: by how much bones
    change over time, differ from side to side, and from a body's proportions; 0 is perfect, 1 is nonsense.
    """
    fits = [
        (misfit({our: point_FK3[:, place] for place, our in enumerate(points) if our != "-"}), name)
        for name, points in SETS.items()
        if len(points) == point_FK3.shape[1]
    ]
    return sorted(fits)


def misfit(points: Mapping[str, np.ndarray]) -> float:
    """How badly named points (F, 3) fit a body; infinite where limbs are never seen whole, or are as long as
    chance has it.
    """
    found: list[float] = []
    if points.keys() >= {"spine1", "head"} and _is_short(points):
        return np.inf
    with np.errstate(all="ignore"):
        way = {
            (side, name): np.linalg.norm(points[start] - points[end], axis=-1)
            for side, name, start, end in (*_BONES, *_TRUNK)
        }
        seen = {key: length_F[np.isfinite(length_F) & (length_F > 0)] for key, length_F in way.items()}
        mean = {key: float(np.median(length_F)) for key, length_F in seen.items() if len(length_F)}
        spread = {key: float(np.median(np.abs(seen[key] - mean[key])) / mean[key]) for key in mean}
        bones = [spread[side, name] for side, name, *_ in _BONES if (side, name) in spread]
        if not bones or np.mean(bones) > _FLABBY:
            return np.inf
        found += [_DEVIATIONS * part for part in spread.values()]
        for name in ("shoulder", "elbow", "hip", "knee", "trunk", "slant"):
            if ("left", name) in mean and ("right", name) in mean:
                found.append(abs(float(np.log(mean["left", name] / mean["right", name]))))
        for side in SIDES:
            for name, other, ratio in _PROPORTIONS:
                if (side, name) in mean and (side, other) in mean:
                    found.append(abs(float(np.log(mean[side, name] / mean[side, other] / ratio))))
    return float(np.mean(np.minimum(found, 2.0)))


def _is_short(points: Mapping[str, np.ndarray]) -> bool:
    """Whether the head is too near to `spine1`, in the middle of the frames in which both are seen."""
    head_F = np.linalg.norm(points["head"] - points["spine1"], axis=-1)
    seen_F = np.isfinite(head_F)
    if not seen_F.any():
        return False
    way_FK = np.linalg.norm(np.stack([*points.values()], axis=1) - points["spine1"][:, None], axis=-1)[seen_F]
    return float(np.median(head_F[seen_F])) < _HEAD_AWAY * float(np.median(np.nanmax(way_FK, axis=1)))
