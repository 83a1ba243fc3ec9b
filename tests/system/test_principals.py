"""The caller at every interface: the same roles decide for HTTP, the stream and rosbridge, on real sockets."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from dmc41x3.loops import run
from maya_un.assembly.stack import Stack
from maya_un.errors import MayaError
from maya_un.http import connections
from maya_un.http.connections import Rights
from maya_un.service.access import callers
from maya_un.service.access.operations import LOCAL, Role
from maya_un.service.people import UserService
from maya_un.values import Mode, StopReport
from tests.rosbridge_clients import Said, Web, web
from tests.shared_robot import SharedRobot, shared_robot
from tests.virtual_time import turn

pytestmark = pytest.mark.system

NOBODY = "nobody"
PEOPLE = (NOBODY, *(role.word for role in Role))
HEADER, AUTH = "header", "auth"
PATIENCE = 20.0


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("principals"), users=True) as one:
        yield one


@pytest.fixture
def unkept(tmp_path: Path) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path, users=False) as one:
        yield one


def http(robot: SharedRobot, who: str, method: str, path: str, body: object = None) -> int:
    """Return the code that a request is answered with, 0 for done."""
    return of_rights(request(robot, who, method, path, body)[0])


def request(robot: SharedRobot, who: str, method: str, path: str, body: object = None, **more: str) -> tuple[int, Any]:
    """Return the code that a request is answered with, 0 for done, and the answer."""
    place = urlsplit(robot.url)
    connection = HTTPConnection(place.hostname or "", place.port, timeout=PATIENCE)
    headers = {**robot.headers(who), "Content-Type": "application/json", **more}
    connection.request(method, path, None if body is None else json.dumps(body), headers)
    answer = connection.getresponse()
    text = answer.read()
    found = json.loads(text) if answer.headers.get_content_type().endswith("json") else text
    connection.close()
    code = 0 if answer.status < 400 else int(json.loads(text)["code"])
    return code, found


class Visitor:
    """A client of rosbridge, somebody by one way or another."""

    def __init__(self, client: Web) -> None:
        self.client = client

    async def call(self, service: str, **args: Any) -> int:
        """Call a service; return the code of its refusal, 0 for done."""
        await self.client.say("call_service", id=service, service=service, args=args)
        found = await self.client.until(lambda one: one["op"] == "service_response" and one["id"] == service)
        values = found["values"]
        if found["result"]:
            text = values.get("code") or (values.get("message", "") if not values.get("success", True) else "")
        else:
            text = values
        return of_rights(text.partition(":")[0])

    async def say(self, op: str, **message: Any) -> int:
        """Say something that no answer comes to; return the code of its refusal, 0 for none."""
        await self.client.say(op, id="it", **message)
        await self.client.say("set_level", level="warning")
        await self.client.say("unsubscribe", topic="/nothing", id="then")
        code = 0
        while (found := await self.client.until(lambda one: one["op"] == "status"))["id"] != "then":
            code = found.get("code", code)
        return code


def of_rights(code: str | int) -> int:
    """Return a code about rights, 0 for any other: the robot's state at this instant does not matter."""
    return int(code) if str(code) in {"4101", "4102", "4103", "4104", "4105"} else 0


async def visited(robot: SharedRobot, who: str, way: str, story: Callable[[Visitor], Awaitable[None]]) -> None:
    """Have somebody visit by rosbridge."""
    headers = robot.headers(who) if way == HEADER else {}
    async with asyncio.timeout(PATIENCE), web(robot.rosbridge, additional_headers=headers) as client:
        if way == AUTH and who != NOBODY:
            await client.say("auth", **mac(robot.tokens[who]))
        await story(Visitor(client))


def mac(token: str) -> dict[str, Any]:
    """Return the fields of `auth`, as roslib sends them."""
    return {"mac": token, "client": "", "dest": "", "rand": "", "t": 0, "level": "", "end": 0}


async def cancelled(one: Visitor) -> int:
    """Cancel all goals, as clients of actionlib do."""
    code = await one.say("advertise", topic="/task/cancel", type="actionlib_msgs/GoalID")
    return code or await one.say("publish", topic="/task/cancel", msg={})


ASKED: dict[str, tuple[tuple[int, int, int, int, int], Callable[[Visitor], Awaitable[int]]]] = {
    "list topics": ((4101, 0, 0, 0, 0), lambda one: one.call("/rosapi/topics")),
    "list nodes": ((4101, 0, 0, 0, 0), lambda one: one.call("/rosapi/nodes")),
    "list services": ((4101, 0, 0, 0, 0), lambda one: one.call("/rosapi/services")),
    "read a parameter": ((4101, 0, 0, 0, 0), lambda one: one.call("/rosapi/get_param", name="/maya/config")),
    "list parameters": ((4101, 0, 0, 0, 0), lambda one: one.call("/rosapi/get_param_names")),
    "set a parameter": ((4101, 4102, 4102, 0, 0), lambda one: one.call("/rosapi/set_param", name="/x", value="1")),
    "delete a parameter": (
        (4101, 4102, 4102, 0, 0),
        lambda one: one.call("/rosapi/delete_param", name="/maya/address"),
    ),
    "subscribe": ((4101, 0, 0, 0, 0), lambda one: one.say("subscribe", topic="/maya_event", type="std_msgs/String")),
    "ask can_teleop": ((4101, 0, 0, 0, 0), lambda one: one.call("/maya_command", task={"command": "can_teleop"})),
    "publish": ((4101, 4102, 4102, 0, 0), lambda one: one.say("publish", topic="/maya_event", msg={"data": "homed"})),
    "advertise": ((4101, 4102, 4102, 0, 0), lambda one: one.say("advertise", topic="/t", type="std_msgs/String")),
    "serve": (
        (4101, 4102, 4102, 0, 0),
        lambda one: one.say("advertise_service", service="/mine", type="std_srvs/Trigger"),
    ),
    "carry out": (
        (4101, 4102, 4102, 0, 0),
        lambda one: one.say("advertise_action", action="/own", type="maya_robot/Task"),
    ),
    "move the gripper": ((4101, 4102, 4104, 0, 0), lambda one: one.call("/gripper", data=True)),
    "call an operation that reads": ((4101, 0, 0, 0, 0), lambda one: one.call("/call_operation", operation="status")),
    "call an operation that drives": (
        (4101, 4102, 4104, 0, 0),
        lambda one: one.call("/call_operation", operation="resume_queue"),
    ),
    "resume the queue": ((4101, 4102, 4104, 0, 0), lambda one: one.call("/resume_queue")),
    "recover the queue": ((4101, 4102, 4102, 0, 0), lambda one: one.call("/recover_queue", choice="abort")),
    "recover": ((4101, 4102, 4102, 0, 0), lambda one: one.call("/controller/recover")),
    "pause": ((4101, 4102, 0, 0, 0), lambda one: one.call("/controller/pause")),
    "resume": ((4101, 4102, 4104, 0, 0), lambda one: one.call("/controller/resume")),
    "scale the speed": (
        (4101, 4102, 0, 0, 0),  # of a student the gate refuses it, which a topic does not tell
        lambda one: one.say("publish", topic="/controller/speed", msg={"data": 1.0}),
    ),
    "send a goal": ((4101, 4102, 0, 0, 0), lambda one: one.say("publish", topic="/task/goal", msg={"goal": {}})),
    "have a step done": ((4101, 4102, 0, 0, 0), lambda one: one.say("publish", topic="/step_command", msg={})),
    "submit": (
        (4101, 4102, 0, 0, 0),
        lambda one: one.say("publish", topic="/send_task", msg={"command": "gripper", "open": True}),
    ),
    "cancel a goal": ((0, 0, 0, 0, 0), cancelled),
    "end everything": ((0, 0, 0, 0, 0), lambda one: one.say("publish", topic="/stop_queue", msg={})),
    "stop": ((0, 0, 0, 0, 0), lambda one: one.call("/controller/stop")),
    "abort": ((0, 0, 0, 0, 0), lambda one: one.call("/controller/abort")),
}
"""A request by rosbridge, and its answers to nobody, a viewer, a student, an operator, an administrator."""


@pytest.mark.parametrize("way", [HEADER, AUTH])
@pytest.mark.parametrize("who", PEOPLE)
def test_rosbridge_refuses_by_the_role_of_the_token(robot: SharedRobot, who: str, way: str) -> None:
    told: dict[str, int] = {}

    async def story(one: Visitor) -> None:
        for name, (_, ask) in ASKED.items():
            told[name] = await ask(one)

    run(visited(robot, who, way, story))
    robot.do(restored)
    assert told == {name: codes[PEOPLE.index(who)] for name, (codes, _) in ASKED.items()}


async def restored(stack: Stack) -> None:
    """Have everything be as before: homed and at rest, with an empty queue that runs."""
    service = stack.service
    await service.direct.end_all()
    for work in (service.recover, service.resume, service.queue.resume):
        with suppress(MayaError):
            await work()
    if not stack.controller.state.homed:
        await service.direct.home()


@pytest.mark.parametrize("who", PEOPLE)
def test_http_and_stream_refuse_as_rosbridge_does(robot: SharedRobot, who: str) -> None:
    index = PEOPLE.index(who)
    assert http(robot, who, "GET", "/v1/status") == ASKED["list topics"][0][index]
    assert http(robot, who, "GET", "/metrics") in (0, 4101)
    assert http(robot, who, "POST", "/v1/pause") == ASKED["pause"][0][index]
    assert http(robot, who, "POST", "/v1/stop") == ASKED["stop"][0][index]
    robot.do(restored)

    async def greeted() -> str:
        url = robot.url.replace("http", "ws") + "/v1/stream"
        async with connect(url, additional_headers=robot.headers(who)) as connection:
            if who == NOBODY:
                await connection.send(json.dumps({"type": "subscribe", "state": {"rate": 1}}))
            return json.loads(await connection.recv())["type"]

    assert run(greeted()) == ("error" if who == NOBODY else "hello")


@pytest.mark.parametrize(("role", "proposal"), [("student", True), ("operator", False), ("admin", False)])
def test_job_sent_by_rosbridge_has_the_owner_of_the_token(robot: SharedRobot, role: str, proposal: bool) -> None:
    name = f"sent by {role}"

    async def story(one: Visitor) -> None:
        target = {"x": 0.41, "y": 1.13, "z": 0.4}
        tasks = [{"command": "approach", "target": target}] * (2 + PEOPLE.index(role))
        assert await one.say("publish", topic="/start_queue", msg={"tasks": tasks}) == 0
        while not (found := [job for job in jobs(robot) if job["steps"] == len(tasks)]):
            await turn()
        assert (found[0]["owner"], found[0]["proposal"]) == (f"the-{role}", proposal), name

    run(visited(robot, role, HEADER, story))
    robot.do(restored)


def jobs(robot: SharedRobot) -> list[dict[str, Any]]:
    """Return the jobs that there are."""
    return list(request(robot, "admin", "GET", "/v1/jobs")[1])


async def ended(client: Web) -> int:
    """Return the code that a connection is closed with."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            await client.hear()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


def newcomer(robot: SharedRobot, name: str, role: str) -> str:
    """Add a user and return his token."""
    return robot.do(lambda stack: stack.service.users.add(name, role)).token


def id_of(token: str) -> str:
    """Return the public part of a token."""
    return token.split("_")[1]


REVOKED: dict[str, Callable[[UserService, str], Awaitable[object]]] = {
    "revoked": lambda users, token: users.revoke(id_of(token), LOCAL),
    "removed": lambda users, _: users.remove("guest"),
    "demoted": lambda users, _: users.change("guest", role="viewer", by=LOCAL),
}
"""Ways to end the rights of `guest`, while an operation runs with his token."""


@pytest.mark.parametrize("how", REVOKED)
@pytest.mark.parametrize("way", [HEADER, AUTH])
def test_rosbridge_connection_closes_at_once_when_its_rights_end(
    robot: SharedRobot, monkeypatch: pytest.MonkeyPatch, how: str, way: str
) -> None:
    monkeypatch.setattr(connections, "LOOK_AGAIN", 1000.0)
    token = newcomer(robot, "guest", "operator")

    async def main() -> None:
        headers = {"Authorization": f"Bearer {token}"} if way == HEADER else {}
        async with asyncio.timeout(PATIENCE), web(robot.rosbridge, additional_headers=headers) as client:
            if way == AUTH:
                await client.say("auth", **mac(token))
            assert await Visitor(client).call("/rosapi/topics") == 0
            await asyncio.to_thread(robot.do, lambda stack: REVOKED[how](stack.service.users, token))
            assert await ended(client) == 4101

    try:
        run(main())
    finally:
        with suppress(MayaError):
            robot.do(lambda stack: stack.service.users.remove("guest"))


def test_motion_of_a_revoked_client_is_stopped(robot: SharedRobot) -> None:
    token = newcomer(robot, "guest", "operator")

    async def main() -> None:
        async with (
            asyncio.timeout(PATIENCE),
            web(robot.rosbridge, additional_headers={"Authorization": f"Bearer {token}"}) as client,
        ):
            await client.say("subscribe", topic="/home/status", type="actionlib_msgs/GoalStatusArray")
            await client.say("send_action_goal", action="/home", action_type="maya_controller/Home", id="h")
            await client.until(lambda one: one["op"] == "publish" and any(g["status"] == 1 for g in goals(one)))
            await asyncio.to_thread(robot.do, lambda stack: stack.service.users.remove("guest"))
            assert await ended(client) == 4101

    run(main())
    robot.do(at_rest)
    robot.do(restored)


def goals(message: Said) -> list[dict[str, Any]]:
    """Return the goals of a list that was published."""
    return list(message["msg"].get("status_list", []))


async def at_rest(stack: Stack) -> None:
    """Return when nothing moves."""
    async for state in stack.controller.watch():
        if state.mode not in (Mode.MOVING, Mode.HOMING, Mode.STOPPING):
            return


@pytest.mark.waits("1 s until a connection looks at its token again")
def test_rosbridge_connection_closes_when_its_token_expires(robot: SharedRobot) -> None:
    token = newcomer(robot, "guest", "operator")

    async def main() -> None:
        headers = {"Authorization": f"Bearer {token}"}
        async with asyncio.timeout(PATIENCE), web(robot.rosbridge, additional_headers=headers) as client:
            assert await Visitor(client).call("/rosapi/topics") == 0
            robot.do(expire)
            assert await ended(client) == 4101

    async def expire(stack: Stack) -> None:
        register = stack.access.register
        register.tokens[id_of(token)] = replace(register.tokens[id_of(token)], expires="2001-01-01T00:00:00+00:00")

    run(main())
    robot.do(lambda stack: stack.service.users.remove("guest"))


def test_wrong_token_is_refused_and_the_connection_still_stops_the_robot(robot: SharedRobot) -> None:
    async def story(one: Visitor) -> None:
        assert await one.say("auth", **mac("maya_00000000_" + "0" * 48)) == 4101
        assert await one.call("/rosapi/topics") == 4101
        assert await one.call("/controller/stop") == 0

    run(visited(robot, NOBODY, AUTH, story))


def test_wrong_token_after_a_right_one_leaves_no_caller(robot: SharedRobot) -> None:
    async def story(one: Visitor) -> None:
        assert await one.call("/rosapi/topics") == 0
        assert await one.say("auth", **mac("maya_00000000_" + "1" * 48)) == 4101
        assert await one.call("/rosapi/topics") == 4101

    run(visited(robot, "operator", AUTH, story))


@pytest.mark.parametrize("alone", [False, True])
def test_stop_waits_for_no_token_to_be_looked_at(
    robot: SharedRobot, monkeypatch: pytest.MonkeyPatch, alone: bool
) -> None:
    monkeypatch.setattr(callers, "FAILURE_COSTS", 10.0 * PATIENCE)
    stopped = threading.Event()
    stop = robot.stack.service.stop

    async def stop_report() -> StopReport:
        stopped.set()
        return await stop()

    monkeypatch.setattr(robot.stack.service, "stop", stop_report)

    async def topics(one: Visitor) -> None:
        assert await one.call("/rosapi/topics") == 0

    async def main() -> None:
        async with asyncio.timeout(PATIENCE), web(robot.rosbridge) as client:
            if alone:
                assert await Visitor(client).call("/rosapi/topics") == 4101
            await client.say("auth", **mac("maya_00000000_" + "2" * 48))
            if alone:
                await visited(robot, "viewer", HEADER, topics)  # so the message with the token was read by itself
            await client.say("call_service", id="s", service="/controller/stop", args={})
            await asyncio.to_thread(stopped.wait, PATIENCE)
            assert stopped.is_set()

    run(main())


def test_client_that_a_proxy_hands_on_needs_a_token_for_stop_too(robot: SharedRobot, unkept: SharedRobot) -> None:
    async def code(one: SharedRobot, service: str, token: str = "") -> int:
        headers = {"X-Forwarded-For": "10.0.0.9"} | ({"Authorization": f"Bearer {token}"} if token else {})
        async with asyncio.timeout(PATIENCE), web(one.rosbridge, additional_headers=headers) as client:
            return await Visitor(client).call(service)

    assert run(code(robot, "/controller/stop")) == 4101
    assert run(code(robot, "/controller/stop", robot.tokens["viewer"])) == 0
    assert run(code(unkept, "/controller/stop")) == 4101
    assert run(code(unkept, "/rosapi/topics")) == 4101


def test_without_users_rosbridge_commands_and_the_first_user_ends_its_clients(unkept: SharedRobot) -> None:
    async def main() -> None:
        async with asyncio.timeout(PATIENCE), web(unkept.rosbridge) as client:
            one = Visitor(client)
            assert await one.call("/gripper", data=True) == 0
            assert await one.call("/rosapi/set_param", name="/x", value="1") == 0
            assert await one.say("auth", **mac("whatever")) == 0
            assert await one.call("/gripper", data=False) == 0
            newcomer(unkept, "root", "admin")
            assert await ended(client) == 4101

    run(main())


def test_token_is_written_to_no_log(robot: SharedRobot, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    token = robot.tokens["operator"]

    async def story(one: Visitor) -> None:
        assert await one.call("/rosapi/topics") == 0

    for way in (HEADER, AUTH):
        run(visited(robot, "operator", way, story))
    http(robot, "operator", "GET", "/v1/status")

    async def greeted(headers: dict[str, str], message: dict[str, Any]) -> None:
        url = robot.url.replace("http", "ws") + "/v1/stream"
        async with connect(url, additional_headers=headers) as connection:
            await connection.send(json.dumps(message))
            assert json.loads(await connection.recv())["type"] == "hello"

    run(greeted(robot.headers("operator"), {"type": "ping"}))
    run(greeted({}, {"type": "hello", "token": token}))
    ours = [record for record in caplog.records if "client" not in record.name]
    assert token.split("_")[2] not in "\n".join(record.getMessage() for record in ours)


WAITING = [
    (how, "POST", "/v1/tasks?wait=true&held=true", {"command": "home"}) for how in ("revoked", "removed", "demoted")
] + [(how, "GET", "/v1/events?wait=60&since=1000000000", None) for how in ("revoked", "removed")]
"""Requests that wait; a viewer, too, may wait for events."""


@pytest.mark.parametrize(("how", "method", "path", "body"), WAITING)
def test_http_request_that_waits_ends_at_once_when_its_rights_end(
    robot: SharedRobot, monkeypatch: pytest.MonkeyPatch, how: str, method: str, path: str, body: object
) -> None:
    """The lease alone does not end it: another token of the same user took that."""
    monkeypatch.setattr(connections, "LOOK_AGAIN", 1000.0)
    robot.tokens["driver"] = newcomer(robot, "guest", "operator")
    made = robot.do(lambda stack: stack.service.users.token("guest", by=LOCAL))
    robot.tokens["waiter"] = made.token
    watched: Rights = robot.app.state.rights
    try:
        lease = request(robot, "driver", "POST", "/v1/lease", {})[1]["id"]
        answers: list[tuple[int, Any]] = []
        waiting = threading.Thread(
            target=lambda: answers.append(request(robot, "waiter", method, path, body, **{"Maya-Lease": lease}))
        )
        before = len(watched)
        waiting.start()
        while len(watched) == before:
            assert waiting.is_alive(), answers
        robot.do(lambda stack: REVOKED[how](stack.service.users, made.token))
        waiting.join(PATIENCE)
        assert answers and answers[0][0] in {4101, 4102, 4105}
    finally:
        with suppress(MayaError):
            robot.do(lambda stack: stack.service.users.remove("guest"))
        robot.do(lambda stack: stack.service.queue.clear())
