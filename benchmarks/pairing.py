"""Pairs: our solvers against the paper's on the same robot poses, where the time goes, and how near the floor it is.

    python benchmarks/pairing.py [--robots nao,coman,reachy] [--poses 1000] [--parts 2500] [--reverse 5000]
        [--exhaustive 1000] [--pairs 40000] [key.sub=value ...]

The amortised solver is trained first, or read where a pairing with these settings has left it. Every method runs in
this one process, with one thread and then with one a core; `mrhubo.pair` uses one process a core instead, which scales
better: the last table of each robot tells how many pairs it makes and writes.
"""

from __future__ import annotations

import copy
import functools
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import torch
from common import print_header, print_table, read_options
from levenberg_marquardt import solve_levenberg_marquardt
from torch import Tensor

from mrhubo.body.latent import LatentProblem
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.config import load_config
from mrhubo.fast.side_by_side import available_cores
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.fitting.preparation import prepare_pairs
from mrhubo.pairing import PairGenerator, PairSetup, PairStore, generate_pairs, make_filter, solve_lbfgs
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import align_pose
from mrhubo.runtime.progress import Progress, Reporter
from mrhubo.runtime.threads import use_threads


def main(argv: list[str]) -> None:
    """Prints the tables of every robot."""
    options, argv = read_options(
        argv, robots="nao,coman,reachy", poses="1000", parts="2500", reverse="5000", exhaustive="1000", pairs="40000"
    )
    print_header()
    gemm = gemm_rate()
    print(f"matrix products: {gemm / 1e9:.0f} GFLOP/s a core (float32, 512 x 512 by 512)\n")
    for robot in options["robots"].split(","):
        config = load_config(Path(f"conf/{robot}.yaml"), [*argv, "pairs.solver=fine", "trainer.accelerator=cpu"])
        setup = prepare_pairs(config)
        maker = PairGenerator(setup.body_map, setup.prior, config)
        start = time.perf_counter()
        maker.prepare(setup.store)
        seconds = time.perf_counter() - start
        trained = f"{config.pairs.amortiser_steps:,} steps in {seconds:.1f} s" if seconds > 2 else "was there already"
        print(f"## {robot}\n\namortised solver: {trained}\n")
        compare(setup, maker, int(options["poses"]), int(options["exhaustive"]))
        parts(setup, maker, gemm, int(options["parts"]))
        reverse(setup, maker, int(options["reverse"]))
        whole(setup, int(options["pairs"]))


def compare(setup: PairSetup, maker: PairGenerator, count: int, exhaustive: int) -> None:
    """Rate, cost and accuracy of every method; the last two, which show what is possible, take `exhaustive` steps of
    quasi-Newton and a fifth as many of Levenberg-Marquardt.
    """
    problem = maker.problem
    target = maker.draw_targets(count, torch.Generator().manual_seed(1234))
    zero, random = torch.zeros(count, problem.latent), torch.randn(count, problem.latent)
    assert maker.amortiser is not None
    metric_ZZ = maker.amortiser.metric_ZZ
    with torch.no_grad():
        amortised, nearest = maker.amortiser(target), nearest_samples(problem, target)
    steps, cores = maker.settings.fine_steps, available_cores()

    def best_of(solve: Callable[[Tensor], Tensor]) -> Tensor:
        found = torch.stack([solve(start) for start in (amortised, nearest, random)])
        costs = torch.stack([problem.cost(z, target) for z in found])
        return found[costs.argmin(0), torch.arange(count)]

    methods: dict[str, tuple[Callable[[], Tensor], bool]] = {
        "paper: L-BFGS, 500 poses at a time": (lambda: solve_lbfgs(problem, target), True),
        "LM from z = 0, 100 steps": (lambda: solve_levenberg_marquardt(problem, zero, target, 100), True),
        "fast": (lambda: maker.amortiser(target) if maker.amortiser else zero, True),
        f"fine (up to {steps} steps)": (
            lambda: solve_quasi_newton(problem, amortised, target, steps, metric_ZZ=metric_ZZ),
            True,
        ),
        f"LM, {exhaustive // 5} steps, best of 3 starts": (
            lambda: best_of(lambda z: solve_levenberg_marquardt(problem, z, target, exhaustive // 5, tolerance=1e-7)),
            False,
        ),
        f"quasi-Newton, {exhaustive:,} steps, best of 3": (
            lambda: best_of(lambda z: solve_quasi_newton(problem, z, target, exhaustive, tolerance=1e-6)),
            False,
        ),
    }
    rows, paper = [], (0.0, 0.0, 0.0)
    for name, (solve, timed) in methods.items():
        rates = []
        for threads in (1, cores) if timed else (cores,):
            with use_threads(threads):
                start = time.perf_counter()
                z = solve().detach()
                rates.append(count / (time.perf_counter() - start))
        with torch.no_grad():
            cost = problem.cost(z, target)
            error = 1000 * (problem.keypoints_of(z) - target).norm(dim=-1).flatten()[:4_000_000]
            phi = setup.prior.reconstruction_error(setup.prior.decode(z))
        mean = float(cost.mean())
        paper = paper if paper[0] else (mean, rates[0], rates[1])
        speed = [f"{rate:,.0f} ({rate / base:,.0f}x)" for rate, base in zip(rates, paper[1:], strict=False)]
        rows.append([
            name, *(speed if timed else ["", ""]), f"{mean:.3f} ({mean / paper[0]:.0%})", f"{cost.quantile(0.99):.2f}",
            f"{error.mean():.2f}", f"{error.quantile(0.99):.1f}", f"{make_filter(phi, 'linear', 1.0).kept_share:.0%}",
        ])  # fmt: skip
    columns = [
        "method",
        "poses/s, 1 thread",
        f"{cores} threads",
        "mean cost",
        "99%",
        "keypoints [mm]",
        "99%",
    ]
    print_table([*columns, "kept by the filter"], rows)
    norm = float((problem.w_prior * z.square().sum(-1)).mean())
    print(f"\nof the lowest costs found, {norm:.3f} is the prior's part, w_prior |z|^2\n")


def parts(setup: PairSetup, maker: PairGenerator, gemm: float, count: int) -> None:
    """Where the time of a `fast` pair goes on one core, a `fine` one's search beside it, and each part's floor."""
    problem, prior, robot = maker.problem, setup.prior, setup.body_map.robot
    assert maker.amortiser is not None
    amortiser = maker.amortiser
    q = robot.sample(count, torch.Generator().manual_seed(0))
    poses = robot.forward(q)
    target, directions = setup.body_map.targets(poses), setup.body_map.robot_directions(poses)
    z, pose = amortiser(target), prior.decode(amortiser(target))
    matrices = prior.decode_matrices(z)
    shard = maker.shard("forward", 0)

    def chunks(work: Callable[..., Tensor], *values: Tensor) -> None:
        for part in zip(*(value.split(512) for value in values), strict=True):
            work(*part)

    with tempfile.TemporaryDirectory(dir=setup.store.folder.parent) as folder, use_threads(1), torch.no_grad():
        config = setup.config
        config.pairs.dir, kept = Path(folder), config.pairs.dir
        store = PairStore.of(config, setup.body_map, prior)
        config.pairs.dir = kept
        work: dict[str, tuple[Callable[[], object], float]] = {
            "random poses, forward kinematics": (lambda: robot.forward(robot.sample(count, torch.Generator())), 0),
            "directions, target keypoints": (lambda: setup.body_map.targets(poses), 0),
            "amortised solver": (lambda: chunks(amortiser, target), macs(amortiser.layers)),
            "decode": (lambda: chunks(prior.decode, z), macs(prior.decoder)),
            "keypoints, cost": (lambda: chunks(setup.body_map.skeleton.keypoints, matrices), 0),
            "alignment": (lambda: chunks(functools.partial(align_pose, setup.body_map), matrices, directions), 0),
            "phi: encode and decode": (
                lambda: chunks(prior.reconstruction_error, pose),
                macs(prior.encoder) + macs(prior.decoder),
            ),
            "checksum, writing": (lambda: store.write(0, shard), 0),
        }
        times = {name: fastest(task) * 1e6 / count for name, (task, _) in work.items()}
        steps, metric_ZZ = maker.settings.fine_steps, amortiser.metric_ZZ

        def search() -> Tensor:
            return solve_quasi_newton(problem, z, target, steps, metric_ZZ=metric_ZZ)

        evaluations = counted(problem, search) / count
        seconds = fastest(search, 2)
    total = sum(times.values())
    rows = []
    for name, (_, products) in work.items():
        floor = 2e6 * products / gemm
        near = f"{times[name] / floor:.1f}" if floor else ""
        rows.append([name, f"{times[name]:.1f}", f"{times[name] / total:.0%}", f"{floor:.1f}" if floor else "", near])
    rows.append(["all of `fast`", f"{total:.1f}", "100%", "", ""])
    *hidden, _ = prior.decoder.linear_layers
    one = sum(map(macs, hidden)) + prior.hidden * 6 * len(problem.tree.joints)
    floor = 2e6 * 2 * one * evaluations / gemm
    time_us = seconds * 1e6 / count
    name = f"quasi-Newton search: {evaluations:.1f} evaluations"
    rows.append([name, f"{time_us:.1f}", "", f"{floor:.1f}", f"{time_us / floor:.1f}"])
    print_table(["part", "us a pair, one core", "share of fast", "floor [us]", "times the floor"], rows)
    size = sum(tensor.nbytes for tensor in shard.values()) / count
    print(f"\nfloor: the part's matrix products at the measured rate; {size:.0f} bytes a pair are written\n")


class Watch(Reporter):
    """Notes when how many pairs were there."""

    def __init__(self) -> None:
        super().__init__(quiet=True)
        self.marks: list[tuple[int, float]] = []

    def step(self, title: str, total: int, unit: str = "") -> Progress:
        """A line that is not shown."""
        marks = self.marks

        class Marks(Progress):
            def update(self, done: int, measure: str = "") -> None:
                if title == "pairs":
                    marks.append((done, time.perf_counter()))

        return Marks(title, total, unit, None)


def whole(setup: PairSetup, count: int) -> None:
    """Pairs made and written by all cores, as `mrhubo.pair` does it, the amortised solver's training left out."""
    rows, cores = [], available_cores()
    for name in ("fast", "fine", "reverse"):
        with tempfile.TemporaryDirectory(dir=setup.store.folder.parent) as folder:
            config = copy.deepcopy(setup.config)
            config.pairs.dir, config.pairs.count = Path(folder), count
            config.pairs.reverse_share = float(name == "reverse")
            config.pairs.solver = "fast" if name == "fast" else "fine"
            mine = prepare_pairs(config)
            write_amortiser(setup, mine)
            watch = Watch()

            maker = PairGenerator(mine.body_map, mine.prior, config)
            generate_pairs(config, maker, mine.store, watch)
            marks = [(done / mine.store.shard_size, seconds) for done, seconds in watch.marks]
            # Until every worker has made a shard, some are still starting.
            first = next(mark for mark in marks if mark[0] >= min(cores, mine.store.shards - 1))
            rate = (marks[-1][0] - first[0]) * mine.store.shard_size / (marks[-1][1] - first[1])
            rows.append([name, f"{rate:,.0f}", f"{first[1] - marks[0][1]:.1f}"])
    worker, own = (resource.getrusage(who).ru_maxrss / 1e6 for who in (resource.RUSAGE_CHILDREN, resource.RUSAGE_SELF))
    print_table([f"`mrhubo.pair` on {cores} cores", "pairs/s", "first shards after [s]"], rows)
    print(f"\nmemory: {own:.2f} GB here at most (all methods), {worker:.2f} GB a worker\n")


def reverse(setup: PairSetup, maker: PairGenerator, count: int) -> None:
    """Pairs from human poses: how fast and how well they are retargeted, and whether alike poses get alike angles."""
    generator, device = torch.Generator().manual_seed(7), maker.device
    z = maker.settings.reverse_spread * torch.randn(count, maker.prior.latent, generator=generator)
    near = z + 0.05 * torch.randn(z.shape, generator=generator)
    with torch.no_grad():
        pose, near_pose = (maker.prior.decode_matrices(latent.to(device)) for latent in (z, near))
    rows = []
    for starts in (2, 4, 12):
        reference = OptimizationRetargeter(setup.body_map, starts=starts)
        with use_threads(1):
            start = time.perf_counter()
            q, cost = reference.solve_frames(pose)
            seconds = time.perf_counter() - start
        moved = (reference.solve_frames(near_pose)[0] - q).abs().amax(1)
        used = " (used)" if starts == maker.reference.starts else ""
        rows.append(
            [
                f"{starts} starts{used}", f"{count / seconds:,.0f}", f"{cost.mean():.5f}", f"{moved.median():.3f}",
                f"{(moved > 0.5).float().mean():.2%}",
            ]
        )  # fmt: skip
    print_table(
        ["reverse pairs", "poses/s, 1 thread", "mean cost", "turn to a near pose: median [rad]", "over 0.5 rad"], rows
    )
    print("\nnear pose: every latent number 0.05 standard deviations away\n")


def write_amortiser(source: PairSetup, target: PairSetup) -> None:
    """The amortised solver of one store under another's name."""
    tensors, _ = read_tensors(source.store.amortiser_path)
    write_tensors(target.store.amortiser_path, tensors, {**target.store.header, "what": "amortiser"})


def macs(layers: torch.nn.Module) -> float:
    """Multiplications and additions of the matrix products of one sample."""
    return float(sum(m.weight.numel() for m in layers.modules() if isinstance(m, torch.nn.Linear)))


def counted(problem: LatentProblem, work: Callable[[], object]) -> int:
    """How many poses `work` has evaluated cost and gradient of."""
    count, evaluate = 0, problem.cost_and_gradient

    def counting(z_ZB: Tensor, target_K3B: Tensor) -> tuple[Tensor, Tensor]:
        nonlocal count
        count += z_ZB.shape[1]
        return evaluate(z_ZB, target_K3B)

    problem.cost_and_gradient = counting  # type: ignore[method-assign]
    try:
        work()
    finally:
        del problem.__dict__["cost_and_gradient"]
    return count


def gemm_rate() -> float:
    """Operations a second of one core in the size of product that the networks have."""
    left, right = torch.randn(512, 512), torch.randn(512, 512)
    with use_threads(1):
        return 2 * 512**3 / fastest(lambda: left @ right, 50)


def fastest(work: Callable[[], object], times: int = 5) -> float:
    """Seconds of the fastest of some repetitions."""
    work()
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return min(found)


if __name__ == "__main__":
    main(sys.argv[1:])
