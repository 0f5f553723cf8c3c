"""A guess that others hang on stops a fit, any other is told."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import pytest

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.unsure import check_unsure


@pytest.mark.parametrize("name", ["chest", "left_elbow", "left_shoulder", "forward", "left_arm", "some_joint"])
def test_what_others_hang_on_is_refused(pair: Callable[..., RobotConfig], name: str) -> None:
    with pytest.raises(UserError, match=rf"^robot\.unsure: '{name}' could not be decided"):
        check_unsure(pair(unsure=["left_hand", name]))


@pytest.mark.parametrize("name", ["left_hand", "right_hand", "head"])
def test_a_guess_at_an_end_is_told(pair: Callable[..., RobotConfig], name: str) -> None:
    with pytest.warns(InputWarning, match=f"'{name}' could not be decided"):
        check_unsure(pair(unsure=[name]))


def test_nothing_is_said_of_what_is_sure(pair: Callable[..., RobotConfig]) -> None:
    with warnings.catch_warnings(action="error"):
        check_unsure(pair())
