"""`mrhubo evaluate nao --retargeter FOLDER`: how good a trained retargeter is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.config import CommandParser, Config, parse_arguments, run_command, whole_number
from mrhubo.errors import UserError

if TYPE_CHECKING:
    from mrhubo.robot import SelfCollision

DESCRIPTION = (
    "Measures a trained retargeter on human motion: against the reference retargeter (joints, links), against the"
    " human (directions of limbs, hands, head, jerk), and in time. The motions, and what is a key link, are those of"
    " the config; the robot is the retargeter's own and must be the config's."
)


def build_parser() -> CommandParser[Config]:
    """The command's arguments."""
    parser = CommandParser("mrhubo evaluate", DESCRIPTION, Config)
    package = "the package that a fit ended with"
    parser.add_argument("--retargeter", metavar="FOLDER", required=True, help=package)
    polish = "steps of optimisation after the networks (default: 0, the networks alone; `retarget` makes 1)"
    parser.add_argument("--polish", metavar="NUMBER", type=whole_number(0, 1_000), default=0, help=polish)
    clips = "the validation clips, for choosing between retargeters; else the test clips"
    parser.add_argument("--validation", action="store_true", help=clips)
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    return parser


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
    config, options = parse_arguments(build_parser(), argv)
    print(evaluate(config, Path(options.retargeter), options.validation, options.quiet, options.polish))


if __name__ == "__main__":
    run_command(main)
