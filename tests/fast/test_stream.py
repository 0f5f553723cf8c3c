"""A stream without PyTorch gives the numbers of the one with it, and exceeds no limit."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import mrhubo
from mrhubo import rotation
from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter, FastStream, StreamSettings
from mrhubo.fast.description import FILE
from mrhubo.fast.engines import FORMS
from mrhubo.motion import read_motion
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import Stream
from tests.fast.exact import double, in_double

SAME_RAD = 1e-5
"""PyTorch works in float64 in this comparison, but the networks' answers, from which one of the two followed answers
begins, are float32 here: they differ by up to 2e-6 rad, and where a joint hardly matters a step makes more of that."""
Frames = list[tuple[Any, float | None]]
FORM = pytest.mark.parametrize("form", FORMS)


@pytest.fixture(scope="module", autouse=True)
def _one_thread(one_thread: None) -> None:
    """Small batches."""


@pytest.fixture(scope="module")
def seen(root: Path) -> Tensor:
    """A person who moves, seen with two degrees of noise; there is a leap after 40 frames."""
    motion = read_motion(root / "data" / "motions" / "stretch.npz").local_TJ33
    poses = torch.cat((motion[60:100], motion[:10]))
    noise = math.radians(2) * torch.randn(50, 21, 3, generator=torch.Generator().manual_seed(0))
    return poses @ rotation.axis_angle_to_matrix(noise)


@pytest.fixture(scope="module")
def make_fast(make: Callable[[str], Retargeter]) -> Callable[[str, str], FastRetargeter]:
    """Function of a robot's name and a form."""
    made: dict[tuple[str, str], FastRetargeter] = {}

    def of(name: str, form: str) -> FastRetargeter:
        if form == "compiled":
            pytest.importorskip("numba")
        if (name, form) not in made:
            made[name, form] = FastRetargeter(make(name).describe(), form)
        return made[name, form]

    return of


def regular(seen: Tensor) -> Frames:
    return [(pose, None) for pose in seen]


def irregular(seen: Tensor) -> Frames:
    """Times of all kinds, some of them twice; gaps short and long; NaN; nobody at first."""
    step = 10 ** (-2.5 + 1.5 * torch.rand(len(seen), generator=torch.Generator().manual_seed(1)).double())
    step[torch.tensor([10, 20])], step[30] = 0.0, 3.0
    frames: Frames = list(zip(seen, (50 + step.cumsum(0)).tolist(), strict=True))
    broken = seen[5].clone()
    broken[7, 1, 2] = torch.nan
    for frame in (0, 1, 12, 13, 14, 40):
        frames[frame] = None, frames[frame][1]
    frames[22] = broken, frames[22][1]
    return frames


@pytest.mark.parametrize(
    ("name", "frames"), [("nao", regular), ("nao", irregular), ("coman", regular), ("reachy", irregular)]
)
def test_the_numbers_are_those_of_the_stream_in_pytorch(
    make: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter], seen: Tensor,
    name: str, frames: Callable[[Tensor], Frames],
) -> None:  # fmt: skip
    given, settings = frames(seen), StreamSettings(worse_time=0.05)
    retargeter = in_double(make(name))
    with double():
        exact = Stream(retargeter, settings=settings)
        wanted = [exact.joints(None if pose is None else pose.double(), time).numpy() for pose, time in given]

    def run(form: str, settings: StreamSettings) -> np.ndarray:
        stream = FastStream(make_fast(name, form), settings=settings)
        return np.stack([stream.joints(None if pose is None else pose.numpy(), time) for pose, time in given])

    np.testing.assert_allclose(run("numpy", settings), wanted, atol=SAME_RAD, rtol=0)
    stays = run("numpy", StreamSettings(worse_time=1e3))
    assert np.abs(stays - wanted).max() > 0.1, "nothing has gone over to the other answer"
    np.testing.assert_allclose(run("compiled", settings), wanted, atol=SAME_RAD, rtol=0)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_who_touches_gives_way_as_in_pytorch(
    make: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter], root: Path, name: str
) -> None:
    """Arms that cross in front of the chest, and a hand that is led through the other."""
    motion = read_motion(root / "data" / "motions" / "crossing_arms.npz").local_TJ33[100:340:10]
    retargeter = in_double(make(name))
    with double():
        exact = Stream(retargeter, rate=10)
        wanted = np.stack([exact.joints(pose.double()).numpy() for pose in motion])
    for form in FORMS:
        stream = FastStream(make_fast(name, form), rate=10)
        found = np.stack([stream.joints(pose.numpy()) for pose in motion])
        np.testing.assert_allclose(found, wanted, atol=SAME_RAD, rtol=0)
    stream = FastStream(make_fast(name, "numpy"), rate=10, settings=StreamSettings(avoid_collisions=False))
    shown = np.stack([stream.joints(pose.numpy()) for pose in motion])
    touching = make(name).collision.collides
    before, after = (float(touching(torch.from_numpy(q).float()).float().sum()) for q in (shown, wanted))
    assert before > 4 * after and before >= 2


@FORM
def test_what_is_told_of_an_answer(
    make: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter], seen: Tensor, form: str
) -> None:
    retargeter, stream = make("nao"), FastStream(make_fast("nao", form))
    for pose in seen[:3]:
        answer = stream(pose.numpy())
    wanted = retargeter.judge(torch.from_numpy(answer.q)[None], pose[None])
    for name, most in (("confidence", 1e-4), ("direction_error_deg", 2e-3), ("phi", 1e-4), ("collision", 0)):
        found = np.asarray(getattr(answer, name), float)
        assert np.abs(found - getattr(wanted, name)[0].double().numpy()).max() <= most
    assert answer.q.shape == (8,) and answer.confidence is not None and answer.confidence.shape == ()
    nobody = stream(None)
    assert nobody.confidence == 0 and not np.any(nobody.branch_confidence) and answer.confidence > 0


@FORM
def test_no_limit_is_exceeded_whatever_comes_in(
    make_fast: Callable[[str, str], FastRetargeter], seen: Tensor, form: str
) -> None:
    fast, generator, time = make_fast("nao", form), np.random.default_rng(0), 0.0
    limits, settings = fast.facts, StreamSettings()
    assert limits.lower is not None and limits.upper is not None and limits.velocity is not None
    stream, last, last_time, last_speed = FastStream(fast), None, 0.0, np.zeros(8)
    for frame in range(150):
        pose: Any = seen[frame % 50].numpy()
        if frame % 6 == 1:
            pose = generator.normal(0, 2, 63)
            pose *= min(1, 18 / np.abs(pose).max() / math.sqrt(3))
        elif frame % 6 == 2:
            pose = None
        elif frame % 6 == 3:
            pose = pose.copy()
            pose[3, 1, 1] = np.nan if frame % 2 else -np.inf
        passed = 10 ** -generator.uniform(1, 3)
        time += passed
        q = stream.joints(pose, time)
        assert q.dtype == np.float32 and ((q >= limits.lower) & (q <= limits.upper)).all()
        if last is not None:
            speed = (q.astype(float) - last) / (time - last_time)
            assert (np.abs(speed) <= limits.velocity).all(), frame
            most = limits.velocity * (time - last_time) / settings.ramp_time
            assert (np.abs(speed - last_speed) <= most + 1e-5 / passed).all(), frame  # angles are float32
            last_speed = speed
        last, last_time = q, time


@FORM
def test_times_gaps_and_where_the_robot_stands(
    make_fast: Callable[[str, str], FastRetargeter], seen: Tensor, form: str
) -> None:
    fast, poses = make_fast("nao", form), seen.numpy()
    velocity, upper = fast.facts.velocity, fast.facts.upper
    assert velocity is not None and upper is not None
    stream = FastStream(fast, rate=30)
    home = stream.joints(None)
    np.testing.assert_array_equal(home, np.clip(0, fast.facts.lower, upper).astype(np.float32))
    stream.reset()
    free = stream.joints(poses[0], 1.0)
    np.testing.assert_allclose(free, fast.predict(poses[0], 10), atol=1e-6)
    later = stream.joints(poses[40], 1.02)
    np.testing.assert_array_equal(stream.joints(poses[9], 1.02), later)
    for time in (1.01, math.nan, math.inf, "1", True):
        with pytest.raises(UserError, match="stream: (time goes back|the time of a frame)"):
            stream.joints(poses[3], time)  # type: ignore[arg-type]
    after = stream.joints(poses[5], np.float64(60.0))
    stream.reset(later)
    np.testing.assert_array_equal(stream.joints(poses[9], 0.0), stream.joints(poses[3], 1e-300))
    assert np.isfinite(stream.joints(poses[3], 0.1)).all()
    assert (np.abs(after - later) <= velocity * stream.settings.longest_gap + 1e-6).all()
    stream.reset(upper)
    first = stream.joints(poses[0], 5.0)
    assert (np.abs(first - upper) <= velocity / 30).all() and np.abs(first - free).max() > 0.01
    stream.reset()
    np.testing.assert_array_equal(stream.joints(poses[0]), free)


@pytest.mark.parametrize("shape", [(2, 21, 3, 3), (1, 21, 3, 3), (63, 1), (5,), (20, 3, 3), (0,), ()])
def test_what_is_no_pose_is_refused_and_changes_nothing(
    make_fast: Callable[[str, str], FastRetargeter], seen: Tensor, shape: tuple[int, ...]
) -> None:
    one, other = (FastStream(make_fast("nao", "numpy")) for _ in range(2))
    one.joints(seen[0].numpy())
    for number in (0.0, np.nan):
        with pytest.raises(UserError):
            one.joints(np.full(shape, number))
    with pytest.raises(UserError, match="no rotation"):
        one.joints(1.5 * seen[1].numpy())
    with pytest.raises(UserError, match="numbers"):
        one.joints("pose")
    other.joints(seen[0].numpy())
    np.testing.assert_array_equal(one.joints(seen[1].numpy()), other.joints(seen[1].numpy()))


def test_what_a_stream_cannot_be(make_fast: Callable[[str, str], FastRetargeter], root: Path) -> None:
    fast = make_fast("nao", "numpy")
    assert mrhubo.FastStream is FastStream
    for rate in (0, math.nan, None, "60"):
        with pytest.raises(UserError, match="frame rate"):
            FastStream(fast, rate=rate)  # type: ignore[arg-type]
    stream = FastStream(fast)
    for q in (np.zeros(7), np.full(8, 9.0), np.full(8, np.nan), ["a"] * 8):
        with pytest.raises(UserError, match="stream: q"):
            stream.reset(q)
    with pytest.raises(UserError, match="motion of"):
        stream(read_motion(root / "data" / "motions" / "wave.npz"))


def test_a_stream_says_which_one_is_for_a_retargeter(
    make: Callable[[str], Retargeter], make_fast: Callable[[str, str], FastRetargeter]
) -> None:
    with pytest.raises(UserError, match=r"its stream is mrhubo\.FastStream"):
        mrhubo.Stream(make_fast("nao", "numpy"))  # type: ignore[arg-type]
    with pytest.raises(UserError, match=r"the stream of others is mrhubo\.Stream"):
        FastStream(make("nao"))  # type: ignore[arg-type]


def test_it_needs_no_pytorch(make: Callable[[str], Retargeter], seen: Tensor, tmp_path: Path) -> None:
    nao = make("nao")
    shutil.copy(nao.save(tmp_path / "nao", {}) / FILE, tmp_path / "robot.safetensors")
    np.save(tmp_path / "poses.npy", seen[:5].numpy())
    script = (
        "import sys; sys.modules.update(torch=None, lightning=None, scipy=None, yourdfpy=None, pytorch_kinematics=None)\n"
        "import mrhubo, numpy\n"
        "from mrhubo.fast import StreamSettings\n"
        "fast = mrhubo.load_fast('robot.safetensors', 'numpy')\n"
        "stream = mrhubo.FastStream(fast, 50, StreamSettings(rest_time=0.2))\n"
        "numpy.save('q.npy', [stream(pose).q for pose in numpy.load('poses.npy')])\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    stream = FastStream(mrhubo.load_fast(tmp_path / "nao", "numpy"), 50, StreamSettings(rest_time=0.2))
    np.testing.assert_array_equal(np.load(tmp_path / "q.npy"), [stream(pose.numpy()).q for pose in seen[:5]])
