"""Processes that make pairs: what is said of one that ends without an answer."""

from __future__ import annotations

import subprocess
import sys

import pytest

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
