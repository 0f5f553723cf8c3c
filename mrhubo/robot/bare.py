"""Sticks where links have no shapes, so that a robot is seen whole."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mrhubo.robot.urdf import Description

_FEWEST = 1 / 3
"""Share of links with shapes below which every link gets a stick: the rest are meshes that are not there."""
_SHORTEST = 0.06
"""Shorter sticks, as a share of the robot's reach, are not missed: the links of a shoulder, whose joints cross."""


def bare_sticks(description: Description, shaped: Collection[str]) -> dict[str, str]:
    """From which link a stick goes to which: its end by its start's name is `{end: start}`, all at most once.

    A robot of whose links few have shapes gets one from every link to those that hang on it. Else each *body*, links
    that keep their places to each other, gets them where none of its links has a shape and its joints are far from each
    other: to the bodies that hang on it, or, where none does, to its farthest link. The root's body gets none.

    Args:
        description: the robot.
        shaped: links that have a shape, or a mesh that can be drawn.
    """
    if len(set(shaped)) < _FEWEST * len(description.links):
        return {joint.child: joint.parent for joint in description.joints.values()}
    root = description.root
    body_of, place_of, reach = {root: root}, {root: np.eye(4)}, {root: 0.0}
    # By body, the bodies that hang on it, and where [m], in its frame.
    outward: dict[str, dict[str, np.ndarray]] = {root: {}}
    order = [root]
    for link in order:
        for joint in description.joints_below.get(link, []):
            child, place_44 = joint.child, place_of[link] @ joint.origin_44
            reach[child] = reach[link] + float(np.linalg.norm(joint.origin_44[:3, 3]))
            if joint.kind == "fixed":
                body_of[child], place_of[child] = body_of[link], place_44
            else:
                body_of[child], place_of[child], outward[child] = child, np.eye(4), {}
                outward[body_of[link]][child] = place_44[:3, 3]
            order.append(child)
    dressed = {body_of[link] for link in shaped if link in body_of} | {root}
    least = _SHORTEST * max(reach.values())
    found: dict[str, str] = {}
    for body, hanging in outward.items():
        if body in dressed:
            continue
        ends = hanging
        if not hanging:
            own = {link: place_of[link][:3, 3] for link in order if body_of[link] == body}
            farthest = max(own, key=lambda link: float(np.linalg.norm(own[link])))
            ends = {farthest: own[farthest]}
        found |= {end: body for end, place_3 in ends.items() if np.linalg.norm(place_3) > least}
    return found
