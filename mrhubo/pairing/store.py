"""Pairs on disk: a folder per pairing config, shards that are whole or absent, each dependent on (config, seed,
index) only.

The folder is named after the robot and the fingerprint of everything that decides the pairs, and each shard's header
repeats it, so that pairs of two configs never mix. How many pairs are wanted is not part of it: more pairs reuse what
is there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config, fingerprint, to_plain
from mrhubo.robot import BodyMap
from mrhubo.storage import DamagedFile, read_some_tensors, read_tensors, write_tensors

MEASURES = ("phi", "cost", "residual_m", "z_norm")
"""One number a pair: reconstruction error, cost of the inverse kinematics, mean keypoint distance [m], norm of z."""
SCHEMA = "mrhubo.pairs/2"
_NOT_IN_PAIRS = ("count", "dir", "workers", "filter", "filter_k")
"""Keys of `pairs` that do not change what a shard holds."""
_NOT_IN_ROBOT = ("urdf", "key_links")


def pose_settings(config: Config) -> dict[str, Any]:
    """`robot` settings that decide how robot and human poses correspond, not where files lie or what is measured."""
    return {k: v for k, v in to_plain(config.robot).items() if k not in _NOT_IN_ROBOT}


def pairs_header(config: Config, body_map: BodyMap, prior: BodyPrior) -> dict[str, str]:
    """What decides the pairs: settings, seed, the robot's kinematics, the checksums of prior and skeleton."""
    plain = to_plain(config)
    pairs = {k: v for k, v in plain["pairs"].items() if k not in _NOT_IN_PAIRS}
    parts = pose_settings(config)
    header = {
        "schema": SCHEMA,
        "robot": config.robot.name,
        "kinematics": body_map.robot.description.kinematics,
        "prior_xxh3": prior.checksum,
        "skeleton_xxh3": body_map.skeleton.checksum,
        "seed": str(config.pairs.seed),
    }
    return {**header, "fingerprint": fingerprint([header, pairs, parts])}


class PairStore:
    """The shards of one pairing config."""

    def __init__(self, folder: Path, header: Mapping[str, str], count: int, shard_size: int, joints: int) -> None:
        """`joints` is the number N of robot joints; every shard holds `shard_size` pairs, `count` of all are used."""
        self.folder = folder / f"{header['robot']}-{header['fingerprint']}"
        self.header, self.count, self.shard_size, self.joints = dict(header), count, shard_size, joints
        self.shards = -(-count // shard_size)

    @classmethod
    def of(cls, config: Config, body_map: BodyMap, prior: BodyPrior) -> PairStore:
        """The store of a config's pairs; `pairs.dir` must be set."""
        assert config.pairs.dir is not None
        header = pairs_header(config, body_map, prior)
        return cls(config.pairs.dir, header, config.pairs.count, config.pairs.shard_size, len(config.robot.joints))

    @property
    def amortiser_path(self) -> Path:
        """File of the amortised solver of this config."""
        return self.folder / "amortiser.safetensors"

    def path(self, index: int) -> Path:
        """File of one shard."""
        return self.folder / f"pairs-{index:06d}.safetensors"

    def missing(self, indices: Iterable[int] | None = None) -> list[int]:
        """Indices (of the given ones, or of all) of shards to be made: absent, damaged or foreign ones."""
        return [index for index in (range(self.shards) if indices is None else indices) if not self._whole(index)]

    def _whole(self, index: int) -> bool:
        try:
            self.read(index)
        except DamagedFile:
            return False
        return True

    def write(self, index: int, tensors: Mapping[str, Tensor]) -> None:
        """Writes one shard atomically."""
        write_tensors(self.path(index), tensors, {**self.header, "index": str(index)})

    def read(self, index: int) -> dict[str, Tensor]:
        """One shard, checked.

        Raises:
            DamagedFile: it is missing, damaged, or was made for another config, seed or index.
        """
        path = self.path(index)
        tensors, header = read_tensors(path)
        self._check_header(path, header, index)
        size = self.shard_size
        shapes = {
            "q": (size, self.joints),
            "R": (size, self.joints, 6),
            "H": (size, len(POSED_JOINT_NAMES), 6),
            **dict.fromkeys(MEASURES, (size,)),
        }
        for name, shape in shapes.items():
            if name not in tensors or tuple(tensors[name].shape) != shape:
                found = tuple(tensors[name].shape) if name in tensors else "nothing"
                raise DamagedFile(f"{path}: '{name}' should have the shape {shape}, found {found}")
            if not bool(torch.isfinite(tensors[name]).all()):
                raise DamagedFile(f"{path}: '{name}' holds NaN or infinite numbers")
        return tensors

    def read_measures(self, index: int) -> dict[str, Tensor]:
        """MEASURES (P,) of one shard, without the rest of it and unchecked against its checksum.

        Raises:
            DamagedFile: it is missing, truncated, or was made for another config, seed or index.
        """
        path = self.path(index)
        tensors, header = read_some_tensors(path, MEASURES)
        self._check_header(path, header, index)
        return tensors

    def _check_header(self, path: Path, header: Mapping[str, str], index: int) -> None:
        if header != {**self.header, "index": str(index)}:
            raise DamagedFile(f"{path}: was made for other settings than this config's")

    def read_all(self) -> dict[str, Tensor]:
        """The first `count` pairs: q (P, N), R (P, N, 6), H (P, 21, 6), phi, cost, residual_m, z_norm (P,)."""
        parts = [self.read(index) for index in range(self.shards)]
        return {name: torch.cat([part[name] for part in parts])[: self.count] for name in parts[0]}
