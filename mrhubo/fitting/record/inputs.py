"""What went into a fit, as MLflow's datasets: the pairs, and the motions that choose the checkpoint and measure.

A digest is a checksum, so that the dashboard shows which runs had the same data.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import fingerprint
from mrhubo.motion import Motion

if TYPE_CHECKING:
    from mlflow.entities import DatasetInput

    from mrhubo.fitting.preparation import Prepared


def mlflow_datasets(prepared: Prepared) -> list[DatasetInput]:
    """Pairs (context `training`), clips of `evaluation.validation` (`validation`) and the other clips (`testing`).

    The pairs' digest is their fingerprint; their profile tells robot, count of each direction, and the checksums of
    prior, skeleton and kinematics. The digest of clips is over their checksums, which the profile lists.
    """
    store, motions = prepared.store, prepared.motions
    robot = prepared.body_map.robot
    profile = {**store.header, "pairs": store.count, **store.counts}
    pairs = _dataset(
        f"{robot.name}-pairs", store.header["fingerprint"], store.folder, profile, "training", len(robot.joint_names)
    )
    clips = [
        _clips(motions.folder, motions.validation, "validation"),
        _clips(motions.folder, motions.test, "testing"),
    ]
    return [pairs, *clips]


def _clips(folder: Path, clips: Sequence[Motion], context: str) -> DatasetInput:
    checksums = {clip.name: clip.checksum for clip in clips}
    profile = {"clips": len(clips), "frames": sum(len(clip) for clip in clips), "motion_xxh3": checksums}
    return _dataset(f"{folder.name}-{context}", fingerprint(checksums), folder, profile, context)


def _dataset(
    name: str, digest: str, folder: Path, profile: Mapping[str, Any], context: str, joints: int | None = None
) -> DatasetInput:
    """Its schema: human poses 6D (21, 6), and as targets `joints` angles [rad]."""
    import numpy as np
    from mlflow.data.schema import TensorDatasetSchema
    from mlflow.entities import Dataset, DatasetInput, InputTag
    from mlflow.types import Schema, TensorSpec

    human = Schema([TensorSpec(np.dtype(np.float32), (-1, len(POSED_JOINT_NAMES), 6), "human_pose_6d")])
    schema = TensorDatasetSchema(human)
    if joints:
        schema.targets = Schema([TensorSpec(np.dtype(np.float32), (-1, joints), "joint_angles_rad")])
    dataset = Dataset(
        name,
        digest,
        source_type="local",
        source=json.dumps({"uri": str(folder.resolve())}),
        schema=json.dumps(schema.to_dict()),
        profile=json.dumps(profile),
    )
    return DatasetInput(dataset, [InputTag("mlflow.data.context", context)])
