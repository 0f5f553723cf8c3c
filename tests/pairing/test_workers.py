"""Processes that make pairs: what is said of one that ends without an answer."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from mrhubo.config import load_config, to_yaml
from mrhubo.errors import UserError
from mrhubo.pairing.workers import _dispatch

ANSWER = "import sys; [print('{}', flush=True) for line in sys.stdin]"


def worker(code: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-S", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )


@pytest.mark.parametrize(
    ("end", "sentence"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "killed"),
        ("import sys; sys.stdin.readline(); sys.exit(3)", "3"),
    ],
)
def test_one_that_ends_is_one_sentence_and_the_others_are_not_waited_for(end: str, sentence: str) -> None:
    both = [worker(ANSWER), worker(end)]
    try:
        with pytest.raises(UserError, match=f"worker.*{sentence}"):
            for _ in range(1000):
                list(_dispatch(both, range(4)))
    finally:
        for process in both:
            process.kill()
            process.communicate()


def test_a_worker_makes_no_pairs_of_a_robot_that_has_changed_meanwhile(root: Path, tmp_path: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", [f"pairs.dir={tmp_path}", "pairs.solver=direct"])
    lines = json.dumps([to_yaml(config), "another"]) + "\n0\n"
    command = [sys.executable, "-c", "from mrhubo.pairing.worker import main; main()"]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, cwd=root)
    assert "has changed since this command began; start it again" in json.loads(done.stdout)["error"], done.stderr
    assert not list(tmp_path.rglob("*.safetensors"))
