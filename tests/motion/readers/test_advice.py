"""Files that are to be converted first."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

import mrhubo
from mrhubo.motion import NoMotion


def _zipped(name: str) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as archive:
        archive.writestr(name, "HIERARCHY")
    return written.getvalue()


_FILES = {
    "a robot's joints": (
        b"Frame,root_translateX,root_translateY,left_hip_pitch_joint_dof\n0,0,1,0.5\n",
        "human motion",
    ),
    "robot's joints": (b"time [s],left_knee_joint [rad],right_knee_joint [rad]\n0,0,1\n", "human motion"),
    "without a header": (b"0.1,-0.2,1e-3," * 12 + b"0.5\n" + b"0,0,0," * 12 + b"0.5\n", "first line"),
    "COLLADA": (b'<?xml version="1.0"?>\n<COLLADA xmlns="x">', "Blender"),
    "Master Motor Map": (b"<?xml version='1.0'?>\n<!-- KIT -->\n<MMM version='1.0'>\n<Motion name='walk'>", "c3d"),
    "web page": (b"<!DOCTYPE html><html><head><title>Sign in</title>", "downloaded"),
    "zip archive": (_zipped("clips/walk 01.bvh"), "unpack it"),
    "a table of Vicon": (b"Joints,,\r\n120,,\r\n,,Hips,,,\r\n", "BVH"),
    "HDF5": (b"\x89HDF\r\n\x1a\n" + bytes(64), "npz"),
    "workbook of Excel": (_zipped("[Content_Types].xml"), "CSV"),
    "FLV": (b"FLV\x01\x01\0\0\0\x09", "MP4"),
    "WMV": (b"\x30\x26\xb2\x75\x8e\x66\xcf\x11\xa6\xd9", "MP4"),
    r"\(MPEG\)": (b"\0\0\x01\xba\x44\0", "MP4"),
    "MPEG-TS": ((b"G" + bytes(187)) * 4, "MP4"),
    "AVCHD": ((bytes(4) + b"G" + bytes(187)) * 4, "MP4"),
    "GIF": (b"GIF89a\x01\0", "MP4"),
    r"\.asf": (b"# a comment\n:version 1.10\n:name VICON\n", "amc"),
}


@pytest.mark.parametrize("what", _FILES)
def test_what_to_do_is_said(what: str, tmp_path: Path) -> None:
    content, words = _FILES[what]
    path = tmp_path / "dance.bvh"
    path.write_bytes(content)
    with pytest.raises(NoMotion, match=f"{what}.*{words}"):
        mrhubo.read_motion(path)


@pytest.mark.parametrize(
    "start", [":root {\n  --blue: #00f;\n}\n", ":root{color:red}", ":root,\n:host { }", ":root:not(.a) {}"]
)
def test_a_style_sheet_is_no_skeleton(start: str, tmp_path: Path) -> None:
    (tmp_path / "style.css").write_text(start)
    with pytest.raises(NoMotion, match="is text that begins with ':root"):
        mrhubo.read_motion(tmp_path / "style.css")


def test_a_skeleton_beside_its_motion_is_no_motion_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "07.asf").write_text(":version 1.10\n")
    (tmp_path / "scene.dae").write_text("<COLLADA>")
    (tmp_path / "notes.json").write_text('{"title": "a dance"}')
    with pytest.raises(mrhubo.UserError, match="holds no motion file"):
        mrhubo.motion.load.motion_files(tmp_path)
