"""How long an answer takes in each form, and how near it is: one frame, batches, the start of a process.

    python benchmarks/inference.py PACKAGE [--batch 10000] [--rounds 300] [--frames 600]

PACKAGE is the folder of a trained retargeter. Forms: PyTorch; NumPy and numba (`mrhubo.load_fast`), the latter where
numba is installed; ONNX Runtime where it and onnx are. mink's loop of differential inverse kinematics, as
docs/compare.md writes it, is timed beside them where mink and MuJoCo are and every limb of the robot runs from link to
link. A frame is answered by one thread, batches by all cores; figures are medians, and what a busy machine adds is in
them. Poses: the motions that ship (easy), and a path through poses drawn joint by joint, one a second (wide).
"""

from __future__ import annotations

import importlib.util
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from common import print_header, print_table, read_options

import mrhubo
from mrhubo.fast.engines import FORMS
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.pairing.random_poses import random_poses
from mrhubo.reference import OptimizationRetargeter, direction_error
from mrhubo.retargeter import Retargeter
from mrhubo.robot import BodyMap
from mrhubo.robot.keypoints import Limb
from mrhubo.runtime.locations import project_root
from mrhubo.runtime.threads import use_threads

_RATE = 60.0
_WARM_UP = 5
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
    """By form: the network alone, after 1 and at most 10 steps, and all that is told of an answer."""

    def torch_poses(poses: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(poses.reshape(-1, 21, 3, 3))

    found: dict[str, dict[str, Answer]] = {
        "PyTorch": {
            "network": lambda poses: retargeter.predict(torch_poses(poses)),
            "1 step": lambda poses: retargeter.predict(torch_poses(poses), 1),
            "10 steps": lambda poses: retargeter.predict(torch_poses(poses), 10),
            "all": lambda poses: retargeter.retarget(torch_poses(poses)),
        }
    }
    for form in FORMS if there("numba") else FORMS[1:]:
        fast = mrhubo.load_fast(package, form)
        found[form] = {
            "network": fast.predict,
            "1 step": lambda poses, fast=fast: fast.predict(poses, 1),
            "10 steps": lambda poses, fast=fast: fast.predict(poses, 10),
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


class MinkLoop:
    """mink's loop for a robot whose limbs run from link to link; it goes on from its last answer."""

    def __init__(self, body_map: BodyMap, iterations: int) -> None:
        import mink  # pyright: ignore[reportMissingImports]
        import mujoco  # pyright: ignore[reportMissingImports]

        robot = body_map.robot
        compiler = '<mujoco><compiler boundmass="0.01" boundinertia="0.001" fusestatic="false"/></mujoco>'
        begin, rest = robot.urdf.read_text().split("<robot", 1)
        head, body = rest.split(">", 1)
        model = mujoco.MjModel.from_xml_string(f"{begin}<robot{head}>{compiler}{body}")
        self._mink, self._body_map, self._iterations = mink, body_map, iterations
        self._limbs = [limb for limb in body_map.directions if isinstance(limb, Limb)]
        self._columns = [int(model.joint(name).qposadr[0]) for name in robot.joint_names]
        self._tasks = {
            limb.end.link: mink.FrameTask(limb.end.link, "body", position_cost=1.0, orientation_cost=0.0)
            for limb in self._limbs
        }
        self._posture, self._limits = mink.PostureTask(model, cost=1e-3), [mink.ConfigurationLimit(model)]
        self._configuration, q = mink.Configuration(model), np.zeros(model.nq)
        q[self._columns] = robot.home().numpy()
        self._configuration.update(q)
        self._posture.set_target_from_configuration(self._configuration)
        links = {link for limb in self._limbs for link in (limb.start.link, limb.end.link)}
        self._rest = {
            link: self._configuration.get_transform_frame_to_world(link, "body").translation() for link in links
        }

    @staticmethod
    def can(body_map: BodyMap) -> bool:
        """Whether every limb runs from link to link, and nothing else is to be imitated."""
        limbs = [d for d in body_map.directions if isinstance(d, Limb)]
        offsets = [point.offset_3 for limb in limbs for point in (limb.start, limb.end)]
        return len(limbs) == len(body_map.measured) and not np.any(offsets)

    def of_directions(self, direction_D3: np.ndarray) -> np.ndarray:
        """Joint angles (N,) [rad] for a human's directions (D, 3)."""
        places, names = dict(self._rest), self._body_map.direction_names
        for limb in self._limbs:
            length = np.linalg.norm(self._rest[limb.end.link] - self._rest[limb.start.link])
            direction_3 = direction_D3[names.index(limb.name), [2, 0, 1]]  # in the robot's axes
            places[limb.end.link] = places[limb.start.link] + length * direction_3
            target = self._mink.SE3.from_translation(places[limb.end.link])
            self._tasks[limb.end.link].set_target(target)
        for _ in range(self._iterations):
            tasks = [*self._tasks.values(), self._posture]
            velocity = self._mink.solve_ik(self._configuration, tasks, 0.1, "daqp", limits=self._limits)
            self._configuration.integrate_inplace(velocity, 0.1)
        return self._configuration.q[self._columns].copy()


def easy(frames: int) -> torch.Tensor:
    """Frames of the motions that ship, evenly."""
    motions = [read_motion(path) for path in sorted((project_root() / "data" / "motions").glob("*.npz"))]
    every = torch.cat([motion.local_TJ33 for motion in motions])
    return every[:: max(1, len(every) // frames)][:frames].float()


def wide(body_map: BodyMap, frames: int) -> torch.Tensor:
    """A path through random poses, one a second."""
    keys = random_poses(body_map.keypoints.parts, 2 + int(frames / _RATE), torch.Generator().manual_seed(0))
    return resample(Motion("wide", keys, 1.0), _RATE).local_TJ33[:frames].float()


def limb_errors(body_map: BodyMap, q_TN: torch.Tensor, local_TJ33: torch.Tensor) -> torch.Tensor:
    """Mean angle of each frame's measured directions (T,) [degrees]."""
    return direction_error(body_map, q_TN, local_TJ33).mean(dim=1)


def nearness(retargeter: Retargeter, forms: Mapping[str, Mapping[str, Answer]], frames: int) -> list[list[str]]:
    """Limbs over the frame's optimum: mean, 99th percentile and largest, for each way and each kind of motion."""
    body_map, rows = retargeter.body_map, []
    best = "compiled" if "compiled" in forms else "numpy"
    for kind, poses in (("easy", easy(frames)), ("wide", wide(body_map, frames))):
        optimum_T = limb_errors(body_map, OptimizationRetargeter(body_map).solve_frames(poses)[0], poses)
        answers = {
            name: torch.from_numpy(np.asarray(forms[best][name](poses.numpy()))) for name in list(forms[best])[:3]
        }
        if there("mink", "mujoco") and MinkLoop.can(body_map):
            targets = body_map.human_directions(poses).numpy()
            for iterations in (1, 10):
                loop = MinkLoop(body_map, iterations)
                found = np.stack([loop.of_directions(target) for target in targets])
                answers[f"mink, iterations: {iterations}"] = torch.from_numpy(found).float()
        for name, q_TN in answers.items():
            rows.append([kind, name, *figures(limb_errors(body_map, q_TN, poses) - optimum_T)])
        rows.append([kind, "optimum itself", *figures(optimum_T)])
    return rows


def figures(error_T: torch.Tensor) -> list[str]:
    """Mean, 99th percentile and largest."""
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
        if there("mink", "mujoco") and MinkLoop.can(retargeter.body_map):
            targets = retargeter.body_map.human_directions(torch.from_numpy(poses)).numpy()
            times = {n: microseconds(MinkLoop(retargeter.body_map, n).of_directions, targets, rounds) for n in (1, 10)}
            rows.append(["mink, as many iterations", "", times[1], times[10], ""])
    print("one frame, one thread [us]; `all`: at most 10 steps, confidence and collision\n")
    print_table(["form", *names], rows)
    many = np.ascontiguousarray(np.resize(poses, (batch, 21, 3, 3)))
    print(f"\nbatches of {batch:,}, {torch.get_num_threads()} threads [frames a second]\n")
    rows = [
        [form, *(per_second(ways[name], many) if name in ways else "" for name in ("network", "all"))]
        for form, ways in forms.items()
    ]
    print_table(["form", "network", "all"], rows)
    print("\na new process, to its first answer (best of three)\n")
    ready = ["PyTorch", *(FORMS if there("numba") else FORMS[1:])]
    print_table(["form", "seconds", "memory [MB]", "torch"], [start(package, form) for form in ready])
    print(f"\nlimbs over the frame's optimum [degrees], {frames} frames\n")
    print_table(["motion", "way", "mean", "99%", "largest"], nearness(retargeter, forms, frames))


if __name__ == "__main__":
    main(sys.argv[1:])
