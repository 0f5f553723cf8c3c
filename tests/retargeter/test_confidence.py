"""Confidence: a probability for each branch that every signal lowers, and that is told in the package."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.reference import DirectionProblem
from mrhubo.retargeter.confidence import SIGNALS, STANDARD, ConfidenceModel, Signals, branches_of, shake
from mrhubo.robot import build_body_map
from mrhubo.robot.parts import LimbPart

FIELDS = {"miss": "miss_deg", "implausible": "phi", "excess": "excess_deg", "shake": "shake_deg"}
WELL = {"miss_deg": 1.0, "phi": 0.0003, "excess_deg": 0.0, "shake_deg": 0.0}


def signals(**numbers: float) -> Signals:
    return Signals(**{name: torch.tensor([[value]]) for name, value in (WELL | numbers).items()})


@pytest.mark.parametrize(
    ("robot", "names"),
    [("nao", ["left_arm", "right_arm"]), ("coman", ["left_arm", "right_arm"]), ("reachy", ["left_arm", "right_arm", "head"])],
)  # fmt: skip
def test_branches_are_arms_and_head(root: Path, robot: str, names: list[str]) -> None:
    body_map = build_body_map(load_config(root / "conf" / f"{robot}.yaml").robot)
    found = branches_of(DirectionProblem(body_map))
    assert [branch.name for branch in found] == names
    for branch in found:
        parts = [body_map.directions[i].part for i in branch.columns]
        assert all(isinstance(part, LimbPart) for part in parts) == (branch.name != "head")
        assert not {i for other in found if other is not branch for i in other.columns} & set(branch.columns)
        assert branch.joints


@pytest.mark.parametrize("signal", SIGNALS)
def test_every_signal_lowers_it(signal: str) -> None:
    levels = [float(STANDARD(signals(**{FIELDS[signal]: 0.001 * 1.5**k}))) for k in range(40)]
    assert all(a >= b for a, b in zip(levels, levels[1:], strict=False))
    assert levels[0] > 0.9 and levels[-1] < 1e-3


@given(st.lists(st.floats(0, 1e6, width=32), min_size=4, max_size=4), st.booleans())
@settings(max_examples=50, deadline=None)
def test_it_is_a_probability(numbers: list[float], rated: bool) -> None:
    found = signals(**dict(zip(WELL, numbers, strict=True)))
    confidence = float(STANDARD(found if rated else dataclasses.replace(found, shake_deg=None)))
    assert 0.0 <= confidence <= 1.0


def test_what_cannot_be_told_is_not_trusted() -> None:
    assert float(STANDARD(signals(phi=math.nan))) == 0.0


def test_it_is_told_in_a_header() -> None:
    assert ConfidenceModel.from_json(STANDARD.to_json()) == STANDARD


@pytest.mark.parametrize(
    ("path", "value"),
    [(("usual_phi",), 0.0), (("usual_phi",), "much"), (("moving", "miss"), -1.0), (("still", "shake"), math.nan),
     (("usual_phi",), 10**400), (("moving", "certain"), math.inf), (("moving", "other"), 1.0), (("still",), 3)],
)  # fmt: skip
def test_wrong_headers_are_refused(path: tuple[str, ...], value: object) -> None:
    content = json.loads(STANDARD.to_json())
    inner = content
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    with pytest.raises(UserError, match="confidence's weights"):
        ConfidenceModel.from_json(json.dumps(content))
    for text in ("", "[]", "{}", "null"):
        with pytest.raises(UserError, match="confidence's weights"):
            ConfidenceModel.from_json(text)


def swing(rate: float, seconds: float, noise_deg: float) -> torch.Tensor:
    """A limb that swings through 60 degrees to either side once a second (T, 1, 3), and what is added to it."""
    generator = torch.Generator().manual_seed(1)
    time_T = torch.arange(int(rate * seconds)) / rate
    angle_T = math.radians(60) * torch.sin(2 * math.pi * time_T)
    direction_T3 = torch.stack((angle_T.cos(), angle_T.sin(), torch.zeros_like(angle_T)), dim=1)
    noise_T3 = math.radians(noise_deg) * torch.randn(len(time_T), 3, generator=generator)
    return torch.nn.functional.normalize(direction_T3 + noise_T3, dim=1)[:, None]


@pytest.mark.parametrize("rate", [12.0, 24.0, 60.0, 120.0])
def test_a_person_does_not_shake_and_noise_does(rate: float) -> None:
    calm, shaky = (torch.rad2deg(shake(swing(rate, 4.0, noise), rate)) for noise in (0.0, 8.0))
    assert calm.shape == (int(rate * 4), 1)
    assert float(calm.max()) == 0.0
    allowed = math.degrees(0.5 * 60 / rate**2)
    assert float(shaky.median()) > max(0.5, 8.0 - allowed)


def test_a_jump_shakes_where_it_is() -> None:
    direction_TD3 = swing(60.0, 2.0, 0.0)
    direction_TD3[60:] = direction_TD3[60:].roll(1, dims=2)
    shaken_T = shake(direction_TD3, 60.0)[:, 0]
    assert float(shaken_T[57:63].min()) > 0.1 and float(torch.cat((shaken_T[:55], shaken_T[65:])).max()) == 0.0


def test_motions_side_by_side_and_short_ones() -> None:
    motions = torch.stack((swing(60.0, 1.0, 0.0), swing(60.0, 1.0, 8.0)))
    both = shake(motions, 60.0)
    torch.testing.assert_close(both[1], shake(motions[1], 60.0))
    for frames in (0, 1, 2):
        assert shake(motions[:, :frames], 60.0).shape == (2, frames, 1)
        assert not shake(motions[:, :frames], 60.0).any()
    assert shake(motions[:, :3], 60.0).shape == (2, 3, 1)
