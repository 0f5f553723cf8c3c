"""Panels are drawings with a line at the moment, whatever joints are called."""

from __future__ import annotations

import numpy as np
import pytest
from lxml import etree

from mrhubo.viewer.panels import LEFT, RIGHT, WIDTH, confidence_strip, joint_bars, joint_curve
from mrhubo.viewer.player import Player


def drawing(svg: str) -> etree._Element:
    return etree.fromstring(svg)


def test_the_least_confidence_of_a_place_is_seen() -> None:
    confidence_T = np.ones(6000)
    confidence_T[3000] = 0.0
    root = drawing(confidence_strip(confidence_T, 0.5))
    colors = [cell.get("fill") for cell in root.iter("{*}rect")]
    assert len(colors) == 150 and colors.count("#c0392b") == 1 and colors[75] == "#c0392b"
    (line,) = root.xpath("//*[@class='now']")
    assert float(line.get("x1")) == WIDTH / 2
    assert len(list(drawing(confidence_strip(np.array([0.5]))).iter("{*}rect"))) == 1


def test_a_curve_stays_between_its_limits() -> None:
    q_T = np.sin(np.linspace(0, 20, 5000))
    root = drawing(joint_curve(q_T, -2.0, np.inf, 1.0))
    height = [float(point.split(",")[1]) for point in root.find("{*}polyline").get("points").split()]
    dashed = [line for line in root.iter("{*}line") if line.get("stroke-dasharray")]
    assert len(height) <= 300 and len(dashed) == 1 and max(height) < float(dashed[0].get("y1"))
    assert root.find("{*}text").text == "-115°"


def test_a_row_a_joint() -> None:
    lower_N, upper_N = np.array([-1.0, -np.inf, 0.0]), np.array([1.0, np.inf, 2.0])
    root = drawing(joint_bars(['a<b&"c"', "turn", "x" * 40], lower_N, upper_N, np.array([0.0, 0.0, 2.0])))
    marks = root.xpath("//*[@class='mark']")
    assert [float(mark.get("cx")) for mark in marks] == pytest.approx([(LEFT + RIGHT) / 2, (LEFT + RIGHT) / 2, RIGHT])
    assert [mark.get("fill") == marks[0].get("fill") for mark in marks] == [True, True, False]
    assert [text.text for text in root.iter("{*}text")] == ['a<b&"c"', "turn", "x" * 19 + "..."]


def test_a_clock_runs_stops_and_begins_anew() -> None:
    player = Player(2.0)
    player.speed = 0.5
    assert player.advance(1.0) == 0.5
    player.speed = 4.0
    assert player.advance(0.5) == pytest.approx(0.5) and player.playing  # around the end
    player.loop = False
    assert player.advance(10.0) == 2.0 and not player.playing
    player.toggle()
    assert player.time == 0.0 and player.playing
    player.seek(99.0)
    assert player.time == 2.0 and not player.playing and player.advance(1.0) == 2.0
    still = Player(0.0)  # a motion of one frame
    assert still.advance(1.0) == 0.0 and not still.playing
