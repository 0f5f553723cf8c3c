"""The paper's tables from our own runs: which trainings they need, what they gave, how they are shown.

Figuera, Park, Ahn: "Redefining Data Pairing for Motion Retargeting Leveraging a Human Body Prior", IROS 2024, tables I
(joint error) and II (link error).
"""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PIL.Image import Image

from mrhubo.config import BaselineConfig, Config, load_config
from mrhubo.config.shipped import shipped_root
from mrhubo.errors import UserError, unknown_name
from mrhubo.runtime.tables import markdown, mean_and_spread, spread_of
from mrhubo.view.bars import grouped_bars

OUR_DEFAULT = "our default"
METHODS: Mapping[str, Sequence[str]] = {
    "proposed": ["pairs.reverse_share=0"],
    "without filter": ["pairs.reverse_share=0", "pairs.filter=none"],
    "one stage": ["pairs.reverse_share=0", "model.stages=1"],
    OUR_DEFAULT: [],
}
"""The settings of each column. The paper's three have forward pairs alone; our default adds reverse ones."""
BASELINE = "S3LE"
"""The column of the baseline, which has settings of its own and needs human motion capture."""
BASELINE_ROBOTS = ("coman",)
"""The robots that the paper measures it on, and for which its settings were searched."""
ALL_METHODS = (*METHODS, BASELINE)
"""The columns of the tables, in their order."""

PAPER: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "reachy": {"proposed": (0.253, 8.678), "without filter": (0.257, 8.698), "one stage": (0.263, 9.519)},
    "coman": {
        "proposed": (0.295, 4.913),
        "without filter": (0.297, 5.008),
        "one stage": (0.314, 5.148),
        "S3LE": (0.281, 5.956),
    },  # fmt: skip
    "nao": {"proposed": (0.389, 3.887), "without filter": (0.413, 3.956), "one stage": (0.506, 4.895)},
}
"""The paper's figures: joint error [rad], link error [cm]."""

_TITLES = {"joint_rad": "joint error [rad]", "link_cm": "link error [cm]"}
_DIGITS = {"joint_rad": 3, "link_cm": 2}
_OVER_FRAMES = {
    "over_frames/joint_rad": ("joint, over frames [rad]", 1, 3),
    "over_frames/link_cm": ("link, over frames [cm]", 1, 2),
}
_ERRORS = {"joint_rad": ("joint [rad]", 1, 3), "link_cm": ("link [cm]", 1, 2)}
_MORE = {
    "limb_deg": ("limbs [deg]", 1, 1),
    "reference_limb_deg": ("reference's", 1, 1),
    "hand_deg": ("hands [deg]", 1, 1),
    "head_deg": ("head [deg]", 1, 1),
    "jerk_ratio": ("jerk ratio", 1, 2),
    "at_limit": ("at a limit [%]", 100, 1),
    "collision": ("collision [%]", 100, 1),
    "reference_collision": ("reference's", 100, 1),
    "latency_us": ("one frame [us]", 1, 0),
    "latency_1000_us": ("a frame of 1,000 [us]", 1, 0),
}

_MOTION = {
    "limb_deg": ("limbs [deg]", 1, 2),
    "excess_deg": ("over optimum", 1, 2),
    "excess_max_deg": ("at worst", 1, 1),
    "jerk_ratio": ("jerk ratio", 1, 2),
    "speed_max": ("speed [rad/s]", 1, 1),
    "speed_p99": ("99%", 1, 1),
    "over_limit": ("over limit [%]", 100, 1),
    "jumps": ("jumps", 1, 1),
}
_WAYS = {
    "": "the networks alone",
    "retarget/": "with steps of optimisation, frame by frame",
    "clip/": "with steps of optimisation, whole clips",
    "stream/": "a stream",
    "reference/": "the reference",
}
"""How motions are answered, by what goes before the names of measures."""

Results = Mapping[tuple[str, str], Sequence[Mapping[str, float]]]
"""Test measures (names without `test/`) of every seed, by (robot, method)."""


@dataclass(frozen=True)
class Part:
    """One training."""

    robot: str
    method: str
    seed: int
    config: Config


def parts(
    robots: Sequence[str],
    seeds: int,
    overrides: Sequence[str],
    methods: Sequence[str] = ALL_METHODS,
    paper: bool = False,
) -> list[Part]:
    """All trainings, seed by seed, so that an interrupted table has every column as early as possible.

    Args:
        robots: names of shipped robots.
        seeds: trainings of each kind.
        overrides: `key.sub=value` for all of them; those of `s3le` are for the baseline.
        methods: the columns wanted.
        paper: with the paper's settings (`conf/paper`) in place of ours.

    Raises:
        UserError: a robot has no config, there is no such method, these robots have none of the methods, or a setting
            is wrong.
    """
    for method in methods:
        if method not in ALL_METHODS:
            raise UserError(f"command line: --methods: {unknown_name('method', method, ALL_METHODS)}")
    folder = shipped_root() / "conf"
    if paper:
        folder = folder / "paper"
    known = sorted(path.stem for path in folder.glob("*.yaml") if path.stem in PAPER)
    for robot in robots:
        if robot not in known:
            raise UserError(f"command line: --robots: {unknown_name('robot', robot, known)}")
    ours = [override for override in overrides if not override.startswith("s3le.")]
    found = []
    for seed in range(seeds):
        for robot in robots:
            file = folder / f"{robot}.yaml"
            for method, change in METHODS.items():
                if method not in methods or (paper and method == OUR_DEFAULT):
                    continue
                config = load_config(file, [*change, *ours, f"trainer.seed={seed}"])
                found.append(Part(robot, method, seed, config))
            if BASELINE in methods and robot in BASELINE_ROBOTS:
                config = load_config(file, [*overrides, f"s3le.seed={seed}"], BaselineConfig)
                found.append(Part(robot, BASELINE, seed, config))
    if not found:
        wanted = f"{', '.join(methods)} on {', '.join(robots)}" + (" with the paper's settings" if paper else "")
        raise UserError(f"command line: there is nothing to train: no {wanted}")
    return found


def tables(results: Results) -> str:
    """The paper's two tables with its figures in brackets beside ours, then the other measures; Markdown."""
    robots = list(dict.fromkeys(robot for robot, _ in results))
    methods = [method for method in ALL_METHODS if any(m == method for _, m in results)]
    blocks = []
    for index, (measure, title) in enumerate(_TITLES.items()):
        rows = []
        for robot in robots:
            cells = []
            for method in methods:
                ours = _cell(results.get((robot, method), []), measure, 1, _DIGITS[measure])
                theirs = PAPER[robot].get(method)
                cells.append(ours + (f" ({theirs[index]:.3f})" if theirs and ours else ""))
            rows.append([robot, *cells])
        blocks.append(f"Table {'I' * (index + 1)}: {title}, mean over the test clips (the paper's in brackets)\n")
        blocks.append(markdown(["robot", *methods], rows) + "\n")
    blocks.append("Beyond the paper, means over the test clips, the networks alone\n")
    blocks.append(_more(results, {**_OVER_FRAMES, **_MORE}) + "\n")
    polished = {f"retarget/{name}": column for name, column in {**_ERRORS, **_MORE}.items()}
    ours = {key: found for key, found in results.items() if any("retarget/joint_rad" in seed for seed in found)}
    blocks.append("The same with steps of optimisation after the networks, frame by frame\n")
    blocks.append(_more(ours, polished) + "\n")
    moved = {key: found for key, found in results.items() if any("clip/jumps" in seed for seed in found)}
    for shared, title in (("", "as they are"), ("reshared/", "re-shared")):
        for way, name in _WAYS.items():
            columns = {f"{shared}{way}{measure}": column for measure, column in _MOTION.items()}
            if any(set(columns) & set(seed) for found in moved.values() for seed in found):
                blocks += [f"Motion, the test clips {title}: {name}\n", _more(moved, columns) + "\n"]
    return "\n".join(blocks).rstrip("\n")


def _more(results: Results, columns: Mapping[str, tuple[str, float, int]]) -> str:
    rows = [
        [robot, method, *(_cell(found, name, unit, digits) for name, (_, unit, digits) in columns.items())]
        for (robot, method), found in results.items()
    ]
    return markdown(["robot", "method", *(title for title, _, _ in columns.values())], rows)


def chart(results: Results) -> Image:
    """Joint and link errors as bars, the paper's as marks."""
    panels = {
        title: {
            robot: {m: _mean_and_spread([x[measure] for x in found]) for (r, m), found in results.items() if r == robot}
            for robot in dict.fromkeys(robot for robot, _ in results)
        }
        for measure, title in _TITLES.items()
    }
    marks = {
        title: {robot: {m: figures[index] for m, figures in PAPER[robot].items()} for robot in PAPER}
        for index, title in enumerate(_TITLES.values())
    }
    return grouped_bars(panels, marks, "the paper")


def _cell(found: Sequence[Mapping[str, float]], name: str, unit: float, digits: int) -> str:
    values = [unit * seed[name] for seed in found if name in seed]
    return mean_and_spread(values, digits) if values else ""


def _mean_and_spread(values: Sequence[float]) -> tuple[float, float]:
    return statistics.fmean(values), spread_of(values)
