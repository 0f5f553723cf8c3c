"""What to do with files that hold human motion in a form that is not read here."""

from __future__ import annotations

import re

from mrhubo.motion.readers.content import Content

_BLENDER = "convert it to BVH, for instance in Blender: import it, then File > Export > Motion Capture (.bvh)"
SOLVE = "solve it for a skeleton first, and export that as BVH or FBX, or convert it to SMPL with MoSh++ or SOMA"
"""What to do with a recording of markers."""
_FILM = "convert it to MP4, by ffmpeg for instance: ffmpeg -i FILE film.mp4"
_ADVICE: tuple[tuple[str, str, str], ...] = (
    (r"\s*<\?xml.{0,400}<COLLADA|\s*<COLLADA", "a COLLADA file", _BLENDER),
    (r"PXR-USDC|#usda", "a USD file", _BLENDER),
    (
        r"\s*+(?:<\?xml[^>]{0,200}+>\s*+)?(?:<!--.{0,2000}?-->\s*+)*<MMM\b",
        "a motion of the Master Motor Map (KIT), in angles of a model that is not in it",
        "name the .c3d file of the same recording, or the one that AMASS has of it (.npz)",
    ),
    (r"\x89HDF", "an HDF5 file", "save its arrays as .npz, for instance by h5py and numpy.savez"),
    (r"FLV\x01", "a video (FLV)", _FILM),
    (r"\x30\x26\xb2\x75\x8e\x66\xcf\x11", "a video or a sound (WMV, WMA)", _FILM),
    (r"\x00\x00\x01\xba", "a video (MPEG)", _FILM),
    (r"G.{187}G.{187}G|.{4}G.{191}G.{191}G", "a video (MPEG-TS, AVCHD)", _FILM),
    (r"GIF8", "a moving picture (GIF)", _FILM),
    (r"BLENDER", "a Blender file", "export the skeleton by File > Export > Motion Capture (.bvh)"),
    (r"\xff\xfe|\xfe\xff", "text in UTF-16", "save it in UTF-8"),
    (
        r'\s*\{.{0,300}"(?:people|bodies)"\s*:\s*\[',
        "a single frame of OpenPose or CMU Panoptic",
        "name the folder that holds them all; points in a picture (pose_keypoints_2d) have to be lifted to three"
        " dimensions first, for instance with MMPose or MotionBERT",
    ),
    (r"Vocaloid Motion Data", "a VMD file of MikuMikuDance", f"play it on a model, and {_BLENDER}"),
    (r"%YAML.{0,400}AnimationClip:", "an animation clip of Unity", "export the character as BVH or FBX first"),
    (r"//Maya ASCII", "a scene of Maya", "export the skeleton as FBX"),
    (
        r"\s*(?:<!DOCTYPE html|<html)",
        "a web page",
        "it was downloaded in place of the file, perhaps as that needs a login",
    ),
    (
        r"PK\x03\x04.{26}(?:\[Content_Types\]\.xml|_rels/|docProps/|xl/)",
        "a workbook of Excel, or another document of Office",
        "save the table as CSV, with a header that names its columns",
    ),
    (
        r"PK\x03\x04.{26}[\w ./()-]{0,200}?\.(?:bvh|amc|asf|fbx|glb|c3d|trc|csv|json|usdc?|usda)",
        "a zip archive of files",
        "unpack it, and name the file in it",
    ),
    (
        r"[^\n]{0,4000}?(?:root_translate|_joint(?:_dof|_pos)?\b|_dof\b)[^\n]*+\n",
        "a table of a robot's joints",
        "name the human motion from which it was made; mrhubo.read_robot_motion reads tables that mrhubo wrote",
    ),
    (
        r"\s*+(?:[-+]?[0-9][0-9.eE+-]*+[ \t]*+[,;\t][ \t]*+){18,500}[-+]?[0-9][0-9.eE+-]*+[ \t\r]*+\n",
        "a table of numbers without a header",
        "a robot's, as Unitree's tools write them, are no human's; of points, the first line must name the columns",
    ),
    (
        r"\s*+(?:#[^\n]*+\n\s*+)*+:(?:version|name|units|documentation|root|bonedata)\b(?!\s*[{,:.\[])",
        "a skeleton (.asf) without a motion",
        "name the .amc file, and leave this one beside it",
    ),
)
"""How such files begin, what they are, and what to do."""


def advice(content: Content) -> str | None:
    """What a file is and what to do with it, for a sentence; None where there is nothing to say."""
    start = content.start.decode("latin1")
    for pattern, what, then in _ADVICE:
        if re.match(pattern, start, re.DOTALL):
            return f"is {what}, which is not read here; {then}"
    return None
