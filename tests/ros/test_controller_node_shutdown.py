"""The controller's node is ended at any instant, from its first import to the middle of a homing."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from threading import Event

import pytest

from tests.campaign import Campaign
from tests.ros.driver_client import Driver
from tests.ros.harness import Ros
from tests.ros.launched_layers import FAST
from tests.ros.workspace import Workspace

pytestmark = pytest.mark.system

IN_TIME = 8.0
"""roslaunch waits for 15 s before it becomes rude."""


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[Ros]:
    with Ros(tmp_path_factory.mktemp("endings"), workspace, cold=True) as own:
        own.set_param("/maya/speed", float(FAST))
        yield own


@pytest.fixture(scope="module")
def driver(ros: Ros) -> Driver:
    return ros.driver()


@pytest.mark.timeout(1200)
def test_it_ends_cleanly_and_in_time(ros: Ros, driver: Driver, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=4, long=60)):
        rng = campaign.rng(case)
        node = ros.start("rosrun", "maya_controller", "hw_simulator.py")
        if case % 2:
            node.until("is offered to the graph")
            driver.do("/home", "maya_controller/Home")
        Event().wait(rng.uniform(0.0, 3.0))  # the instant is drawn: no fact is waited for
        how = rng.choice([signal.SIGINT, signal.SIGTERM])
        node.send(how)
        code = node.wait(IN_TIME)
        if code and (not node.said or "init_import_site" in node.said):  # before the first line of the node
            assert code in {-how, 128 + how, 1}, (code, node.said)
        else:
            assert code == 0, (code, node.said)
            assert "Traceback" not in node.said
        assert "/hw_simulator" not in ros.nodes()
