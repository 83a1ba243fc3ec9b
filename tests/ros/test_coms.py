"""A supervisor over MQTT, ros-coms as process.launch starts it, and a real master behind it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.ros.harness import Ros
from tests.ros.workspace import Workspace
from tests.system.brokers import broker
from tests.system.test_coms import call, supervisor

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]


@pytest.mark.waits("5 s of homing at fifty times real speed, as rospy and the broker live in real time")
def test_a_supervisor_moves_a_robot_behind_a_master(tmp_path: Path, workspace: Workspace) -> None:
    with broker(tmp_path) as one, Ros(tmp_path, workspace) as ros, supervisor(one) as lab:
        environment = {"IP": f"ws://127.0.0.1:{ros.rosbridge_port}", "MAYA_COMS_URL": one.url}
        launched = ros.launch("maya_process", "process.launch", environment, speed=50, skip_firebase=False)
        line = launched.until("POST /connect", 60.0)
        url = next(word for word in line.split() if word.startswith("http://")).rstrip(":")
        launched.until("The queue is worked", 60.0)
        assert call("POST", url, "/connect")["status"] == 200
        lab.until_online()
        for id_, command, args in (("1", "home", {}), ("2", "approach", {"x": 0.5, "y": 0.9, "z": 0.5})):
            lab.send(id_, command, **args)
            result = lab.hear("results")
            assert (result["id"], result["success"]) == (id_, True), result
