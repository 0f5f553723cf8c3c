"""Exports a package's networks as one ONNX file, and asks it as a program without mrhubo would.

    pip install 'mrhubo[onnx]' onnxruntime
    python examples/09_onnx.py PACKAGE [OUT.onnx]

PACKAGE is the folder that `mrhubo fit` printed at its end. `mrhubo export --retargeter PACKAGE --to onnx --out FILE`
writes the same. The function `ask` needs ONNX Runtime and NumPy alone.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import onnxruntime

import mrhubo
from mrhubo.exporting import write_onnx

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


def ask(file: str, poses: np.ndarray) -> tuple[list[str], np.ndarray]:
    """The joints' names and angles (frames, joints) [rad] for poses (frames, 21, 3, 3)."""
    session = onnxruntime.InferenceSession(file)
    (angles,) = session.run(None, {"local_rotations": poses.astype(np.float32)})
    return json.loads(session.get_modelmeta().custom_metadata_map["joint_names"]), np.asarray(angles)


def main(package: str, out: str = "robot.onnx") -> None:
    """Writes the file, and compares its answers to a motion with the networks'."""
    retargeter = mrhubo.load(package)
    off = write_onnx(retargeter, Path(out))
    print(f"{out}: {Path(out).stat().st_size / 1e6:.1f} MB, {off:.0e} rad off PyTorch at most on poses of the prior")

    poses = mrhubo.read_motion(WAVE).local_TJ33
    names, angles = ask(out, poses.numpy())
    print(f"joints: {', '.join(names)}")
    print(f"{len(angles)} frames, {np.abs(angles - retargeter.predict(poses).numpy()).max():.0e} rad off at most")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
