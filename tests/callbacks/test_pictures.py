"""Pictures are made for every robot, one without shapes included, and differ where the poses differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.callbacks import Clip
from mrhubo.callbacks.pictures import Artist
from mrhubo.config import load_config
from mrhubo.motion import Motion
from mrhubo.pairing import make_filter
from mrhubo.robot import Robot, build_body_map


def bare(path: Path, folder: Path) -> Path:
    """The URDF without any shape."""
    from lxml import etree

    tree = etree.parse(str(path))
    for tag in ("visual", "collision"):
        for element in list(tree.getroot().iter(tag)):
            element.getparent().remove(element)
    tree.write(str(folder / "bare.urdf"))
    return folder / "bare.urdf"


@pytest.mark.parametrize("shapes", [True, False])
def test_key_poses_show_what_differs(root: Path, tmp_path: Path, shapes: bool) -> None:
    config = load_config(root / "conf" / "nao.yaml").robot
    robot = Robot(config.urdf if shapes else bare(config.urdf, tmp_path), config.joints)
    artist, prior = Artist(robot), BodyPrior.open()
    pose = prior.decode(torch.randn(3, 32, generator=torch.Generator().manual_seed(0)))
    q = robot.sample(3, torch.Generator().manual_seed(1))
    clip = Clip(Motion("clip", pose, 24.0, "a motion"), q)
    same, again = (np.asarray(artist.key_poses(clip, {"mrhubo": q}, count=2), float) for _ in range(2))
    other = np.asarray(
        artist.key_poses(clip, {"mrhubo": robot.sample(3, torch.Generator().manual_seed(2))}, count=2), float
    )
    assert np.array_equal(same, again)
    assert same.shape == other.shape and np.abs(same - other)[2 * same.shape[0] // 3 :].max() > 50


@pytest.mark.parametrize("name", ["nao", "reachy"])
def test_the_sheet_of_pairs(root: Path, name: str) -> None:
    body_map, prior = build_body_map(load_config(root / "conf" / f"{name}.yaml").robot), BodyPrior.open()
    generator = torch.Generator().manual_seed(0)
    pose = prior.decode(1.5 * torch.randn(30, 32, generator=generator))
    pairs = {"q": body_map.robot.sample(30, generator), "H": pose, "phi": prior.reconstruction_error(pose)}
    sheet = Artist(body_map.robot).pairs(pairs, make_filter(pairs["phi"], "linear", 1.0), prior, count=1)
    assert sheet.width > 600 and sheet.height > 500 and np.asarray(sheet).std() > 10
