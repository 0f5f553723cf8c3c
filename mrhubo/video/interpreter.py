"""A model of TensorFlow Lite, run by LiteRT (https://ai.google.dev/edge/litert)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import read_regular
from mrhubo.lazy import import_optional

_MAX_MODEL = 128 * 2**20


class Network:
    """A network that takes one picture."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Loads it.

        Args:
            path: of a `.tflite` file.
            threads: of the CPU that it may use.

        Raises:
            UserError: LiteRT is not installed, or the file is missing or damaged.
        """
        litert = import_optional(
            "ai_edge_litert.interpreter",
            "finding people in pictures needs ai-edge-litert: pip install 'mrhubo[video]'",
        )
        self.path = path
        data = read_regular(path, _MAX_MODEL)
        try:
            self._interpreter = litert.Interpreter(model_content=data, num_threads=threads)
            self._interpreter.allocate_tensors()
        except (ValueError, RuntimeError) as error:
            raise UserError(f"{path}: is no model of TensorFlow Lite, or damaged; fetch it again") from error
        inputs = self._interpreter.get_input_details()
        self._input: int = inputs[0]["index"]
        self.input_shape = tuple(int(size) for size in inputs[0]["shape"])
        """(1, height, width, 3)."""
        self._outputs = {one["name"]: one["index"] for one in self._interpreter.get_output_details()}

    def __call__(self, picture_HW3: np.ndarray) -> dict[str, np.ndarray]:
        """Its outputs by name, without the first axis.

        Args:
            picture_HW3: of `input_shape`, in the range that the network expects, float32.
        """
        self._interpreter.set_tensor(self._input, picture_HW3[None])
        self._interpreter.invoke()
        return {name: self._interpreter.get_tensor(index)[0] for name, index in self._outputs.items()}

    def check(self, *shapes: tuple[int, ...]) -> None:
        """Refuses a network whose outputs, in the order of their names, have not these shapes.

        Raises:
            UserError: it is another one.
        """
        found = [self._interpreter.get_tensor(self._outputs[name]).shape[1:] for name in sorted(self._outputs)]
        if found != list(shapes):
            raise UserError(f"{self.path}: is another model: its outputs are {found}, expected {list(shapes)}")
