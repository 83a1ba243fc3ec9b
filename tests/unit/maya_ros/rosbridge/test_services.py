"""Services that clients call, and those that they answer."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from maya_ros.graph.protocol import Message
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.limits import UNDER_WAY
from maya_un.errors import ServiceFailed
from tests.rosbridge_clients import ClientBus, Said, client_bus, settled
from tests.virtual_time import elapse

SET_BOOL = "std_srvs/SetBool"


class Service:
    """Answers /s once `answers` is set; counts what was begun and what was cancelled."""

    def __init__(self, one: ClientBus) -> None:
        self.answers = asyncio.Event()
        self.asked: list[Message] = []
        self.cancelled = 0
        one.robot.serve("/s", SET_BOOL, self.answer)

    async def answer(self, request: Message) -> Message:
        self.asked.append(request)
        try:
            await self.answers.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        return {"success": request["data"], "message": "done"}


async def test_a_service_is_called_under_the_name_and_id_that_the_client_used() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        assert await talker.ask("call_service", service="s", id="c", args={"data": True}) == []
        service.answers.set()
        values = {"success": True, "message": "done"}
        response = {"op": "service_response", "id": "c", "service": "s", "values": values, "result": True}
        assert await talker.told() == [response]


@pytest.mark.parametrize("args", [None, [], {}, [{}], [{"data": False}], [False]])
async def test_arguments_may_be_omitted_or_given_as_a_list(args: Any) -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        service.answers.set()
        (told,) = await talker.ask("call_service", service="/s", args=args)
        assert told["result"] is True
        assert "id" not in told
        assert service.asked == [{"data": False}]


async def test_client_continues_during_its_calls_and_gets_answers_as_they_are_ready() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        talker.say("call_service", service="/s", id="slow", args={"data": True})
        (told,) = await talker.ask("call_service", service="/rosapi/get_time", id="quick")
        assert told["id"] == "quick"
        service.answers.set()
        assert [message["id"] for message in await talker.told()] == ["slow"]


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ({"service": "/nobody"}, "4019"),
        ({"service": "/s", "args": {"data": 3}}, "4018"),
        ({"service": "/s", "args": {"date": True}}, "4018"),
        ({"service": "/s", "args": [True, 2]}, "4018"),
        ({"service": "/s", "args": [2]}, "4018"),
        ({"service": "/s", "args": "true"}, "4005"),
        ({"service": "/s", "timeout": "soon"}, "4005"),
        ({"service": "/s", "timeout": 10**400}, "4005"),
        ({"service": "/s", "timeout": -(10**400)}, "4005"),
        ({"service": "/s", "compression": "gzip"}, "4005"),
        ({"service": "/s", "fragment_size": 1}, "4005"),
        ({"service": "/a b"}, "4005"),
    ],
)
async def test_a_call_that_fails_is_answered_so(message: Said, code: str) -> None:
    async with client_bus() as one:
        Service(one)
        (told,) = await one.talker().ask("call_service", id=1, **message)
        assert (told["op"], told["id"], told["service"], told["result"]) == (
            "service_response", 1, message["service"], False,
        )  # fmt: skip
        assert told["values"].startswith(f"{code}: ")


@pytest.mark.parametrize("message", [{}, {"service": 5}, {"service": "/s", "id": ["x"]}])
async def test_invalid_call_is_reported_as_a_status(message: Said) -> None:
    async with client_bus() as one:
        assert [status["code"] for status in await one.talker().ask("call_service", **message)] == [4005]


async def test_call_with_a_timeout_is_reported_and_its_command_cancelled() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        assert await talker.ask("call_service", service="/s", timeout=2.5) == []
        await elapse(2.0)
        assert await talker.told() == []
        await elapse(0.6)
        (told,) = await talker.told()
        assert (told["result"], told["values"][:5]) == (False, "4020:")
        assert service.cancelled == 1


async def test_a_timeout_of_nothing_is_for_ever() -> None:
    async with client_bus() as one:
        Service(one)
        talker = one.talker()
        await talker.ask("call_service", service="/s", timeout=0)
        await elapse(10_000.0)
        assert await talker.told() == []


async def test_calls_of_a_client_are_cancelled_when_it_leaves() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        await talker.ask("call_service", service="/s")
        await one.leave(talker)
        assert service.cancelled == 1


async def test_a_client_has_only_so_many_calls_under_way() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        for number in range(UNDER_WAY):
            talker.say("call_service", service="/s", id=number)
        assert await talker.told() == []
        assert [message["result"] for message in await talker.ask("call_service", service="/s", id="more")] == [False]
        service.answers.set()
        assert len(await talker.told()) == UNDER_WAY
        assert (await talker.ask("call_service", service="/s", id="more"))[0]["result"] is True


async def test_an_answer_may_come_as_a_picture_or_in_fragments() -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        service.answers.set()
        (told,) = await talker.ask("call_service", service="/s", compression="png")
        assert json.loads(outgoing.decoded(told["data"], 1000))["values"]["message"] == "done"
        pieces = await talker.ask("call_service", service="/s", id="f", fragment_size=20)
        assert {(piece["op"], piece["id"]) for piece in pieces} == {("fragment", "f")}
        assert json.loads("".join(piece["data"] for piece in pieces))["values"]["message"] == "done"


@pytest.mark.parametrize("compression", ["cbor", "cbor-raw"])
async def test_call_service_that_asks_for_cbor_is_answered_in_json(compression: str) -> None:
    async with client_bus() as one:
        service, talker = Service(one), one.talker()
        service.answers.set()
        (told,) = await talker.ask("call_service", service="/s", args={"data": True}, compression=compression)
        assert told["values"] == {"success": True, "message": "done"}


async def served_by_a_client(one: ClientBus) -> Any:
    server = one.talker()
    assert await server.ask("advertise_service", service="mine", type=SET_BOOL) == []
    return server


async def test_a_service_of_a_client_is_answered_by_it() -> None:
    async with client_bus() as one:
        server = await served_by_a_client(one)
        call = asyncio.ensure_future(one.robot.call("/mine", {"data": True}))
        (request,) = await server.told()
        assert {**request, "id": ""} == {"op": "call_service", "id": "", "service": "mine", "args": {"data": True}}
        server.say("service_response", id=request["id"], service="mine", values={"success": True}, result=True)
        assert await call == {"success": True, "message": ""}


async def test_clients_call_each_other() -> None:
    async with client_bus() as one:
        server, other = await served_by_a_client(one), one.talker()
        other.say("call_service", service="/mine", id="c", args={"data": False})
        (request,) = await server.told()
        server.say("service_response", id=request["id"], service="/mine", values={"message": "no"}, result=True)
        await settled()
        assert (await other.told())[0]["values"] == {"success": False, "message": "no"}


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ({"result": False, "values": "out of order"}, "out of order"),
        ({"result": False}, "its server gave no reason"),
        ({"result": True, "values": {"success": "yes"}}, "success"),
    ],
)
async def test_failing_client_fails_its_callers(answer: Said, reason: str) -> None:
    async with client_bus() as one:
        server = await served_by_a_client(one)
        call = asyncio.ensure_future(one.robot.call("/mine", {"data": True}))
        (request,) = await server.told()
        server.say("service_response", id=request["id"], service="mine", **answer)
        with pytest.raises(ServiceFailed, match=reason):
            await call


@pytest.mark.parametrize("end", ["unadvertise", "leave", "advertise anew"])
async def test_caller_learns_that_the_serving_client_stopped(end: str) -> None:
    async with client_bus() as one:
        server = await served_by_a_client(one)
        call = asyncio.ensure_future(one.robot.call("/mine", {"data": True}))
        await settled()
        if end == "leave":
            await one.leave(server)
        elif end == "unadvertise":
            await server.ask("unadvertise_service", service="/mine")
        else:
            await server.ask("advertise_service", service="/mine", type=SET_BOOL)
        with pytest.raises(ServiceFailed):
            await call
        assert ("/mine" in await one.bus.directory.services()) is (end == "advertise anew")


@pytest.mark.parametrize("name", ["/maya_command", "/gripper", "/task", "/s"])
async def test_service_of_another_server_cannot_be_taken(name: str) -> None:
    async with client_bus() as one:
        service, thief = Service(one), one.talker()
        service.answers.set()
        assert [status["code"] for status in await thief.ask("advertise_service", service=name, type=SET_BOOL)] == [
            4005
        ]
        assert (await one.robot.call("/s", {"data": True}))["success"] is True


@pytest.mark.parametrize(
    ("op", "message"),
    [
        ("service_response", {"service": "/mine", "id": "x"}),
        ("service_response", {"service": "/other", "id": "x"}),
        ("service_response", {"service": "/mine"}),
        ("advertise_service", {"service": "/new", "type": "std_srvs/Nothing"}),
        ("advertise_service", {"service": "/new"}),
    ],
)
async def test_response_without_a_call_or_service_is_reported(op: str, message: Said) -> None:
    async with client_bus() as one:
        server = await served_by_a_client(one)
        assert [status["level"] for status in await server.ask(op, **message)] == ["error"]
        assert list(await one.bus.directory.services()) == ["/mine"]
