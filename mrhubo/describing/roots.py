"""Robots whose URDF has its root on a limb: legs and arms are seen from the trunk, which then has to be the root."""

from __future__ import annotations

from mrhubo.robot.discovery import Discovery
from mrhubo.robot.parts import CHEST, PELVIS
from mrhubo.robot.rooted import is_carried
from mrhubo.robot.urdf import Description


def better_root(description: Description, found: Discovery) -> str | None:
    """The link of the trunk that has to be the root, where a joint of a limb that moves lies between the two; else
    None.
    """
    limbs = set(found.joints) - set(found.chains.get("waist", ()))
    trunk = [found.ends[name].link for name in (PELVIS.name, CHEST.name) if name in found.ends]
    if not any(is_carried(link, limbs, description) for link in trunk):
        return None
    return _main_link(trunk[0] if found.whole_body else found.ends[CHEST.name].link, description)


def _main_link(link: str, description: Description) -> str:
    """Of what is fixed to a link and carried by it, what weighs most, else carries most: a base at a mount of a leg
    would tell nobody anything.
    """
    links, joints = [link], description.joints.values()
    for carrier in links:
        links += [joint.child for joint in joints if joint.kind == "fixed" and joint.parent == carrier]
    weight = {name: description.masses.get(name, (0.0,))[0] for name in links}
    return max(links, key=lambda name: (weight[name], sum(joint.parent == name for joint in joints)))
