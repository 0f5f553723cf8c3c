"""Pairs on disk: a folder per pairing config, shards that are whole or absent, each dependent on (config, seed,
direction, index) only.

A forward pair starts from a random robot pose (MR.HuBo), a reverse pair from a human pose drawn from the prior; a shard
holds pairs of one direction.

The folder is named after the robot and the fingerprint of everything that decides the pairs, and each shard's header
repeats it, so that pairs of two configs never mix. How many pairs are wanted, and how many of them reverse, is not part
of it: more pairs reuse what is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config, fingerprint, to_plain
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.storage import read_some_tensors, read_tensors, write_tensors
from mrhubo.pairing.settings import pairing_settings
from mrhubo.robot import BodyMap
from mrhubo.runtime.locations import default_pairs

MEASURES = ("phi", "cost", "residual_m", "z_norm")
"""One number a pair: reconstruction error, as `pairs.phi` says; and of the pose that the inverse kinematics ended with,
before alignment, cost, mean keypoint distance [m], norm of z."""
SCHEMA = "mrhubo.pairs/5"
_NOT_IN_PAIRS = ("count", "reverse_share", "dir", "workers", "filter", "filter_k")
"""Keys of `pairs` that do not change what a shard holds."""
_NOT_IN_ROBOT = ("urdf", "key_links", "max_speed", "unsure", "balance")


def pose_settings(config: Config) -> dict[str, Any]:
    """`robot` settings that decide how robot and human poses correspond, not where files lie or what is measured."""
    used = {"manual": ("manual",), "search": ("manual", "search")}.get(config.robot.scale, ())
    unused = {"manual", "search"}.difference(used)
    return {k: v for k, v in to_plain(config.robot).items() if k not in (*_NOT_IN_ROBOT, *unused)}


def pairs_header(config: Config, body_map: BodyMap, prior: BodyPrior) -> dict[str, str]:
    """What decides the pairs: settings, seed, the robot's kinematics, the checksums of prior and skeleton."""
    pairs = {k: v for k, v in to_plain(pairing_settings(config)).items() if k not in _NOT_IN_PAIRS}
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

    def __init__(
        self, folder: Path, header: Mapping[str, str], count: int, reverse_share: float, shard_size: int, joints: int
    ) -> None:
        """`joints` is the number N of robot joints; every shard holds `shard_size` pairs, `count` of all are used."""
        self.folder = folder / f"{header['robot']}-{header['fingerprint']}"
        self.header, self.count, self.shard_size, self.joints = dict(header), count, shard_size, joints
        self.counts = {"forward": count - round(count * reverse_share), "reverse": round(count * reverse_share)}
        """Pairs of each direction that are used."""
        self._places = [
            (direction, index) for direction, used in self.counts.items() for index in range(-(-used // shard_size))
        ]
        self.shards = len(self._places)

    @classmethod
    def of(cls, config: Config, body_map: BodyMap, prior: BodyPrior) -> PairStore:
        """The store of a config's pairs, in `pairs.dir` or where pairs lie by default."""
        pairs, header = config.pairs, pairs_header(config, body_map, prior)
        folder = pairs.dir or default_pairs()
        return cls(folder, header, pairs.count, pairs.reverse_share, pairs.shard_size, len(config.robot.joints))

    @property
    def amortiser_path(self) -> Path:
        """File of the amortised solver of this config."""
        return self.folder / "amortiser.safetensors"

    def place(self, number: int) -> tuple[str, int]:
        """Direction and index of one shard, of those numbered 0 to `shards` - 1."""
        return self._places[number]

    def path(self, number: int) -> Path:
        """File of one shard."""
        direction, index = self.place(number)
        return self.folder / f"{direction}-{index:06d}.safetensors"

    def missing(self, numbers: Iterable[int] | None = None) -> list[int]:
        """Numbers (of the given ones, or of all) of shards to be made: absent, damaged or foreign ones."""
        numbers = range(self.shards) if numbers is None else numbers
        return [number for number in numbers if not self._is_intact(number)]

    def _is_intact(self, number: int) -> bool:
        try:
            self.read(number)
        except DamagedFile:
            return False
        return True

    def header_of(self, number: int) -> dict[str, str]:
        """What one shard's header must say."""
        direction, index = self.place(number)
        return {**self.header, "direction": direction, "index": str(index)}

    def write(self, number: int, tensors: Mapping[str, Tensor]) -> None:
        """Writes one shard atomically."""
        write_tensors(self.path(number), tensors, self.header_of(number))

    def read(self, number: int) -> dict[str, Tensor]:
        """One shard, checked.

        Raises:
            DamagedFile: it is missing, damaged, or was made for another config, seed, direction or index.
        """
        path = self.path(number)
        tensors, header = read_tensors(path)
        self._check_header(path, header, number)
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

    def read_measures(self, number: int) -> dict[str, Tensor]:
        """MEASURES (P,) of one shard, without the rest of it and unchecked against its checksum.

        Raises:
            DamagedFile: it is missing, truncated, or was made for another config, seed, direction or index.
        """
        path = self.path(number)
        tensors, header = read_some_tensors(path, MEASURES)
        self._check_header(path, header, number)
        return tensors

    def _check_header(self, path: Path, header: Mapping[str, str], number: int) -> None:
        if header != self.header_of(number):
            raise DamagedFile(f"{path}: was made for other settings than this config's")

    def read_all(self) -> dict[str, Tensor]:
        """The first `counts` pairs of each direction: q (P, N), R (P, N, 6), H (P, 21, 6), phi, cost, residual_m,
        z_norm (P,) and reverse (P,), true where a pair starts from the human.
        """
        return self._join(self.read)

    def read_all_measures(self, most_shards: int) -> dict[str, Tensor]:
        """MEASURES and reverse (P,); of more shards than `most_shards`, of that many, evenly spread.

        Raises:
            DamagedFile: a shard is missing, truncated, or was made for another config, seed, direction or index.
        """
        return self._join(self.read_measures, max(1, -(-self.shards // most_shards)))

    def _join(self, read: Callable[[int], dict[str, Tensor]], step: int = 1) -> dict[str, Tensor]:
        left, parts = dict(self.counts), []
        for number in range(0, self.shards, step):
            direction, _ = self.place(number)
            used = min(self.shard_size, left[direction])
            left[direction] -= used
            tensors = {name: tensor[:used] for name, tensor in read(number).items()}
            parts.append({**tensors, "reverse": torch.full((used,), direction == "reverse")})
        return {name: torch.cat([part[name] for part in parts]) for name in parts[0]}
