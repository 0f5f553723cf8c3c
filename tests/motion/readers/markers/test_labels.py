"""Labels of the sets that laboratories use."""

from __future__ import annotations

import pytest

from mrhubo.motion.readers.markers.labels import has_body, marker_places
from tests.motion.marker_writer import PLUG_IN_GAIT, label_of

_SETS = {
    "Plug-in Gait": "LFHD LBHD C7 T10 CLAV STRN RBAK LSHO LUPA LELB LFRM LWRA LWRB LFIN LASI LPSI LTHI LKNE LTIB LANK"
    " LHEE LTOE",
    "CMU": "LFHD LBHD C7 T10 CLAV STRN RBAC LSHO LUPA LELB LFRM LWRA LWRB LFIN LFWT LBWT LTHI LKNE LSHN LANK LHEE LTOE LMT5",
    "KIT": "LFHD LBHD CLAV STRN C7 T10 LSHO LAEL LAOL LWTS LWPS LHTS LHPS LASI LPSI LKNE LANK LHEE LTOE LMT1 LMT5",
    "bones": "L_HEAD SGL CV7 TV8 SJN SXS L_SAE L_HLE L_HME L_RSP L_USP L_HM2 L_IAS L_IPS L_FLE L_FME L_FAL L_TAM L_FCC"
    " L_FM1 L_FM2 L_FM5",
    "OpenSim": "LACR C7 CLAV LLEL LMEL LFAradius LFAulna LASI LPSI LLFC LMFC LLMAL LMMAL LCAL LTOE LMT5",
    "OpenSim's gait": "Sternum L.Acromium V.Sacral L.ASIS L.Elbow.Lat L.Wrist.Lat L.Knee.Lat L.Knee.Med L.Ankle.Lat"
    " L.Heel L.Toe.Tip",
    "OptiTrack": "BackTop LShoulderTop LElbowOut LWristOut LWristIn LHandOut WaistLFront WaistLBack LKneeOut LAnkleOut"
    " LToeOut LToeIn LHeel",
    "OpenCap": "L.ASIS_study L.PSIS_study L_knee_study L_mknee_study L_ankle_study L_mankle_study L_toe_study"
    " L_calc_study C7_study L_shoulder_study L_lelbow_study L_melbow_study L_lwrist_study L_mwrist_study",
}  # fmt: skip
_NO_JOINTS = {"RBAK", "RBAC", "LUPA", "LFRM", "LTHI", "LTIB", "LSHN", "LAOL"}


def _both(labels: str) -> list[str]:
    """With those of the other side."""
    left = labels.split()
    right = ["R" + label[1:] if label[0] == "L" else label.replace("WaistL", "WaistR") for label in left]
    return [*left, *(label for label in right if label not in left)]


@pytest.mark.parametrize("name", _SETS)
def test_known_sets_have_a_body_and_every_label_a_place(name: str) -> None:
    labels = _both(_SETS[name])
    found = marker_places(labels)
    assert has_body(labels)
    assert len({*found.values()}) == len(found)
    unknown = {label for place, label in enumerate(labels) if place not in found.values()}
    assert unknown <= {*_NO_JOINTS, *(f"R{label[1:]}" for label in _NO_JOINTS)}
    for place, at in found.items():
        side = place.partition("_")[0]
        bare = labels[at].removeprefix("Waist")
        assert (side == "left") == (bare[0] == "L") and (side == "right") == (bare[0] == "R"), place
        if side in ("left", "right"):
            other = {"left": "right", "right": "left"}[side]
            assert f"{other}_{place.partition('_')[2]}" in found


def test_outer_and_inner_sides_are_told_apart() -> None:
    found = marker_places(["L_HME", "L_HLE", "LMKNE", "LKNE", "R.Ankle.Medial", "R.Ankle.Lateral", "RMMAL"])
    assert found == {
        "left_medial_elbow": 0, "left_lateral_elbow": 1, "left_medial_knee": 2, "left_lateral_knee": 3,
        "right_medial_ankle": 4, "right_lateral_ankle": 5,
    }  # fmt: skip


def test_a_person_before_the_label_and_small_letters_do_not_matter() -> None:
    assert marker_places(["Ann:lasi", "left asis", "RIGHT_PSIS"]) == {"left_front_pelvis": 0, "right_back_pelvis": 2}


@pytest.mark.parametrize("missing", ["LSHO", "RASI", "RPSI"])
def test_without_shoulders_and_pelvis_there_is_no_body(missing: str) -> None:
    labels = [
        label_of(f"{side}_{name}")
        for side in ("left", "right")
        for name in PLUG_IN_GAIT
        if name[:4] not in ("back", "fron")
    ]
    labels += ["LASI", "RASI", "LPSI", "RPSI"]
    assert has_body(labels) and not has_body([label for label in labels if label != missing])


def test_words_that_are_no_labels_have_no_place() -> None:
    assert not marker_places(["", "*12", "LKneeAngles", "LGroundReactionForce", "CentreOfMass", "RFEO", "PELP"])
