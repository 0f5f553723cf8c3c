"""The first step of a fit: everything that a user can get wrong is checked, before any work."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch

from mrhubo.config import Config, fingerprint, places_named, to_plain, with_places
from mrhubo.errors import UserError
from mrhubo.evaluation import Motions, load_motions
from mrhubo.pairing import PairSetup, pose_settings
from mrhubo.retargeter import build_network
from mrhubo.robot.unsure import check_unsure
from mrhubo.runtime.folders import make_folders
from mrhubo.runtime.locations import default_tracking
from mrhubo.runtime.names import check_name


@dataclass
class Prepared(PairSetup):
    """A config whose every part has been checked, opened: robot, prior, motions, and the places of what is kept."""

    motions: Motions
    tracking_dir: Path
    """Folder of the tracking database, the packages, and unfinished fits."""

    @property
    def references_dir(self) -> Path:
        """Folder of the reference retargeter's answers."""
        return self.store.folder.parent / "reference"

    @property
    def fingerprint(self) -> str:
        """Of everything that decides the result of a fit."""
        plain = to_plain(self.config)
        for key in ("tracking", "evaluation", "body"):  # the checksums of prior and skeleton are in the store's header
            plain.pop(key)
        plain["robot"] = [pose_settings(self.config), self.config.robot.key_links]  # wherever the URDF lies
        for key in ("dir", "workers"):
            plain["pairs"].pop(key)
        clips = {motion.name: motion.checksum for motion in self.motions.all}
        velocity = self.body_map.robot.velocity_N.tolist()  # of the references, as the smoothness
        evaluation = [sorted(m.name for m in self.motions.validation), self.config.evaluation.smoothness, velocity]
        return fingerprint([plain, self.store.header, clips, evaluation])


@with_places
def prepare_pairs(config: Config, search: bool = False) -> PairSetup:
    """Opens everything that making pairs needs; the config stays as it is. `search`: the caller can do `robot.scale:
    search`.

    Raises:
        UserError: anything in the config, the URDF or the prior is wrong.
    """
    check_name("robot.name", config.robot.name)
    check_unsure(config.robot)
    if config.robot.scale == "search" and not search:
        raise UserError(
            "robot.scale: 'search' is done by mrhubo.fit alone, in one process; take what it found, config.yaml in its "
            "run, or 'manual' or 'auto'"
        )
    setup = PairSetup.open(config)
    if config.trainer.accelerator == "gpu" and not torch.cuda.is_available():
        raise UserError("trainer.accelerator: 'gpu' is asked for, but torch finds no CUDA device; use 'auto' or 'cpu'")
    return setup


@with_places
def prepare(config: Config, search: bool = False, split: bool = True) -> Prepared:
    """Opens everything that a fit will need; the config stays as it is. `search` as for `prepare_pairs`, `split` as for
    `load_motions`.

    Raises:
        UserError: anything in the config, the URDF, the prior or the motions is wrong.
    """
    setup = prepare_pairs(config, search)
    config, body_map = setup.config, setup.body_map
    build_network(config, body_map)
    motions = load_motions(config, body_map.skeleton, split)
    return Prepared(config, body_map, setup.prior, setup.store, motions, tracking_dir(config))


def make_places(setup: PairSetup, *more: Path) -> None:
    """Makes the folders that a command is going to write to, before any work.

    Args:
        setup: of pairs alone, or of a whole fit.
        more: folders in that of the tracking.

    Raises:
        UserError: one of them cannot be used.
    """
    folders = {"pairs.dir": [setup.store.folder]}
    if isinstance(setup, Prepared):
        kept = setup.tracking_dir
        folders["pairs.dir"].append(setup.references_dir)
        folders["tracking.dir"] = [kept / "fits", kept / "packages", kept / "artifacts", *more]
    with places_named(setup.config):
        make_folders(folders)


def tracking_dir(config: Config) -> Path:
    """Folder of the tracking database, the packages, and unfinished fits."""
    return config.tracking.dir or default_tracking()


def device_of(config: Config) -> torch.device:
    """The device that `trainer.accelerator` stands for."""
    return torch.device("cuda" if config.trainer.accelerator != "cpu" and torch.cuda.is_available() else "cpu")
