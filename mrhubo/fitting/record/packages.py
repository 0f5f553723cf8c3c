"""The package of a fit: written, kept with its run, and made a version of the robot's model."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config.faults import machine_fault
from mrhubo.config.secrets import redacted
from mrhubo.evaluation import Clip, Evaluation
from mrhubo.fitting.record.recording import Recording
from mrhubo.fitting.record.registry import register
from mrhubo.retargeter import Retargeter

_EXAMPLE = 8
"""Frames of a model's input example."""


def package_dir(recording: Recording) -> Path:
    """Where a run's package is written."""
    prepared = recording.prepared
    return prepared.tracking_dir / "packages" / f"{prepared.config.robot.name}-{recording.run_id[:8]}"


def save_package(recording: Recording, retargeter: Retargeter, score: Evaluation, checkpoint: Path) -> Path:
    """Writes the package to `mlruns/packages`, and package and checkpoint to the run; returns the folder."""
    provenance = {
        "run_id": recording.run_id,
        **recording.provenance,
        "test_joint_rad": f"{score.joint_rad:.6f}",
        "test_link_cm": f"{score.link_cm:.6f}",
    }
    folder = retargeter.save(package_dir(recording), provenance)
    recording.whole = f"the package is whole: {folder}"
    recording.client.log_artifacts(recording.run_id, str(folder), "package")
    recording.client.log_artifact(recording.run_id, str(checkpoint), "checkpoint")
    return folder


def register_package(recording: Recording, retargeter: Retargeter, score: Evaluation, clip: Clip) -> str:
    """Makes the package a version of the robot's model, with the start of a clip as the example.

    Returns:
        the version's URI, or why there is none: a server without a registry ends no fit.

    Raises:
        UserError: the server is away.
    """
    recording.deliver()
    tags = {
        "run_id": recording.run_id,
        **recording.provenance,
        "test_joint_rad": f"{score.joint_rad:.4f}",
        "test_link_cm": f"{score.link_cm:.3f}",
    }
    example_TJ33 = clip.motion.local_TJ33[:_EXAMPLE]
    try:
        return register(recording.client, recording.run_id, package_dir(recording), retargeter, example_TJ33, tags)
    except Exception as error:  # MLflow's own, the network's, the database's
        reason = redacted(" ".join((machine_fault(error) or str(error)).split()), recording.client.uri)
        return f"not registered: {type(error).__name__}: {reason[:200]}"
