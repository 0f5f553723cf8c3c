"""Latent inverse kinematics: the paper's L-BFGS against our solvers, on the same robot poses, in one process.

    python benchmarks/pairing.py [--config conf/nao.yaml] [--poses 1000] [key.sub=value ...]

The amortised solver is trained (or read from the pairs' folder) first; its training time is printed on its own.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import torch
from common import print_header, print_table

from mrhubo.body.inverse import solve_levenberg_marquardt
from mrhubo.config import load_config
from mrhubo.pairing import PairGenerator, PairStore, make_filter, solve_lbfgs
from mrhubo.pipeline import device_of, prepare


def main(argv: list[str]) -> None:
    """Prints the table."""
    options = {"--config": "conf/nao.yaml", "--poses": "1000"}
    while argv and argv[0] in options:
        options[argv[0]], argv = argv[1], argv[2:]
    print_header()
    config = load_config(Path(options["--config"]), [*argv, "pairs.solver=fine"])
    with tempfile.TemporaryDirectory() as folder:
        config.pairs.dir = Path(folder)
        prepared = prepare(config)
        device = device_of(config)
        maker = PairGenerator(prepared.body_map.to(device), prepared.prior.to(device), config.pairs)
        start = time.perf_counter()
        maker.prepare(PairStore.of(config, prepared.body_map, prepared.prior), lambda step, cost: None)
        print(f"amortised solver: {config.pairs.amortiser_steps:,} steps in {time.perf_counter() - start:.1f} s\n")
    problem = maker.problem
    target = maker.draw_targets(int(options["--poses"]), torch.Generator().manual_seed(1234))
    zero = torch.zeros(len(target), problem.latent, device=device)
    with torch.no_grad():
        guess = maker.amortiser(target) if maker.amortiser else zero
    methods = {
        "paper (L-BFGS, 500 poses)": lambda: solve_lbfgs(problem, target),
        "LM from z = 0": lambda: solve_levenberg_marquardt(problem, zero, target, 100),
        "fast (amortised)": lambda: maker.amortiser(target) if maker.amortiser else zero,
        f"fine (amortised + LM, {config.pairs.lm_steps})": lambda: solve_levenberg_marquardt(
            problem, guess, target, config.pairs.lm_steps
        ),
        "converged (200 LM steps)": lambda: solve_levenberg_marquardt(problem, guess, target, 200, tolerance=1e-7),
    }
    rows, paper_cost = [], 0.0
    for name, solve in methods.items():
        with torch.no_grad() if "paper" not in name else torch.enable_grad():
            start = time.perf_counter()
            z = solve()
            if device.type == "cuda":
                torch.cuda.synchronize()
            seconds = time.perf_counter() - start
        with torch.no_grad():
            cost = problem.cost(z, target)
            error = 1000 * (problem.keypoints_of(z) - target).norm(dim=-1)
            phi = prepared.prior.reconstruction_error(prepared.prior.decode(z))
        paper_cost = paper_cost or float(cost.mean())
        rows.append([
            name, f"{len(target) / seconds:,.0f}", f"{cost.mean():.3f}", f"{cost.mean() / paper_cost:.0%}",
            f"{cost.quantile(0.99):.2f}", f"{error.mean():.1f}", f"{error.flatten()[:4_000_000].quantile(0.99):.1f}",
            f"{make_filter(phi, 'linear', 1.0).kept_share:.0%}",
        ])  # fmt: skip
    print_table(
        ["method", "poses/s", "mean cost", "of the paper's", "99% cost", "error [mm]", "99% error", "phi kept"], rows
    )


if __name__ == "__main__":
    main(sys.argv[1:])
