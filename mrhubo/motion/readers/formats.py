"""The table of formats: which reader takes a file, told by what is in it and never by its ending."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.advice import advice
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.frame_files import frame_files
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.repeats import fill_repeats


@dataclass(frozen=True)
class Format:
    """A kind of file and who reads it; a reader is imported when a file may be its own."""

    name: str
    """For a sentence that lists what is read."""
    module: str
    """In `mrhubo.motion.readers`."""
    recogniser: str
    """A function in it, of a `Content`: whether a file is of this kind; does not raise."""
    reader: str
    """A function in it, of a path and options, that gives a `Motion`; raises a UserError that names the path where the
    file is bad.
    """
    endings: tuple[str, ...]
    """The endings, in small letters, of files in a folder that are of this kind or damaged."""

    def recognises(self, content: Content) -> bool:
        """Whether a file is of this kind."""
        return getattr(self._imported(), self.recogniser)(content)

    def read(self, path: Path, options: ReadOptions) -> Motion:
        """Reads a file of this kind.

        Raises:
            UserError: the file is bad.
        """
        return getattr(self._imported(), self.reader)(path, options)

    def _imported(self) -> ModuleType:
        return importlib.import_module(f"mrhubo.motion.readers.{self.module}")


_PYTHON = (".pkl", ".pickle", ".joblib", ".pt", ".pth", ".npy", ".motion", ".mat")

FORMATS: tuple[Format, ...] = (
    Format("AMASS and SMPL-family .npz", "amass", "is_amass", "read_amass", (".npz",)),
    Format("BVH", "bvh", "is_bvh", "read_bvh", (".bvh",)),
    Format("FBX", "scene.fbx", "is_fbx", "read_fbx", (".fbx",)),
    Format("glTF and VRM", "scene.gltf", "is_gltf", "read_gltf", (".glb", ".gltf", ".vrm", ".vrma")),
    Format("Xsens' MVNX", "mvnx", "is_mvnx", "read_mvnx", (".mvnx",)),
    Format("skeletons of OptiTrack Motive (.csv)", "scene.motive", "is_motive", "read_motive", ()),
    Format("markers, segments and joints in C3D", "markers.convert", "is_c3d", "read_c3d", (".c3d",)),
    Format("markers in tables of Qualisys (.tsv)", "markers.tables", "is_qualisys", "read_qualisys", ()),
    Format("markers in tables of Vicon (.csv)", "markers.tables", "is_vicon", "read_vicon", ()),
    Format("ASF/AMC", "amc", "is_amc", "read_acclaim", (".amc",)),
    Format("NTU RGB+D's .skeleton", "kinect_text", "is_skeleton", "read_skeleton", (".skeleton",)),
    Format("keypoints, SMPL parameters and DeepMimic's motions in JSON", "json_file", "is_json", "read_json", ()),
    Format("SMPL parameters in tables (.csv)", "parameter_table", "is_parameter_table", "read_parameter_table", ()),
    Format("keypoints in tables (.csv)", "keypoint_table", "is_table", "read_table", ()),
    Format("keypoints in tables with a line a point", "point_table", "is_point_table", "read_point_table", ()),
    Format("joints in TRC", "trc_file", "is_trc", "read_trc", (".trc",)),
    Format("angles of OpenSim (.mot, .sto)", "scene.opensim", "is_opensim", "read_opensim", (".mot",)),
    Format("keypoints (.npy, .npz)", "keypoints", "is_keypoints", "read_keypoints", ()),
    Format("videos (MP4, MOV, MKV, WebM, AVI)", "video", "is_video", "read_video", ()),
    # the last row: whatever else holds arrays in dictionaries
    Format("what an estimator of human pose writes", "estimators", "is_container", "read_estimated", _PYTHON),
)
"""The first row that recognises a file reads it."""
_FOLDERS = {
    "points": ("frame_folders", "read_frames"),
    "poses": ("pose_folders", "read_pose_files"),
    "others": ("point_folders", "read_point_files"),
    "answers": ("sam3d_folders", "read_sam3d_files"),
}
"""The module and its reader of folders with a file a frame, by what is in those."""


def find_format(content: Content) -> Format | None:
    """The row of the table that reads a file; None where there is none."""
    return next((row for row in FORMATS if row.recognises(content)), None)


def read_any(path: Path, options: ReadOptions) -> Motion:
    """Reads a motion by whichever reader recognises it; of a folder, if that has a JSON file a frame.

    Raises:
        NoMotion: nobody does; says what the file is.
        UserError: whoever does finds it bad.
    """
    if (frames := frame_files(path)) is not None:
        name, reader = _FOLDERS[frames.kind]
        module = importlib.import_module(f"mrhubo.motion.readers.{name}")
        return fill_repeats(getattr(module, reader)(path, frames, options))
    content = Content.open(path)
    row = find_format(content)
    if row is None:
        expected = ", ".join(row.name for row in FORMATS)
        refusal = NoMotion(
            f"{path}: is {content.described}, and no human motion that is read here; expected one of: {expected}"
            " (docs/formats.md says how each is laid out)"
        )
    else:
        try:
            return fill_repeats(row.read(path, options))
        except NoMotion as error:  # a reader may take a file for its own that is none: JSON of anything with joints
            refusal = error
    if (what_to_do := advice(content)) is not None:
        raise NoMotion(f"{path}: {what_to_do}") from refusal
    raise refusal
