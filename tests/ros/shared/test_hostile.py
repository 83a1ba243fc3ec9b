"""Hostile requests to the nodes: they plan in worker processes, so a stop comes at once."""

from __future__ import annotations

import json
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from tests.costly_requests import ANSWERS, CostlyRequest, costly_clients, prepared, send_request
from tests.ros.launched_layers import LaunchedLayers

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

SLOW = 0.01
"""Share of the speed at which a motion outlasts the requests."""

WITHIN = 1.0
"""A stop is answered within this time, also on a machine that runs other tests [s]."""


def port_of(robot: LaunchedLayers) -> int:
    """Return the port at which process_controller answers."""
    place = Path(robot.ros.environment["MAYA_RUNTIME_DIR"]) / "service.json"
    return urlsplit(json.loads(place.read_text())["url"]).port or 0


@pytest.mark.parametrize("kind", ["preview of lines", "inspection with most samples", "held job of lines"])
def test_hostile_requests_to_the_queue_delay_no_stop(robot: LaunchedLayers, kind: str) -> None:
    port = port_of(robot)
    request = prepared(port, kind)
    robot.ready()
    robot.at_speed(SLOW)
    before = robot.mark()
    robot.begun("approach", robot.away())
    with costly_clients(port, request, 8) as crowd:
        while crowd.left > 2:
            assert send_request(port, CostlyRequest("GET", "/v1/status"))[0] == 200
        asked = time.monotonic()
        assert send_request(port, CostlyRequest("POST", "/v1/stop"))[0] == 200
        late = time.monotonic() - asked
    robot.until_told("stopped", before)
    robot.at_rest()
    robot.at_speed(1.0)
    assert send_request(port, CostlyRequest("POST", "/v1/queue/clear"))[0] == 200
    assert late <= WITHIN
    assert not crowd.dropped and set(crowd.statuses) <= ANSWERS
    assert robot.told[1]["fault"] is None
