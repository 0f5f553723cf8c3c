"""Which place on a body each marker is put on, by its label in the sets that laboratories use.

Labels have the side before them, `LASI`, `L_IAS`, `R.Elbow.Lat`, or behind. Sets: Vicon's Plug-in Gait
(https://help.vicon.com, Plug-in Gait Reference Guide), CMU's (http://mocap.cs.cmu.edu/markerPlacementGuide.pdf), KIT's
(https://motion-database.humanoids.kit.edu/marker_set), Qualisys' and others' that name bones as S. van Sint Jan does
(Color Atlas of Skeletal Landmark Definitions, 2007), OptiTrack's (https://docs.optitrack.com, Skeleton Marker Sets) and
those of OpenSim's models.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from mrhubo.body.joints import SIDES

_SIDED = {
    "front_head": "FHD FRONTHEAD FHEAD",
    "back_head": "BHD HEADBACK BACKHEAD BHEAD",
    "side_head": "HEAD HEADSIDE HED TEMPLE",
    "acromion": "SHO ACR ACROMION ACROMIUM SAE AC ACJ SHOULDER SHOULDERTOP SHD",
    "lateral_elbow": "ELB LEL ELBL ELBLAT ELBOW ELBOWLAT LELB LELBOW LATELBOW HLE LEP AEL ELBOWOUT LHE HEL LEE",
    "medial_elbow": "ELBM MEL ELBMED ELBOWMED MELB MELBOW MEDELBOW HME MEP ELBOWIN MHE HEM MEE MELBO",
    "thumb_wrist": "WRA RSP WTS WRISTIN FARADIUS RAD RADIUS RADIAL WRR WRISTRAD WRISTLAT LWRIST",
    "little_wrist": "WRB USP WPS WRISTOUT FAULNA ULN ULNA ULNAR WRU WRISTULN WRISTMED MWRIST",
    "wrist": "WRI WRIST WRT",
    "hand": "FIN HANDOUT HAND HM3 MCP3 FINGER",
    "thumb_knuckle": "HM2 HTS MCP2 HANDIN",
    "little_knuckle": "HM5 HPS MCP5",
    "front_pelvis": "ASI ASIS IAS FWT WAISTFRONT FRONTWAIST FRONTHIP FWST",
    "back_pelvis": "PSI PSIS IPS BWT WAISTBACK BACKWAIST BACKHIP BWST",
    "lateral_knee": "KNE FLE KNEE KNEELAT KNEEOUT KNEL LKNEE LFC LEPI LATKNEE KNELAT LKN KNL FEL LFE",
    "medial_knee": "KNM FME KNEEMED KNEEIN KNEM MKNE MKNEE MFC MEPI MEDKNEE KNEMED MKN FEM MFE",
    "lateral_ankle": "ANK FAL ANKLE ANKLELAT ANKLEOUT ANKL LANK LANKLE LMAL LM MAL LATANKLE ANKLAT LML",
    "medial_ankle": "ANM TAM ANKLEMED ANKLEIN ANKM MANK MANKLE MMAL MM MEDANKLE ANKMED MED MML",
    "heel": "HEE HEEL FCC CAL CALC CALCANEUS HL",
    "toe": "TOE FM2 MT2 MTP2 TOES TOETIP SMH MTP",
    "little_toe": "MT5 FM5 MTP5 5META TOEOUT VMH MTO",
    "big_toe": "MT1 FM1 MTP1 TOEIN FMH MTI",
}
_CENTRAL = {
    "back_neck": "C7 CV7 BACKTOP",
    "back_low": "T10 TV10 T8 TV8 T9 TV9 T11 TV11 T12 TV12 T7 TV7",
    "front_neck": "CLAV CLV SJN IJ JN JUG SUPRASTERNAL STRNTOP",
    "front_low": "STRN STER SXS PX XIPH XYPH STERNUM STRNLOW",
    "brow": "SGL GLAB GLABELLA FOREHEAD HEADFRONT",
    "sacrum": "SACR SAC SACRUM VSACRAL SACRAL S1 SV1",
}
_OF_NO_PLACE = ("STUDY", "MARKER", "MRK")
"""Words that say nothing of a place."""
_WAIST = re.compile(r"WAIST([LR])")
"""OptiTrack has the side within."""
_LONG = (("LATERAL", "LAT"), ("MEDIAL", "MED"), ("LEFT", "L"), ("RIGHT", "R"))


def _places() -> dict[str, str]:
    """Places by plain labels; for some places there are two labels in a set, of which the first is taken."""
    found: dict[str, str] = {label: place for place, labels in _CENTRAL.items() for label in labels.split()}
    for place, labels in _SIDED.items():
        for label in labels.split():
            for letter, side in zip("LR", SIDES, strict=True):
                found.setdefault(f"{letter}{label}", f"{side}_{place}")
    for place, labels in _SIDED.items():
        for label in labels.split():
            for letter, side in zip("LR", SIDES, strict=True):
                found.setdefault(f"{label}{letter}", f"{side}_{place}")
    return found


_PLACES = _places()
_NEEDED = {f"{side}_{place}" for side in SIDES for place in ("acromion", "front_pelvis")}


def marker_places(labels: Sequence[str]) -> dict[str, int]:
    """The places on a body that labels name, each by the first label that does.

    Returns:
        the place of the label in the list, by that on the body: `left_acromion`, `back_neck` ...
    """
    found: dict[str, int] = {}
    for at, label in enumerate(labels):
        place = _PLACES.get(_plain(label))
        if place is not None:
            found.setdefault(place, at)
    return found


def has_body(labels: Sequence[str]) -> bool:
    """Whether labels name the places of which a body is made: shoulders and the pelvis, front and back."""
    found = marker_places(labels).keys()
    back = {f"{side}_back_pelvis" for side in SIDES} <= found or "sacrum" in found
    return back and found >= _NEEDED


def _plain(label: str) -> str:
    """A label in capitals, without signs and words that say nothing, and without its person."""
    bare = label.rpartition(":")[2].upper()
    words = [word for word in re.findall(r"[A-Z0-9]+", bare) if word not in _OF_NO_PLACE]
    plain = _WAIST.sub(r"\1WAIST", "".join(words))
    for long, short in _LONG:
        plain = plain.replace(long, short)
    return plain
