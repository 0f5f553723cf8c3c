"""A retargeter's networks for programs without mrhubo: one ONNX file, or a short NumPy file with weights beside it."""

from mrhubo.exporting.numpy_file import write_numpy
from mrhubo.exporting.onnx_file import INPUTS, write_onnx

__all__ = ["INPUTS", "write_numpy", "write_onnx"]
