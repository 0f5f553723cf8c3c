"""The processes of one job, on one machine or many: started by torchrun or SLURM, joined by Lightning Fabric."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch

from mrhubo.runtime.trainer import quiet_lightning


@dataclass(frozen=True)
class Ranks:
    """This process among the others. Alone by default: nothing to share, nothing to wait for."""

    rank: int = 0
    count: int = 1
    nodes: int = 1
    """Machines that the processes run on, equally many on each."""
    device: torch.device | None = None
    """The device that this rank was given; None if it is alone."""
    fabric: Any = None

    @classmethod
    def join(cls, accelerator: str = "auto") -> Ranks:
        """Joins the job that this process was started in, or stays alone if it was started by hand.

        gloo on CPUs, nccl on GPUs. `accelerator` as in the config: `auto`, `cpu` or `gpu`.
        """
        shape = _job_shape()
        if shape is None:
            return cls()
        from lightning.fabric import Fabric

        nodes, processes = shape
        on_gpu = accelerator != "cpu" and torch.cuda.is_available()
        fabric = Fabric(accelerator="cuda" if on_gpu else "cpu", strategy="ddp", devices=processes, num_nodes=nodes)
        with quiet_lightning():
            fabric.launch()
        return cls(fabric.global_rank, fabric.world_size, nodes, fabric.device, fabric)

    def wait(self) -> None:
        """Until every rank has come here."""
        if self.fabric is not None:
            self.fabric.barrier()

    def gather(self, indices: Sequence[int], count: int) -> list[int]:
        """All ranks' indices, each below `count`, in order; the same list on every rank."""
        marked = torch.zeros(count, dtype=torch.int32, device=self.device or "cpu")
        marked[list(indices)] = 1
        if self.fabric is not None:
            marked = self.fabric.all_reduce(marked, reduce_op="sum")
        return marked.nonzero()[:, 0].tolist()


def _job_shape() -> tuple[int, int] | None:
    """Nodes and processes a node of the job, as torchrun or SLURM tell; None outside a job."""
    env = os.environ
    if "TORCHELASTIC_RUN_ID" in env and int(env["WORLD_SIZE"]) > 1:
        local = int(env["LOCAL_WORLD_SIZE"])
        return int(env["WORLD_SIZE"]) // local, local
    # An interactive SLURM shell ("bash") holds an allocation but is no job step.
    if int(env.get("SLURM_NTASKS", "1")) > 1 and "SLURM_PROCID" in env and env.get("SLURM_JOB_NAME") != "bash":
        nodes = int(env.get("SLURM_NNODES", "1"))
        return nodes, int(env["SLURM_NTASKS"]) // nodes
    return None
