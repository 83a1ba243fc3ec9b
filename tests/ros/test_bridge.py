"""The rosbridge node on a real graph: the same clients as without ROS, and what ROS' own tools see of them."""

from __future__ import annotations

import asyncio
import subprocess
from typing import Any

from tests.ros.harness import Ros
from tests.rosbridging import Web, web
from tests.system.test_rosbridge_clients import ROSLIBPY, SCRIPTS, agrees, node, told_by

PARTS = {"cube": [0.41, 1.13, 0.4]}


def launched(ros: Ros) -> str:
    """Start all floors and return the URL of the endpoint, once they know how they stand."""
    ros.set_param("/maya/parts", PARTS)
    ros.launch("maya_process", "process.launch")
    ros.until_nodes("/hw_simulator", "/robot_controller", "/primitive_server", "/process_controller", "/rosbridge")
    url = f"ws://127.0.0.1:{ros.rosbridge_port}"
    ros.until(lambda: asyncio.run(is_ready(url)), "the endpoint")
    return url


async def is_ready(url: str) -> bool:
    """Tell whether the robot floor says why it can take no wish: because it is not homed."""
    try:
        async with web(url) as client, asyncio.timeout(5.0):
            answer = await client.answer("/maya_command", task={"command": "can_teleop"})
    except (OSError, AssertionError, TimeoutError):
        return False
    return answer["code"] == "2103"


async def listens(url: str) -> bool:
    """Tell whether the endpoint is there."""
    try:
        async with web(url):
            return True
    except OSError:
        return False


def test_roslib_and_roslibpy_drive_the_real_graph(ros: Ros) -> None:
    url = launched(ros)
    said = told_by(node(), SCRIPTS / "client.mjs", url)
    agrees(said)
    assert said["own service"] == {"success": True, "message": "by roslib"}
    assert [said[name] for name in ("none", "png", "cbor", "cbor-raw")] == [
        f"äöü {name}" for name in ("none", "png", "cbor", "cbor-raw")
    ]


def test_roslibpy_drives_the_real_graph(ros: Ros) -> None:
    url = launched(ros)
    said = told_by(*ROSLIBPY, url.rpartition(":")[2])
    agrees(said)
    assert said["chatter"] == [{"data": f"{number}"} for number in range(3)]


def test_tools_of_ros_hear_clients_and_clients_hear_them(ros: Ros) -> None:
    ros.start("rosrun", "maya_process", "rosbridge.py")
    ros.until_nodes("/rosbridge")
    url = f"ws://127.0.0.1:{ros.rosbridge_port}"
    ros.until(lambda: asyncio.run(listens(url)), "the endpoint")

    async def story() -> None:
        async with web(url) as client:
            await client.say("subscribe", topic="/from_ros", type="std_msgs/String")
            pub = ros.start("rostopic", "pub", "-l", "/from_ros", "std_msgs/String", "data: hello")
            assert (await told(client, "/from_ros"))["data"] == "hello"
            pub.close()
            await client.say("advertise", topic="/from_web", type="geometry_msgs/Point", latch=True)
            await client.say("publish", topic="/from_web", msg={"x": 1.5})
            heard = await asyncio.to_thread(ros.tool, "rostopic", "echo", "-n", "1", "/from_web/x")
            assert heard.split()[0] == "1.5"
            await client.say("advertise_service", service="/by_web", type="std_srvs/Trigger")
            assert "/by_web" in (await client.answer("/rosapi/services"))["services"]
            asked = await asyncio.create_subprocess_exec(
                "rosservice", "call", "/by_web", env=ros.environment, stdout=subprocess.PIPE
            )
            request = await client.until(lambda message: message["op"] == "call_service")
            values = {"success": True, "message": "from the web"}
            await client.say("service_response", id=request["id"], service="/by_web", values=values, result=True)
            out, _ = await asked.communicate()
            assert b"from the web" in out

    asyncio.run(story())


async def told(client: Web, topic: str) -> Any:
    found = await client.until(lambda message: message.get("topic") == topic)
    return found["msg"]
