"""Processes of tests that need not import what takes seconds."""

from __future__ import annotations

import multiprocessing
from multiprocessing.context import ForkServerContext


def new_server() -> ForkServerContext:
    """Starts processes that have imported everything already, which takes a fresh interpreter seconds. There is one
    server for a process of tests; it starts with the first process.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["mrhubo.fit", "mrhubo.pair", "mrhubo.sweep", "mrhubo.fitting.sweeping", "mrhubo.fitting.fit", "tests.chain", "tests.light",
         "mlflow.store.tracking.sqlalchemy_store"]
    )  # fmt: skip
    return context
