"""A package answers on a robot's computer as it does where everything is installed. Called by `.ci/environments`.

check_runtime.py make PACKAGE ANSWER.npz       an untrained package, and its answer
check_runtime.py ask PACKAGE ANSWER.npz        its answer, in an environment without what training needs
check_runtime.py compare ANSWER.npz ANSWER.npz
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np

ABSENT = ("lightning", "mlflow", "matplotlib", "optuna", "omegaconf", "pandas", "psutil")


def make(package: str, answer: str) -> None:
    """Writes an untrained package for NAO and its answer."""
    import torch

    from mrhubo.body import BodyPrior
    from mrhubo.config import load_config
    from mrhubo.config.shipped import shipped_root
    from mrhubo.retargeter import Retargeter, build_network
    from mrhubo.robot import build_body_map

    config = load_config(shipped_root() / "conf" / "nao.yaml", ["model.hidden=16"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    made.save(Path(package), {})
    _answer(package, answer)


def ask(package: str, answer: str) -> None:
    """Writes the package's answer; nothing that only training needs is there, so nothing can have been used."""
    present = [name for name in ABSENT if importlib.util.find_spec(name)]
    assert not present, f"requirements/runtime.txt brings {present}"
    _answer(package, answer)


def _answer(package: str, answer: str) -> None:
    import mrhubo
    from mrhubo.config.shipped import shipped_root

    result = mrhubo.load(package)(mrhubo.read_motion(shipped_root() / "data" / "motions" / "wave.npz"))
    result.save(answer)
    result.save(Path(answer).with_suffix(".csv"))


def compare(here: str, there: str) -> None:
    """The two answers are the same to float32's rounding."""
    with np.load(here, allow_pickle=False) as first, np.load(there, allow_pickle=False) as second:
        assert set(first) == set(second)
        for name in ("q", "confidence", "phi"):
            np.testing.assert_allclose(second[name], first[name], atol=1e-4)
        print(f"{len(first['q'])} frames of {len(first['joint_names'])} joints, the same in both environments")


if __name__ == "__main__":
    {"make": make, "ask": ask, "compare": compare}[sys.argv[1]](*sys.argv[2:])
