"""Questions of clients about the graph itself."""

from __future__ import annotations

from typing import Any

import pytest

from maya_ros.graph.protocol import Feedback, Message
from tests.rosbridge_clients import DATE, ClientBus, client_bus

STRING = "std_msgs/String"


async def nothing(_: Message, __: Feedback) -> Message:
    return {}


async def no_answer(_: Message) -> Message:
    return {}


def furnished(one: ClientBus) -> None:
    """Put something into the graph to be asked for."""
    one.robot.advertise("/t", STRING)
    one.robot.act("/task", "maya_robot/Task", nothing)
    one.robot.serve("/gripper", "std_srvs/SetBool", no_answer)
    one.bus.node("display").subscribe("/t", STRING, lambda _: None)


async def call(one: ClientBus, name: str, /, **args: Any) -> Any:
    """Return the values of an answer, its words where it failed."""
    (told,) = await one.talker().ask("call_service", service=f"/rosapi/{name}", args=args)
    assert (told["op"], told["service"]) == ("service_response", f"/rosapi/{name}")
    return told["values"]


async def test_names_may_lack_the_leading_slash() -> None:
    async with client_bus() as one:
        (told,) = await one.talker().ask("call_service", service="rosapi/get_time")
        assert told["values"] == {"time": {"secs": int(DATE), "nsecs": 0}}
        assert told["service"] == "rosapi/get_time"


async def test_topics_and_their_types() -> None:
    async with client_bus() as one:
        furnished(one)
        found = await call(one, "topics")
        types = dict(zip(found["topics"], found["types"], strict=True))
        assert types["/t"] == STRING
        assert types["/task/goal"] == "maya_robot/TaskActionGoal"
        assert await call(one, "topic_type", topic="/t") == {"type": STRING}
        assert await call(one, "topic_type", topic="t") == {"type": STRING}
        assert await call(one, "topic_type", topic="/nothing") == {"type": ""}
        assert await call(one, "topics_for_type", type=STRING) == {"topics": ["/t"]}
        raw = await call(one, "topics_and_raw_types")
        assert raw["typedefs_full_text"][raw["topics"].index("/t")] == "string data\n"
        assert "MSG: geometry_msgs/Point" in raw["typedefs_full_text"][raw["topics"].index("/task/goal")]


async def test_services_and_their_types() -> None:
    async with client_bus() as one:
        furnished(one)
        services = (await call(one, "services"))["services"]
        assert {"/gripper", "/rosapi/topics"} <= set(services)
        assert await call(one, "service_type", service="/gripper") == {"type": "std_srvs/SetBool"}
        assert await call(one, "service_type", service="/rosapi/topics") == {"type": "rosapi/Topics"}
        assert await call(one, "service_type", service="/nothing") == {"type": ""}
        assert await call(one, "services_for_type", type="std_srvs/SetBool") == {"services": ["/gripper"]}
        assert await call(one, "service_node", service="/gripper") == {"node": "/robot"}
        assert await call(one, "service_providers", service="/nothing") == {"providers": []}
        for one_of_it in ("/gripper", "std_srvs/SetBool"):
            assert await call(one, "service_providers", service=one_of_it) == {"providers": ["/robot"]}
        for service, host in (("/gripper", "127.0.0.1"), ("/rosapi/topics", "127.0.0.1"), ("/nothing", "")):
            assert await call(one, "service_host", service=service) == {"host": host}


async def test_questions_take_the_values_of_their_fields_as_a_list() -> None:
    async with client_bus() as one:
        furnished(one)
        (told,) = await one.talker().ask("call_service", service="/rosapi/topic_type", args=["/t"])
        assert told["values"] == {"type": STRING}
        (told,) = await one.talker().ask("call_service", service="/rosapi/set_param", args=["/p", "5"])
        assert told["result"] is True
        assert await call(one, "get_param", name="/p") == {"value": "5"}


async def test_services_with_another_rosapi_names_each_once() -> None:
    async with client_bus() as one:
        one.robot.serve("/rosapi/topics", "rosapi/Topics", no_answer)
        assert (await call(one, "services"))["services"].count("/rosapi/topics") == 1


async def test_nodes_and_their_topics_are_listed() -> None:
    async with client_bus() as one:
        furnished(one)
        assert {"/robot", "/display", "/rosapi"} <= set((await call(one, "nodes"))["nodes"])
        details = await call(one, "node_details", node="/robot")
        assert details["services"] == ["/gripper"]
        assert "/t" in details["publishing"]
        assert "/task/goal" in details["subscribing"]
        assert await call(one, "publishers", topic="/t") == {"publishers": ["/robot"]}
        assert await call(one, "subscribers", topic="/t") == {"subscribers": ["/display"]}
        assert (await call(one, "node_details", node="/nobody")).startswith("4019: ")


async def test_action_servers_are_those_with_all_their_topics() -> None:
    async with client_bus() as one:
        furnished(one)
        one.robot.advertise("/half/goal", "maya_robot/TaskActionGoal")
        assert await call(one, "action_servers") == {"action_servers": ["/task"]}


async def test_details_of_types() -> None:
    async with client_bus() as one:
        typedefs = (await call(one, "message_details", type="maya_robot/MayaPrimitive"))["typedefs"]
        first, point = typedefs
        assert first["fieldnames"] == ["command", "target", "open"]
        assert first["fieldtypes"] == ["string", "geometry_msgs/Point", "bool"]
        assert first["fieldarraylen"] == [-1, -1, -1]
        assert point["type"] == "geometry_msgs/Point"
        request = (await call(one, "service_request_details", type="maya_robot/MayaCommand"))["typedefs"]
        assert request[0]["fieldtypes"] == ["maya_robot/MayaPrimitive"]
        response = (await call(one, "service_response_details", type="std_srvs/SetBool"))["typedefs"]
        assert response[0]["fieldnames"] == ["success", "message"]
        assert await call(one, "message_details", type="string") == {"typedefs": []}
        (time,) = (await call(one, "message_details", type="time"))["typedefs"]
        assert (time["type"], time["fieldnames"]) == ("time", ["secs", "nsecs"])
        assert (await call(one, "message_details", type="maya_robot/Nothing")).startswith("4019: ")
        assert (await call(one, "service_request_details", type="nothing")).startswith("4019: ")


async def test_parameters_are_set_and_read_as_json() -> None:
    async with client_bus() as one:
        assert await call(one, "set_param", name="/a/b", value='{"c": [1, 2.5, "x", null, true]}') == {}
        assert await call(one, "get_param", name="a/b/c") == {"value": '[1,2.5,"x",null,true]'}
        assert await call(one, "get_param", name="/a") == {"value": '{"b":{"c":[1,2.5,"x",null,true]}}'}
        assert await call(one, "get_param_names") == {"names": ["/a/b/c"]}
        assert await call(one, "has_param", name="/a/b") == {"exists": True}
        assert await call(one, "search_param", name="/a/b") == {"global_name": "/a/b"}
        assert await call(one, "delete_param", name="/a/b/c") == {}
        assert await call(one, "has_param", name="/a/b/c") == {"exists": False}


async def test_a_parameter_that_is_not_there_is_its_default_or_null() -> None:
    async with client_bus() as one:
        assert await call(one, "get_param", name="/x") == {"value": "null"}
        assert await call(one, "get_param", name="/x", default='"y"') == {"value": '"y"'}
        assert await call(one, "get_param", name="/x", default="y") == {"value": '"y"'}
        assert (await call(one, "delete_param", name="/x")).startswith("4019: ")
        assert (await call(one, "set_param", name="/x", value="{")).startswith("4018: ")


@pytest.mark.parametrize("args", [{"topic": 5}, {"wrong": "x"}, {"topic": "no name"}])
async def test_invalid_query_is_refused(args: dict[str, Any]) -> None:
    async with client_bus() as one:
        assert (await call(one, "topic_type", **args))[:2] == "40"
