"""A motion holds NumPy's arrays or PyTorch's tensors, and gives both."""

from __future__ import annotations

import dataclasses
import pickle
import subprocess
import sys

import numpy as np
import torch

from mrhubo.motion import Motion

POSES = np.random.default_rng(0).normal(size=(5, 21, 3, 3)).astype(np.float32)


def test_arrays_and_tensors_share_their_numbers() -> None:
    motion = Motion.of(
        name="a", local_TJ33=POSES.copy(), frame_rate=30.0, root_position_T3=np.zeros((5, 3), np.float32)
    )
    assert len(motion) == 5 and motion.arrays.root_rotation_T33 is None and motion.root_rotation_T33 is None
    assert isinstance(motion.local_TJ33, torch.Tensor) and motion.local_TJ33 is motion.local_TJ33
    motion.local_TJ33[0] = 7.0
    assert (motion.arrays.local_TJ33[0] == 7.0).all()
    assert motion.root_position_T3 is not None and motion.root_position_T3.shape == (5, 3)


def test_of_tensors_or_arrays_it_is_the_same_motion() -> None:
    one, other = Motion("a", torch.from_numpy(POSES), 30.0), Motion.of(name="a", local_TJ33=POSES, frame_rate=30.0)
    assert one.checksum == other.checksum != Motion("a", torch.from_numpy(POSES), 31.0).checksum
    assert one.changed(name="b").local_TJ33 is one.local_TJ33 and one.changed(name="b").name == "b"
    for found in (pickle.loads(pickle.dumps(other)), dataclasses.replace(other, description="x")):
        assert found.checksum == one.checksum and isinstance(found.local_TJ33, torch.Tensor)


def test_a_motion_without_pytorch() -> None:
    script = (
        "import sys; sys.modules['torch'] = None\n"
        "import numpy; from mrhubo.motion import Motion, mirror, resample, trim\n"
        "motion = Motion.of(name='a', local_TJ33=numpy.tile(numpy.eye(3, dtype='f4'), (9, 21, 1, 1)), frame_rate=8.0)\n"
        "motion = mirror(trim(resample(motion, 16.0), 0.5, 0.75))\n"
        "assert len(motion) == 5 and motion.checksum, len(motion)\n"
        "try: motion.local_TJ33\n"
        "except ImportError: sys.exit(7)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 7, done.stderr
