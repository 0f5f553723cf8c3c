"""What several tests of live sessions need."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from mrhubo.live.output import Output
from mrhubo.live.pilot import Pilot
from mrhubo.live.robot import LiveRobot
from tests.live.messages import message
from tests.live.robots import AT_ONCE, UPPER, make_robot
from tests.live.walkers import drive, make_legged, poses_of
from tests.reference.standing.steppers import walk


@pytest.fixture(scope="module")
def open_server() -> Iterator[object]:
    """A server of the page that listens."""
    from mrhubo.live.endpoints import Endpoint
    from mrhubo.live.server import Server

    found = Server(Endpoint("127.0.0.1", 0))
    found.open()
    yield found
    found.close()


@pytest.fixture
def outputs() -> list[Output]:
    """A robot on its way up."""
    pilot, found = Pilot(make_robot(lambda pose, time: UPPER), AT_ONCE, True), []
    for step in range(60):
        pilot.inbox.offer(message(step, time=step / 60), "a", step / 60)
        found.append(pilot.tick(step / 60))
    return found


@pytest.fixture(scope="module")
def walking(tmp_path_factory: pytest.TempPathFactory) -> tuple[LiveRobot, list[Output]]:
    """A robot with legs, which walks."""
    pilot, sent = drive(make_legged(tmp_path_factory.mktemp("legged")), poses_of(walk(40)), AT_ONCE)
    assert np.ptp(sent.place_T3[:, 0]) > 0.1 and len({str(output.standing) for output in sent.outputs}) == 40
    return pilot.robot, sent.outputs
