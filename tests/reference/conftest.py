"""Robots, their retargeters, human poses made up and recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, build_body_map

ROBOTS = ("nao", "coman", "reachy")


@pytest.fixture(scope="module", autouse=True)
def _small_batches(one_thread: None) -> None:
    """Everything here."""


@pytest.fixture(scope="session")
def body_maps(root: Path) -> dict[str, BodyMap]:
    return {name: build_body_map(load_config(root / "conf" / f"{name}.yaml").robot) for name in ROBOTS}


@pytest.fixture(scope="session")
def retargeters(body_maps: dict[str, BodyMap]) -> dict[str, OptimizationRetargeter]:
    return {name: OptimizationRetargeter(body_map) for name, body_map in body_maps.items()}


@pytest.fixture(scope="session")
def cmu_poses(external_dir: Path) -> dict[str, Tensor]:
    """The eleven evaluation clips as local rotations (T, 21, 3, 3), 24 frames per second."""
    clips = {}
    for path in sorted((external_dir / "cmu" / "evaluation").glob("*.npz")):
        with np.load(path) as data:
            axis_angle = torch.from_numpy(data["pose_body"]).float().reshape(-1, 21, 3)
        clips[path.stem] = rotation.axis_angle_to_matrix(axis_angle)
    return clips


@pytest.fixture(scope="session")
def make_pose() -> Callable[..., Tensor]:
    """Function: local rotations (T, 21, 3, 3) from axis-angles (T, 3) [rad] by joint name; the other joints at rest."""

    def make(**axis_angles: Tensor) -> Tensor:
        whole = torch.zeros(len(next(iter(axis_angles.values()))), len(POSED_JOINT_NAMES), 3)
        for name, value in axis_angles.items():
            whole[:, POSED_JOINT_NAMES.index(name)] = value
        return rotation.axis_angle_to_matrix(whole)

    return make


@pytest.fixture(scope="session")
def random_pose(make_pose: Callable[..., Tensor]) -> Callable[[int, int], Tensor]:
    """Function of count and seed: poses (count, 21, 3, 3) with normally distributed axis-angles in chest, arms and head."""
    spread = {"spine2": 0.3, "neck": 0.3, "head": 0.3, "collar": 0.2, "shoulder": 0.7, "elbow": 0.7, "wrist": 0.7}

    def draw(count: int, seed: int) -> Tensor:
        generator = torch.Generator().manual_seed(seed)
        names = [n for n in POSED_JOINT_NAMES if n.split("_")[-1] in spread]
        return make_pose(**{n: spread[n.split("_")[-1]] * torch.randn(count, 3, generator=generator) for n in names})

    return draw
