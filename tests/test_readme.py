"""The code that README and docs show runs as it stands, where it needs no files that a user brings."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import torch

from mrhubo.config import load_config


def blocks(path: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", path.read_text(), re.S)


@pytest.mark.parametrize("page", ["README.md", "docs/prior.md"])
def test_the_priors_code_runs(root: Path, page: str) -> None:
    (code,) = [block for block in blocks(root / page, "python") if "BodyPrior.open" in block]
    names: dict[str, object] = {}
    exec(code, names)
    pose = names["pose"]
    assert isinstance(pose, torch.Tensor) and pose.shape == (1, 21, 6) and bool(pose.isfinite().all())


def test_the_official_files_settings_are_keys(root: Path, tmp_path: Path) -> None:
    (settings,) = blocks(root / "docs" / "official-files.md", "yaml")
    robot = (root / "conf" / "nao.yaml").read_text().replace("../data", str(root / "data"))
    (tmp_path / "nao.yaml").write_text(f"{robot}\n{settings}")
    config = load_config(tmp_path / "nao.yaml")
    assert config.body.prior == "vposer" and config.body.betas == [0.3, -1.2]


def test_links_lead_somewhere(root: Path) -> None:
    for page in [root / "README.md", *sorted((root / "docs").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"
