"""Which point of a body each keypoint is by its place in a set that is known.

Orders of the sets: COCO https://cocodataset.org/#format-data; OpenPose's BODY_25 and COCO-18
https://cmu-perceptual-computing-lab.github.io/openpose/web/html/doc/md_doc_02_output.html; MediaPipe
https://ai.google.dev/edge/mediapipe/solutions/vision/pose_landmarker; Human3.6M with 17 points
https://github.com/facebookresearch/VideoPose3D; SMPL https://smpl.is.tue.mpg.de; Halpe
https://github.com/Fang-Haoshu/Halpe-FullBody; Kinect 2 as in NTU RGB+D https://github.com/shahroudy/NTURGB-D; Azure
Kinect https://learn.microsoft.com/azure/kinect-dk/body-joints; MPI-INF-3DHP https://vcai.mpi-inf.mpg.de/3dhp-dataset;
CMU Panoptic http://domedb.perception.cs.cmu.edu; SPIN's https://github.com/nkolot/SPIN/blob/master/constants.py, of
which 4D-Humans keeps the first 44; the 45, 73, 127 and 144 of the package smplx https://github.com/vchoutas/smplx, of
SMPL, SMPL-H and SMPL-X; Stereolabs' ZED with 34 and 38 https://www.stereolabs.com/docs/body-tracking; Kinect 1
https://learn.microsoft.com/previous-versions/windows/kinect-1.8/jj131025(v=ieb.10), and as UTD-MHAD has it
https://personal.utdallas.edu/~kehtar/UTD-MHAD.html; NVIDIA Maxine
https://docs.nvidia.com/maxine/ar/latest/Appendix/B3DBodyPoseKeypointFormat.html; LSP
http://sam.johnson.io/research/lsp.html; KIT-ML as HumanML3D's authors have it
https://github.com/EricGuo5513/HumanML3D; MPII http://human-pose.mpi-inf.mpg.de. FreeMoCap and others put MediaPipe's
points of hands and face after those of the body, EasyMocap and SMPLify-X OpenPose's.
"""

from __future__ import annotations

from mrhubo.body.joints import JOINT_NAMES, SIDES

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
_AZURE = (
    "pelvis spine1 spine2 neck left_collar left_shoulder left_elbow left_wrist - - left_thumb right_collar "
    "right_shoulder right_elbow right_wrist - - right_thumb left_hip left_knee left_ankle left_foot right_hip "
    "right_knee right_ankle right_foot - nose left_eye left_ear right_eye right_ear"
)
_KINECT = (
    "left_shoulder left_elbow left_wrist - right_shoulder right_elbow right_wrist - left_hip left_knee left_ankle "
    "left_foot right_hip right_knee right_ankle right_foot"
)
_HALPE = f"{_COCO} - - - left_toe right_toe - - left_heel right_heel"


def _fingers(*places: int) -> str:
    """Fifteen joints of each hand's fingers, of which those at three places are knuckles of the index, the middle and
    the little finger, as in SMPL-H; or 21 points, as OpenPose has them.
    """
    count = 15 if places[0] == 0 else 21
    knuckles = dict(zip(places, ("index", "middle", "pinky"), strict=True))
    return " ".join(f"{side}_{knuckles[n]}" if n in knuckles else "-" for side in SIDES for n in range(count))


_SMPL_HANDS, _HANDS = _fingers(0, 3, 6), _fingers(5, 9, 17)
_SKIN = f"nose {_EYES_EARS} {_TOES_HEELS}{' -' * 10}"

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
        "SMPL-H": f"{' '.join(JOINT_NAMES)} {_SMPL_HANDS}",
        "SMPL-X": f"{' '.join(JOINT_NAMES)} - - - {_SMPL_HANDS}",
        "SMPL with points of the skin": f"{' '.join(JOINT_NAMES)} - - {_SKIN}",
        "SMPL-H with points of the skin": f"{' '.join(JOINT_NAMES)} {_SMPL_HANDS} {_SKIN}",
        "SMPL-X with points of the skin": f"{' '.join(JOINT_NAMES)} - - - {_SMPL_HANDS} {_SKIN}{' -' * 51}",
        "SMPL-X with points of the skin and the jaw": f"{' '.join(JOINT_NAMES)} - - - {_SMPL_HANDS} {_SKIN}{' -' * 68}",
        "OpenPose's BODY_25": _BODY_25,
        "OpenPose's BODY_25 with hands": f"{_BODY_25} {_HANDS}",
        "OpenPose's BODY_25 with hands and 51 of the face": f"{_BODY_25} {_HANDS}{' -' * 51}",
        "OpenPose's BODY_25 with hands and 68 of the face": f"{_BODY_25} {_HANDS}{' -' * 68}",
        "OpenPose's BODY_25 with hands and 70 of the face": f"{_BODY_25} {_HANDS}{' -' * 70}",
        "OpenPose's 15": f"nose - {_RIGHT_LEFT_ARMS} - {_RIGHT_LEG} {_LEFT_LEG}",
        "4D-Humans' 44": f"{_BODY_25}{' -' * 19}",
        "SPIN's 49": f"{_BODY_25}{' -' * 24}",
        "MPI-INF-3DHP": f"head_top neck {_RIGHT_LEFT_ARMS} {_RIGHT_LEG} {_LEFT_LEG} pelvis spine2 -",
        "Human3.6M with 32": f"pelvis {_RIGHT_LEG} - - {_LEFT_LEG} - - - spine2 - nose head_top - left_shoulder "
        "left_elbow left_wrist - - - - - right_shoulder right_elbow right_wrist - - - -",
        "CMU Panoptic": "neck nose pelvis left_shoulder left_elbow left_wrist left_hip left_knee left_ankle "
        "right_shoulder right_elbow right_wrist right_hip right_knee right_ankle left_eye left_ear right_eye right_ear",
        "CMU Panoptic's 15": "neck nose pelvis left_shoulder left_elbow left_wrist left_hip left_knee left_ankle "
        "right_shoulder right_elbow right_wrist right_hip right_knee right_ankle",
        "Azure Kinect": _AZURE,
        "ZED with 34": f"{_AZURE} left_heel right_heel",
        "ZED with 38": "pelvis spine1 spine2 spine3 neck nose left_eye right_eye left_ear right_ear left_collar "
        "right_collar left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist left_hip right_hip "
        "left_knee right_knee left_ankle right_ankle left_toe right_toe - - left_heel right_heel - - left_index "
        "right_index - - left_pinky right_pinky",
        "Kinect 1": f"pelvis spine2 - - {_KINECT}",
        "Kinect 1 from the head": f"head neck spine2 pelvis {_KINECT}",
        "Kinect 2": f"pelvis spine2 - - {_KINECT} - - - - -",
        "NVIDIA Maxine": "pelvis left_hip right_hip spine2 left_knee right_knee neck left_ankle right_ankle left_toe "
        "right_toe - - left_heel right_heel nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder "
        "left_elbow right_elbow left_wrist right_wrist left_pinky right_pinky - - left_index right_index - -",
        "Human3.6M without the nose": f"pelvis {_RIGHT_LEG} {_LEFT_LEG} spine2 - head_top left_shoulder left_elbow "
        "left_wrist right_shoulder right_elbow right_wrist",
        "MPII": "right_ankle right_knee right_hip left_hip left_knee left_ankle pelvis - neck head_top right_wrist "
        "right_elbow right_shoulder left_shoulder left_elbow left_wrist",
        "LSP": "right_ankle right_knee right_hip left_hip left_knee left_ankle right_wrist right_elbow right_shoulder "
        "left_shoulder left_elbow left_wrist neck head_top",
        "MPI-INF-3DHP with 28": "- - spine2 - pelvis neck - head_top left_collar left_shoulder left_elbow left_wrist - "
        "right_collar right_shoulder right_elbow right_wrist - left_hip left_knee left_ankle left_foot left_toe "
        "right_hip right_knee right_ankle right_foot right_toe",
        "KIT-ML": f"pelvis spine1 spine2 neck - {_RIGHT_LEFT_ARMS} {_RIGHT_LEG} right_foot right_toe {_LEFT_LEG} "
        "left_foot left_toe",
        "Halpe 26": _HALPE,
        "Halpe 136": f"{_HALPE}{' -' * 68} {_HANDS}",
        "MediaPipe": _MEDIAPIPE,
        "MediaPipe with hands": f"{_MEDIAPIPE}{' -' * 42}",
        "MediaPipe with hands and face": f"{_MEDIAPIPE}{' -' * 510}",
        "MediaPipe with hands, face and irises": f"{_MEDIAPIPE}{' -' * 520}",
        "COCO-WholeBody": f"{_COCO} {_TOES_HEELS}{' -' * 68} {_HANDS}",
    }.items()
}  # fmt: skip
"""Our names of the points of each set, in its order."""
