"""A robot that is written otherwise (names, order, signs, base) moves as it did: reference, networks, pairs."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import torch
import yaml
from torch import Tensor

from tests.chain import (
    ROOT,
    Motion,
    answer,
    cut_motion,
    load,
    new_package,
    optimise,
    pair,
    quietly,
    read_motion,
    read_tensors,
    write_tensors,
)
from tests.invariance.rewrite import Change, draw_change, rewrite, undo

ROBOTS = ("nao", "coman", "reachy")
PARTS = {"nao": ("L", "R"), "coman": ("L", "R"), "reachy": ("l_", "r_", "neck")}
"""How the names of the joints begin, of each branch of the networks."""
KINDS = ("names", "order", "signs", "base")
CLOSE = 1e-3
SMOOTH = 0.02


def config_of(robot: str) -> Path:
    return ROOT / "conf" / f"{robot}.yaml"


def joints_of(config: Path) -> list[str]:
    return yaml.safe_load(config.read_text())["robot"]["joints"]


pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Motion]:
    folder = tmp_path_factory.mktemp("motions")
    return {name: read_motion(cut_motion(name, folder, every=8)) for name in ("wave", "boxing")}


@pytest.fixture(scope="module", params=ROBOTS)
def optimised(request: pytest.FixtureRequest, motions: dict[str, Motion]) -> tuple[Path, dict[float, list[Tensor]]]:
    """A robot's config, and what the reference retargeter answers for it."""
    config = config_of(request.param)
    return config, optimise(config, motions.values(), (0, SMOOTH))


def test_the_reference_finds_the_same_motion(
    optimised: tuple[Path, dict[float, list[Tensor]]], motions: dict[str, Motion], tmp_path: Path
) -> None:
    """Whatever starts are drawn: their draws depend on the order of the joints and the signs.

    Each frame's optimum is the same. The search for a whole motion ends when a step lowers the cost by less than 3e-5
    of it, which leaves single frames some thousandths of a rad from the optimum, other ones from other starts.
    """
    config, expected = optimised
    change = draw_change(config, ROBOTS.index(config.stem), *KINDS)
    changed = optimise(rewrite(config, change, tmp_path), motions.values(), (0, SMOOTH))
    for smoothness, found in changed.items():
        for q_TN, expected_TN in zip(found, expected[smoothness], strict=True):
            away_T = (undo(change, joints_of(config), q_TN) - expected_TN).abs().amax(1)
            assert float(away_T.quantile(1.0 if smoothness == 0 else 0.9)) < CLOSE
            assert float(away_T.max()) < 10 * CLOSE


def test_names_alone_change_no_bit(
    optimised: tuple[Path, dict[float, list[Tensor]]], motions: dict[str, Motion], tmp_path: Path
) -> None:
    config, expected = optimised
    changed = rewrite(config, draw_change(config, 3, "names"), tmp_path)
    found = optimise(changed, motions.values(), (SMOOTH,))[SMOOTH]
    assert all(torch.equal(*both) for both in zip(found, expected[SMOOTH], strict=True))


@pytest.mark.parametrize("robot", ["nao", "reachy"])
@pytest.mark.parametrize("seed", [0, 1])
def test_networks_answer_the_same(robot: str, seed: int, motions: dict[str, Motion], tmp_path: Path) -> None:
    package = new_package(config_of(robot), tmp_path / "package", "model.hidden=24")
    change = draw_change(package / "config.yaml", seed, *KINDS)
    changed = change_package(package, change, PARTS[robot], tmp_path / "changed")
    before, after = load(package), load(changed)
    joints = joints_of(package / "config.yaml")
    assert list(after.joint_names) == [change.joints[joints[i]] for i in change.order or []]
    for motion in motions.values():
        expected, found = answer(before, motion), answer(after, motion)
        assert float(expected["q"].std(dim=0).mean()) > 0.02, "it moves"
        found["q"] = undo(change, joints, found["q"])
        for name in ("q", "confidence", "phi"):
            torch.testing.assert_close(found[name], expected[name], atol=CLOSE, rtol=0, msg=name)
        torch.testing.assert_close(found["direction_error_deg"], expected["direction_error_deg"], atol=0.1, rtol=0)
        assert torch.equal(found["collision"], expected["collision"])


def change_package(package: Path, change: Change, parts: tuple[str, ...], folder: Path) -> Path:
    """The package of the changed robot whose networks answer as the old ones did.

    Outputs are put into the new order. tanh is odd and mirrored limits have the opposite middle, so the last layer of a
    joint whose axis is negated is negated.
    """
    rewrite(package / "config.yaml", change, folder)
    for name in ("body_prior.safetensors", "skeleton.safetensors"):
        shutil.copy(package / name, folder)
    tensors, header = read_tensors(package / "retargeter.safetensors")
    old = joints_of(package / "config.yaml")
    new = [old[i] for i in change.order or range(len(old))]
    signs = torch.tensor([-1.0 if name in change.negated else 1.0 for name in new])
    places = torch.tensor([old.index(name) for name in new])
    limits = torch.stack([tensors[f"limited.{end}_N"] for end in ("lower", "upper")])[:, places] * signs
    tensors["limited.lower_N"], tensors["limited.upper_N"] = limits.amin(0), limits.amax(0)
    for part, start in enumerate(parts):
        mine = [[name for name in names if name.startswith(start)] for names in (old, new)]
        moved = torch.tensor([mine[0].index(name) for name in mine[1]])
        six = (6 * moved[:, None] + torch.arange(6)).flatten()
        mirrored = torch.tensor([-1.0 if name in change.negated else 1.0 for name in mine[1]])

        def alter(name: str, to: Tensor) -> None:
            tensors[name] = to.contiguous()

        for kind in ("weight", "bias"):
            pre, post = f"pre.parts.{part}.last.{kind}", f"post.parts.{part}.last.{kind}"
            alter(pre, tensors[pre][six])
            alter(post, tensors[post][moved] * (mirrored[:, None] if kind == "weight" else mirrored))
        first = f"post.parts.{part}.first.weight"
        alter(first, tensors[first][:, six])
    write_tensors(folder / "retargeter.safetensors", tensors, header)
    return folder


@pytest.mark.parametrize("robot", ["nao", "reachy"])
def test_pairs_of_a_renamed_robot_are_the_same_bits(robot: str, tmp_path: Path) -> None:
    changed = rewrite(config_of(robot), draw_change(config_of(robot), 4, "names"), tmp_path / "robot")
    settings = [
        "pairs.count=200", "pairs.reverse_share=0.5", "pairs.shard_size=100", "pairs.amortiser_steps=10",
        "pairs.fine_steps=3", "pairs.workers=1", "trainer.accelerator=cpu", "--quiet",
    ]  # fmt: skip
    found = []
    for config, folder in ((config_of(robot), tmp_path / "old"), (changed, tmp_path / "new")):
        quietly(pair, ["--config", str(config), *settings, f"pairs.dir={folder}"])
        paths = sorted(folder.rglob("*-000000.safetensors"))
        found.append({path.name: read_tensors(path)[0] for path in paths})
    old, new = found
    assert old.keys() == new.keys() and len(old) == 2
    for name, tensors in old.items():
        for key, tensor in tensors.items():
            assert torch.equal(new[name][key], tensor), f"{name}: {key}"
