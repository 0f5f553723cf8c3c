"""A new process reads what numba has kept without getting ready to compile, and can compile after that."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mrhubo.fast import FastRetargeter
from mrhubo.retargeter import Retargeter

pytest.importorskip("numba")


def test_a_kept_kernel_is_read_without_what_compiling_needs(
    make: Callable[[str], Retargeter], array: np.ndarray, tmp_path: Path
) -> None:
    nao = make("nao")
    nao.save_description(tmp_path)
    np.save(tmp_path / "pose.npy", array[3])
    script = (
        "import sys, numba, numpy, mrhubo\n"
        "numpy.save('q.npy', mrhubo.load_fast('runtime.safetensors', 'compiled')(numpy.load('pose.npy')).q)\n"
        "print('numba.np.arraymath' in sys.modules)\n"
        "print(numba.njit(lambda x: numpy.sqrt(x).sum())(numpy.array([4.0, 9.0])), 'numba.np.arraymath' in sys.modules)\n"
    )
    answer = FastRetargeter(nao.describe(), "compiled")(array[3])  # keeps what it compiles
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == "False\n5.0 True\n", done.stderr
    np.testing.assert_array_equal(np.load(tmp_path / "q.npy"), answer.q)
