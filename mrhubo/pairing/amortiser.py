"""The amortised solver: a small network from target keypoints to the latent, trained per robot on the IK cost itself.

No labels: every step draws fresh robot poses and lowers the cost of the network's own answers, by the analytic gradient
of `LatentProblem.cost_and_gradient`. Training is resumed exactly from its last checkpoint, because step s draws from
(seed, s) alone.

Legend: B batch, K used keypoints, Z latent numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import torch
from torch import Tensor, nn

from mrhubo.body.latent import LatentProblem
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.trainer import cosine_schedule

_BATCH = 256
_BLOCK = 32
"""Steps whose robot poses are drawn at once: kinematics of a few poses take nearly as long as those of many."""
_CONDITIONED_ON, _MEASURED_ON = 4096, 1024
"""Robot poses that tell how the inputs spread, and how the cost bends where the answers lie."""
_LR = 2e-3
_CHECKPOINT_EVERY = 250


class Amortiser(nn.Module):
    """MLP from keypoints (B, K, 3) to latents (B, Z).

    `metric_ZZ` is the mean inverse Hessian of the cost where its answers lie, for a search from there.

    Inputs are standardised by a sample of targets; outputs are coordinates along the eigenvectors of the cost's
    `LatentProblem.metric`, longer where the cost is flatter, which evens out its curvature.
    """

    center_F: Tensor
    scale_F: Tensor
    axes_ZZ: Tensor
    metric_ZZ: Tensor

    def __init__(self, keypoints: int, latent: int, hidden: int = 512) -> None:
        super().__init__()
        self.register_buffer("center_F", torch.zeros(3 * keypoints))
        self.register_buffer("scale_F", torch.ones(3 * keypoints))
        self.register_buffer("axes_ZZ", torch.eye(latent))
        self.register_buffer("metric_ZZ", torch.eye(latent))
        self.layers = nn.Sequential(
            nn.Linear(3 * keypoints, hidden),
            nn.SiLU(),
            nn.Linear(hidden, hidden),
            nn.SiLU(),
            nn.Linear(hidden, hidden),
            nn.SiLU(),
            nn.Linear(hidden, latent),
        )

    def condition(self, sample_BK3: Tensor, metric_ZZ: Tensor) -> None:
        """Sets centre and scale of the inputs (a coordinate that never varies, as of a pinned keypoint, is fed as zero)
        and the axes of the outputs.
        """
        flat = sample_BK3.flatten(1)
        spread = flat.std(0)
        self.center_F.copy_(flat.mean(0))
        self.scale_F.copy_(torch.where(spread > 1e-4, 1 / spread.clamp_min(1e-4), torch.zeros_like(spread)))
        variance, vectors = torch.linalg.eigh(metric_ZZ)
        self.axes_ZZ.copy_((vectors * (variance / variance[0]) ** 0.25).T)

    def forward(self, target_BK3: Tensor) -> Tensor:
        """Latents (B, Z)."""
        return self.layers((target_BK3.flatten(1) - self.center_F) * self.scale_F) @ self.axes_ZZ


def train_amortiser(
    problem: LatentProblem,
    draw: Callable[[int, torch.Generator], Tensor],
    steps: int,
    seed: int,
    path: Path,
    header: dict[str, str],
    report: Reporter = SILENT,
) -> Amortiser:
    """Reads the trained solver from `path`, or trains it, from the last checkpoint beside it if there is one.

    Args:
        problem: the cost to lower.
        draw: `draw(count, generator)` gives target keypoints (count, K, 3) of fresh random robot poses.
        steps: optimiser steps.
        seed: seed of weights and draws.
        path: file of the result; a checkpoint is kept beside it until it is done.
        header: what the file must have been made for; a file with another header is not used.
        report: told of the steps.
    """
    device = problem.device
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = Amortiser(len(problem.keypoints), problem.latent)
    if _restore(path, header, network=network):
        return network.to(device).requires_grad_(False).eval()
    network.condition(draw(_CONDITIONED_ON, torch.Generator().manual_seed(seed)).cpu(), problem.metric.cpu())
    network = network.to(device)
    optimizer = torch.optim.Adam(network.parameters(), _LR, fused=True)
    checkpoint = path.with_suffix(".checkpoint")
    targets: tuple[Tensor, ...] = ()
    first = _restore(checkpoint, header, network=network, optimizer=optimizer)
    schedule = cosine_schedule(optimizer, steps)
    with report.step("amortised solver", steps, "steps") as progress:
        for step in range(first, steps):
            # The schedule is a function of the step alone, so it needs no state in the checkpoint.
            for group, rate in zip(optimizer.param_groups, schedule.base_lrs, strict=True):
                group["lr"] = rate * schedule.lr_lambdas[0](step)
            if step % _BLOCK == 0 or step == first:
                block = torch.Generator().manual_seed((seed + 1) * 1_000_003 + step // _BLOCK)
                targets = draw(_BLOCK * _BATCH, block).split(_BATCH)
            target = targets[step % _BLOCK]
            answer = network(target)
            cost, gradient = problem.cost_and_gradient(
                answer.detach().T.contiguous(), target.permute(1, 2, 0).contiguous()
            )
            optimizer.zero_grad()
            answer.backward(gradient.T / _BATCH)
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            if step % 50 == 0 or step + 1 == steps:
                progress.update(step + 1, f"mean cost {float(cost.mean()):.3f}")
            if (step + 1) % _CHECKPOINT_EVERY == 0 and step + 1 < steps:
                write_tensors(checkpoint, _state(network, optimizer, step + 1), header)
    with torch.no_grad():
        sample = draw(_MEASURED_ON, torch.Generator().manual_seed(seed))
        network.metric_ZZ.copy_(problem.metric_of(network(sample)))
    write_tensors(path, _state(network), header)
    checkpoint.unlink(missing_ok=True)
    return network.requires_grad_(False).eval()


def _state(network: Amortiser, optimizer: torch.optim.Optimizer | None = None, step: int = 0) -> dict[str, Tensor]:
    tensors = {f"network.{name}": value for name, value in network.state_dict().items()}
    if optimizer is not None:
        for index, entry in optimizer.state_dict()["state"].items():
            tensors |= {f"optimizer.{index}.{name}": value for name, value in entry.items()}
        tensors["step"] = torch.tensor(step)
    return tensors


def _restore(
    path: Path, header: dict[str, str], network: Amortiser, optimizer: torch.optim.Optimizer | None = None
) -> int:
    """Loads what `_state` gave; the step reached (1 for a finished network), or 0 if there is nothing usable."""
    try:
        tensors, found = read_tensors(path)
    except DamagedFile:
        return 0
    if found != header:
        return 0
    network.load_state_dict({k.removeprefix("network."): v for k, v in tensors.items() if k.startswith("network.")})
    if optimizer is None:
        return 1
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        if key.startswith("optimizer."):
            _, index, name = key.split(".", 2)
            state.setdefault(int(index), {})[name] = value
    optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})
    return int(tensors["step"])
