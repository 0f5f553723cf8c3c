"""The stage as a tree of nodes in viser, which moves to any moment of it.

Names of nodes: `/world` carries everything and moves where the camera follows; below it `floor`, `person` with a mesh a
colour, `contacts`, and for each robot `robot_K` (its base) with a node for every body, below that which it hangs on,
and `contacts_K`. https://viser.studio documents the library.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mrhubo.body import JOINT_NAMES
from mrhubo.viewer.meshing import Mesh
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.person import Person
from mrhubo.viewer.poses import to_wxyz
from mrhubo.viewer.skin import human_skins
from mrhubo.viewer.spots import SPOT_COLOR, SPOT_HEIGHT_M, spots_of
from mrhubo.viewer.stage import Stage, Standing

if TYPE_CHECKING:
    import viser

WORLD = "/world"
_FLOOR_M, _FLOOR_COLOR, _LINE, _SECTION = 40.0, (238, 240, 243), (214, 218, 224), (188, 194, 202)
_LABEL_M = 0.12
"""How far labels are above heads."""
_FOV, _AZIMUTH, _ELEVATION, _MARGIN = np.radians(36.0), np.radians(16.0), np.radians(9.0), 1.22
"""Of the camera: its vertical field of view, where it stands seen from above and from the side, and what is left free
around the figures.
"""
_ASPECT = 1.2
"""Width by height of the part of a page that no panel hides, at least."""


class Scene:
    """The nodes of a stage in a viser server."""

    def __init__(self, server: viser.ViserServer, stage: Stage) -> None:
        """Adds the nodes, at the first moment, and places the camera."""
        self.stage, self.nodes, self.follows = stage, dict[str, Any](), stage.goes_far
        """The nodes by name; whether the world moves so that who walks stays in the picture."""
        self.bones: list[tuple[Any, np.ndarray, np.ndarray]] = []
        """Bones of the person, their places (T, 3) [m] and quaternions (T, 4)."""
        self.clickable: list[list[tuple[Any, int]]] = []
        """For each robot its meshes, and the column of the joint that moves each."""
        self._server, self._scene, self._sent = server, server.scene, dict[int, np.ndarray]()
        self._moves: list[Callable[[float], None]] = []
        self._scene.set_up_direction("+z")
        self._scene.configure_default_lights(enabled=True, cast_shadow=True)
        self._add(WORLD, self._scene.add_frame, show_axes=False)
        self._add(
            f"{WORLD}/floor", self._scene.add_grid, width=_FLOOR_M, height=_FLOOR_M, plane="xy", cell_size=0.5,
            section_size=1.0, cell_color=_LINE, section_color=_SECTION, plane_color=_FLOOR_COLOR, plane_opacity=1.0,
            shadow_opacity=0.2, fade_distance=25.0, position=(0.0, 0.0, -0.002),
        )  # fmt: skip
        standings = iter(stage.standings)
        if stage.person is not None:
            standing = next(standings)
            self._add_person(stage.person, standing)
            self._add_spots(f"{WORLD}/contacts", stage.person, standing)
        for number, (robot, standing) in enumerate(zip(stage.robots, standings, strict=True)):
            self._add_robot(f"{WORLD}/robot_{number}", robot, standing)
            self._add_spots(f"{WORLD}/contacts_{number}", robot, standing)
        self._place_camera()
        self.show(0.0)

    def show(self, time: float) -> None:
        """Moves everything to a moment [s]; only what has changed is sent."""
        with self._server.atomic():
            frame = int(np.clip(round(time * self.stage.frame_rate), 0, self.stage.frames - 1))
            followed_2 = self.stage.followed_F2[frame] if self.follows else np.zeros(2)
            self._send(self.nodes[WORLD], np.append(-followed_2, 0.0), None)
            for move in self._moves:
                move(time)

    def _add(self, name: str, make: Callable[..., Any], **given: Any) -> Any:
        self.nodes[name] = make(name, **given)
        return self.nodes[name]

    def _send(self, node: Any, place_3: np.ndarray | None, wxyz_4: np.ndarray | None) -> None:
        """Moves a node or a bone, if it is not there already."""
        for kind, (attribute, value) in enumerate((("position", place_3), ("wxyz", wxyz_4))):
            key = 2 * id(node) + kind
            if value is None or (key in self._sent and np.array_equal(self._sent[key], value)):
                continue
            self._sent[key] = value
            setattr(node, attribute, value)

    def _add_person(self, person: Person, standing: Standing) -> None:
        name = f"{WORLD}/person"
        root = self._add(name, self._scene.add_frame, show_axes=False)
        wxyz_TJ4, place_TJ3 = to_wxyz(person.turn_TJ33), person.place_TJ3
        rest_J3 = _rest_places()
        for number, skin in enumerate(human_skins()):
            weight_VB = np.eye(len(skin.bones))[skin.carrier_V]
            mesh = self._add(
                f"{name}/{number}", self._scene.add_mesh_skinned, vertices=skin.mesh.vertices_V3,
                faces=skin.mesh.faces_F3, bone_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(skin.bones), 1)),
                bone_positions=rest_J3[list(skin.bones)], skin_weights=weight_VB, color=_bytes(skin.mesh.color),
            )  # fmt: skip
            for handle, joint in zip(mesh.bones, skin.bones, strict=True):
                self.bones.append((handle, place_TJ3[:, joint], wxyz_TJ4[:, joint]))
        self._add_label(name, person.name or "person", standing)
        place_T3, wxyz_T4 = standing.pose_T44[:, :3, 3], to_wxyz(standing.pose_T44[:, :3, :3])

        def move(time: float) -> None:
            frame = self.stage.frame_of(person, time)
            self._send(root, place_T3[frame], wxyz_T4[frame])
            for handle, bone_T3, bone_T4 in self.bones:
                self._send(handle, bone_T3[frame], bone_T4[frame])

        self._moves.append(move)

    def _add_spots(self, name: str, figure: Person | Performance, standing: Standing) -> None:
        """A disc on the floor for every spot of a figure, which is seen while its foot is planted."""
        spots = spots_of(figure, standing)
        if spots is None:
            return
        discs = [
            self._add(
                f"{name}/{spot}", self._scene.add_cylinder, radius=float(radius), height=SPOT_HEIGHT_M,
                color=_bytes(SPOT_COLOR), visible=False, cast_shadow=False,
            )
            for spot, radius in zip(spots.names, spots.radius_P, strict=True)
        ]  # fmt: skip

        def move(time: float) -> None:
            frame = self.stage.frame_of(figure, time)
            for spot, disc in enumerate(discs):
                self._send(disc, spots.place_TP3[frame, spot], None)
                if disc.visible != bool(spots.planted_TP[frame, spot]):
                    disc.visible = bool(spots.planted_TP[frame, spot])

        self._moves.append(move)

    def _add_robot(self, name: str, robot: Performance, standing: Standing) -> None:
        names, nodes, clickable = [], [], []
        for number, body in enumerate(robot.bodies):
            above = name if body.parent is None else f"{names[body.parent]}/{number}"
            names.append(above)
            nodes.append(self._add(above, self._scene.add_frame, show_axes=False))
            for part, mesh in enumerate(body.meshes):
                handle = self._add_mesh(f"{above}/mesh_{part}", mesh)
                clickable += [] if body.parent is None else [(handle, body.column)]
        self.clickable.append(clickable)
        self._add_label(name, robot.label, standing)
        local_BT44 = robot.local_BT44.copy()
        local_BT44[0] = standing.pose_T44 @ local_BT44[0]
        place_BT3, wxyz_BT4 = local_BT44[..., :3, 3], to_wxyz(local_BT44[..., :3, :3])

        def move(time: float) -> None:
            frame = self.stage.frame_of(robot, time)
            for node, place_T3, wxyz_T4 in zip(nodes, place_BT3, wxyz_BT4, strict=True):
                self._send(node, place_T3[frame], wxyz_T4[frame])

        self._moves.append(move)

    def _add_mesh(self, name: str, mesh: Mesh) -> Any:
        return self._add(
            name, self._scene.add_mesh_simple, vertices=mesh.vertices_V3, faces=mesh.faces_F3,
            color=_bytes(mesh.color), side="double",
        )  # fmt: skip

    def _add_label(self, name: str, text: str, standing: Standing) -> None:
        """Above the head of a figure; it goes where the figure goes on the floor."""
        label = self._add(
            f"{WORLD}/label_{name.rpartition('/')[2]}", self._scene.add_label, text=text, anchor="bottom-center"
        )
        height = standing.high_3[2] + _LABEL_M
        place_T3 = np.column_stack([standing.pose_T44[:, :2, 3], np.full(len(standing.pose_T44), height)])
        figure = self._figure_of(standing)

        def move(time: float) -> None:
            self._send(label, place_T3[self.stage.frame_of(figure, time)], None)

        self._moves.append(move)

    def _figure_of(self, standing: Standing) -> Person | Performance:
        figures = [*([] if self.stage.person is None else [self.stage.person]), *self.stage.robots]
        return figures[next(n for n, s in enumerate(self.stage.standings) if s is standing)]

    def _place_camera(self) -> None:
        """In front of the figures, so far away that all are in the picture."""
        low_3, high_3 = self.stage.box()
        high_3 = high_3 + [0.0, 0.0, 2 * _LABEL_M]
        middle_3 = np.array([(low_3[0] + high_3[0]) / 2, (low_3[1] + high_3[1]) / 2, (low_3[2] + high_3[2]) / 2])
        tall, wide = _MARGIN * (high_3[2] - low_3[2]), _MARGIN * (high_3[1] - low_3[1])
        away = max(tall, wide / _ASPECT) / (2 * np.tan(_FOV / 2)) + (high_3[0] - low_3[0]) / 2
        level_3 = np.array([np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.0])
        camera = self._server.initial_camera
        camera.fov, camera.up = float(_FOV), (0.0, 0.0, 1.0)
        camera.look_at = tuple(middle_3)
        camera.position = tuple(middle_3 + away * (np.cos(_ELEVATION) * level_3 + [0.0, 0.0, np.sin(_ELEVATION)]))


def _rest_places() -> np.ndarray:
    """Places (22, 3) [m] of the joints at rest."""
    from mrhubo.body.joints import REST_K3
    from mrhubo.frames import human_to_world

    return human_to_world(REST_K3[: len(JOINT_NAMES)].astype(float))


def _bytes(color: tuple[float, float, float]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in color)
    return red, green, blue
