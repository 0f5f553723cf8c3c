"""How long an answer takes in each form and by each rival, and how near it is: one frame, batches, a process's start.

    python benchmarks/inference.py PACKAGE [--batch 10000] [--rounds 300] [--frames 600]

PACKAGE is the folder of a trained retargeter. Forms: PyTorch; NumPy and numba (`mrhubo.load_fast`), the latter where
numba is installed; ONNX Runtime where it and onnx are. A frame is answered by one thread, batches by all cores; figures
are medians, and what a busy machine adds is in them.

Rivals, where they can do the robot and are installed (what is left out is said): mink's loop of differential inverse
kinematics with dense targets and with the ends alone (`mink_loop.py` says which), a closed form for arms of seven
joints (`closed_form.py`), and our optimiser, which tries twelve starts for each frame. Joints, limbs and hands are
those of arms; joints are compared with the optimiser's, which is fair only where one answer is best. Poses, 60 a
second: parts of the motions that ship (easy), and a path through poses drawn joint by joint, one a second (wide).
"""

from __future__ import annotations

import importlib.util
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from closed_form import ClosedForm, NoClosedForm
from common import print_header, print_table, read_options
from mink_loop import MinkLoop, NoLoop

import mrhubo
from mrhubo.fast.engines import FORMS
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.pairing.random_poses import random_poses
from mrhubo.reference import DirectionProblem, OptimizationRetargeter, direction_error, joint_error
from mrhubo.retargeter import Retargeter
from mrhubo.robot import BodyMap
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.threads import use_threads

_RATE = 60.0
_WARM_UP = 5
OURS = ("network", "1 step", "10 steps")
Answer = Callable[[np.ndarray], Any]
"""Of a frame (21, 3, 3), or of many."""


def there(*names: str) -> bool:
    """Whether packages are installed."""
    return all(importlib.util.find_spec(name) is not None for name in names)


def microseconds(answer: Answer, poses: np.ndarray, rounds: int) -> str:
    """Median of a frame's answer."""
    for number in range(_WARM_UP):
        answer(poses[number % len(poses)])
    taken = []
    for number in range(rounds):
        pose = poses[number % len(poses)]
        start = time.perf_counter()
        answer(pose)
        taken.append(time.perf_counter() - start)
    return f"{1e6 * statistics.median(taken):,.0f}"


def per_second(answer: Answer, poses: np.ndarray) -> str:
    """Frames a second of a batch, the best of three."""
    answer(poses)
    taken = []
    for _ in range(3):
        start = time.perf_counter()
        answer(poses)
        taken.append(time.perf_counter() - start)
    return f"{len(poses) / min(taken):,.0f}"


def columns(package: Path, retargeter: Retargeter) -> dict[str, dict[str, Answer]]:
    """By form: the network alone, after 1 and at most 10 steps, and all that is told of an answer. Only the last gives
    way where the robot would touch itself, which neither the optimum nor rivals do.
    """

    def torch_poses(poses: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(poses.reshape(-1, 21, 3, 3))

    found: dict[str, dict[str, Answer]] = {
        "PyTorch": {
            "network": lambda poses: retargeter.predict(torch_poses(poses)),
            "1 step": lambda poses: retargeter.predict(torch_poses(poses), 1, avoid_collisions=False),
            "10 steps": lambda poses: retargeter.predict(torch_poses(poses), 10, avoid_collisions=False),
            "all": lambda poses: retargeter.retarget(torch_poses(poses)),
        }
    }
    for form in FORMS if there("numba") else FORMS[1:]:
        fast = mrhubo.load_fast(package, form)
        found[form] = {
            "network": fast.predict,
            "1 step": lambda poses, fast=fast: fast.predict(poses, 1, False),
            "10 steps": lambda poses, fast=fast: fast.predict(poses, 10, False),
            "all": fast,
        }
    if there("onnx", "onnxruntime"):
        found["ONNX Runtime"] = {"network": onnx_answer(retargeter)}
    return found


def onnx_answer(retargeter: Retargeter) -> Answer:
    """The exported file in ONNX Runtime, one thread."""
    import onnxruntime  # pyright: ignore[reportMissingImports]

    from mrhubo.exporting import write_onnx

    with tempfile.TemporaryDirectory() as folder:
        write_onnx(retargeter, Path(folder) / "robot.onnx")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        session = onnxruntime.InferenceSession(Path(folder) / "robot.onnx", options)
    return lambda poses: session.run(None, {"local_rotations": poses.reshape(-1, 21, 3, 3)})[0]


@dataclass(frozen=True)
class Rival:
    """A way of answering frame by frame."""

    name: str
    make: Callable[[], Answer]
    """A new one, which has not answered yet: some go on from their last answer."""
    directions: bool
    """Whether it is asked by the human's directions (D, 3), not by the pose."""
    batches: bool = False
    """Whether it answers many frames at once."""


def easy(frames: int) -> torch.Tensor:
    """As many frames from the middle of each motion that ships, one after the other, at 60 a second."""
    motions = [read_motion(path) for path in sorted((project_root() / "data" / "motions").glob("*.npz"))]
    each = max(1, frames // len(motions))
    middles = [resample(motion, _RATE).local_TJ33 for motion in motions]
    middles = [local[max(0, (len(local) - each) // 2) :][:each] for local in middles]
    return torch.cat(middles)[:frames].float()


def wide(body_map: BodyMap, frames: int) -> torch.Tensor:
    """A path through random poses, one a second."""
    keys = random_poses(body_map.keypoints.parts, 2 + int(frames / _RATE), torch.Generator().manual_seed(0))
    return resample(Motion("wide", keys, 1.0), _RATE).local_TJ33[:frames].float()


def rivals(retargeter: Retargeter, forms: Mapping[str, Mapping[str, Answer]]) -> tuple[list[Rival], list[str]]:
    """Ways of answering frame by frame, and those that had to be left out, with the reason."""
    body_map = retargeter.body_map
    best = "compiled" if "compiled" in forms else "numpy"
    found = [Rival(f"{name} ({best})", lambda name=name: forms[best][name], False) for name in OURS]
    missing = []
    if there("mink", "mujoco", "daqp"):
        try:
            for which, iterations in (("dense", 1), ("dense", 10), ("ends", 10)):
                make = partial(MinkLoop, body_map, iterations, which == "dense")
                name = f"mink, {which}, {make().targets} targets, iterations: {iterations}"
                found.append(Rival(name, lambda make=make: make().of_directions, True))
        except NoLoop as error:
            missing.append(f"mink's loop is not written for {error}")
    else:
        missing.append("mink: is not installed (pip install mink mujoco daqp)")
    try:
        form = ClosedForm(body_map)
        found.append(Rival("closed form (NumPy)", lambda: form.of_directions, True, batches=True))
    except NoClosedForm as error:
        missing.append(f"closed form of seven-joint arms: {error}")
    return found, missing


def nearness(body_map: BodyMap, ways: Sequence[Rival], frames: int) -> list[list[str]]:
    """Rows: what a frame takes [us], joints [rad] against the frame's optimum, limbs over it and hands over it [deg],
    for each way and each kind of motion.
    """
    rows = []
    reference = OptimizationRetargeter(body_map)
    moved = [i for i, turned in enumerate(arm_joints(body_map)) if turned]
    for kind, poses in (("easy", easy(frames)), ("wide", wide(body_map, frames))):
        optimum_TN = reference.solve_frames(poses)[0]
        optimum = {region: errors(body_map, optimum_TN, poses, region) for region in ("arm", "hand")}
        directions_TD3 = body_map.human_directions(poses).numpy()
        for way in ways:
            answer, taken, found = way.make(), [], []
            for asked in directions_TD3 if way.directions else poses.numpy():
                begun = time.perf_counter()
                found.append(np.asarray(answer(asked)))
                taken.append(time.perf_counter() - begun)
            q_TN = torch.from_numpy(np.stack(found)).float()
            over = {region: errors(body_map, q_TN, poses, region) - of for region, of in optimum.items()}
            joints_T = joint_error(q_TN[:, moved], optimum_TN[:, moved])
            cells = [f"{1e6 * statistics.median(taken):,.0f}", f"{float(joints_T.mean()):.3f}"]
            rows.append([kind, way.name, *cells, *figures(over["arm"]), *figures(over["hand"])[:1]])
        shown = poses[:: max(1, len(poses) // 5)][:5].numpy()
        single = microseconds(lambda pose: reference.solve_frames(torch.from_numpy(pose[None])), shown, len(shown))
        rows.append([kind, "reference", single, "0", *figures(optimum["arm"]), *figures(optimum["hand"])[:1]])
    return rows


def arm_joints(body_map: BodyMap) -> list[bool]:
    """Which joints (N,) turn something of an arm or a hand."""
    problem = DirectionProblem(body_map)
    of_arms = [direction.part.region in ("arm", "hand") for direction in body_map.directions]
    turns_C = (problem.blocks.directions_DC[torch.tensor(of_arms)] > 0).any(dim=0)
    return [bool(turns_C[block]) for block in problem.blocks.block_N.tolist()]


def errors(body_map: BodyMap, q_TN: torch.Tensor, local_TJ33: torch.Tensor, region: str) -> torch.Tensor:
    """Mean angle of a region's directions in each frame (T,) [degrees]; NaN where there are none."""
    of = [d.part.region == region for i, d in enumerate(body_map.directions) if i in body_map.measured]
    return direction_error(body_map, q_TN, local_TJ33)[:, torch.tensor(of)].mean(dim=1)


def figures(error_T: torch.Tensor) -> list[str]:
    """Mean, 99th percentile and largest; nothing where the robot has no such part."""
    if bool(error_T.isnan().any()):
        return ["", "", ""]
    return [f"{float(figure):.2f}" for figure in (error_T.mean(), error_T.quantile(0.99), error_T.max())]


def start(package: Path, form: str) -> list[str]:
    """Seconds and memory of a new process to its first answer."""
    script = (
        "import time; begun = time.perf_counter()\n"
        "import sys, mrhubo, numpy\n"
        f"load = mrhubo.load if {form!r} == 'PyTorch' else lambda p: mrhubo.load_fast(p, {form!r})\n"
        "load(sys.argv[1])(numpy.broadcast_to(numpy.eye(3, dtype='f4'), (21, 3, 3)))\n"
        "lines = dict(line.split(':', 1) for line in open('/proc/self/status'))\n"
        "memory = int(lines['VmHWM'].split()[0]) / 1024\n"
        "print(time.perf_counter() - begun, memory, 'torch' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": str(project_root())}
    runs = []
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", script, str(package.resolve())], env=environment, capture_output=True, text=True
        )
        if done.returncode:
            raise SystemExit(done.stderr)
        runs.append(done.stdout.split())
    seconds, memory, with_torch = min(runs, key=lambda run: float(run[0]))
    return [form, f"{float(seconds):.2f}", f"{float(memory):.0f}", "yes" if with_torch == "True" else "no"]


def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, rest = read_options(argv, batch="10000", rounds="300", frames="600")
    if len(rest) != 1 or not Path(rest[0]).is_dir():
        sys.exit("usage: python benchmarks/inference.py [--batch N] [--rounds N] [--frames N] PACKAGE")
    package, batch, rounds, frames = Path(rest[0]), *(int(options[name]) for name in ("batch", "rounds", "frames"))
    print_header()
    retargeter = mrhubo.load(package)
    forms, poses = columns(package, retargeter), easy(300).numpy()
    names = ["network", "1 step", "10 steps", "all"]
    with use_threads(1):
        rows = [
            [form, *(microseconds(ways[name], poses, rounds) if name in ways else "" for name in names)]
            for form, ways in forms.items()
        ]
    print("one frame, one thread [us]; `all`: at most 10 steps, confidence and collision\n")
    print_table(["form", *names], rows)
    many = np.ascontiguousarray(np.resize(poses, (batch, 21, 3, 3)))
    print(f"\nbatches of {batch:,}, {torch.get_num_threads()} threads [frames a second]\n")
    rows = [
        [form, *(per_second(ways[name], many) if name in ways else "" for name in ("network", "all"))]
        for form, ways in forms.items()
    ]
    ways, missing = rivals(retargeter, forms)
    for way in ways:
        if way.batches:
            targets = retargeter.body_map.human_directions(torch.from_numpy(many)).numpy()
            rows.append([way.name, per_second(way.make(), targets), ""])
    print_table(["form", "network", "all"], rows)
    print("\na new process, to its first answer (best of three)\n")
    ready = ["PyTorch", *(FORMS if there("numba") else FORMS[1:])]
    print_table(["form", "seconds", "memory [MB]", "torch"], [start(package, form) for form in ready])
    print(f"\nframe by frame by one thread, limbs and hands over the frame's optimum, {frames} frames\n")
    with use_threads(1):
        table = nearness(retargeter.body_map, ways, frames)
    print_table(["motion", "way", "[us]", "joints [rad]", "limbs [deg]", "99%", "largest", "hands [deg]"], table)
    for sentence in missing:
        print(f"\nleft out: {sentence}")


if __name__ == "__main__":
    main(sys.argv[1:])
