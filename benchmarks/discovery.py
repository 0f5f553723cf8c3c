"""How often detection of a humanoid's mapping is right: on the shipped robots, however their files are written, on
random humanoids, and on other URDF files.

    python benchmarks/discovery.py [--seeds 0-1000] [--strange 0-100] [--urdfs FOLDER]
        [--robots nao-whole-body,coman-whole-body,reachy]

The shipped robots' hand-written configs, with legs and waist where they have them, are the measure of theirs. A random
humanoid counts as right when its joints, points (2 cm on an arm of half a metre), up, forward, hands and feet are;
where something is wrong, it counts whether a question asks about it. The strange ones are random humanoids too, each
with something that only some robots have, and some of them are to be refused. Of other files only what was found is
printed, as nobody wrote down what is true of them.
"""

from __future__ import annotations

import collections
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from common import print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.robot import read_keypoints
from mrhubo.robot.discovery import Discovery, discover
from mrhubo.robot.generator import Humanoid, humanoid
from mrhubo.robot.generator.score import asked, mistakes, region
from mrhubo.robot.generator.strange import STRANGE
from mrhubo.robot.generator.variants import variant
from mrhubo.robot.urdf import describe
from mrhubo.runtime.locations import project_root

FORMS = {
    "as it is": {},
    "renamed": {"rename": True},
    "reordered": {"reorder": True},
    "axes negated": {"negate": True},
    "y up": {"turn": (math.pi / 2, 0.0, 0.0)},
    "turned, scaled by 3, and all else": {
        "turn": (0.4, 2.0, -1.0), "scale": 3.0, "rename": True, "reorder": True, "negate": True,
    },
}  # fmt: skip

SHIPPED = "nao-whole-body,coman-whole-body,reachy"
_MOST_TOLD = 200


def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, argv = read_options(argv, seeds="0-1000", strange="0-100", urdfs="", robots=SHIPPED)
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    print_header()
    shipped(options["robots"].split(","))
    made("random humanoids", [(seed, None) for seed in _range(options["seeds"])])
    made("strange humanoids", [(seed, kind) for kind in STRANGE for seed in _range(options["strange"])])
    if options["urdfs"]:
        others(Path(options["urdfs"]))


def _range(text: str) -> range:
    first, _, last = text.partition("-")
    return range(int(first), int(last))


def shipped(robots: list[str]) -> None:
    """The shipped robots in every form."""
    rows = []
    for robot in robots:
        config = load_config(project_root() / f"conf/{robot}.yaml").robot
        points = read_keypoints(config.keypoints).points
        description = describe(config.urdf)
        for form, changes in FORMS.items():
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "robot.urdf"
                text, names = variant(config.urdf, seed=1, **changes)
                path.write_text(text)
                found = discover(path, whole_body=True)
                new = {joint: names.get(joint, joint) for joint in description.joints}
                missing = {new[joint] for joint in config.joints} - set(found.joints)
                scale = float(changes.get("scale", 1.0))
                placed = describe(path)
                apart = [
                    math.dist(
                        position(placed, names.get(point.link, point.link), scale * np.array(point.offset_3)),
                        found.points[name].root_3,
                    )
                    / scale
                    for name, point in points.items()
                ]
            extra = len(found.joints) - len(config.joints)
            rows.append(
                [
                    robot,
                    form,
                    str(len(missing)),
                    str(extra),
                    f"{1000 * max(apart):.0f}",
                    f"{found.forward.confidence:.2f}",
                ]
            )
    print_table(["robot", "form", "joints missing", "joints more", "farthest point [mm]", "sure of facing"], rows)
    print()


def position(description, link: str, offset_3: np.ndarray) -> np.ndarray:
    """Of a point on a link (3,) at zero, in the root's frame."""
    pose_44 = np.eye(4)
    for joint in reversed(description.joints_above(link)):
        pose_44 = pose_44 @ joint.origin_44
    return pose_44[:3, :3] @ offset_3 + pose_44[:3, 3]


def made(title: str, seeds: list[tuple[int, str | None]]) -> None:
    """Random humanoids: how many are right, and of what kind those are that are not."""
    groups: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    parts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    faults: collections.Counter[str] = collections.Counter()
    silent: list[str] = []
    seconds = 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.urdf"
        for seed, kind in seeds:
            truth = humanoid(seed, kind)
            path.write_text(truth.urdf)
            start = time.perf_counter()
            try:
                found = discover(path, whole_body=True)
            except UserError:
                found = None
                wrong, told = ["refused"] if truth.mappable else [], True
            else:
                wrong = mistakes(found, truth, path) if truth.mappable else ["two arms: not refused"]
                told = not wrong or asked(found, wrong)
            seconds += time.perf_counter() - start
            outcome = "right" if not wrong else "asks" if told else "wrong"
            for group in ("all", *(truth.told if kind is None else [kind])):
                groups[group][outcome] += 1
            for part in _parts(truth):
                there = [phrase for phrase in wrong if region(phrase) == part]
                if found is not None:
                    parts[part]["right" if not there else "asks" if asked(found, there) else "wrong"] += 1
            faults.update({phrase.split(":")[0].removeprefix("left_").removeprefix("right_") for phrase in wrong})
            if outcome == "wrong":
                silent.append(f"{seed}{f', {kind}' if kind else ''}: {'; '.join(wrong)[:160]}")
    heads = ["count", "right [%]", "wrong, asks [%]", "wrong, silent [%]"]
    print_table([title, *heads], _shares(groups))
    print()
    print_table([f"{title}, by part", *heads], _shares(parts))
    print(f"\n{1000 * seconds / max(len(seeds), 1):.0f} ms each; wrong parts: {dict(faults.most_common())}")
    for line in silent[:_MOST_TOLD]:
        print(f"silent {line}")
    print()


def _parts(truth: Humanoid) -> list[str]:
    """What of a body a robot has."""
    has = {"legs": bool(truth.chains["left_leg"]), "waist": bool(truth.chains["waist"])}
    return ["arms and head", *(part for part, there in has.items() if there)]


def _shares(groups: dict[str, collections.Counter[str]]) -> list[list[str]]:
    return [
        [
            group,
            str(sum(counts.values())),
            *(f"{100 * counts[kind] / sum(counts.values()):.1f}" for kind in ("right", "asks", "wrong")),
        ]
        for group, counts in sorted(groups.items())
    ]


def others(folder: Path) -> None:
    """What is found of every URDF in a folder."""
    rows = [[path.stem[-40:], *_summary(path)] for path in sorted(folder.glob("*.urdf"))]
    print_table(["file", "arms", "neck", "waist", "legs", "facing", "sure", "questions"], rows)


def _summary(path: Path) -> list[str]:
    try:
        found: Discovery = discover(path)
    except UserError as refusal:
        return ["", "", "", "", "", "", str(refusal).rpartition(": ")[2][:80]]
    counts = [str(len(found.chains.get(name, ()))) for name in ("left_arm", "neck", "waist", "left_leg")]
    facing = " ".join(f"{number:.2f}" for number in found.forward.root_3)
    return [
        *counts,
        facing,
        f"{found.forward.confidence:.2f}",
        ", ".join(question.about for question in found.questions),
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
