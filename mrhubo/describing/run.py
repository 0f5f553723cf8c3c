"""From a robot's model to its config and picture, and from a config to its picture."""

from __future__ import annotations

import contextlib
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mrhubo.config import is_config, load_config
from mrhubo.describing.model_file import find_model, model_name, model_named
from mrhubo.describing.roots import better_root
from mrhubo.describing.yaml_file import described_yaml, keypoint_entries, unsure
from mrhubo.errors import InputWarning, UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.robot import BodyMap, Robot, build_body_map
from mrhubo.robot.discovery import Discovery, discover
from mrhubo.robot.mjcf import is_mjcf, urdf_of_mjcf
from mrhubo.robot.rooted import rooted
from mrhubo.robot.urdf import Description, describe_text
from mrhubo.robot.urdf import describe as read_urdf
from mrhubo.runtime.names import check_name

DEFAULT_FOLDER = Path("conf")
_MOST_JOINTS = 1_000
"""Joints that move: known humanoids with all their fingers have 150, and looking takes the square of their number."""


@dataclass(frozen=True)
class Described:
    """A robot whose config was written."""

    found: Discovery
    file: Path
    """The config."""
    picture: Path
    """Where its picture belongs: beside it."""
    urdf: Path
    notes: tuple[str, ...]
    """What was left out of a model that was no URDF."""
    more: tuple[str, ...]
    """What of the body the robot can move, and this config leaves out."""

    @property
    def doubts(self) -> dict[str, str]:
        """The entries that are guesses, and what was asked about each."""
        return unsure(self.found)


def read_model(word: str) -> Description:
    """The links and joints of the model that a word names.

    Raises:
        UserError: there is no such model, or it cannot be read.
    """
    path = find_model(word)
    with tempfile.TemporaryDirectory() as folder, model_named(path, urdf := Path(folder) / f"{path.stem}.urdf"):
        if not is_mjcf(path):
            return read_urdf(path)
        urdf.write_text(urdf_of_mjcf(path, Path(folder)).urdf, encoding="utf-8")
        return read_urdf(urdf)


def describe_model(word: str, out: Path | None = None, force: bool = False, whole_body: bool = False) -> Described:
    """Finds out what a robot's links stand for, and writes its config, and its URDF where the model is MuJoCo's.

    Args:
        word: the model: a file, or the name of a robot of robot_descriptions.
        out: the config to write; default: `conf/NAME.yaml`, or `conf/NAME-whole-body.yaml`.
        force: whether a file that is there already may be replaced.
        whole_body: whether legs and waist move too.

    Raises:
        UserError: the model cannot be read or is no robot with arms, or a file is there already.
    """
    path = find_model(word)
    file = out or default_config(path, whole_body)
    with _as_urdf(path, file, force) as (urdf, notes):
        with model_named(path, urdf):
            description = read_urdf(urdf)
            found = _discover(description, whole_body)
        check_name("the config's file name", file.stem)
        picture, written = file.with_suffix(".png"), {}
        if (turned := _by_its_trunk(description, found, whole_body, _rooted_file(file), file.parent)) is not None:
            description, found, told = turned
            urdf = description.path
            written[urdf] = description.text
            notes = (*notes, f"{told}: the config names a file that says so, {urdf}")
        if not force:
            for new in (file, *written):
                refuse_existing(new)
            refuse_foreign(picture)
        written[file] = described_yaml(found, urdf, file, picture, path.name).encode()
        for new, content in written.items():
            with atomic_path(new) as temporary:
                temporary.write_bytes(content)
    return Described(found, file, picture, urdf, notes, _more(description, found))


def config_of(word: str) -> tuple[Path, Described | None]:
    """The config of a model: one that is there already, as the user may have changed it, or a new one.

    Raises:
        UserError: as for `describe_model`; or there is a config of that name, of another robot.
    """
    path = find_model(word)
    file = default_config(path)
    if not file.exists():
        described = describe_model(word)
        return described.file, described
    urdf = load_config(file).robot.urdf
    written = (path, file.with_suffix(".urdf"), _rooted_file(file))
    if not any(there.exists() and urdf.exists() and there.samefile(urdf) for there in written):
        raise UserError(
            f"{file} is there already, of another model ({urdf}): name it, or describe yours by another --out"
        )
    return file, None


def open_robot(word: str, whole_body: bool = False) -> Robot:
    """The robot of a config, or of a model whose config nobody has written: what is a guess is told.

    Args:
        word: a config or a model.
        whole_body: whether legs and waist of a model move too.

    Raises:
        UserError: the config or the model cannot be used; or `whole_body` is said of a config.
    """
    if is_config(word):
        if whole_body:
            raise UserError(
                "--whole-body, and whole_body=True in Python, go with a URDF or a MuJoCo model; the config "
                f"'{word}' says itself what of a body it has"
            )
        return Robot.from_config(word)
    model, description = find_model(word), read_model(word)
    with model_named(model, description.path):
        found = _discover(description, whole_body)
        if (turned := _by_its_trunk(description, found, whole_body, description.path)) is not None:
            description, found, told = turned
            warnings.warn(f"{word}: {told}", InputWarning, stacklevel=2)
        robot = _robot(description, found, model_name(model))
    for about, text in unsure(found).items():
        warnings.warn(f"{word}: {about}: {text}", InputWarning, stacklevel=2)
    if guessed := found.guessed:
        more = f" and {len(guessed) - 1} more" * (len(guessed) > 1)
        warnings.warn(
            f"{word}: it gives '{guessed[0]}'{more} no limits, or about a turn, so those of a human's joints were "
            "taken; `mrhubo describe` writes a config that can hold the robot's own",
            InputWarning,
            stacklevel=2,
        )
    return robot


def _rooted_file(file: Path) -> Path:
    """Where a robot's URDF is written with another root, of its config."""
    return file.with_name(f"{file.stem}-rooted.urdf")


def _by_its_trunk(
    description: Description, found: Discovery, whole_body: bool, path: Path, folder: Path | None = None
) -> tuple[Description, Discovery, str] | None:
    """A robot whose root is on a limb with its trunk as the root, at a path, what is found of it, and a sentence about
    it; `folder` as for `rooted`. None where it stays as it is.
    """
    root = better_root(description, found)
    if root is None:
        return None
    turned = describe_text(path, rooted(description, root, folder))
    told = (
        f"its root, '{description.root}', is carried by a limb that moves, so '{root}' was made the root, and is the "
        "base whose place is told"
    )
    return turned, _discover(turned, whole_body), told


def default_config(path: Path, whole_body: bool = False) -> Path:
    """Where the config of a model goes if nobody says it."""
    return DEFAULT_FOLDER / f"{model_name(path)}{'-whole-body' if whole_body else ''}.yaml"


def draw_config(file: Path, picture: Path) -> str | None:
    """Draws the robot of a config beside the human, whether the config makes sense or not; returns what a fit would
    refuse about it.

    Raises:
        UserError: a link or a joint does not exist, or the picture cannot be written.
    """
    from mrhubo.describing.picture import draw, save_picture  # a second that a robot which is opened has no use for

    config = load_config(file)
    with warnings.catch_warnings(action="ignore"):  # told by the check below
        body_map = BodyMap(Robot.from_config(file))
    save_picture(draw(body_map), picture)
    try:
        build_body_map(config.robot)
    except UserError as error:
        return str(error)
    return None


def refuse_existing(file: Path) -> None:
    """Refuses to replace what somebody may have worked on."""
    if file.exists():
        raise UserError(f"{file} is there already, and may hold work of yours; name another by --out, or give --force")


def refuse_foreign(picture: Path) -> None:
    """Refuses to replace a picture that is none of ours, as a photograph of the robot."""
    if picture.exists():
        from mrhubo.describing.picture import is_our_picture

        if not is_our_picture(picture):
            refuse_existing(picture)


def _discover(description: Description, whole_body: bool = False) -> Discovery:
    """What the links of a robot stand for; where joints cannot be used, and no whole robot is left, they are to blame.

    Raises:
        UserError: no two arms are found, or there are too many joints to look.
    """
    moving = sum(joint.kind != "fixed" for joint in description.joints.values())
    if moving > _MOST_JOINTS:
        raise UserError(
            f"{description.path}: {moving:,} joints move, more than {_MOST_JOINTS:,} among which arms are looked for; "
            "make those fixed that belong to no humanoid"
        )
    try:
        found = discover(description, whole_body)
        if description.faults:
            with warnings.catch_warnings(action="ignore"):
                BodyMap.of(_robot(description, found, "robot"))
    except UserError as error:
        if not description.faults:
            raise
        fault = next(iter(description.faults.values()))
        raise UserError(f"{description.path}, {fault}; without this joint no two whole arms are found") from error
    return found


def _more(description: Description, found: Discovery) -> tuple[str, ...]:
    """Which of legs and waist have joints that move if the whole body does, and not in what was found."""
    if found.whole_body:
        return ()
    moved = set(discover(description, whole_body=True).joints) - set(found.joints)
    parts = {"legs": found.chains.get("left_leg", ()), "waist": found.chains.get("waist", ())}
    return tuple(name for name, joints in parts.items() if moved & set(joints))


def _robot(description: Description, found: Discovery, name: str) -> Robot:
    ranges = {joint: [limits.lower, limits.upper] for joint, limits in found.ranges.items()}
    return Robot.from_urdf(
        description, found.joints, keypoint_entries(found), found.key_links, ranges, name=name
    )  # fmt: skip


@contextlib.contextmanager
def _as_urdf(path: Path, file: Path, force: bool) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """The model's URDF, and what was left out of it. One that is made of MuJoCo's model lies beside the config to be;
    where the work in here fails it goes away again, and what was there before is back.
    """
    if not is_mjcf(path):
        yield path, ()
        return
    urdf = file.with_suffix(".urdf")
    made = urdf_of_mjcf(path, urdf.parent)
    if not force:
        refuse_existing(urdf)
    former = urdf.read_bytes() if urdf.is_file() else None
    with atomic_path(urdf) as temporary:
        temporary.write_text(made.urdf, encoding="utf-8")
    try:
        yield urdf, made.notes
    except BaseException:
        if former is None:
            urdf.unlink(missing_ok=True)
        else:
            with atomic_path(urdf) as temporary:
                temporary.write_bytes(former)
        raise
