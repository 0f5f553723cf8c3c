"""Whether a body map can be right: what a wrong one shows in the robot's tree, and in random poses of it.

What cannot be right is refused, what may be a mistake is warned of once. Everything follows from the table of body
parts: a part hangs on another, and a limb runs from one point to another. Where they lie: `mrhubo.robot.placement`.

Legend: B random poses, E limbs, K links, N joints.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch

from mrhubo.errors import UserError
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.centres import check_centres
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.mirrored import check_mirrored
from mrhubo.robot.model import Robot
from mrhubo.robot.offsets import check_offsets
from mrhubo.robot.placement import check_placement, warn
from mrhubo.robot.suggestions import quoted
from mrhubo.robot.told_joints import name_unlisted, refuse_untold
from mrhubo.robot.yardstick import Yardstick

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_POSES = 64
_NO_LENGTH = 1e-4
"""Metres under which a limb has no direction, and under which a link stays where it is."""
_STEADY, _STRETCHED = 1.1, 1.2
"""How many times longer than at its shortest a limb may be: to be one limb at all, and without a word."""
_TOLD = 1e-3
"""Metres from a joint's centre up to which a point lies there."""
_LONG = 5.0
"""Metres beyond which a limb's length is probably in millimetres."""
_RATIO = (0.2, 2.0)
"""Length of a limb by that of the limb which it hangs on."""


def check_body_map(body_map: BodyMap) -> None:
    """Refuses a body map that cannot be right.

    Raises:
        UserError: one point stands for two body parts, a part does not hang on the one that carries it, a limb has no
            length, left and right are exchanged, or a joint moves no body part; names it.
    """
    robot, generator = body_map.robot, torch.Generator().manual_seed(0)
    q_BN = robot.sample(_POSES, generator)
    view = body_map.shared.view_robot(robot.forward(q_BN))
    limbs = [direction for direction in body_map.directions if isinstance(direction, Limb)]
    length_BE = (view.end_BE3 - view.start_BE3).norm(dim=-1)
    lengths = {
        limb.part.name: (float(shortest), float(longest))
        for limb, shortest, longest in zip(limbs, length_BE.amin(0), length_BE.amax(0), strict=True)
    }
    check_offsets(body_map)
    _check_shared(body_map)
    _check_tree(body_map, limbs, lengths)
    _check_lengths(body_map, limbs, lengths)
    check_placement(body_map, q_BN)
    refuse_untold(body_map)
    name_unlisted(body_map)
    check_centres(body_map)
    check_mirrored(body_map)


def check_key_links(robot: Robot, key_links: Sequence[str]) -> None:
    """Refuses links of which no joint moves any: their error would be 0 whatever the joints do.

    Raises:
        UserError: names the links.
    """
    position_BL3 = robot.forward(robot.sample(_POSES, torch.Generator().manual_seed(0))).position_BL3
    moved_BK3 = position_BL3[:, [robot.link_index(link) for link in key_links]]
    if float((moved_BK3 - moved_BK3[:1]).abs().max()) < _NO_LENGTH:
        found = Yardstick(robot).found
        moving = [] if found is None else [link for link in found.key_links if link in robot.moving_links]
        advice = f": key_links: [{', '.join(moving)}]" if moving else ""
        raise UserError(
            f"robot.key_links: none of robot.joints moves {quoted(key_links)}, so their error would always be 0; name "
            f"links of the arms{advice}"
        )


def _check_shared(body_map: BodyMap) -> None:
    """Refuses one point, or one link's axes, for two parts."""
    points, ends = body_map.keypoints.points, body_map.keypoints.ends
    for (name, point), (other, same) in itertools.combinations(points.items(), 2):
        if point == same:
            raise UserError(
                f"robot.keypoints.{other}: is where '{name}' is, on the link '{point.link}'; one point cannot be two "
                f"body parts{body_map.yardstick.advice(name, other)}"
            )
    seen_from = {part.name: part.seen_from for part in body_map.keypoints.parts}
    for (name, end), (other, same) in itertools.combinations(ends.items(), 2):
        if end.link != same.link or seen_from[name] is seen_from[other] is None:  # a trunk without a waist
            continue
        if seen_from[other] != name and seen_from[name] != other:
            raise UserError(
                f"robot.keypoints.{other}: is the link '{end.link}', as is '{name}'; one link cannot stand for both"
                f"{body_map.yardstick.advice(name, other)}"
            )
        warn(f"robot.keypoints.{other}: is the link '{end.link}', as is '{name}', against which it never turns")


def _check_tree(body_map: BodyMap, limbs: Sequence[Limb], lengths: dict[str, tuple[float, float]]) -> None:
    """Refuses a part that does not move with what carries it, and a limb that does not run outwards."""
    tree, ends, by_part = Ancestry(body_map.robot), body_map.keypoints.ends, {limb.part.name: limb for limb in limbs}
    inward = {x.part.name for x in limbs if x.part.seen_from and tree.is_inward(x, ends[x.part.seen_from])}
    for part in (part for part in body_map.keypoints.parts if part.name in by_part or part.name in ends):
        limb, carrier = by_part.get(part.name), part.hangs_on
        if carrier in ends:
            name, link = (limb.part.start, limb.start.link) if limb else (part.name, ends[part.name].link)
            joint = tree.turns_apart(ends[carrier].link, link)
            # Of pelvis and chest either may be the root.
            reversed_ = part.name in inward or (limb is None and tree.turns_apart(link, ends[carrier].link) is None)
            if joint and not reversed_:
                raise UserError(
                    f"robot.keypoints.{carrier}: '{ends[carrier].link}' is turned by the joint '{joint}', which does "
                    f"not turn '{name}' ('{link}') with it; name the link that carries '{name}'"
                    f"{body_map.yardstick.advice(carrier)}"
                )
        elif limb is None and carrier in by_part and carrier not in inward:
            inner, link = by_part[carrier], ends[part.name].link
            if joint := tree.turns_apart(inner.start.link, link):
                raise UserError(
                    f"robot.keypoints.{part.name}: '{link}' is not turned by the joint '{joint}', which turns "
                    f"'{inner.part.start}' ('{inner.start.link}'); the two are on different chains"
                    f"{body_map.yardstick.advice(part.name)}"
                )
    for limb in (limb for limb in limbs if limb.part.name not in inward):
        _check_limb(tree, limb, lengths[limb.part.name], body_map.yardstick.advice(limb.part.start, limb.part.end))


def _check_limb(tree: Ancestry, limb: Limb, length: tuple[float, float], advice: str) -> None:
    inner, outer = limb.start.link, limb.end.link
    if tree.is_above(inner, outer):
        return
    place = f"robot.keypoints.{limb.part.end}: '{limb.part.start}' ('{inner}')"
    joint = tree.turns_apart(inner, outer)
    if tree.is_above(outer, inner):
        if joint is not None or not any(limb.end.offset_3):
            raise UserError(
                f"{place} lies below '{limb.part.end}' ('{outer}') in the robot's tree, and a limb runs outwards (are "
                f"the two exchanged?){advice}"
            )
    elif joint is not None and length[1] > _STEADY * length[0]:
        raise UserError(
            f"{place} is turned by the joint '{joint}', and '{limb.part.end}' ('{outer}') is not: the two are on "
            f"different chains, {_centimetres(length)} apart{advice}"
        )


def _check_lengths(body_map: BodyMap, limbs: Sequence[Limb], lengths: dict[str, tuple[float, float]]) -> None:
    """Refuses a limb between two points that are one; warns of lengths that no limb has."""
    for limb in limbs:
        shortest, longest = lengths[limb.part.name]
        advice = body_map.yardstick.advice(limb.part.start, limb.part.end, given=body_map.keypoints)
        if shortest < _NO_LENGTH:
            raise UserError(
                f"robot.keypoints: '{limb.part.start}' and '{limb.part.end}' lie on one point, so the limb has no "
                f"direction; choose another link or an offset{advice}"
            )
        between = f"from '{limb.part.start}' ('{limb.start.link}') to '{limb.part.end}' ('{limb.end.link}')"
        if longest > _STRETCHED * shortest and not _as_told(body_map, limb):
            warn(
                f"robot.keypoints: the {_words(limb)} {between} is {_centimetres((shortest, longest))} long, as the "
                "joints stand, and a limb keeps its length; take links or offsets at its two joints"
                f"{advice}"
            )
        elif longest > _LONG:
            warn(
                f"robot.keypoints: the {_words(limb)} {between} is {longest:.0f} m long; are lengths in the URDF in "
                "millimetres? They are in metres"
            )
        inner = lengths.get(limb.part.hangs_on or "")
        if inner is not None and longest <= _STRETCHED * shortest and inner[1] <= _STRETCHED * inner[0]:
            if not _RATIO[0] <= longest / inner[1] <= _RATIO[1]:
                warn(
                    f"robot.keypoints: the {_words(limb)} {between} is {_centimetres((shortest, longest))} long, and "
                    f"what it hangs on {_centimetres(inner)} (are these points at the limbs' joints?)"
                    f"{advice}"
                )


def _as_told(body_map: BodyMap, limb: Limb) -> bool:
    """Whether a limb's ends are where the axes tell them, as those of an elbow whose hinge lies far beside the arm, so
    that there are no better ones.
    """
    ends = ((limb.part.start, limb.start), (limb.part.end, limb.end))
    distances = [body_map.yardstick.distance(name, point) for name, point in ends]
    return all(distance is not None and distance < _TOLD for distance in distances)


def _words(limb: Limb) -> str:
    return limb.part.name.replace("_", " ")


def _centimetres(length: tuple[float, float]) -> str:
    shortest, longest = (f"{100 * metres:.3g}" for metres in length)
    return f"{shortest} cm" if shortest == longest else f"{shortest} .. {longest} cm"
