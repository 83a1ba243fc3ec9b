"""The rosbridge node on a real graph: the same clients as without ROS, and what ROS' own tools see of them."""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from time import monotonic
from typing import Any

import pytest

from tests.ros.harness import Ros
from tests.rosbridge_clients import Web, web
from tests.system.test_rosbridge_clients import ROSLIBPY, SCRIPTS, agrees, node, output_of

PARTS = {"cube": [0.41, 1.13, 0.4]}


def launched(ros: Ros) -> str:
    """Start all layers and return the URL of the endpoint, once they know their state."""
    ros.set_param("/maya/parts", PARTS)
    ros.launch("maya_process", "process.launch")
    ros.until_nodes("/hw_simulator", "/robot_controller", "/primitive_server", "/process_controller", "/rosbridge")
    url = f"ws://127.0.0.1:{ros.rosbridge_port}"
    ros.until(lambda: asyncio.run(is_ready(url)), "the endpoint")
    return url


async def is_ready(url: str) -> bool:
    """Return whether the robot layer gives its reason for refusing commands: it is not homed."""
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


@pytest.mark.waits("about 16 s of homing, a pick and a place at twenty times real speed, as rospy lives in real time")
def test_roslib_and_roslibpy_drive_the_real_graph(ros: Ros) -> None:
    url = launched(ros)
    said = output_of(node(), SCRIPTS / "client.mjs", url)
    agrees(said)
    assert said["own service"] == {"success": True, "message": "by roslib"}
    assert [said[name] for name in ("none", "png", "cbor", "cbor-raw")] == [
        f"äöü {name}" for name in ("none", "png", "cbor", "cbor-raw")
    ]


@pytest.mark.waits("about 16 s of homing, a pick and a place at twenty times real speed, as rospy lives in real time")
def test_roslibpy_drives_the_real_graph(ros: Ros) -> None:
    url = launched(ros)
    said = output_of(*ROSLIBPY, url.rpartition(":")[2])
    agrees(said)
    assert said["chatter"] == [{"data": f"{number}"} for number in range(3)]


def test_ros_tools_and_clients_exchange_messages(ros: Ros) -> None:
    ros.start("rosrun", "maya_process", "rosbridge.py")
    ros.until_nodes("/rosbridge")
    url = f"ws://127.0.0.1:{ros.rosbridge_port}"
    ros.until(lambda: asyncio.run(listens(url)), "the endpoint")

    async def story() -> None:
        async with web(url) as client:
            await client.say("subscribe", topic="/from_ros", type="std_msgs/String")
            pub = ros.start("rostopic", "pub", "-l", "/from_ros", "std_msgs/String", "data: hello")
            assert (await next_message(client, "/from_ros"))["data"] == "hello"
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


SERVICES = """
import rospy, std_srvs.srv, std_msgs.msg
rospy.init_node("many")
for number in range(40):
    rospy.Service(f"/many/{number}", std_srvs.srv.SetBool, lambda request: (request.data, "set"))
keep = rospy.Publisher("/many/text", std_msgs.msg.String, queue_size=1)
rospy.spin()
"""


@asynccontextmanager
async def beside_many_services(ros: Ros) -> AsyncIterator[Web]:
    """Give a client of the node beside one with many services."""
    ros.start("rosrun", "maya_process", "rosbridge.py")
    ros.start("/usr/bin/python3", "-c", SERVICES)
    ros.until(lambda: "/many/39" in ros.services() and "/rosbridge" in ros.nodes(), "services")
    url = f"ws://127.0.0.1:{ros.rosbridge_port}"
    while not await listens(url):
        pass
    async with web(url) as client:
        yield client


def test_rosapi_asks_the_master_and_one_server_at_a_time(ros: Ros) -> None:
    async def story() -> None:
        async with beside_many_services(ros) as client:
            types = await client.answer("/rosapi/services_for_type", type="std_srvs/SetBool")
            assert sorted(types["services"]) == sorted(f"/many/{number}" for number in range(40))
            assert (await client.answer("/rosapi/service_type", service="/many/7"))["type"] == "std_srvs/SetBool"
            assert (await client.answer("/rosapi/service_host", service="/many/7"))["host"] == "127.0.0.1"
            quickest = min([await seconds(client, "/rosapi/services_for_type", type="a/B") for _ in range(3)])
            assert quickest < 1.0  # a second is what a connection costs that its server had no place for

    asyncio.run(story())


async def seconds(client: Web, service: str, **args: Any) -> float:
    """Return how long a question takes [s]."""
    before = monotonic()
    await client.answer(service, **args)
    return monotonic() - before


def test_of_two_clients_that_advertise_one_service_the_owner_is_reported(ros: Ros) -> None:
    async def story() -> None:
        async with beside_many_services(ros) as one, web(f"ws://127.0.0.1:{ros.rosbridge_port}") as two:
            for client in (one, two):
                await client.say("set_level", level="info")
            for op, what, kind in (
                ("advertise_service", "service", "std_srvs/Trigger"),
                ("advertise_action", "action", "maya_controller/Move"),
            ):
                for client in (one, two):
                    await client.say(op, type=kind, **{what: f"/{what}"})
                next_message = [await client.hear() for client in (one, two)]
                assert sorted(status.get("code", 0) for status in next_message) == [0, 4005]

    asyncio.run(story())


def test_clients_of_the_node_speak_as_to_the_original(ros: Ros) -> None:
    async def story() -> None:
        async with beside_many_services(ros) as client:
            for args in ([True], {"data": True}):
                await client.say("call_service", id="c", service="/many/1", args=args)
                assert (await client.hear())["values"] == {"success": True, "message": "set"}
            for op in ("subscribe", "advertise"):
                await client.say(op, topic="/many/text", type="std_msgs/Int32")
                assert (await client.hear())["code"] == 4005
            await client.say("subscribe", topic="/times", type="std_msgs/Header")
            await client.say("advertise", topic="/times", type="std_msgs/Header")
            await client.say("publish", topic="/times", msg={"stamp": "now"})
            assert (await client.hear())["msg"]["stamp"]["secs"] > 1_700_000_000
            await client.say("subscribe", topic="/joints", type="sensor_msgs/JointState")
            await client.say("advertise", topic="/joints", type="sensor_msgs/JointState")
            await client.say("publish", topic="/joints", msg={"position": [float("nan")]})
            found = (await client.hear())["msg"]
            assert found["header"]["stamp"]["secs"] > 1_700_000_000
            assert found["position"] == [None]
            await client.say("subscribe", topic="/client_count")
            assert (await client.hear())["msg"] == {"data": 1}

    asyncio.run(story())


def test_advertise_service_of_a_type_that_only_ros_knows_is_answered(ros: Ros) -> None:
    async def story() -> None:
        async with beside_many_services(ros) as client:
            await client.say("advertise_service", service="/camera", type="sensor_msgs/SetCameraInfo")
            await client.say("call_service", id="c", service="/camera", args={"camera_info": {"width": 3}})
            asked = await client.hear()
            assert (asked["op"], asked["args"]["camera_info"]["width"]) == ("call_service", 3)
            values = {"success": True, "status_message": "set"}
            await client.say("service_response", id=asked["id"], service="/camera", values=values, result=True)
            assert (await client.hear())["values"] == values
            await client.say("advertise_service", service="/nothing", type="sensor_msgs/NoSuchService")
            assert (await client.hear())["code"] == 4019

    asyncio.run(story())


async def next_message(client: Web, topic: str) -> Any:
    found = await client.until(lambda message: message.get("topic") == topic)
    return found["msg"]
