"""What a package needs of the config that its retargeter was made with."""

from __future__ import annotations

import copy
from pathlib import Path

from mrhubo.config import Config, to_yaml


def portable_settings(config: Config, urdf: str, prior: str, skeleton: str) -> str:
    """What loading needs of the config, as YAML whose only paths are the files beside it, whose names are given.

    How pairs were made and the network was trained is in the run (`run_id`); a package outlives changes of those keys.
    """
    config = copy.deepcopy(config)
    config.robot.urdf = Path(urdf)
    config.body.prior_path, config.body.model_path, config.body.betas = Path(prior), Path(skeleton), []
    return to_yaml({"robot": config.robot, "body": config.body, "model": config.model})
