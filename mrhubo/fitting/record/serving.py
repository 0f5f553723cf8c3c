"""What MLflow runs to serve a package: `mlflow models serve`, or `mlflow.pyfunc.load_model(...).predict(poses)`.

A model version holds this file as text ("models from code") and the package as its artifact; nothing is unpickled. It
imports mlflow and announces its model when it is run, so that no other module may import it: `registry`, beside it,
names its path.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import torch
from mlflow.exceptions import MlflowException
from mlflow.models import set_model
from mlflow.pyfunc.model import PythonModel, PythonModelContext

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.retargeter import Retargeter
from mrhubo.rotation import axis_angle_to_matrix


class ServedRetargeter(PythonModel):
    """A package behind MLflow's interface."""

    def load_context(self, context: PythonModelContext) -> None:
        """Opens the package."""
        self.retargeter = Retargeter.load(context.artifacts["package"])

    def predict(
        self, context: PythonModelContext, model_input: np.ndarray, params: dict[str, Any] | None = None
    ) -> pd.DataFrame:
        """A row a frame: joint angles [rad] inside the limits, one column a joint, and `confidence` (0..1).

        Args:
            context: of `load_context`.
            model_input: (T, 63) axis-angle [rad] of SMPL's joints 1..21 in the order of `POSED_JOINT_NAMES`, AMASS's
                `pose_body`.
            params: none are known.

        Raises:
            MlflowException: the poses have another shape, or hold NaN or infinite numbers; a server answers with the
                sentence and status 400.
        """
        try:
            return self._retarget(np.asarray(model_input, np.float32))
        except UserError as error:
            raise MlflowException.invalid_parameter_value(str(error)) from error

    def _retarget(self, pose_T63: np.ndarray) -> pd.DataFrame:
        width = 3 * len(POSED_JOINT_NAMES)
        if pose_T63.ndim != 2 or pose_T63.shape[1] != width:
            raise UserError(
                f"human poses must have the shape (frames, {width}), axis-angle [rad] of SMPL's joints 1..21,"
                f" found {pose_T63.shape}"
            )
        pose_TJ3 = torch.from_numpy(pose_T63.copy()).unflatten(1, (len(POSED_JOINT_NAMES), 3))
        result = self.retargeter.retarget(axis_angle_to_matrix(pose_TJ3))
        table = pd.DataFrame(result.q.numpy(), columns=list(self.retargeter.joint_names))
        return table.assign(confidence=result.confidence.numpy())


set_model(ServedRetargeter())
