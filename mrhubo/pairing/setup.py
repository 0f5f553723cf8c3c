"""What pairs are made from, opened from a config: by a command, and again by each of its workers."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

from mrhubo.body import BodyPrior, build_skeleton, open_prior
from mrhubo.config import Config
from mrhubo.pairing.store import PairStore
from mrhubo.robot import BodyMap, build_body_map


@dataclass
class PairSetup:
    """Robot, prior and store of a config, checked."""

    config: Config
    body_map: BodyMap
    prior: BodyPrior
    store: PairStore

    @classmethod
    def open(cls, config: Config) -> PairSetup:
        """Opens the files that the config names. In its own config are the joints that are not held (`BodyMap.of`).

        Raises:
            UserError: anything in the config, the URDF or the prior is wrong.
        """
        prior = open_prior(config.body)
        body_map = build_body_map(config.robot, build_skeleton(config.body))
        config = _with_joints(config, body_map.robot.joint_names)
        return PairSetup(config, body_map, prior, PairStore.of(config, body_map, prior))


def _with_joints(config: Config, joints: Sequence[str]) -> Config:
    """The config with the joints that move alone: it is what is recorded, and what a package is made again from."""
    if list(joints) == list(config.robot.joints):
        return config
    config = copy.deepcopy(config)
    config.robot.joints = list(joints)
    config.robot.ranges = {name: ends for name, ends in config.robot.ranges.items() if name in joints}
    return config
