"""mrhubo: human-to-humanoid motion retargeting that learns from robot poses (MR.HuBo).

    import mrhubo
    retargeter = mrhubo.load("mlruns/packages/nao-1a2b3c4d")     # the folder that a fit ends with
    result = retargeter(mrhubo.read_motion("data/motions/wave.npz"))
    result.q                                                    # joint angles (frames, joints) [rad]

These names are the public face; each is imported when it is first asked for, so that `import mrhubo` costs nothing.
Retargeting with a package needs neither Lightning nor MLflow.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from mrhubo.lazy import lazy_names

if TYPE_CHECKING:
    from pathlib import Path

    from mrhubo.errors import UserError
    from mrhubo.fast import FastRetargeter, FastStream
    from mrhubo.motion import Motion, ReadOptions, read_motion
    from mrhubo.reference import OptimizationRetargeter
    from mrhubo.retargeter import Retargeter, RetargetResult
    from mrhubo.robot import Robot
    from mrhubo.robot_motion import RobotMotion, read_robot_motion, write_robot_motion
    from mrhubo.streaming import Stream

    __version__: str

__all__ = [
    "FastRetargeter",
    "FastStream",
    "Motion",
    "OptimizationRetargeter",
    "ReadOptions",
    "RetargetResult",
    "Retargeter",
    "Robot",
    "RobotMotion",
    "Stream",
    "UserError",
    "__version__",
    "for_robot",
    "load",
    "load_fast",
    "read_motion",
    "read_robot_motion",
    "write_robot_motion",
]

_HOMES = {
    "FastRetargeter": "mrhubo.fast",
    "FastStream": "mrhubo.fast",
    "Motion": "mrhubo.motion",
    "OptimizationRetargeter": "mrhubo.reference",
    "ReadOptions": "mrhubo.motion",
    "RetargetResult": "mrhubo.retargeter",
    "Retargeter": "mrhubo.retargeter",
    "Robot": "mrhubo.robot",
    "RobotMotion": "mrhubo.robot_motion",
    "Stream": "mrhubo.streaming",
    "UserError": "mrhubo.errors",
    "read_motion": "mrhubo.motion",
    "read_robot_motion": "mrhubo.robot_motion",
    "write_robot_motion": "mrhubo.robot_motion",
}
"""Module of each public name."""


def load(source: str | os.PathLike[str]) -> Retargeter:
    """A trained retargeter, on the CPU; `.to("cuda")` moves it.

    Args:
        source: the folder of a package, or a version in MLflow's registry: `models:/mrhubo-nao/3`, or with an alias
            `models:/mrhubo-nao@best`. The registry is the one that MLflow is set to (MLFLOW_TRACKING_URI), else that of
            `mlruns`. Only such a URI imports mlflow.

    Raises:
        UserError: there is no such folder or version, or it holds no whole package.
    """
    from mrhubo.retargeter import Retargeter

    return Retargeter.load(package_folder(source))


def for_robot(robot: Robot | str | os.PathLike[str], whole_body: bool = False, start: str = "universal") -> Retargeter:
    """A retargeter for a robot that nothing was trained for, by the network that is the same for every robot.

        retargeter = mrhubo.for_robot("my.urdf", whole_body=True)

    Made in seconds. It answers motions, poses and streams with a confidence as a trained one does (docs/universal.md).
    `mrhubo.load_fast` makes the form without PyTorch of it.

    Args:
        robot: a `Robot` that knows its body parts; or a config's file, the name of a shipped robot, or a URDF, whose
            body parts are found out (`mrhubo describe` shows them; what is a guess is told as a warning).
        whole_body: whether the legs, feet and waist of a URDF or a MuJoCo model move too, as --whole-body of the
            commands has it (docs/whole-body.md); else its arms, hands and head alone. A config or a `Robot` says itself
            what it has.
        start: what an answer's steps of optimisation begin at: "universal", that network, or "nearest", the nearest of
            2,048 robot poses.

    Raises:
        UserError: the file cannot be used, the robot's body parts make no sense, there is no such start, or
            `whole_body` is said of a config or a `Robot`.
    """
    from mrhubo.describing.run import open_robot
    from mrhubo.errors import UserError, unknown_name
    from mrhubo.retargeter import optimised, untrained
    from mrhubo.robot import BodyMap, Robot

    if start not in ("universal", "nearest"):
        raise UserError(f"for_robot: {unknown_name('start', start, ('universal', 'nearest'))}")
    if isinstance(robot, Robot):
        if whole_body:
            raise UserError(
                f"whole_body=True goes with a URDF or a MuJoCo model; the robot '{robot.name}' says itself what of a "
                "body it has"
            )
        found = robot
    else:
        found = open_robot(os.fspath(robot), whole_body)
    return untrained(found) if start == "universal" else optimised(BodyMap.of(found))


def package_folder(source: str | os.PathLike[str]) -> Path:
    """The folder that `load` reads: the given one, or one into which a version in the registry has been fetched.

    Raises:
        UserError: there is no such version.
    """
    from pathlib import Path

    if str(source).startswith("models:"):
        from mrhubo.fitting.record.registry import fetch_package

        source = fetch_package(str(source))
    return Path(source)


def load_fast(source: str | os.PathLike[str] | Retargeter, form: str | None = None) -> FastRetargeter:
    """A trained retargeter that needs no PyTorch and answers a frame in a fraction of a millisecond (docs/fast.md).

    Args:
        source: as for `load`, or a package's file `runtime.safetensors` alone. For a package that was made before there
            was such a file, it is worked out anew, by PyTorch; so it is for a retargeter, such as `for_robot`
            gives for a robot without a package.
        form: "compiled" (needs numba: the extra `fast`) or "numpy"; None: compiled where numba is installed.

    Raises:
        UserError: there is no such package, it is damaged, or the form is wrong.
    """
    from mrhubo.fast import FastRetargeter
    from mrhubo.fast.description import FILE

    if not isinstance(source, str | os.PathLike):
        return FastRetargeter(source.describe(), form)
    folder = package_folder(source)
    if folder.is_dir() and not (folder / FILE).exists():
        return FastRetargeter(load(folder).describe(), form)
    return FastRetargeter.load(folder, form)


_lazy = lazy_names(__name__, _HOMES)


def __getattr__(name: str) -> Any:
    if name != "__version__":
        return _lazy(name)
    globals()[name] = value = _version()
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    """What pyproject.toml states: as it was installed, or, in a source tree that is not, as it stands there."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("mrhubo")
    except PackageNotFoundError:
        import tomllib
        from pathlib import Path

        project = Path(__file__).resolve().parents[1] / "pyproject.toml"
        return tomllib.loads(project.read_text())["project"]["version"] if project.is_file() else "unknown"
