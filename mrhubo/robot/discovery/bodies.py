"""A robot as rigid bodies and the joints between them, without a root: what hangs together does so from any side.

Links that fixed joints connect are one body. Which link of a URDF is the root is an accident of its file: a pelvis, a
chest, a foot, a wheelbase. So a body's branches are looked at alike, those towards the root too.

Legend: all poses in the root link's frame with every joint at 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mrhubo.robot.discovery.lines import Line
from mrhubo.robot.shapes import LinkGeometry, read_collision_geometry, read_geometry, without_markers
from mrhubo.robot.urdf import Description

FULL_TURN = 6.2
"""Range of a joint that is no limit, as about a full turn is none [rad]."""
_AWAY = 1.0
"""How far from all joints that move a link lies that is none of the robot's, in lengths of the box around these."""


@dataclass(frozen=True, eq=False)
class Hinge:
    """A joint that moves, between two bodies."""

    name: str
    line: Line
    rotary: bool
    bodies: tuple[int, int]
    """Those of the parent and of the child link."""
    lower: float | None
    upper: float | None
    free: bool
    """Whether it is driven by itself, mimicking none."""
    drives: bool
    """Whether others mimic it."""
    links: tuple[str, str]
    """Parent and child link."""
    motor: str | None = None
    """The joint of the motor that it mimics, if that carries nothing and is no part of the tree."""

    @property
    def alone(self) -> bool:
        """Whether it is driven by itself, or by a motor of its own."""
        return self.free or self.motor is not None

    def other(self, body: int) -> int:
        """The body on the other side."""
        return self.bodies[1] if self.bodies[0] == body else self.bodies[0]

    def link_of(self, body: int) -> str:
        """Its link in a body."""
        return self.links[0] if self.bodies[0] == body else self.links[1]

    @property
    def limited(self) -> bool:
        """Whether its limits mean something: less than a full turn."""
        return self.lower is not None and self.upper is not None and 0 < self.upper - self.lower < FULL_TURN


@dataclass(frozen=True)
class Step:
    """A joint of a chain, passed from one body to the next."""

    hinge: Hinge
    start: int
    """The body from which it is passed."""

    @property
    def end(self) -> int:
        """The body that is reached."""
        return self.hinge.other(self.start)

    @property
    def inner_link(self) -> str:
        """The joint's link on the body's side."""
        return self.hinge.link_of(self.start)

    @property
    def outer_link(self) -> str:
        """The joint's link on the far side."""
        return self.hinge.link_of(self.end)

    @property
    def sign(self) -> float:
        """1 where turning the joint turns the far side about the line's axis, -1 where the root is on the far side."""
        return 1.0 if self.hinge.bodies[0] == self.start else -1.0


Chain = tuple[Step, ...]


def lines_of(chain: Chain) -> list[Line]:
    """The axes of a chain."""
    return [step.hinge.line for step in chain]


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of a robot."""

    description: Description
    pose_44: dict[str, np.ndarray]
    """Of every link."""
    body_of: dict[str, int]
    """By link."""
    hinges: tuple[Hinge, ...]
    degrees: bool = False
    """Whether the file's limits are in degrees; those of the hinges are in radians all the same."""
    gains: Mapping[str, float] = field(default_factory=dict)
    """By hinge: how much farther a limb turns than its joint, where a second hinge follows; 1 for all others."""
    springs: Mapping[str, str] = field(default_factory=dict)
    """Joints taken as fixed that give way a little about the axis of a hinge next to them; by name, that hinge's."""
    _extents: dict[tuple[int, str], float] = field(default_factory=dict, repr=False, compare=False)
    nexts: dict[tuple[int, str], Step | None] = field(default_factory=dict, repr=False, compare=False)
    _branches: dict[tuple[int, str], tuple[set[int], list[Hinge]]] = field(
        default_factory=dict, repr=False, compare=False
    )

    @cached_property
    def links_of(self) -> list[list[str]]:
        """The links of each body, in the file's order."""
        found: list[list[str]] = [[] for _ in range(max(self.body_of.values()) + 1)]
        for link, body in self.body_of.items():
            found[body].append(link)
        return found

    @cached_property
    def steps_from(self) -> list[list[Step]]:
        """The joints at each body, passed from there, without those of motors beside the ones that they drive."""
        found: list[list[Step]] = [[] for _ in self.links_of]
        motors = {hinge.motor for hinge in self.hinges}
        for hinge in (hinge for hinge in self.hinges if hinge.name not in motors):
            for body in hinge.bodies:
                found[body].append(Step(hinge, body))
        return found

    @cached_property
    def shapes_of(self) -> list[list[LinkGeometry]]:
        """The primitive shapes of each body: those that collide, else those that are seen."""
        found: list[list[LinkGeometry]] = [[] for _ in self.links_of]
        for read in (read_collision_geometry, read_geometry):
            solid = {shape.link for shapes in found for shape in shapes}
            for shape in without_markers(read(self.description.parsed), self.size):
                if shape.link not in solid:
                    found[self.body_of[shape.link]].append(shape)
        return found

    def position(self, link: str) -> np.ndarray:
        """A link's origin (3,)."""
        return self.pose_44[link][:3, 3]

    def in_link(self, link: str, point_3: np.ndarray) -> np.ndarray:
        """A point in a link's frame."""
        pose_44 = self.pose_44[link]
        return pose_44[:3, :3].T @ (point_3 - pose_44[:3, 3])

    def centre(self, body: int) -> np.ndarray | None:
        """Centre of mass (3,) of a body; None if it has no mass."""
        found = [
            (link, self.description.masses[link]) for link in self.links_of[body] if link in self.description.masses
        ]
        if not found:
            return None
        centres = [self.pose_44[link][:3, :3] @ np.array(mass[1:]) + self.position(link) for link, mass in found]
        return np.average(centres, axis=0, weights=[mass[0] for _, mass in found])

    def bare(self, body: int) -> bool:
        """Whether a body has neither mass nor shape, nor a mesh: a frame, or what a sensor turns."""
        links = self.description.parsed.link_map
        return self.centre(body) is None and not any(
            links[link].visuals or links[link].collisions for link in self.links_of[body] if link in links
        )

    def weight(self, body: int) -> float:
        """Mass of a body [kg]; 0 if the file gives none."""
        return sum(self.description.masses[link][0] for link in self.links_of[body] if link in self.description.masses)

    @cached_property
    def weighty(self) -> frozenset[int]:
        """The bodies to which the file gives a mass."""
        return frozenset(body for body in range(len(self.links_of)) if self.weight(body) > 0)

    def middle(self, body: int) -> np.ndarray:
        """About where a body is (3,): its centre of mass, else the mean of its corners."""
        centre_3 = self.centre(body)
        return self.corners(body).mean(0) if centre_3 is None else centre_3

    def corners(self, body: int) -> np.ndarray:
        """Points (P, 3) at the outside of a body's shapes, and the origins of its links; of meshes nothing is known."""
        found = [self.position(link)[None] for link in self.links_of[body]]
        for shape in self.shapes_of[body]:
            found.append(self.shape_corners(shape))
        return np.concatenate(found)

    def shape_corners(self, shape: LinkGeometry) -> np.ndarray:
        """Corners (8, 3) of the box around a primitive shape."""
        pose_44 = self.pose_44[shape.link] @ shape.origin_44
        size = shape.size
        half_3 = {
            "box": lambda: np.array(size) / 2,
            "sphere": lambda: np.full(3, size[0]),
            "cylinder": lambda: np.array([size[0], size[0], size[1] / 2]),
            "capsule": lambda: np.array([size[0], size[0], size[1] / 2 + size[0]]),
        }[shape.kind]()
        signs_83 = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3)
        return pose_44[:3, 3] + (signs_83 * half_3) @ pose_44[:3, :3].T

    def beyond(self, step: Step) -> tuple[set[int], list[Hinge]]:
        """The bodies and joints of a branch, its first joint among them."""
        key = (step.start, step.hinge.name)
        if key not in self._branches:
            self._branches[key] = self._branch(step)
        return self._branches[key]

    def _branch(self, step: Step) -> tuple[set[int], list[Hinge]]:
        bodies, hinges, todo = {step.end}, [step.hinge], [step.end]
        while todo:
            body = todo.pop()
            for further in self.steps_from[body]:
                if further.hinge is not step.hinge and further.end not in bodies:
                    bodies.add(further.end)
                    hinges.append(further.hinge)
                    todo.append(further.end)
        return bodies, hinges

    def onward(self, step: Step) -> list[Step]:
        """The joints at the body that a joint leads to, without itself."""
        return [further for further in self.steps_from[step.end] if further.hinge is not step.hinge]

    def extent(self, step: Step) -> float:
        """How far the longest chain reaches beyond a joint, from body to body along joint origins and link ends [m]."""
        if key_of(step) in self._extents:
            return self._extents[key_of(step)]
        pending = [step]  # not a function that calls itself: a file may have thousands of joints in a row
        while pending:
            here = pending[-1]
            onward = self.onward(here)
            if missing := [on for on in onward if key_of(on) not in self._extents]:
                pending += missing
                continue
            pending.pop()
            here_3 = self.position(here.outer_link)
            own = max(float(np.linalg.norm(self.position(link) - here_3)) for link in self.links_of[here.end])
            further = [
                float(np.linalg.norm(self.position(on.outer_link) - here_3)) + self._extents[key_of(on)]
                for on in onward
            ]
            self._extents[key_of(here)] = max([own, *further])
        return self._extents[key_of(step)]

    def span(self, step: Step) -> float:
        """How far from its joint a branch reaches, by links and shapes [m]."""
        corners = np.concatenate([self.corners(body) for body in self.beyond(step)[0]])
        return float(np.linalg.norm(corners - self.position(step.outer_link), axis=-1).max())

    def path(self, start: int, end: int) -> Chain:
        """The joints from one body to another."""
        came: dict[int, Step] = {}
        todo, seen = [start], {start}
        for body in todo:
            for step in self.steps_from[body]:
                if step.end not in seen:
                    seen.add(step.end)
                    came[step.end] = step
                    todo.append(step.end)
        found = []
        while end != start:
            if end not in came:
                return ()
            found.append(came[end])
            end = came[end].start
        return tuple(reversed(found))

    @cached_property
    def size(self) -> float:
        """Longest distance between two link origins [m], about that of a box around them; without those of a room or a
        map, far from all that moves.
        """
        points = np.stack([self.position(link) for link in self.body_of])
        if self.hinges:
            moving = np.stack([hinge.line.point_3 for hinge in self.hinges])
            low_3, high_3 = moving.min(0), moving.max(0)
            away = np.linalg.norm(points - np.clip(points, low_3, high_3), axis=-1)
            points = np.vstack([moving, points[away < max(_AWAY * math.dist(low_3, high_3), 1e-6)]])
        return max(float(np.linalg.norm(points.max(0) - points.min(0))), 1e-6)


def key_of(step: Step) -> tuple[int, str]:
    """By which a step is remembered."""
    return step.start, step.hinge.name
