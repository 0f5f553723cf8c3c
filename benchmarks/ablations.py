"""Two stages against one, filter against none, with reverse pairs and without: several seeds each, on the same pairs,
every training a tracked fit.

    python benchmarks/ablations.py [--config conf/nao.yaml] [--seeds 3] [key.sub=value ...]

A variant and seed that a finished run already has (same settings, pairs, prior, motions) is read from MLflow,
not redone.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from common import mean_and_spread, print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.fit import fit
from mrhubo.pipeline import prepare
from mrhubo.recording import Recording
from mrhubo.tracking import database_uri

VARIANTS = {
    "forward pairs alone: two stages, linear filter": ["pairs.reverse_share=0"],
    "forward pairs alone: one stage": ["pairs.reverse_share=0", "model.stages=1"],
    "forward pairs alone: without filter": ["pairs.reverse_share=0", "pairs.filter=none"],
    "shipped settings: half of the pairs reverse": [],
}


def measures(file: Path, overrides: list[str]) -> tuple[float, float]:
    """Joint error [rad] and link error [cm] on the test clips, from MLflow or from a new fit."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    import mlflow

    config = load_config(file, overrides)
    fingerprint = prepare(config).fingerprint
    uri = config.tracking.uri or database_uri(Recording.folder(config))
    client = mlflow.MlflowClient(tracking_uri=uri)
    experiment = client.get_experiment_by_name(config.tracking.experiment)
    if experiment is not None:
        wanted = f"tags.config_fingerprint = '{fingerprint}' and attributes.status = 'FINISHED'"
        for run in client.search_runs([experiment.experiment_id], wanted, max_results=1):
            return run.data.metrics["test/joint_rad"], run.data.metrics["test/link_cm"]
    result = fit(load_config(file, overrides))
    return result.measures["joint_rad"], result.measures["link_cm"]


def main(argv: list[str]) -> None:
    """Prints the table."""
    options, argv = read_options(argv, config="conf/nao.yaml", seeds="3")
    rows = []
    for name, change in VARIANTS.items():
        found = [
            measures(Path(options["config"]), [*argv, *change, f"trainer.seed={seed}"])
            for seed in range(int(options["seeds"]))
        ]
        joint, link = zip(*found, strict=True)
        each = "; ".join(f"{j:.3f} / {c:.2f}" for j, c in found)
        rows.append([name, mean_and_spread(joint, 3), mean_and_spread(link, 2), each])
    print_header()
    print_table(["variant", "joint [rad]", "link [cm]", "each seed"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
