"""The branches of a network trained side by side, each in a thread: two threads that share a small product of matrices
wait for each other, and those that have a branch each do not.

A branch's loss and gradient need nothing of another's, so the arithmetic stays what it is in one thread.

Legend: B batch, F input features, M robot links, N robot joints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial

import torch
from torch import Tensor

from mrhubo.fitting.module import RetargetModule
from mrhubo.retargeter.networks import Piece

Losses = dict[str, Tensor]


class BranchThreads:
    """Loss and gradient of all pieces of a network, in the threads of a pool."""

    def __init__(self, pool: ThreadPoolExecutor, pieces: Sequence[Piece], losses: Callable[..., Losses]) -> None:
        """`losses` is `RetargetModule.losses`."""
        # The largest first, so that no thread is left alone with it.
        self.pool, self._losses = pool, losses
        self._pieces = [
            (piece, torch.tensor(piece.inputs), torch.tensor(piece.joints), [*piece.weights()])
            for piece in sorted(pieces, key=lambda piece: -piece.share)
        ]

    def losses(self, features_BF: Tensor, R_BM6: Tensor, q_BN: Tensor) -> Losses:
        """As `RetargetModule.losses`; their gradients are then in the weights, in place of those of before."""

        def of(piece: Piece, inputs: Tensor, joints: Tensor, weights: Sequence[Tensor]) -> Losses:
            batch = features_BF.index_select(1, inputs), R_BM6.index_select(1, joints), q_BN.index_select(1, joints)
            found = {name: piece.share * loss for name, loss in self._losses(*batch, piece).items()}
            for tensor in weights:
                tensor.grad = None
            found["loss"].backward()
            return found

        parts = list(self.pool.map(of, *zip(*self._pieces, strict=True)))
        return {name: torch.stack([part[name].detach() for part in parts]).sum() for name in parts[0]}


@contextmanager
def branches_in_threads(module: RetargetModule) -> Iterator[None]:
    """Inside, the module trains its branches side by side, if there are several and torch has several threads."""
    threads, pieces = torch.get_num_threads(), module.network.pieces()
    count = min(threads, len(pieces))
    if count < 2:
        yield
        return
    each = threads // count
    with ThreadPoolExecutor(count, "branch", partial(torch.set_num_threads, each)) as pool:
        module.branch_threads = BranchThreads(pool, pieces, module.losses)
        try:
            yield
        finally:
            module.branch_threads = None
            torch.set_num_threads(threads)
