"""The agent between a real rosbridge endpoint and supervisors in memory; either side goes away and comes back."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any, cast

import pytest

from dmc41x3.loops import run
from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, Graph, Message
from maya_ros.graph.servers.steps import Steps, bridged
from maya_ros.graph.table import STEP_COMMAND, STEP_RESULT, STEP_ROBOT, STEP_STATUS, TASK
from maya_ros.rosbridge.endpoint import Endpoint
from maya_un.coms.agent import LONGEST, Agent
from maya_un.coms.robot import Rosbridge
from maya_un.coms.transport import LONGEST_PAUSE, Report, ReportKind, SupervisorCommand
from maya_un.errors import (
    InvalidMessage,
    InvalidRequest,
    KeyReused,
    RobotNotReached,
    SessionTakenOver,
    StepOfOtherRobot,
    WrongRobot,
)
from maya_un.http import dates
from maya_un.http.sockets import bound_socket
from maya_un.steps.store import StepStore
from maya_un.steps.text import RobotIdentity, StepEnd
from tests.rosbridge_clients import DATE
from tests.unit.coms.memory import Memory
from tests.virtual_time import elapse
from tests.waiting import until


class Robot:
    """A robot behind a rosbridge whose port stays the same; `begun` lists the commands that ran."""

    name = "MAYA"

    def __init__(self, store: StepStore) -> None:
        self.begun: list[str] = []
        self.go = asyncio.Event()
        self.go.set()
        self.bus = Bus()
        self.store = store
        with bound_socket(0) as listener:
            self.port = listener.getsockname()[1]
        self._task = self.bus.node("primitive_server").act(TASK.name, TASK.type, self._act)

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    async def _act(self, goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "begun"})
        self.begun.append(goal["task"]["command"])
        await self.go.wait()
        return success()

    @asynccontextmanager
    async def bridge(self) -> AsyncIterator[Steps]:
        """Run the node firebase_bridge."""
        async with bridged(self.bus.node("firebase_bridge"), self.store, dates.now, name=self.name) as steps:
            yield steps

    @asynccontextmanager
    async def rosbridge(self) -> AsyncIterator[None]:
        """Serve rosbridge."""

        @contextmanager
        def seat(_: Guest) -> Iterator[Graph]:
            node = self.bus.node("rosbridge")
            yield node
            node.close()

        endpoint = Endpoint(seat, lambda: DATE, None, 10)
        async with endpoint.serving(bound_socket(self.port)):
            yield


Story = Callable[[Robot, Agent, Memory], Awaitable[None]]


def told(
    story: Story, folder: Path, default_command: str | None = None, kind: Callable[[str | None], Memory] = Memory
) -> None:
    """Run a story with an agent that is connected by nobody yet."""

    async def main() -> None:
        store = await StepStore.open(folder / "steps.db")
        robot, memory = Robot(store), kind(default_command)
        agent = Agent("MAYA", Rosbridge(robot.url), memory, dates.now, Random(1))
        running = asyncio.create_task(agent.run())
        try:
            async with asyncio.timeout(150.0):
                await story(robot, agent, memory)
        finally:
            running.cancel()
            with suppress(asyncio.CancelledError):
                await running
            await store.close()

    run(main())


def command(id_: str | None, name: str = "home", **more: Any) -> bytes:
    return json.dumps({"command": name, **more} | ({} if id_ is None else {"id": id_})).encode()


def test_commands_run_in_their_order_and_each_has_its_reports(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            for id_ in "abc":
                await memory.put(f"k{id_}", command(id_, "gripper", args={"open": id_ == "b"}))
            results = await memory.results(3)
        assert [(result.id, result.key, json.loads(result.text)["success"]) for result in results] == [
            (id_, f"k{id_}", True) for id_ in "abc"
        ]
        assert robot.begun == ["gripper"] * 3
        assert memory.commands == {}
        assert agent.status()["steps"] == {}

    told(story, tmp_path)


def test_a_command_without_an_id_has_the_transports(tmp_path: Path) -> None:
    async def story(robot: Robot, _: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await memory.put("key 1", command(None))
            (result,) = await memory.results(1)
        assert (result.id, json.loads(result.text)["id"]) == ("key 1", "key 1")

    told(story, tmp_path)


def test_an_invalid_id_of_the_transport_is_refused_and_blocks_nothing(tmp_path: Path) -> None:
    async def story(robot: Robot, _: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k" * 201, command(None))
            (refused,) = await memory.results(1)
            assert (refused.id, json.loads(refused.text)["code"]) == (None, str(InvalidRequest.code))
            await memory.put("good", command("good"))
            await memory.results(2)
        assert robot.begun == ["home"]

    told(story, tmp_path)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (b"x" * (LONGEST + 1), InvalidMessage.code),
        (b"[" * 20_000, InvalidMessage.code),
        (b"\xff\xfe", InvalidMessage.code),
        (b"[]", InvalidMessage.code),
        (b'{"id": 3, "command": "home"}', InvalidRequest.code),
        (b'{"id": "1"}', InvalidRequest.code),
    ],
)
def test_a_command_that_cannot_be_read_is_answered(text: bytes, code: int, tmp_path: Path) -> None:
    async def story(robot: Robot, _: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await memory.put("bad", text)
            (result,) = await memory.results(1)
            assert (result.key, json.loads(result.text)["code"]) == ("bad", str(code))
            await memory.put("good", command("good"))
            await memory.results(2)
        assert robot.begun == ["home"]

    told(story, tmp_path)


def test_the_old_form_has_the_default_command(tmp_path: Path) -> None:
    async def story(robot: Robot, _: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await memory.put("1", b'{"args": {"x": 0.5, "y": 1.1, "z": 0.4}}')
            await memory.results(1)
        assert robot.begun == ["approach"]

    told(story, tmp_path, "approach")


def test_an_id_with_other_content_is_refused_and_the_first_runs_on(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("1"))
            await until(lambda: agent.status()["steps"] == {"1": "executing"})
            await memory.put("k2", command("1", "can_teleop"))
            (refused,) = await memory.results(1)
            assert (refused.key, json.loads(refused.text)["code"]) == ("k2", str(KeyReused.code))
            robot.go.set()
            _, done = await memory.results(2)
            assert (done.key, json.loads(done.text)["success"]) == ("k1", True)
            await memory.put("k3", command("1", "can_teleop"))
            *_, again = await memory.results(3)
            assert (again.key, json.loads(again.text)["code"]) == ("k3", str(KeyReused.code))
        assert robot.begun == ["home"]

    told(story, tmp_path)


def test_an_id_with_another_deadline_is_the_same_command(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("1"))
            await until(lambda: agent.status()["steps"] == {"1": "executing"})
            later = {**json.loads(command("1")), "deadline": "2999-01-01T00:00:00Z", "robot": "MAYA"}
            await memory.put("k2", json.dumps(later).encode())
            await memory.put("k3", b"{")
            await memory.results(1)  # of k3: k2 was taken before it
            robot.go.set()
            _, *done = await memory.results(3)
        assert [(one.key, json.loads(one.text)["success"]) for one in done] == [("k1", True), ("k2", True)]
        assert robot.begun == ["home"]

    told(story, tmp_path)


NOWHERE = {"x": float("nan"), "y": 10**400, "z": "0.4" * 10_000}


@pytest.mark.parametrize(
    "other", [command("1", "can_teleop"), command("1", "dance"), command("1", "pick", args=NOWHERE)]
)
def test_a_refusal_of_other_content_is_not_the_result_of_the_first(other: bytes, tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("1"))
            await until(lambda: agent.status()["steps"] == {"1": "executing"})
            refusals = await published_beside(robot, other)
            assert [one["code"] for one in refusals] == [str(KeyReused.code)]
            robot.go.set()
            (done,) = await memory.results(1)
            assert (done.key, json.loads(done.text)["success"]) == ("k1", True)
            await memory.put("k2", other)
            _, refused = await memory.results(2)
            assert (refused.key, json.loads(refused.text)) == ("k2", refusals[0] | _dates(refused))

    told(story, tmp_path)


def _dates(report: Report) -> dict[str, Any]:
    data = json.loads(report.text)
    return {"started": data["started"], "finished": data["finished"]}


async def published_beside(robot: Robot, text: bytes) -> list[dict[str, Any]]:
    """Have another program of the robot send a command; return the results that the robot publishes until then."""
    found: list[dict[str, Any]] = []
    node = robot.bus.node("other")
    node.subscribe(
        STEP_RESULT.name, STEP_RESULT.type, lambda message: found.append(json.loads(message["data"])), queue_size=10
    )
    commands = node.advertise(STEP_COMMAND.name, STEP_COMMAND.type, queue_size=10)
    commands.publish({"data": text.decode()})
    await until(lambda: bool(found))
    node.close()
    return found


def test_an_unreadable_command_under_a_pending_id_names_no_other_error(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("k2"))
            await until(lambda: agent.status()["steps"] == {"k2": "executing"})
            await memory.put("k2", b"{")  # its id is its key
            (refused,) = await memory.results(1)
            data = json.loads(refused.text)
            assert (data["code"], data["content"]) == (str(KeyReused.code), {"command": None, "args": {}})
            robot.go.set()
            _, done = await memory.results(2)
            assert (done.key, json.loads(done.text)["success"]) == ("k1", True)

    told(story, tmp_path)


def test_a_result_survives_the_loss_of_either_side(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge():
            async with robot.rosbridge():
                await memory.put("k1", command("1"))
                await until(lambda: robot.begun == ["home"])
            await until(lambda: not agent.status()["robot"]["connected"])
            robot.go.set()
            await memory.set_away(True)
            await until(lambda: not agent.status()["supervisors"]["connected"])
            async with robot.rosbridge():
                await until(lambda: agent.status()["steps"] == {"1": "result"})
                await memory.set_away(False)
                (result,) = await memory.results(1)
        assert json.loads(result.text)["success"]
        assert robot.begun == ["home"]

    told(story, tmp_path)


def test_running_step_does_not_block_others_after_a_lost_link(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        robot.go.clear()
        async with robot.bridge():
            async with robot.rosbridge():
                await memory.put("k1", command("1"))
                await until(lambda: agent.status()["steps"] == {"1": "executing"})
            await until(lambda: not agent.status()["robot"]["connected"])
            async with robot.rosbridge():
                await memory.put("k2", command("2", "can_teleop"))
                await until(lambda: agent.status()["steps"] == {"1": "executing", "2": "accepted"})
                assert agent.status()["robot"]["connected"]
                robot.go.set()
                await memory.results(2)
        assert robot.begun == ["home", "can_teleop"]

    told(story, tmp_path)


class Late(Memory):
    """After a reconnect, delivers commands only while it takes a result of which it knows no command."""

    def __init__(self, default_command: str | None = None) -> None:
        super().__init__(default_command)
        self.taking = asyncio.Event()
        self.taking.set()
        self.taken = asyncio.Event()

    async def next(self, delivered: set[str]) -> SupervisorCommand:
        if delivered:
            self.taken.set()
        await self.taking.wait()
        return await super().next(delivered)

    async def take(self, report: Report) -> None:
        await super().take(report)
        if report.kind is ReportKind.RESULT and report.key is None:
            self.taken.clear()
            self.taking.set()
            await self.taken.wait()


def test_command_repeated_during_its_result_is_answered(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        assert isinstance(memory, Late)
        robot.go.clear()
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("1"))
            await until(lambda: agent.status()["steps"] == {"1": "executing"})
            await memory.set_away(True)
            await until(lambda: not agent.status()["supervisors"]["connected"])
            robot.go.set()
            await until(lambda: agent.status()["steps"] == {"1": "result"})
            memory.taking.clear()
            await memory.set_away(False)
            results = await memory.results(2)
            await until(lambda: agent.status()["steps"] == {})
        assert [(one.id, one.key) for one in results] == [("1", None), ("1", "k1")]
        assert results[0].text == results[1].text
        assert memory.commands == {}
        assert robot.begun == ["home"]

    told(story, tmp_path, kind=Late)


def test_waiting_for_the_bridge_is_reported(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        await memory.put("k1", command("1"))
        await until(lambda: "does not answer" in str(agent.status()["robot"]["waits_for"]))
        async with robot.rosbridge():
            await until(lambda: "firebase_bridge" in str(agent.status()["robot"]["waits_for"]))
            async with robot.bridge():
                await memory.results(1)
                await until(lambda: agent.status()["robot"]["connected"])
        assert robot.begun == ["home"]

    told(story, tmp_path)


class Direct:
    """A link to the robot that works in virtual time: rosbridge without its sockets."""

    def __init__(self, robot: Robot) -> None:
        self.where = "direct"
        self.away = False
        self._node = robot.bus.node("rosbridge")
        self._came: asyncio.Queue[Report | RobotIdentity | None] = asyncio.Queue()

    def cut(self) -> None:
        """End the connection; the next attempts fail until `away` is False again."""
        self.away = True
        self._came.put_nowait(None)

    @asynccontextmanager
    async def connected(self) -> AsyncIterator[Direct]:
        if self.away:
            raise RobotNotReached(url=self.where, reason="it is away")
        self._came = asyncio.Queue()
        readers = [
            self._node.subscribe(row.name, row.type, self._hear(row is STEP_RESULT))
            for row in (STEP_RESULT, STEP_STATUS)
        ]
        readers.append(self._node.subscribe(STEP_ROBOT.name, STEP_ROBOT.type, self._meet))
        self._commands = self._node.advertise(STEP_COMMAND.name, STEP_COMMAND.type)
        yield self
        for one in (*readers, self._commands):
            one.close()

    def _hear(self, result: bool) -> Callable[[Message], None]:
        def hear(message: Message) -> None:
            data = json.loads(message["data"])
            kind = ReportKind.RESULT if result else ReportKind(data["state"])
            self._came.put_nowait(Report(data["id"], kind, message["data"]))

        return hear

    def _meet(self, message: Message) -> None:
        self._came.put_nowait(RobotIdentity(**json.loads(message["data"])))

    async def prepare(self) -> None:
        """It hears everything already."""

    async def send(self, text: str) -> None:
        self._commands.publish({"data": text})

    async def receive(self) -> Report | RobotIdentity:
        report = await self._came.get()
        if report is None:
            raise RobotNotReached(url=self.where, reason="it went away")
        return report


@pytest.mark.parametrize("side", ["robot", "supervisors", "both"])
async def test_commands_survive_ten_minutes_without_a_side(side: str, tmp_path: Path) -> None:
    store = await StepStore.open(tmp_path / "steps.db")
    robot, memory = Robot(store), Memory()
    direct = Direct(robot)
    agent = Agent("MAYA", cast(Rosbridge, direct), memory, dates.now, Random(1))
    running = asyncio.create_task(agent.run())
    loop = asyncio.get_running_loop()
    async with robot.bridge():
        robot.go.clear()
        await memory.put("k1", command("1"))
        await memory.put("k2", command("2"))
        while robot.begun != ["home"]:
            await elapse(0.1)
        if side != "supervisors":
            direct.cut()
        if side != "robot":
            await memory.set_away(True)
        await elapse(0.1)
        robot.go.set()
        for id_ in "345":
            await memory.put(f"k{id_}", command(id_))
        await elapse(600.0)
        assert robot.begun == ["home", "home"]  # the robot had accepted these
        assert len(memory.commands) >= 3
        back = loop.time()
        direct.away = False
        await memory.set_away(False)
        results = await memory.results(5)
        assert loop.time() - back <= 2.0 * LONGEST_PAUSE
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await store.close()
    assert sorted(result.id or "" for result in results) == list("12345")
    assert all(json.loads(result.text)["success"] for result in results)
    assert robot.begun == ["home"] * 5
    assert memory.commands == {}


@pytest.mark.parametrize("name", ["home", "can_teleop"])
def test_a_result_from_before_a_crash_does_not_refuse_its_command(name: str, tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        await memory.set_away(True)
        await memory.put("k1", command("1", name))
        async with robot.rosbridge(), robot.bridge() as steps:
            await until(lambda: agent.status()["robot"]["connected"])
            await steps.answer(command("1").decode())
            results = robot.bus.node("firebase_bridge").advertise(STEP_RESULT.name, STEP_RESULT.type, queue_size=10)
            results.publish({"data": (await steps.answer(command("1").decode())).text})
            await until(lambda: agent.status()["steps"] == {"1": "result"})
            await memory.set_away(False)
            await until(lambda: not memory.commands)
        (answer,) = [json.loads(result.text) for result in await memory.results(1) if result.key == "k1"]
        expected = (True, None) if name == "home" else (False, str(KeyReused.code))
        assert (answer["success"], answer["code"]) == expected
        assert robot.begun == ["home"]

    told(story, tmp_path)


def test_results_of_steps_that_no_supervisor_sent_do_not_pile_up(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        await memory.set_away(True)
        async with robot.bridge(), robot.rosbridge():
            await until(lambda: agent.status()["robot"]["connected"])
            results = robot.bus.node("firebase_bridge").advertise(STEP_RESULT.name, STEP_RESULT.type, queue_size=10)
            await until(lambda: results.readers)  # the agent subscribes once it knows the robot
            for number in range(1010):
                results.publish({"data": StepEnd(f"s{number}", None, None, dates.now(), dates.now()).text})
                if number % 10 == 9:  # as many as wait
                    await until(lambda: f"s{number}" in agent.status()["steps"])  # noqa: B023 - it is called at once
            assert len(agent.status()["steps"]) == 1000
            await memory.set_away(False)
            assert {one.id for one in await memory.results(1000)} == {f"s{number}" for number in range(10, 1010)}

    told(story, tmp_path)


def test_no_command_reaches_a_robot_with_another_name(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await until(lambda: agent.status()["robot"]["connected"])
        robot.name = "MAYA2"
        await memory.put("k1", command("1"))
        heard: list[Message] = []
        robot.bus.node("other").subscribe(STEP_COMMAND.name, STEP_COMMAND.type, heard.append)
        async with robot.bridge(), robot.rosbridge():
            await until(lambda: agent.status()["robot"]["code"] == WrongRobot.code)
            assert not agent.status()["robot"]["connected"]
            assert "MAYA2" in agent.status()["robot"]["waits_for"]
        assert heard == []
        assert memory.reports == []
        robot.name = "MAYA"
        async with robot.bridge(), robot.rosbridge():
            await memory.results(1)
        assert robot.begun == ["home"]

    told(story, tmp_path)


def test_a_robot_that_becomes_another_one_behind_its_rosbridge_gets_no_command(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        async with robot.rosbridge():
            async with robot.bridge():
                await until(lambda: agent.status()["robot"]["connected"])
            robot.name = "MAYA2"
            async with robot.bridge():
                await until(lambda: agent.status()["robot"]["code"] == WrongRobot.code)
                await memory.put("k1", command("1"))
                await until(lambda: bool(agent.status()["steps"]))
        assert robot.begun == []

    told(story, tmp_path)


def test_a_command_carries_the_name_of_its_robot(tmp_path: Path) -> None:
    async def story(robot: Robot, _: Agent, memory: Memory) -> None:
        heard: list[Message] = []
        robot.bus.node("other").subscribe(STEP_COMMAND.name, STEP_COMMAND.type, heard.append)
        async with robot.bridge(), robot.rosbridge():
            await memory.put("k1", command("1"))
            await memory.put("k2", command("2", robot=None))
            await memory.put("k3", command("3", robot="MAYA2"))
            codes = {result.id: json.loads(result.text)["code"] for result in await memory.results(3)}
        assert {json.loads(message["data"])["robot"] for message in heard} == {"MAYA", "MAYA2"}
        assert codes == {"1": None, "2": None, "3": str(StepOfOtherRobot.code)}
        assert robot.begun == ["home", "home"]

    told(story, tmp_path)


def test_supervisors_wait_until_the_robot_is_known_and_learn_of_a_new_journal(tmp_path: Path) -> None:
    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        async with robot.rosbridge():
            await until(lambda: "firebase_bridge" in str(agent.status()["robot"]["waits_for"]))
            assert memory.journals == []
            async with robot.bridge():
                await until(lambda: agent.status()["supervisors"]["connected"])
            async with robot.bridge():
                await memory.put("k1", command("1"))
                await memory.results(1)
            other = robot.store = await StepStore.open(tmp_path / "other.db")
            async with robot.bridge():
                await until(lambda: len(memory.journals) == 2)
            await other.close()
        assert memory.journals[1] == other.journal != memory.journals[0]

    told(story, tmp_path)


def test_replaced_robot_forgets_unaccepted_commands(tmp_path: Path) -> None:
    class Taken(Memory):
        """Belongs to another robot after it was away."""

        def require_there(self) -> None:
            super().require_there()
            if self.journals[1:]:
                raise SessionTakenOver(where=self.where, name="MAYA")

    async def story(robot: Robot, agent: Agent, memory: Memory) -> None:
        async with robot.bridge(), robot.rosbridge():
            await until(lambda: agent.status()["supervisors"]["connected"])
        await until(lambda: not agent.status()["robot"]["connected"])
        await memory.put("k1", command("1"))
        await until(lambda: agent.status()["steps"] == {"1": "sending"})
        await memory.set_away(True)
        await until(lambda: not agent.status()["supervisors"]["connected"])
        memory.journals.append("another robot's")
        await memory.set_away(False)
        await until(lambda: agent.status()["supervisors"]["code"] == SessionTakenOver.code)
        assert agent.status()["steps"] == {}
        async with robot.bridge(), robot.rosbridge():
            await until(lambda: agent.status()["robot"]["connected"])
        assert robot.begun == []

    told(story, tmp_path, kind=Taken)
