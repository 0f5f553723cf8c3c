"""What a sweep's trials train: fits without their test.

Pairs are shared by all trials with the same pairing settings: the first that needs them makes them, the others wait.
"""

from __future__ import annotations

from mrhubo.callbacks import Pruning
from mrhubo.config import Config
from mrhubo.files.storage import locked
from mrhubo.fitting.pairs import make_pairs
from mrhubo.fitting.preparation import Prepared
from mrhubo.fitting.record import Recording
from mrhubo.fitting.references import make_references
from mrhubo.fitting.sweeping import SweepTrial
from mrhubo.fitting.training import train
from mrhubo.runtime.progress import SILENT


class FitTrials:
    """Fits, stopped early where the sweep's pruner says so."""

    schema = Config

    def train(self, prepared: Prepared, trial: SweepTrial) -> float:
        """Pairs, references and a training; goes on where an earlier one with this config was stopped."""
        workspace = trial.workspace
        watch = Pruning(trial.trial, lambda step, link_cm: trial.show(f"step {step:,}: {link_cm:.2f} cm"))
        with workspace:
            with Recording.start(prepared, workspace, trial.parent) as recording:
                trial.begin(recording.run_id)
                trial.show("pairs")
                with locked(prepared.store.folder.with_suffix(".lock"), wait=True):
                    make_pairs(prepared, SILENT)
                    validation, _ = make_references(prepared, SILENT)
                training = train(
                    prepared,
                    SILENT,
                    validation,
                    workspace.checkpoints,
                    recording.logger,
                    callbacks=[watch],
                )
                link_cm = trial.conclude(prepared.fingerprint, training.best_link_cm, pruned=watch.pruned)
            workspace.finish()
        return link_cm
