"""`python -m mrhubo.evaluate --config conf/nao.yaml --retargeter FOLDER`: how good a trained retargeter is."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import parse_arguments, run_command
from mrhubo.errors import UserError
from mrhubo.runtime.progress import Reporter

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


def main(argv: list[str]) -> None:
    """The command."""
    config, flags = parse_arguments(argv, "mrhubo.evaluate", DESCRIPTION, flags=FLAGS)
    if flags["retargeter"] is None:
        raise UserError("command line: --retargeter FOLDER is missing; a fit ends with the folder's name")
    polish = flags["polish"] or "0"
    if not polish.isdigit() or int(polish) > 1_000:
        raise UserError(f"command line: --polish must be 0 .. 1000 steps, found '{polish}'")
    from mrhubo.fitting.measurement import measure_package
    from mrhubo.fitting.preparation import prepare

    report, package = Reporter(flags["quiet"]), Path(flags["retargeter"])
    print(measure_package(prepare(config), report, package, flags["validation"], int(polish)))


if __name__ == "__main__":
    run_command(main)
