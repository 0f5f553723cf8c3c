"""Pictures are made for every robot, one without shapes included, and differ where the poses differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.evaluation import Clip
from mrhubo.motion import Motion
from mrhubo.pairing import make_filter
from mrhubo.robot import Robot, build_body_map
from mrhubo.view import save_gif
from mrhubo.view.pictures import GIF_RATE, Artist, liveliness


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
    pose = prior.decode_matrices(torch.randn(3, prior.latent, generator=torch.Generator().manual_seed(0)))
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
    pose = prior.decode(1.5 * torch.randn(30, prior.latent, generator=generator))
    pairs = {"q": body_map.robot.sample(30, generator), "H": pose, "phi": prior.reconstruction_error(pose)}
    sheet = Artist(body_map.robot).pairs(pairs, make_filter(pairs["phi"], "linear", 1.0), prior, count=1)
    assert sheet.width > 600 and sheet.height > 500 and np.asarray(sheet).std() > 10


def test_the_animation_is_short_whole_and_small(root: Path, tmp_path: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml").robot
    robot = Robot(config.urdf, config.joints)
    share = torch.linspace(0, 1, 120)[:, None]
    q = robot.lower_N + share * (robot.upper_N - robot.lower_N)
    pose = torch.eye(3).expand(120, 21, 3, 3)
    clip = Clip(Motion("clip", pose, 60.0, "a motion"), q)
    frames = Artist(robot).animation(clip, {"mrhubo": q}, seconds=0.5)
    assert len(frames) == 7, "both ends of half a second at 12 frames a second"
    assert len({frame.size for frame in frames}) == 1
    for frame in frames:
        pixels = np.asarray(frame.convert("L"))
        assert (pixels[:, [0, -1]] == 255).all() and (pixels[[0, -1]] == 255).all(), "nothing is cut off"
    moving = np.abs(np.asarray(frames[0], float) - np.asarray(frames[-1], float)).max(axis=(0, 2)) > 60
    width = len(moving)
    assert not moving[: width // 4].any() and moving[width // 2 :].any(), "the human stands, the robot moves"
    path = save_gif(frames, tmp_path / "clip.gif", GIF_RATE)
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size, gif.info["loop"]) == (7, frames[0].size, 0)
        assert gif.convert("RGB").getpixel((0, 0)) == (255, 255, 255)
    assert path.stat().st_size < 30_000 * len(frames)
    standing = Clip(clip.motion, q[:1].expand(120, -1))
    assert liveliness(clip) > liveliness(standing) == 0
