"""Where a training goes on from."""

from __future__ import annotations

from pathlib import Path

import lightning
import torch

from mrhubo.config import load_config
from mrhubo.fitting.module import RetargetModule
from mrhubo.fitting.training import _start
from mrhubo.retargeter import build_network
from mrhubo.robot import build_body_map
from mrhubo.runtime.progress import Reporter


class Heard(Reporter):
    """Keeps what is said."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def say(self, text: str) -> None:
        self.said.append(text)


def test_a_checkpoint_of_another_layout_is_passed_over_with_a_sentence(root: Path, tmp_path: Path) -> None:
    """As an earlier version, or another network, left one."""
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=8"])
    body_map = build_body_map(config.robot)
    module = RetargetModule(build_network(config, body_map), config.trainer)
    last, report = tmp_path / "last.ckpt", Heard()
    assert _start(tmp_path, module, report) is None and report.said == []
    config.model.hidden = 16
    other = RetargetModule(build_network(config, body_map), config.trainer)
    torch.save({"state_dict": other.state_dict(), "pytorch-lightning_version": lightning.__version__}, last)
    for content in (None, b"junk"):
        if content is not None:
            last.write_bytes(content)
        assert _start(tmp_path, module, report) is None
        (sentence,) = report.said
        why = "it is of another version, or of a network of another layout" if content is None else "it cannot be read"
        assert sentence == f"{last} is passed over: {why}; the training goes on from its beginning"
        report.said.clear()
