"""Robots that tests write by hand: a chest, and what is joined to it; and what is read of what was found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.robot.discovery import Discovery, discover

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
SIDES = {"left": 1, "right": -1}


@dataclass
class Made:
    """A URDF that is being written: a chest, and what is joined to it."""

    parts: list[str] = field(default_factory=lambda: ["<link name='chest'/>"])

    def join(
        self, name: str, parent: str, xyz, axis, limits=(-1.5, 1.5), kind="revolute", more: str = "", shape: str = "",
        rpy=(0, 0, 0),
    ) -> str:  # fmt: skip
        """A link that weighs something, on a joint with limits, or without."""
        given = "" if limits is None else f"<limit lower='{limits[0]}' upper='{limits[1]}' effort='1' velocity='1'/>"
        self.parts.append(
            f"<link name='{name}'><inertial><origin xyz='0 0 -0.05'/><mass value='1'/></inertial>{shape}</link>"
            f"<joint name='{name}_joint' type='{kind}'><parent link='{parent}'/><child link='{name}'/>"
            f"<origin xyz='{xyz[0]} {xyz[1]} {xyz[2]}' rpy='{rpy[0]} {rpy[1]} {rpy[2]}'/><axis xyz='{axis[0]} {axis[1]} {axis[2]}'/>{given}{more}</joint>"
        )
        return name

    def arm(self, side: str, height: float = 0.4, called: str = "") -> str:
        """Shoulder and upper arm, hanging; its last link."""
        link = "chest"
        for word, axis in (("pitch", Y), ("roll", X), ("yaw", Z)):
            at = (0, 0.2 * SIDES[side], height) if word == "pitch" else (0, 0, 0)
            limits = (-2.8, 1.2) if word == "pitch" else (-1.5, 1.5)
            link = self.join(f"{side}_{called}shoulder_{word}", link, at, axis, limits)
        return link

    def forearm(self, side: str, parent: str, height: float = -0.3, called: str = "") -> str:
        """Elbow and forearm's twist."""
        link = self.join(f"{side}_{called}elbow", parent, (0, 0, height), Y, (-2.3, 0.0))
        return self.join(f"{side}_{called}forearm", link, (0, 0, -0.1), Z)

    def wrist(self, side: str, parent: str, called: str = "") -> str:
        """The wrist's two swings."""
        link = self.join(f"{side}_{called}wrist_pitch", parent, (0, 0, -0.15), Y)
        return self.join(f"{side}_{called}wrist_roll", link, (0, 0, 0), X)

    def leg(self, side: str) -> str:
        """As far as the shank, which is 0.4 m long."""
        link = self.join(f"{side}_hip_roll", "chest", (0, 0.1 * SIDES[side], -0.1), X)
        link = self.join(f"{side}_hip_pitch", link, (0, 0, 0), Y, (-2.0, 0.5))
        return self.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))

    def found(self, folder: Path) -> Discovery:
        """What is discovered of it."""
        file = folder / "made.urdf"
        file.write_text(f"<robot name='made'>{''.join(self.parts)}</robot>")
        return discover(file, whole_body=True)


def at(found: Discovery, point: str) -> list[float]:
    return list(found.points[point].root_3)


def about(found: Discovery) -> set[str]:
    return {question.about for question in found.questions}
