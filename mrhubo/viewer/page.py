"""A stage as one HTML file, which needs no server and no network: viser's recording, and panels beside it.

viser's page brings the figures, the timeline, play and pause, and speeds. Confidence and joints are no part of a
recording, so they are written into the page, and follow its timeline (`page.js`).
"""

from __future__ import annotations

import html
import json
import math
from importlib.resources import files
from pathlib import Path

import numpy as np

from mrhubo.files.atomic import atomic_path
from mrhubo.viewer.controls import CONTACTS, about
from mrhubo.viewer.panels import (
    AT_END,
    AT_LIMIT,
    INSIDE,
    LEFT,
    RIGHT,
    confidence_strip,
    contact_strips,
    joint_bars,
    joint_curve,
    range_of,
)
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.scene import Scene
from mrhubo.viewer.server import local_server
from mrhubo.viewer.stage import Stage

_SCALE = 1000
"""Marks are kept as thousandths of a joint's range."""
_STYLE = """
body:has(#mrhubo-panel:not(.closed)) #root{width:calc(100% - 366px)}
#mrhubo-panel{position:fixed;top:12px;right:12px;width:330px;max-height:calc(100vh - 44px);overflow:auto;z-index:10;
background:#fffffff2;color:#4a515c;font:13px sans-serif;border-radius:6px;box-shadow:0 1px 10px #0003;padding:10px 14px}
#mrhubo-panel.closed{width:auto}#mrhubo-panel.closed>*:not(header){display:none}
#mrhubo-panel header{display:flex;justify-content:space-between;gap:8px;font-weight:bold}
#mrhubo-panel p{margin:8px 0 4px}#mrhubo-panel select{width:100%;margin:6px 0}
#mrhubo-panel button{border:0;background:none;cursor:pointer;font-size:15px;line-height:1}
"""


def save_page(stage: Stage, path: Path, title: str) -> Path:
    """Writes a stage as a page, with every frame of its clock; whole or not at all.

    Args:
        stage: what is shown.
        path: of the file; folders are made, and a file that is there is replaced.
        title: of the page.

    Raises:
        UserError: viser is not installed, or the disk refuses.
    """
    text = page_text(stage, title)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def page_text(stage: Stage, title: str) -> str:
    """The page itself, HTML; arguments as for `save_page`.

    Raises:
        UserError: viser is not installed.
    """
    with local_server() as server:
        scene = Scene(server, stage)
        recording = server.get_scene_serializer()
        for frame in range(stage.frames):
            scene.show(frame / stage.frame_rate)
            recording.insert_sleep(1 / stage.frame_rate)
        page = recording.as_html()
    page = page.replace("<title>Viser</title>", f"<title>{html.escape(title)}</title>")
    body_end = page.rindex("</body>")
    return page[:body_end] + _panels(stage, title) + page[body_end:]


def _panels(stage: Stage, title: str) -> str:
    """What is written into the page; nothing where there is no robot."""
    if not stage.robots:
        return ""
    options = "".join(f'<option value="{n}">{html.escape(r.label)}</option>' for n, r in enumerate(stage.robots))
    sections = "".join(_section(robot) for robot in stage.robots)
    facts = json.dumps([_facts(robot) for robot in stage.robots], separators=(",", ":")).replace("<", "\\u003c")
    script = files("mrhubo.viewer").joinpath("page.js").read_text(encoding="utf-8")
    return (
        f'<style>{_STYLE}</style><div id="mrhubo-panel"><header><span>{html.escape(title)}</span>'
        f'<button title="open or close">&#9776;</button></header><select class="robot">{options}</select>'
        f"{sections}</div>"
        f'<script type="application/json" id="mrhubo-robots">{facts}</script><script>{script}</script>'
    )


def _section(robot: Performance) -> str:
    motion = robot.motion
    parts = [f'<section><p>{html.escape(about(robot))}</p><p class="time"></p>']
    if motion.confidence is not None:
        parts.append(f"<p>confidence (red: not to be trusted)</p>{confidence_strip(motion.confidence)}")
    if motion.contact is not None and motion.contact_names:
        parts.append(f"<p>{CONTACTS}</p>{contact_strips(motion.contact, motion.contact_names)}")
    names = "".join(f'<option value="{n}">{html.escape(name)}</option>' for n, name in enumerate(motion.joint_names))
    parts.append(f'<select class="joint">{names}</select>')
    for column in range(len(motion.joint_names)):
        limits = float(robot.lower_N[column]), float(robot.upper_N[column])
        parts.append(f'<div class="curve">{joint_curve(motion.q[:, column], *limits)}</div>')
    parts.append(joint_bars(motion.joint_names, robot.lower_N, robot.upper_N, motion.q[0]))
    return "".join([*parts, "</section>"])


def _facts(robot: Performance) -> dict[str, object]:
    """What moves a robot's marks."""
    ends = [range_of(float(low), float(high)) for low, high in zip(robot.lower_N, robot.upper_N, strict=True)]
    low_N, high_N = np.array(ends).T
    shares_TN = np.clip((robot.motion.q - low_N) / (high_N - low_N), 0, 1)
    assert all(math.isfinite(end) for pair in ends for end in pair), "rows have ends"
    return {
        "rate": robot.frame_rate, "frames": len(robot), "left": LEFT, "right": RIGHT, "scale": _SCALE,
        "near": AT_LIMIT * _SCALE, "colors": [INSIDE, AT_END],
        "shares": (_SCALE * shares_TN).round().astype(int).tolist(),
    }  # fmt: skip
