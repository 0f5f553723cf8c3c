"""A process that makes the shards it is told to, started by `mrhubo.pairing.workers`.

The first line on standard input is a JSON list of the config, as YAML, and of the fingerprint of its pairs, which the
files that the config names have to give here too; every other line is the index of a shard to make and write. Each is
answered by one line of JSON: {"shard": index, "cost": ..., "residual_m": ...} or {"error": sentence}.
"""

from __future__ import annotations

import json
import signal
import sys
import tempfile
import warnings
from pathlib import Path

from mrhubo.config import load_config
from mrhubo.errors import InputWarning, UserError
from mrhubo.pairing.generate import PairGenerator
from mrhubo.pairing.setup import PairSetup
from mrhubo.pairing.store import PairStore


def main() -> None:
    """Answers lines until there are no more."""
    warnings.simplefilter("ignore", InputWarning)  # whoever started us has given them
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; whoever started us ends us
    lines = iter(sys.stdin)
    answers, sys.stdout = sys.stdout, sys.stderr  # nothing else may come between the answers
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "config.yaml"
            text, fingerprint = json.loads(next(lines))
            path.write_text(text, encoding="utf-8")
            config = load_config(path)
        setup = PairSetup.open(config)
        if setup.store.header["fingerprint"] != fingerprint:
            raise UserError(
                f"{config.robot.urdf}: it, or another file that the config names, has changed since this command"
                " began; start it again"
            )
        generator = PairGenerator(setup.body_map, setup.prior, config)
        generator.prepare(setup.store)
        for line in lines:
            answer = make_shard(generator, setup.store, int(line))
            print(json.dumps(answer), file=answers, flush=True)
    except UserError as error:
        print(json.dumps({"error": str(error)}), file=answers, flush=True)


def make_shard(generator: PairGenerator, store: PairStore, index: int) -> dict[str, float]:
    """Makes and writes one shard, unless another process has done so; its index and mean quality.

    Raises:
        UserError: it cannot be written.
    """
    if store.path(index).exists():
        return {"shard": index}
    tensors = generator.shard(*store.place(index))
    store.write(index, tensors)
    return {"shard": index, **{name: float(tensors[name].mean()) for name in ("cost", "residual_m")}}
