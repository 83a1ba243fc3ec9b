"""The rights of clients for whom a graph of ROS acts as its own user."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any

import pytest

from maya_ros.graph.access import RestrictedGraph, SharedGuest
from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.servers.operations import OperationServer
from maya_ros.graph.table import CALL_OPERATION, HOME, SEND_TASK, STOP
from maya_ros.ros1.serving import asked_by_operation
from maya_un.client.operations import operations
from maya_un.client.request import Request
from maya_un.errors import InvalidRequest, MayaError, NotAllowed, NotSignedIn
from maya_un.service.access.operations import ROS, Caller, Operation, Role

OTHER = "/lab/maya2"
"""The namespace of another Maya in the graph."""

OWNER = Caller("root", Role.ADMIN, "ros", implicit=True)


async def asked() -> Mapping[str, Operation]:
    return asked_by_operation()


EVERYBODY = (None, *Role)


class Users:
    """Knows the user of the tests by any token."""

    def __init__(self, role: Role | None) -> None:
        self.role = role

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return somebody of the role."""
        del authorization, loopback, stopping, alone
        if self.role is None:
            raise NotSignedIn(reason="test")
        return Caller("ana", self.role, source, lease)

    async def current(self, asked: Any) -> Any:
        """Return the callers unchanged."""
        return asked

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Ignore the listener."""
        return listener


class App:
    """Answers every operation, as the graph's user."""

    async def ready(self) -> None:
        """Be ready."""

    async def ask(self, request: Request[Any], caller: Caller) -> str:
        """Return who did it."""
        return json.dumps([request.path, caller.name])


@asynccontextmanager
async def seated(role: Role | None, lease: str = "") -> AsyncIterator[RestrictedGraph]:
    """Yield the graph of a client of a role, None without a token."""
    guest = SharedGuest(asked, "test", lease=lease)
    try:
        await guest.introduce(Users(role), "maya_x")
    except NotSignedIn:
        assert role is None
    bus = Bus()

    async def who() -> Caller:
        return OWNER

    async def home(_: Message, feedback: Feedback) -> Message:
        feedback({})
        return success()

    async def stop(_: Message) -> Message:
        return {"success": True, "message": ""}

    async def answered(_: Message) -> Message:
        return {**success(), "result": "{}"}

    robot = bus.node("robot")
    for space in ("", OTHER):
        robot.act(space + HOME.name, HOME.type, home)
        robot.serve(space + STOP.name, STOP.type, stop)
    robot.serve("/camera/stop", STOP.type, stop)
    robot.serve(OTHER + CALL_OPERATION.name, CALL_OPERATION.type, answered)
    async with OperationServer(App(), lambda: 0, who).open(robot):
        yield RestrictedGraph(bus.node("rosbridge"), guest)
    robot.close()


def called(name: str, of: str = "", /, **arguments: Any) -> Callable[[RestrictedGraph], Awaitable[object]]:
    """Return what calls an operation of the Maya in a namespace."""
    request = {"operation": name, "arguments": json.dumps(arguments)}
    return lambda graph: graph.call(of + CALL_OPERATION.name, request)


async def cancelled(graph: RestrictedGraph) -> None:
    """Cancel a goal of the other Maya."""
    graph.advertise(f"{OTHER}{HOME.name}/cancel", "actionlib_msgs/GoalID").publish({"id": "1"})


async def proposed(graph: RestrictedGraph) -> None:
    """Send a task to the queue."""
    graph.advertise(SEND_TASK.name, SEND_TASK.type).publish({"command": "home"})


async def code_of(asked: Awaitable[object]) -> int:
    """Return the code of a refusal, 0 for none."""
    try:
        answer = await asked
    except MayaError as refusal:
        return refusal.code
    assert not isinstance(answer, dict) or answer["success"], answer
    return 0


JOB = {"name": "x", "steps": []}
REQUESTS: dict[str, tuple[tuple[int, int, int, int, int], Callable[[RestrictedGraph], Awaitable[object]]]] = {
    "read": ((4101, 0, 0, 0, 0), called("status")),
    "pause": ((4101, 4102, 0, 0, 0), called("pause_queue")),
    "submit": ((4101, 4102, 4102, 0, 0), called("submit", job=JOB)),
    "jog": ((4101, 4102, 4102, 0, 0), called("jog_release")),
    "ask for a lease": ((4101, 4102, 4102, 0, 0), called("ask_for_lease")),
    "take the lease": ((4101, 4102, 4102, 0, 0), called("take_lease", force=False)),
    "take the lease by force": ((4101, 4102, 4102, 4102, 0), called("take_lease", force=True)),
    "sign out": ((4101, 4102, 4102, 4102, 0), called("sign_out")),
    "add a user": ((4101, 4102, 4102, 4102, 0), called("add_user", name="mallory", role="admin")),
    "home": ((4101, 4102, 4102, 0, 0), lambda graph: graph.do(HOME.name, HOME.type, {})),
    "send a task": ((4101, 4102, 4102, 0, 0), proposed),
    "stop": ((0, 0, 0, 0, 0), lambda graph: graph.call(STOP.name, {})),
    "stop by its name": ((0, 0, 0, 0, 0), called("stop")),
    "stop the other": ((0, 0, 0, 0, 0), lambda graph: graph.call(OTHER + STOP.name, {})),
    "home the other": ((4101, 4102, 4102, 0, 0), lambda graph: graph.do(OTHER + HOME.name, HOME.type, {})),
    "cancel on the other": ((0, 0, 0, 0, 0), cancelled),
    "read the other": ((4101, 0, 0, 0, 0), called("status", OTHER)),
    "add a user to the other": ((4101, 4102, 4102, 4102, 0), called("add_user", OTHER, name="mallory", role="admin")),
    "another service": ((4101, 4102, 4102, 0, 0), lambda graph: graph.call("/camera/stop", {})),
}
"""Requests, and how they are answered without a token, to a viewer, a student, an operator and an administrator."""


@pytest.mark.parametrize("role", EVERYBODY)
async def test_client_needs_the_rights_to_what_is_done_as_the_user_of_the_graph(role: Role | None) -> None:
    told: dict[str, int] = {}
    async with seated(role, lease="lent") as graph:
        for name, (_, ask) in REQUESTS.items():
            told[name] = await code_of(ask(graph))
    assert told == {name: codes[EVERYBODY.index(role)] for name, (codes, _) in REQUESTS.items()}


async def test_unknown_operation_is_refused_before_the_call() -> None:
    async with seated(Role.ADMIN) as graph:
        for name in ("nothing", "add_user\ud800", 5, None):
            with pytest.raises(InvalidRequest):
                await graph.call(CALL_OPERATION.name, {"operation": name})
        with pytest.raises(InvalidRequest):
            await graph.call(CALL_OPERATION.name, [])


async def test_stop_does_not_wait_until_the_other_operations_are_known() -> None:
    async def never() -> Mapping[str, Operation]:
        raise AssertionError

    guest = SharedGuest(never)
    for name in ("stop", "abort"):
        assert await guest.asked_by(CALL_OPERATION.name, {"operation": name}) is asked_by_operation()[name]


@pytest.mark.parametrize("request_", [["take_lease", '{"force": true}'], {"operation": "take_lease", "arguments": 5}])
async def test_force_is_found_in_arguments_of_every_form(request_: Any) -> None:
    async with seated(Role.OPERATOR) as graph:
        with pytest.raises((NotAllowed, InvalidRequest)):
            await graph.call(CALL_OPERATION.name, request_)


def test_right_to_every_operation_is_known() -> None:
    known = asked_by_operation()
    assert set(known) == set(operations())
    assert known["jog_by"] is Operation.JOG
    assert known["task"] is Operation.COMMAND
    assert known["submit"] is Operation.SUBMIT
    assert known["add_user"] is Operation.USERS
