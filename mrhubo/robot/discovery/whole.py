"""A robot with two arms: as it is, or, where it has one, with the mirror image of that in the other one's place."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

from mrhubo.errors import UserError
from mrhubo.robot.discovery.bodies import Bodies
from mrhubo.robot.discovery.lone_arm import LoneArm, find_lone_arm
from mrhubo.robot.discovery.mirror_image import with_mirror_image
from mrhubo.robot.discovery.no_arms import NoArms, why_no_arms
from mrhubo.robot.discovery.reading import read_bodies
from mrhubo.robot.discovery.result import Question
from mrhubo.robot.discovery.roles import Roles, find_roles
from mrhubo.robot.discovery.symmetry import Pair, find_pairs
from mrhubo.robot.urdf import Description


@dataclass(frozen=True)
class Whole:
    """A robot whose arms are a pair, and what of them is made up."""

    bodies: Bodies
    roles: Roles
    lone: LoneArm | None = None
    """The arm that is no image, if the robot has one."""
    images: Mapping[str, str] = field(default_factory=dict)
    """By joint or link of that arm, what was added as its image."""
    why: str = ""
    """What may be why no second arm was found."""

    def is_image(self, name: str) -> bool:
        """Whether a joint or link is none of the file's."""
        return name in self.images.values()

    def without_images(self, question: Question) -> Question:
        """A question, with the file's own joints and links among its candidates."""
        kept = tuple(name for name in question.candidates if not self.is_image(name))
        return question if kept == question.candidates else replace(question, candidates=kept)

    def told(self, sides: Collection[str]) -> Iterator[str]:
        """That there is one arm, which is on one of the sides."""
        if self.lone is not None:
            name = self.lone.chain[0].hinge.name
            yield (
                f"only one arm was found, the {' and '.join(sides)} one, which begins with '{name}'; {self.lone.cue}, "
                f"so it is taken for a humanoid's, and what is written moves that arm alone{self.why}"
            )

    def asked(self) -> Iterator[Question]:
        """What of the only arm was guessed."""
        if self.lone is not None and self.lone.doubt is not None:
            name = self.lone.chain[0].hinge.name
            yield Question("chest", f"only one arm was found: {self.lone.cue}, so it was taken for a humanoid's, but "
                           f"{self.lone.doubt} was guessed", (name,))  # fmt: skip


def complete(description: Description) -> Whole:
    """A robot with its roles, whether it has two arms or one.

    Raises:
        UserError: no arms can be told.
    """
    bodies = read_bodies(description)
    pairs = find_pairs(bodies)
    try:
        roles = find_roles(bodies, pairs)
    except NoArms as error:
        found = _with_image(bodies, pairs)
        if found is None:
            raise error from None
        return found
    # The only pair may be legs, below the only arm.
    if roles.legs is None and (found := _with_image(bodies, pairs)) is not None:
        return found
    return Whole(bodies, roles)


def _with_image(bodies: Bodies, pairs: list[Pair]) -> Whole | None:
    """The robot with its only arm's image; None where it has none."""
    lone = find_lone_arm(bodies, pairs)
    if lone is None:
        return None
    first = lone.chain[0]
    parent_44 = bodies.pose_44[first.inner_link]
    whole, images = with_mirror_image(bodies.description, first.hinge.name, parent_44, lone.normal_3, lone.middle_3)
    both = read_bodies(whole)
    try:
        roles = find_roles(both, find_pairs(both))
    except UserError:
        return None
    names = {chain[0].hinge.name for chain in roles.arms.chains}
    if names != {first.hinge.name, images[first.hinge.name]}:
        return None
    return Whole(both, roles, lone, images, why_no_arms(bodies))
