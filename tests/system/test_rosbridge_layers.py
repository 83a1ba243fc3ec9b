"""The whole stack behind rosbridge, without sockets, in virtual time: commands of the graph, and their results."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import GoalStatus, Message
from maya_ros.graph.table import POSITION
from maya_ros.rosbridge import thread_proxy
from maya_ros.rosbridge.endpoint import NODE
from maya_ros.rosbridge.outgoing import MessageEncoder
from maya_ros.rosbridge.standalone import graph_of
from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.http.bridge import Bridge
from maya_un.service.access.operations import Caller, Operation, Role
from maya_un.values import Mode, Point
from tests.calm import CALM
from tests.campaign import Campaign
from tests.homing_mark import stand_homed
from tests.rosbridge_clients import DATE, BusClient, Said
from tests.virtual_time import elapse

pytestmark = pytest.mark.system

START, TRAY = Point(0.41, 1.13, 0.4), Point(1.18, 0.21, 0.4)
NEAR = 0.002
"""A part stands where it was put to within so much [m]."""

EVENT = {"topic": "/maya_event", "type": "std_msgs/String"}


class Robot:
    """A stack with a cube on the twin's table, its graph, and a client of it."""

    def __init__(self, stack_: Stack, bus: Bus, bridge: Bridge) -> None:
        self.stack = stack_
        self.bus = bus
        self.bridge = bridge
        self.press = MessageEncoder(lambda: DATE)
        self.talker = self.come()

    def come(self) -> BusClient:
        """Return one more client."""
        return BusClient(self.bus, self.press, self.bus.node(NODE))

    async def leave(self, talker: BusClient) -> None:
        """Have a client go."""
        await talker.session.close()
        talker.node.close()

    async def until(self, fact: Callable[[Said], bool], talker: BusClient | None = None) -> Said:
        """Return the first message to a client that is so."""
        mouth = (talker or self.talker).mouth
        seen = 0
        while True:
            for message in mouth.said[seen:]:
                seen += 1
                if fact(message):
                    return message
            await elapse(0.05)

    async def command(self, command: str, target: Point | None = None, open_: bool = False) -> Message:
        """Have /maya_command do a primitive, and return what it answers."""
        name = f"{command} {len(self.talker.mouth.frames)}"
        self.talker.say("call_service", id=name, service="/maya_command", args={"task": task(command, target, open_)})
        answer = await self.until(lambda message: message.get("id") == name)
        assert answer["result"] is True, answer
        return answer["values"]

    async def call(self, operation: str, arguments: object = None) -> Message:
        """Call an operation by its name, and return the answer of /call_operation; text is sent as it is."""
        name = f"{operation} {len(self.talker.mouth.frames)}"
        text = arguments if isinstance(arguments, str) else json.dumps(arguments or {})
        args = {"operation": operation, "arguments": text}
        self.talker.say("call_service", id=name, service="/call_operation", args=args)
        answer = await self.until(lambda message: message.get("id") == name)
        assert answer["result"] is True, answer
        return answer["values"]

    async def idle(self) -> None:
        """Return when the queue is empty again."""
        while self.stack.service.queue.view().running or self.waiting:
            await elapse(0.2)

    @property
    def waiting(self) -> bool:
        """Whether anything waits in the queue."""
        return bool(self.stack.service.queue.view().waiting)

    @property
    def cube(self) -> Point:
        """Position of the cube, by the twin's own record."""
        assert self.stack.twin is not None
        return Point(*self.stack.twin.mechanics.record.parts["cube"])


def task(command: str, target: Point | None = None, open_: bool = False) -> Message:
    """Return a maya_robot/MayaPrimitive."""
    return {"command": command, "target": {} if target is None else target._asdict(), "open": open_}


@pytest.fixture(autouse=True)
def seldom(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look seldom whether there is a new state: in virtual time every look costs some."""
    monkeypatch.setattr(thread_proxy, "POSITION", replace(POSITION, rate=5.0))


@asynccontextmanager
async def robot(folder: Path, *, homed: bool = False) -> AsyncIterator[Robot]:
    """Yield a robot of its own."""
    async with stack(CALM, parts={"cube": START}) as running:
        if homed:
            await stand_homed(running)
        bridge = Bridge(asyncio.get_running_loop(), running.service, gate=running.gate)
        async with graph_of(running, bridge, folder / "steps.db", now=asyncio.get_running_loop().time) as bus:
            one = Robot(running, bus, bridge)
            yield one
            await one.leave(one.talker)


def stands_on_the_tray(cube: Point) -> bool:
    return max(abs(cube.x - TRAY.x), abs(cube.y - TRAY.y)) < NEAR


async def by_command(one: Robot) -> None:
    for command, target in (("home", None), ("pick", START), ("place", TRAY)):
        assert await one.command(command, target) == {"success": True, "code": "", "message": ""}


async def by_task(one: Robot) -> None:
    for step in (task("pick", START), task("place", TRAY)):
        one.talker.say("send_action_goal", id=step["command"], action="/task", args={"task": step}, feedback=True)
        ended = await one.until(lambda message, name=step["command"]: is_end_of(message, name))
        assert (ended["status"], ended["values"]["success"]) == (4, True)
    phases = [said["values"]["phase"] for said in one.talker.mouth.said if said["op"] == "action_feedback"]
    assert {"approach", "down", "close", "up"} & set(phases)


def is_end_of(message: Said, name: str) -> bool:
    return message["op"] == "action_result" and message["id"] == name


async def by_goal_topic(one: Robot) -> None:
    await one.talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
    for number, step in enumerate((task("pick", START), task("place", TRAY))):
        one.talker.say("publish", topic="/task/goal", msg={"goal_id": {"id": f"{number}"}, "goal": {"task": step}})
        ended = await one.until(lambda message, name=f"{number}": message["msg"]["status"]["goal_id"]["id"] == name)
        assert ended["msg"]["status"]["status"] == GoalStatus.SUCCEEDED


async def by_move(one: Robot) -> None:
    for step in (task("pick", START), task("place", TRAY)):
        one.talker.say("publish", topic="/maya_move", msg=step)
        await elapse(0.5)
        while one.stack.service.direct.doing:
            await elapse(0.2)


async def by_send_task(one: Robot) -> None:
    for step in (task("pick", START), task("place", TRAY)):
        one.talker.say("publish", topic="/send_task", msg=step)
    await elapse(0.5)
    assert len(one.stack.service.queue.view().waiting) == 1, "each is a job"
    await one.idle()


async def by_start_queue(one: Robot) -> None:
    steps = [task("home"), task("pick", START), task("place", TRAY)]
    one.talker.say("publish", topic="/start_queue", msg={"tasks": steps})
    await elapse(0.5)
    assert one.stack.service.queue.view().running is not None
    assert not one.waiting, "all are one job"
    await one.idle()


async def by_operation(one: Robot) -> None:
    job = {"name": "cube", "parts": {"cube": [*START]}, "places": {"tray": [*TRAY]}}
    steps = ["home", {"pick": "cube"}, {"place": "tray"}]
    accepted = await one.call("submit", {"job": {**job, "steps": steps}})
    assert accepted["success"], accepted
    number = json.loads(accepted["result"])["id"]
    await one.idle()
    assert json.loads((await one.call("report", {"job": number}))["result"])["state"] == "done"


@pytest.mark.parametrize(
    "way", [by_command, by_task, by_goal_topic, by_move, by_send_task, by_start_queue, by_operation]
)
async def test_part_is_moved_by_every_interface(way: Callable[[Robot], object], tmp_path: Path) -> None:
    async with robot(tmp_path, homed=way not in (by_command, by_start_queue, by_operation)) as one:
        assert not stands_on_the_tray(one.cube)
        await way(one)  # type: ignore[misc]
        assert stands_on_the_tray(one.cube)
        assert (await one.command("can_teleop"))["success"] is True


async def test_events_and_positions_show_the_state(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        told = await one.talker.ask("subscribe", **EVENT)
        word, _, rest = told[0]["msg"]["data"].partition(" ")
        assert (word, json.loads(rest)["homed"]) == ("not_homed", False)
        assert (await one.command("can_teleop"))["code"] == "2103"
        assert (await one.command("home"))["success"] is True
        words = [message["msg"]["data"].split()[0] for message in one.talker.mouth.said if "msg" in message]
        assert words[:2] == ["homing", "homed"]
        one.talker.say("subscribe", topic="/maya_position")
        position = await one.until(lambda message: message.get("topic") == "/maya_position")
        point = one.stack.controller.state.point
        assert point is not None
        assert position["msg"] == point._asdict()
        one.talker.say("subscribe", topic="/hardware_sensor")
        raw = await one.until(lambda message: message.get("topic") == "/hardware_sensor")
        assert raw["msg"]["position"] == list(one.stack.controller.state.counts)


async def test_second_command_is_refused_with_a_code_and_the_first_unharmed(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        one.talker.say("send_action_goal", id="first", action="/task", args={"task": task("home")}, feedback=True)
        await one.until(lambda message: message["op"] == "action_feedback")
        other = one.come()
        for number, request in enumerate(
            (
                ("send_action_goal", {"action": "/task", "args": {"task": task("home")}}),
                ("send_action_goal", {"action": "/home"}),
                ("send_action_goal", {"action": "/move", "args": {"a": 0.1, "b": 1.0, "c": 1.0}}),
            )
        ):
            other.say(request[0], id=number, **request[1])
            refused = await one.until(lambda message, name=number: message.get("id") == name, other)
            assert (refused["result"], refused["values"][:6]) == (False, "2104: ")
        other.say("call_service", id="g", service="/gripper", args={"data": True})
        refused = await one.until(lambda message: message.get("id") == "g", other)
        assert refused["values"]["success"] is False
        assert refused["values"]["message"].startswith("2104: ")
        assert (await one.command("pick", START))["code"] == "2104"
        ended = await one.until(lambda message: is_end_of(message, "first"))
        assert ended["values"]["success"] is True
        await one.leave(other)


async def test_cancel_stops_on_the_path_and_is_reported_at_rest(tmp_path: Path) -> None:
    async with robot(tmp_path, homed=True) as one:
        one.talker.say(
            "send_action_goal", id="far", action="/task", args={"task": task("approach", TRAY)}, feedback=True
        )
        await one.until(lambda message: message["op"] == "action_feedback" and message["values"]["progress"] > 0.2)
        one.talker.say("cancel_action_goal", action="/task", id="far")
        ended = await one.until(lambda message: is_end_of(message, "far"))
        assert (ended["status"], ended["values"]["code"]) == (5, "2202")
        assert not one.stack.controller.state.moving
        assert (await one.command("pick", START))["success"] is True


async def test_client_that_vanishes_stops_its_command(tmp_path: Path) -> None:
    async with robot(tmp_path, homed=True) as one:
        other = one.come()
        other.say("call_service", service="/maya_command", args={"task": task("approach", TRAY)})
        while not one.stack.controller.state.moving:
            await elapse(0.05)
        await one.leave(other)
        await elapse(2.0)
        assert not one.stack.controller.state.moving
        assert one.stack.controller.state.point != TRAY
        assert (await one.command("can_teleop"))["success"] is True


async def test_stop_queue_ends_everything_at_any_instant_a_homing_included(tmp_path: Path, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=2, long=60)):
        folder = tmp_path / str(case)
        folder.mkdir()
        instant = campaign.rng(case).uniform(0.0, 60.0)
        async with robot(folder) as one:
            steps = [task("home"), task("pick", START), task("place", TRAY)]
            one.talker.say("publish", topic="/start_queue", msg={"tasks": steps})
            one.talker.say("publish", topic="/send_task", msg=task("approach", START))
            await elapse(instant)
            one.talker.say("publish", topic="/stop_queue", msg={})
            await elapse(5.0)
            state, view = one.stack.controller.state, one.stack.service.queue.view()
            assert not state.moving
            assert state.mode in (Mode.IDLE, Mode.NOT_HOMED)
            assert view.running is None
            assert not view.waiting
            await elapse(60.0)
            assert one.stack.controller.state.counts == state.counts, "nothing begins by itself"
            assert (await one.command("home"))["success"] is True


async def test_stop_and_pause_are_services_past_a_running_command(tmp_path: Path) -> None:
    async with robot(tmp_path, homed=True) as one:
        one.talker.say("send_action_goal", id="far", action="/task", args={"task": task("approach", TRAY)})
        while not one.stack.controller.state.moving:
            await elapse(0.05)
        for service in ("/controller/pause", "/controller/resume", "/controller/stop"):
            one.talker.say("call_service", id=service, service=service)
            answer = await one.until(lambda message, name=service: message.get("id") == name)
            assert answer["values"]["success"] is True, answer
            await elapse(0.5)
        ended = await one.until(lambda message: is_end_of(message, "far"))
        assert (ended["status"], ended["values"]["code"]) == (5, "2201")


async def test_holder_of_the_lease_drives_and_the_graph_is_notified(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        ada = Caller("ada", Role.OPERATOR, "test")
        await one.bridge.call(ada, Operation.LEND, lambda service: service.lease.take(ada))
        assert (await one.command("home"))["code"] == "4103"
        one.talker.say("call_service", id="stop", service="/controller/stop")
        assert (await one.until(lambda message: message.get("id") == "stop"))["values"]["success"] is True


@pytest.mark.parametrize(
    ("operation", "arguments", "code", "reason"),
    [
        ("resume-queue", None, "4005", "'resume-queue' is unknown; `maya call` lists all operations"),
        ("recording", {"name": "x"}, "4005", "'recording' is unknown"),
        ("reach", {"x": 1.0, "y": 1.0}, "4005", "z: reach needs z"),
        ("reach", {"x": 1.0, "y": 1.0, "z": "high"}, "4005", "z: it is not of the type float"),
        ("reach", {"x": True, "y": 1.0, "z": 1.0}, "4005", "x: it is not of the type float"),
        ("reach", {"x": 1.0, "y": 1.0, "z": 1.0, "w": 1.0}, "4005", "w: reach has the parameters x, y, z"),
        ("report", {"job": "1/cancel"}, "4005", "job: it is not of the type int"),
        ("status", "[]", "4005", "it is not a JSON object"),
        ("status", "{", "4005", "it is not JSON"),
        ("status", '{"a": ' + "1" * 20_000 + "}", "4005", "they are longer than 16384 characters; use HTTP"),
        ("teach", {"name": "tray"}, "2103", ""),
    ],
)
async def test_a_bad_call_of_an_operation_is_refused_as_over_http(
    operation: str, arguments: object, code: str, reason: str, tmp_path: Path
) -> None:
    async with robot(tmp_path) as one:
        answer = await one.call(operation, arguments)
        assert (answer["success"], answer["code"], answer["result"]) == (False, code, ""), answer
        assert reason in answer["message"]


async def test_an_operation_is_called_with_the_rights_of_the_sender(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        assert json.loads((await one.call("status"))["result"])["state"]["homed"] is False
        ada = Caller("ada", Role.OPERATOR, "test")
        await one.bridge.call(ada, Operation.LEND, lambda service: service.lease.take(ada))
        assert (await one.call("resume_queue"))["code"] == "4103"
        assert (await one.call("stop"))["success"] is True


async def test_steps_of_others_are_carried_out_once(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        await one.talker.ask("subscribe", topic="/step_result", type="std_msgs/String")
        step = json.dumps({"id": "1", "primitive": "home"})
        one.talker.say("publish", topic="/step_command", msg={"data": step})
        result = await one.until(lambda message: message.get("topic") == "/step_result")
        assert json.loads(result["msg"]["data"])["id"] == "1"


async def test_parameters_show_the_running_configuration(tmp_path: Path) -> None:
    async with robot(tmp_path) as one:
        one.talker.say("call_service", id="p", service="rosapi/get_param", args={"name": "/maya/config/cell"})
        answer = await one.until(lambda message: message.get("id") == "p")
        assert json.loads(answer["values"]["value"]) == Config().cell.model_dump(mode="json")
