"""Entries to paste are YAML, whatever a robot's links are called."""

from __future__ import annotations

import pytest
import yaml

from mrhubo.robot.entries import Point
from mrhubo.robot.suggestions import axes_entry, point_entry


@pytest.mark.parametrize("link", ["l_hand", "a: b", "13_28", "it's", "{x}", "yes", " torso"])
def test_an_entry_names_the_link(link: str) -> None:
    assert yaml.safe_load(point_entry("left_wrist", Point(link, (0.0, 0.0, 0.0)))) == {"left_wrist": link}
    beside = yaml.safe_load(point_entry("left_wrist", Point(link, (0.0, 0.1, -0.22))))
    assert beside == {"left_wrist": {"link": link, "offset": [0, 0.1, -0.22]}}
    turned = yaml.safe_load(axes_entry("chest", link, {"forward": (0.0, 0.0, 1.0), "up": (-1.0, 0.0, 0.0)}))
    assert turned == {"chest": {"link": link, "forward": [0, 0, 1], "up": [-1, 0, 0]}}
    assert yaml.safe_load(axes_entry("chest", link, {"forward": (1.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0)})) == {
        "chest": link
    }
