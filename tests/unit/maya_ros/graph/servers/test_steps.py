"""Steps of external processes, behind their server, on a robot layer that answers at once."""

from __future__ import annotations

import json
from pathlib import Path

from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.servers.steps import TaskServer
from maya_un.steps.store import StepStore
from tests.virtual_time import elapse

DATE = "2026-01-01T00:00:00+00:00"


async def done(_: Message, __: Feedback) -> Message:
    return {"success": True, "code": "", "message": ""}


async def test_step_is_answered_and_diagnostics_show_the_bridge(tmp_path: Path) -> None:
    bus, results, diagnostics = Bus(), list[Message](), list[Message]()
    client = bus.node("ros_coms")
    client.subscribe("/step_result", "std_msgs/String", results.append)
    client.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", diagnostics.append)
    commands = client.advertise("/step_command", "std_msgs/String")
    store = await StepStore.open(tmp_path / "steps.db")
    try:
        async with TaskServer(store, lambda: DATE).open(bus.node("firebase_bridge")):
            await elapse(1.5)
            assert diagnostics[-1]["status"][0]["level"] == 1
            server = bus.node("primitive_server").act("/task", "maya_robot/Task", done)
            await elapse(1.5)
            assert diagnostics[-1]["status"][0]["level"] == 0
            commands.publish({"data": json.dumps({"id": "one", "command": "home"})})
            await elapse(1.0)
            server.close()
        assert json.loads(results[0]["data"])["id"] == "one"
    finally:
        await store.close()
