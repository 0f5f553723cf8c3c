"""The networks as one ONNX file, written node by node: they are products of matrices and a few functions, for which no
tracing of PyTorch is needed.

Legend: B frames, J = 21 posed joints, P of them that are looked at, D directions, N joints.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.exporting import onnx_universal
from mrhubo.exporting.graph import SHORT, Graph
from mrhubo.exporting.meaning import compared, describe_networks, meaning
from mrhubo.exporting.values import Value
from mrhubo.fast.description import Description
from mrhubo.fast.sections import Part
from mrhubo.files.atomic import atomic_path
from mrhubo.lazy import import_optional
from mrhubo.retargeter import Retargeter

INPUTS = ("poses", "directions")
_OPSET, _IR = 18, 9
"""Of 2022 and 2023, which every runtime of today reads."""
_TINY = 1e-12


def write_onnx(retargeter: Retargeter, path: Path, inputs: str = "poses") -> float:
    """Writes the file and returns how far its answers are from mrhubo's at most [rad], on poses of the body prior.

    Args:
        retargeter: whose networks.
        path: where to.
        inputs: "poses", or "directions" for networks that see these.

    Raises:
        UserError: the package onnx is missing, the networks see no directions, a branch of the robot is none that the
            network for every robot knows, the file's answers are others than mrhubo's, or the disk refuses.
    """
    missing = "an ONNX file needs the package onnx: pip install 'mrhubo[onnx]'"
    onnx = import_optional("onnx", missing)
    import_optional("onnx.reference", missing)
    if inputs not in INPUTS:
        raise UserError(f"inputs must be one of {', '.join(INPUTS)}, found {inputs!r}")
    description = describe_networks(retargeter, inputs)
    if inputs == "directions" and description.settings.features != "directions":
        raise UserError("these networks see rotations, not directions (model.input_frame: local); export --input poses")
    model = _model(onnx, description, inputs)
    off = compared(lambda local_BJ33: _answers(onnx, model, retargeter, inputs, local_BJ33), retargeter, description)
    with atomic_path(path) as temporary:
        temporary.write_bytes(model.SerializeToString())
    return off


def _model(onnx: Any, description: Description, inputs: str) -> Any:
    universal = description.universal
    graph = Graph(onnx, np.float32 if universal is None else np.float64)
    directions = len(description.cost.weight_D)
    name, shape = ("local_rotations", [21, 3, 3]) if inputs == "poses" else ("directions", [directions, 3])
    if universal is not None:
        given = Value(graph, name, np.float32).cast(np.float64)
        target = Value(graph, _directions(graph, description, given.name)) if inputs == "poses" else given
        angles = onnx_universal.joint_angles(description, universal, target).cast(np.float32)
        limits = (limit.astype(np.float32) for limit in (description.cost.lower_N, description.cost.upper_N))
        return _finished(onnx, graph, description, inputs, name, shape, angles.clip(*limits).name)
    if description.settings.features == "local":
        rows = graph.gather(name, description.features.input_I, 1)
        columns = graph.node("Transpose", graph.gather(rows, [0, 1], 3), perm=[0, 1, 3, 2])
        features = graph.flat(columns, 6 * len(description.features.input_I))
    else:
        features = _features(graph, description, _directions(graph, description, name) if inputs == "poses" else name)
    raw = features
    for stage in (description.pre, description.post):
        raw = _branched(graph, stage, raw, description.settings.residual) if stage else raw
    return _finished(onnx, graph, description, inputs, name, shape, _limited(graph, description, raw))


def _finished(
    onnx: Any, graph: Graph, description: Description, inputs: str, name: str, shape: list[int], angles: str
) -> Any:
    # No runtime can refuse a frame: what is no number makes all of its joints none, or some would be made up.
    nothing = graph.node("Mul", graph.flat(name, math.prod(shape)), graph.constant(0.0, np.float32))
    nothing = graph.node("ReduceSum", nothing, graph.numbers([1]), keepdims=1)
    graph.node("Add", angles, nothing, output="joint_angles")
    helper, single, joints = onnx.helper, onnx.TensorProto.FLOAT, len(description.cost.lower_N)
    made = helper.make_graph(
        graph.nodes, "mrhubo",
        [helper.make_tensor_value_info(name, single, ["batch", *shape])],
        [helper.make_tensor_value_info("joint_angles", single, ["batch", joints])],
        graph.constants,
    )  # fmt: skip
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", _OPSET)], producer_name="mrhubo")
    model.ir_version = _IR
    helper.set_model_props(model, meaning(description, inputs))
    onnx.checker.check_model(model, full_check=True)
    return model


def _directions(graph: Graph, description: Description, poses: str) -> str:
    """Directions (B, D, 3) of poses, as `mrhubo.fast.plain.human` works them out."""
    human = description.human
    rows = graph.gather(poses, human.joint_P, 1)
    first, second = (graph.at(rows, column, 3) for column in (0, 1))

    def scaled(a: str) -> str:
        square = graph.node("Add", graph.dot(a, a), graph.constant(_TINY))
        return graph.node("Div", a, graph.node("Sqrt", square))

    x = scaled(first)
    for _ in range(2):
        second = graph.node("Sub", second, graph.node("Mul", graph.dot(x, second), x))
    y = scaled(second)
    turns = graph.stack([x, y, graph.cross(x, y)], 3)
    places: dict[int, str] = {}
    for place, parent in enumerate(human.parent_P.tolist(), 1):
        own = graph.at(turns, place - 1, 1)
        places[place] = graph.node("MatMul", places[parent], own) if parent else own
    like = graph.node("Mul", places[1], graph.constant(0.0))
    places[0] = graph.node("Add", like, graph.constant(np.eye(3)))
    turned = graph.stack([places[place] for place in human.place_D.tolist()], 1)
    found = graph.node(
        "Squeeze", graph.node("MatMul", turned, graph.constant(human.rest_D3[..., None])), graph.numbers([3])
    )
    if len(human.bend_Z):
        found = _with_bends(graph, description, found)
    seen = graph.stack([places[int(human.view_V[view])] for view in human.seen_D.tolist()], 1)
    rows = graph.node("MatMul", graph.node("Unsqueeze", found, graph.numbers([2])), seen)
    return graph.node("Squeeze", rows, graph.numbers([2]))


def _with_bends(graph: Graph, description: Description, found: str) -> str:
    """The directions with those of bend axes worked out of the limbs'."""
    human, constants = description.human, description.settings.constants
    upper, lower, own = (graph.gather(found, places, 1) for places in (human.upper_Z, human.lower_Z, human.bend_Z))
    across, cosine = graph.cross(upper, lower), graph.dot(upper, lower)
    sine = graph.node("Sqrt", graph.dot(across, across))
    # ONNX has no atan2: of a sine that is not negative it is twice the arc tangent of sine / (length + cosine).
    length = graph.node("Sqrt", graph.node("Add", graph.node("Mul", sine, sine), graph.node("Mul", cosine, cosine)))
    below = graph.node("Max", graph.node("Add", length, cosine), graph.constant(SHORT))
    bend = graph.node("Mul", graph.atan(graph.node("Div", sine, below)), graph.constant(2.0))

    def rising(name: str) -> str:
        low, high = (math.radians(constants[f"{name}_{end}_deg"]) for end in ("low", "high"))
        share = graph.node("Div", graph.node("Sub", bend, graph.constant(low)), graph.constant(high - low))
        share = graph.node("Clip", share, graph.constant(0.0), graph.constant(1.0))
        rest = graph.node("Sub", graph.constant(3.0), graph.node("Mul", share, graph.constant(2.0)))
        return graph.node("Mul", graph.node("Mul", share, share), rest)

    plane, one = rising("plane"), graph.constant(1.0)
    own = graph.unit(graph.node("Sub", own, graph.node("Mul", upper, graph.dot(upper, own))))
    own = graph.node("Mul", graph.node("Sub", one, plane), own)
    axis = graph.node("Add", graph.node("Mul", plane, graph.unit(across)), own)
    axis = graph.node("Mul", axis, graph.node("Sub", one, rising("needed")))
    order = np.arange(len(human.place_D))
    order[human.bend_Z] = len(order) + np.arange(len(human.bend_Z))
    return graph.gather(graph.node("Concat", found, axis, axis=1), order, 1)


def _features(graph: Graph, description: Description, directions: str) -> str:
    """What the networks see of directions, as `mrhubo.fast.plain.networks.features_of`."""
    f = description.features
    vectors, count = graph.gather(directions, f.input_I, 1), len(f.input_I)
    parts, unit = [graph.flat(vectors, 3 * count)], vectors
    if len(f.bend_W):
        bend, upper, lower = (graph.gather(vectors, places, 1) for places in (f.bend_W, f.upper_W, f.lower_W))
        length = graph.node("Sqrt", graph.dot(bend, bend))
        missing = graph.node("Max", graph.node("Sub", graph.constant(1.0), length), graph.constant(0.0))
        bend = graph.node("Add", bend, graph.node("Mul", missing, graph.unit(graph.cross(upper, lower))))
        parts.append(graph.flat(bend, 3 * len(f.bend_W)))
        order = np.arange(count)
        order[f.bend_W] = count + np.arange(len(f.bend_W))
        unit = graph.gather(graph.node("Concat", vectors, bend, axis=1), order, 1)
    if len(f.first_O):
        cosine = graph.dot(graph.gather(unit, f.first_O, 1), graph.gather(unit, f.second_O, 1))
        parts.append(graph.flat(cosine, len(f.first_O)))
    if len(f.limb_M):
        along, axis, seen = (graph.gather(unit, places, 1) for places in (f.limb_M, f.axis_M, f.seen_M))
        axis = graph.unit(graph.node("Sub", axis, graph.node("Mul", along, graph.dot(along, axis))))
        views = [graph.dot(seen, view) for view in (along, axis, graph.cross(along, axis))]
        parts.append(graph.flat(graph.node("Concat", *views, axis=2), 3 * len(f.limb_M)))
    shifted = graph.node("Sub", graph.node("Concat", *parts, axis=1), graph.constant(f.center_F))
    return graph.node("Mul", shifted, graph.constant(f.scale_F))


def _branched(graph: Graph, stage: tuple[Part, ...], x: str, residual: bool) -> str:
    found, given = [], np.concatenate([part.output for part in stage])
    for part in stage:
        y = graph.gather(x, part.input, 1)
        for number, (weight, bias) in enumerate(part.layers):
            into = _gelu(graph, y) if number else y
            z = graph.node("Gemm", into, graph.constant(weight), graph.constant(bias), transB=1)
            y = graph.node("Add", y, z) if residual and 0 < number < len(part.layers) - 1 else z
        found.append(y)
    return graph.gather(graph.node("Concat", *found, axis=1), given.argsort(), 1)


def _gelu(graph: Graph, x: str) -> str:
    erf = graph.node("Erf", graph.node("Mul", x, graph.constant(math.sqrt(0.5))))
    twice = graph.node("Add", erf, graph.constant(1.0))
    return graph.node("Mul", graph.node("Mul", x, twice), graph.constant(0.5))


def _limited(graph: Graph, description: Description, raw: str) -> str:
    lower_N, upper_N = (limit.astype(np.float32) for limit in (description.cost.lower_N, description.cost.upper_N))
    share = graph.node("Tanh", raw) if description.settings.bound == "tanh" else raw
    angle = graph.node("Mul", share, graph.constant((upper_N - lower_N) / 2))
    angle = graph.node("Add", angle, graph.constant((upper_N + lower_N) / 2))
    angle = graph.node("Max", angle, graph.constant(lower_N))
    return graph.node("Min", angle, graph.constant(upper_N))


def _answers(onnx: Any, model: Any, retargeter: Retargeter, inputs: str, given: Tensor) -> np.ndarray:
    """Of the file to poses (B, N) [rad], as ONNX's own evaluator works them out."""
    if inputs == "directions":
        given = retargeter.body_map.human_directions(given.to(retargeter.device)).cpu()
    evaluator = onnx.reference.ReferenceEvaluator(model)
    return evaluator.run(None, {model.graph.input[0].name: given.numpy().astype(np.float32)})[0]
