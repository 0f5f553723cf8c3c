"""The controls beside a stage: timeline, play, speed, loop; and for every robot its confidence and its joints."""

from __future__ import annotations

import html
import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mrhubo.viewer.panels import confidence_strip, contact_strips, joint_bars, joint_curve
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.player import SPEEDS, Player
from mrhubo.viewer.scene import Scene

if TYPE_CHECKING:
    import viser

_PANEL_S = 0.1
"""How often [s] panels are drawn anew: they are text that goes through the browser's layout."""

_STEP_S = 0.01
"""Of the timeline [s]."""
CONTACTS = "contacts (orange: the foot is planted)"
"""What stands above the strips of a robot's feet."""


class Controls:
    """Controls that tell a player, and are told by it where it is."""

    def __init__(self, server: viser.ViserServer, scene: Scene, player: Player) -> None:
        """Adds the controls to the server's page."""
        self._gui, self._scene, self._player, self._stage = server.gui, scene, player, scene.stage
        self.panels: list[list[Callable[[float], None]]] = []
        self._drawn_at, self._stale = -np.inf, True
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label("mrhubo")
        gui.main_panel.dock_right()  # so that it hides nobody
        self.timeline = gui.add_slider("time [s]", 0.0, max(round(player.duration, 2), _STEP_S), _STEP_S, 0.0)
        self.play = gui.add_button("Pause")
        self.speed = gui.add_dropdown("speed", [f"{speed:g}x" for speed in SPEEDS], initial_value="1x")
        self.loop = gui.add_checkbox("loop", player.loop)
        self.timeline.on_update(self._seek)
        self.play.on_click(lambda _: player.toggle())
        self.speed.on_update(lambda _: setattr(player, "speed", float(self.speed.value.removesuffix("x"))))
        self.loop.on_update(lambda _: setattr(player, "loop", self.loop.value))
        if self._stage.followed_F2.any():
            follow = gui.add_checkbox("follow who walks", scene.follows)
            follow.on_update(lambda _: setattr(scene, "follows", follow.value))
        labels = _distinct([robot.label for robot in self._stage.robots])
        # A list, and not tabs, as a click on a robot has to open its panels, and viser's tabs open by hand alone.
        self.robot = gui.add_dropdown("robot", labels, visible=len(labels) > 1) if labels else None
        self.folders: list[Any] = []
        self.joints: list[Any] = []
        for number, robot in enumerate(self._stage.robots):
            self.folders.append(gui.add_folder(None, visible=number == 0))
            with self.folders[-1]:
                self._add_robot(number, robot, labels[number])
        if self.robot is not None:
            self.robot.on_update(lambda _: self._choose())

    def show(self, time: float, clock: float) -> None:
        """Puts the controls where the player is.

        Args:
            time: of the player [s].
            clock: of the world [s]; panels are not drawn at every call.
        """
        word = "Pause" if self._player.playing else "Play"
        if self.play.label != word:
            self.play.label = word
        shown = min(round(time / _STEP_S) * _STEP_S, self.timeline.max)
        if abs(self.timeline.value - shown) > 1e-6:
            self.timeline.value = shown
            self._stale = True
        if self._stale and clock - self._drawn_at >= _PANEL_S:
            self._drawn_at, self._stale = clock, False
            self._draw_panels(time)

    def _seek(self, event: Any) -> None:
        if event.client is not None:  # moved by somebody, and not by the player
            self._player.seek(float(self.timeline.value))

    def _chosen(self) -> int | None:
        return None if self.robot is None else self.robot.options.index(self.robot.value)

    def _choose(self) -> None:
        chosen = self._chosen()
        for number, folder in enumerate(self.folders):
            if folder.visible != (number == chosen):
                folder.visible = number == chosen
        self._draw_panels(self._player.time)

    def _draw_panels(self, time: float) -> None:
        if (chosen := self._chosen()) is not None:
            for panel in self.panels[chosen]:
                panel(time)

    def _add_robot(self, number: int, robot: Performance, label: str) -> None:
        motion, gui = robot.motion, self._gui
        panels: list[Callable[[float], None]] = []
        gui.add_html(_note(about(robot)))
        if motion.confidence is not None:
            confidence_T = motion.confidence
            gui.add_html(_note("confidence (red: not to be trusted)"))
            strip = gui.add_html(confidence_strip(confidence_T))
            panels.append(lambda time: _draw(strip, confidence_strip(confidence_T, self._share(robot, time))))
        if motion.contact is not None and motion.contact_names:
            contact_TF, names = motion.contact, motion.contact_names
            gui.add_html(_note(CONTACTS))
            feet = gui.add_html(contact_strips(contact_TF, names))
            panels.append(lambda time: _draw(feet, contact_strips(contact_TF, names, self._share(robot, time))))
        joint = gui.add_dropdown("joint", list(motion.joint_names), initial_value=motion.joint_names[0])
        self.joints.append(joint)
        curve, bars = gui.add_html(""), gui.add_html("")

        def draw_curve(time: float) -> None:
            column = motion.joint_names.index(joint.value)
            limits = float(robot.lower_N[column]), float(robot.upper_N[column])
            _draw(curve, joint_curve(motion.q[:, column], *limits, self._share(robot, time)))

        def draw_bars(time: float) -> None:
            q_N = motion.q[self._stage.frame_of(robot, time)]
            _draw(bars, joint_bars(motion.joint_names, robot.lower_N, robot.upper_N, q_N))

        joint.on_update(lambda _: draw_curve(self._player.time))
        self.panels.append([*panels, draw_curve, draw_bars])
        for handle, column in self._scene.clickable[number]:
            handle.on_click(lambda _, name=motion.joint_names[column]: self._click(label, joint, name))

    def _click(self, label: str, joint: Any, name: str) -> None:
        joint.value = name
        if self.robot is not None and self.robot.value != label:
            self.robot.value = label

    def _share(self, robot: Performance, time: float) -> float:
        return self._stage.frame_of(robot, time) / max(len(robot) - 1, 1)


def about(robot: Performance) -> str:
    """Who found a robot's angles, and how large it is shown."""
    size = "at its own size" if robot.scale == 1.0 else f"shown {robot.scale:.2g} times its size"
    made = robot.motion.robot.made_by or "a file of its motion"
    return f"{robot.robot.name}, {len(robot.motion.joint_names)} joints, by {made}; {size}"


def _distinct(labels: Sequence[str]) -> list[str]:
    """Labels of which those that have come before have a number: files of one name may lie in several folders."""
    found: list[str] = []
    for label in labels:
        fits = (name for n in itertools.count(1) if (name := label if n == 1 else f"{label} ({n})") not in found)
        found.append(next(fits))
    return found


def _note(text: str) -> str:
    return f'<div style="font-size:0.8em;opacity:0.75;padding:0.2em 0.75em">{html.escape(text)}</div>'


def _draw(handle: Any, svg: str) -> None:
    content = f'<div style="padding:0 0.75em 0.3em">{svg}</div>'
    if handle.content != content:
        handle.content = content
