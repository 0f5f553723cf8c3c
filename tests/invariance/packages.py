"""A package of the same robot written in another way, whose networks answer as the old ones do."""

from __future__ import annotations

import shutil
from pathlib import Path

import torch
import yaml
from torch import Tensor

from tests.chain import Motion, answer, load, new_package, read_tensors, write_tensors
from tests.invariance.rewrite import Change, rewrite, undo

CLOSE = 1e-3
"""Joint angles that differ by less [rad] are the same."""
PARTS = {"nao": ("L", "R"), "coman": ("L", "R"), "reachy": ("l_", "r_", "neck")}
"""How the names of the joints begin, of each branch of the networks."""


def joints_of(config: Path) -> list[str]:
    """The list `robot.joints` of a config."""
    return yaml.safe_load(config.read_text())["robot"]["joints"]


def answers_alike(
    package: Path, changed: Path, change: Change, motion: Motion, close: float = CLOSE, **settings: int
) -> None:
    """Asserts that two packages give the same motion [rad], once the change is undone, and say the same about it."""
    joints = joints_of(package / "config.yaml")
    before, after = load(package), load(changed)
    assert list(after.joint_names) == [change.joints[joints[i]] for i in change.order or []]
    expected, found = answer(before, motion, **settings), answer(after, motion, **settings)
    assert float(expected["q"].std(dim=0).mean()) > 20 * min(close, CLOSE), "it moves"
    found["q"] = undo(change, joints, found["q"])
    for name in ("q", "confidence", "phi"):
        torch.testing.assert_close(found[name], expected[name], atol=close, rtol=0, msg=name)
    torch.testing.assert_close(found["direction_error_deg"], expected["direction_error_deg"], atol=0.1, rtol=0)
    assert torch.equal(found["collision"], expected["collision"])


def changed_package(package: Path, change: Change, folder: Path) -> Path:
    """The package of the changed robot whose networks answer as the old ones did.

    Outputs are put into the new order. tanh is odd and mirrored limits have the opposite middle, so the last layer of a
    joint whose axis is negated is negated.
    """
    written = rewrite(package / "config.yaml", change, folder.with_name(f"{folder.name} robot"))
    for name in ("body_prior.safetensors", "skeleton.safetensors"):
        shutil.copy(package / name, written.parent)
    new_package(written, folder)
    robot = yaml.safe_load((package / "config.yaml").read_text())["robot"]["name"]
    tensors, told = read_tensors(package / "retargeter.safetensors")
    learnt = {key: told[key] for key in ("phi_threshold", "confidence")}
    header = {**read_tensors(folder / "retargeter.safetensors")[1], **learnt}
    old = joints_of(package / "config.yaml")
    new = [old[i] for i in change.order or range(len(old))]
    signs = torch.tensor([-1.0 if name in change.negated else 1.0 for name in new])
    places = torch.tensor([old.index(name) for name in new])
    limits = torch.stack([tensors[f"limited.{end}_N"] for end in ("lower", "upper")])[:, places] * signs
    tensors["limited.lower_N"], tensors["limited.upper_N"] = limits.amin(0), limits.amax(0)
    for part, start in enumerate(PARTS[robot]):
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
