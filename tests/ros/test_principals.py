"""A ROS graph while users are kept: it acts by the token of its nodes, and without one it looks and stops."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import pytest

from maya_ros.graph.protocol import GoalStatus
from tests.ros.driver_client import RefusedError
from tests.ros.harness import Ros, places
from tests.ros.launched_layers import DONE, LaunchedLayers, launched_layers, primitive
from tests.ros.ros2_node import ros2_node
from tests.ros.workspace import Workspace, clean_environment
from tests.rosbridge_clients import web

pytestmark = pytest.mark.system

MAYA = str(Path(sys.executable).with_name("maya"))
NOT_SIGNED_IN = "4101"


def maya(environment: Mapping[str, str], *words: str) -> dict[str, object]:
    """Return what a command answers."""
    done = subprocess.run(
        [MAYA, "--json", *words], env=dict(environment), capture_output=True, text=True, timeout=40, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return dict(json.loads(done.stdout))


def owned(folder: Path) -> tuple[dict[str, str], str]:
    """Have an administrator kept in the state folder of a graph to come; return his environment and his token."""
    environment = {**clean_environment(), **places(folder)}
    return environment, str(maya(environment, "user", "reset", "root")["token"])


def code_of(robot: LaunchedLayers, service: str) -> str:
    """Return the code that a service fails with, "" where it is done."""
    try:
        answer = robot.driver.call(service)
    except RefusedError as refusal:
        return NOT_SIGNED_IN if f"[{NOT_SIGNED_IN}]" in str(refusal) else str(refusal)
    return "" if answer["success"] else str(answer["message"]).partition(":")[0]


def ended(
    robot: LaunchedLayers, action: str, kind: str, goal: dict[str, object] | None = None
) -> tuple[GoalStatus, str]:
    """Return how a goal ends."""
    outcome, result = robot.driver.do(action, kind, goal).ended()
    return GoalStatus(outcome), str(result["code"])


def test_graph_without_a_token_looks_and_stops_and_nothing_else(tmp_path: Path, workspace: Workspace) -> None:
    _, token = owned(tmp_path)
    with launched_layers(tmp_path, workspace) as robot:
        refused = (GoalStatus.REJECTED, NOT_SIGNED_IN)
        assert ended(robot, "/home", "maya_controller/Home") == refused
        assert ended(robot, "/task", "maya_robot/Task", {"task": primitive("home")}) == refused
        assert ended(robot, "/robot_controller/task", "maya_robot/Task", {"task": primitive("home")}) == refused
        for service in ("/controller/recover", "/controller/resume", "/controller/pause"):
            assert code_of(robot, service) == NOT_SIGNED_IN
        assert code_of(robot, "/controller/stop") == ""
        before = robot.mark()
        robot.driver.publish("/stop_queue", "std_msgs/Empty", {})
        robot.driver.publish("/maya_move", "maya_robot/MayaPrimitive", primitive("home"))
        robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("home"))
        robot.launched.until(f"/maya_move: {NOT_SIGNED_IN}")
        robot.launched.until(f"/send_task: {NOT_SIGNED_IN}")
        assert "homing" not in robot.words(before)
        assert robot.told[1]["homed"] is False
        asyncio.run(rosbridge_needs_a_token(robot, token))
        if find_spec("cyclonedds") is not None:
            ros_2_may_only_stop(robot)


def ros_2_may_only_stop(robot: LaunchedLayers) -> None:
    """Check that programs of ROS 2 have the rights of this graph."""
    with ros2_node(robot.ros) as (_, peer):
        assert peer.ask("command", task={"command": "can_teleop"})["code"] == NOT_SIGNED_IN
        assert peer.ask("send", task={"command": "home"})["accepted"] is False
        assert peer.ask("trigger", service="/controller/recover")["message"].startswith(f"{NOT_SIGNED_IN}: ")
        assert peer.ask("trigger", service="/controller/stop")["success"]


async def rosbridge_needs_a_token(robot: LaunchedLayers, token: str) -> None:
    """Check that a client of rosbridge in this graph shows a token for all but a stop."""
    url = f"ws://127.0.0.1:{robot.ros.rosbridge_port}"
    async with asyncio.timeout(40.0), web(url) as client:
        await client.say("call_service", id="a", service="/rosapi/get_param", args={"name": "/maya/config"})
        answer = await client.until(lambda one: one.get("id") == "a")
        assert answer["values"].startswith(f"{NOT_SIGNED_IN}: ")
        assert (await client.answer("/controller/stop"))["success"]
        await client.say("auth", mac=token)
        assert (await client.answer("/rosapi/get_param", name="/maya/sim_mode"))["value"] == "true"


@pytest.mark.waits("5 s of homing at fifty times real speed, and up to 1 s until the graph looks at its users again")
def test_graph_with_a_token_acts_for_its_user_until_that_is_revoked(tmp_path: Path, workspace: Workspace) -> None:
    owner, first = owned(tmp_path)
    file = tmp_path / "graph-token"
    file.touch(mode=0o600)
    file.write_text(first)
    with launched_layers(tmp_path, workspace, {"MAYA_GRAPH_TOKEN_FILE": str(file)}) as robot:
        assert ended(robot, "/home", "maya_controller/Home") == (GoalStatus.SUCCEEDED, DONE["code"])
        robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("gripper", open_=True))
        robot.eventually(lambda: maya(owner, "history")["jobs"], "a job")
        (job,) = maya(owner, "history")["jobs"]  # type: ignore[misc]
        assert job["owner"] == "root"
        second = maya(owner, "user", "token", "root")
        revoker = {**owner, "MAYA_TOKEN": str(second["token"])}
        maya(revoker, "user", "revoke", first.split("_")[1])
        robot.eventually(
            lambda: ended(robot, "/home", "maya_controller/Home") == (GoalStatus.REJECTED, NOT_SIGNED_IN), "a refusal"
        )
        assert code_of(robot, "/controller/stop") == ""


def test_node_whose_token_file_is_readable_by_others_does_not_start(tmp_path: Path, workspace: Workspace) -> None:
    file = tmp_path / "graph-token"
    file.write_text("maya_01234567_" + "0" * 48)
    file.chmod(0o644)
    with Ros(tmp_path, workspace) as ros:
        node = ros.start(
            "rosrun", "maya_robot", "primitive_server.py", environment={"MAYA_GRAPH_TOKEN_FILE": str(file)}
        )
        assert node.wait() == 2
        assert "4007" in node.said
        assert str(file) in node.said
