"""`python -m mrhubo.evaluate --config conf/nao.yaml --retargeter FOLDER`: how good a trained retargeter is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config import Config, parse_arguments, run_command
from mrhubo.errors import UserError

if TYPE_CHECKING:
    from mrhubo.robot import SelfCollision

DESCRIPTION = (
    "Measures a trained retargeter on human motion: against the reference retargeter (joints, links), against the"
    " human (directions of limbs, hands, head, jerk), and in time. The motions, and what is a key link, are those of"
    " the config; the robot is the retargeter's own and must be the config's."
)
FLAGS = {
    "retargeter FOLDER": "the package that a fit ended with",
    "polish NUMBER": "steps of optimisation after the networks (default: 0, the networks alone; `retarget` makes 1)",
    "validation": "the validation clips, for choosing between retargeters; else the test clips",
    "quiet": "no progress line",
}


def evaluate(config: Config, package: Path, validation: bool = False, quiet: bool = False, polish: int = 0) -> str:
    """Returns the table of clips and their means, and the latency.

    Raises:
        UserError: the config, the package or the motions cannot be used, or the package is of another robot.
    """
    from mrhubo.evaluation import evaluate_clips, latencies, table
    from mrhubo.fitting import pipeline
    from mrhubo.retargeter import Retargeter
    from mrhubo.runtime.progress import Progress

    retargeter = Retargeter.load(package)
    prepared = pipeline.prepare(config)
    body_map, own = prepared.body_map, retargeter.body_map.robot
    same = own.description.kinematics == body_map.robot.description.kinematics
    if not same or own.joint_names != body_map.robot.joint_names:
        raise UserError(
            f"{package}: was made for another robot or other joints ('{own.name}': {', '.join(own.joint_names)}) than"
            f" the config's ('{config.robot.name}': {', '.join(config.robot.joints)})"
        )
    clips = pipeline.make_references(prepared, quiet)[0 if validation else 1]
    predictions = []
    with Progress("evaluation", len(clips), "clips", quiet) as progress:
        for done, clip in enumerate(clips, start=1):
            predictions.append(retargeter.predict(clip.motion.pose_TJ6, polish))
            progress.update(done, clip.name)
    found = evaluate_clips(predictions, clips, body_map, config.robot.key_links)
    one, many = latencies(lambda pose: retargeter.predict(pose, polish), clips).values()
    latency = f"latency, one thread: {one:.0f} us for one frame, {many:.1f} us a frame for 1,000 at once"
    return "\n".join([table(found), "", *_not_covered(body_map.collision), latency])


def _not_covered(shapes: SelfCollision) -> list[str]:
    links = shapes.uncovered
    return [f"collision: {len(links)} links have meshes for collision, which are not read: {', '.join(links)}"] * bool(
        links
    )


def main(argv: list[str]) -> None:
    """The command."""
    config, flags = parse_arguments(argv, "mrhubo.evaluate", DESCRIPTION, flags=FLAGS)
    if flags["retargeter"] is None:
        raise UserError("command line: --retargeter FOLDER is missing; a fit ends with the folder's name")
    polish = flags["polish"] or "0"
    if not polish.isdigit() or int(polish) > 1_000:
        raise UserError(f"command line: --polish must be 0 .. 1000 steps, found '{polish}'")
    print(evaluate(config, Path(flags["retargeter"]), flags["validation"], flags["quiet"], int(polish)))


if __name__ == "__main__":
    run_command(main)
