"""The controller layer behind its server, on a bus, in virtual time."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from typing import cast

import pytest

from dmc41x3.twin.wire.server import VirtualController
from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.conversions import path_to_message
from maya_ros.graph.events import EventPublisher, ReportedEvent, read
from maya_ros.graph.protocol import GoalStatus, Message
from maya_ros.graph.servers.controller import ControllerServer
from maya_ros.graph.servers.tasks import FEEDBACK_RATE
from maya_ros.graph.timing import MotionTimer
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.controller.homing import homed_pose
from maya_un.kinematics.workspace import Workspace
from maya_un.machine.truth import StartPose
from maya_un.motion.path import Path
from maya_un.testing.faults import abort_input
from maya_un.testing.rig import rig
from maya_un.values import Joints, Mode, State
from tests.calm import CALM
from tests.graphs import timer_of
from tests.homing_mark import take_over
from tests.virtual_time import elapse, turn

HOMED = homed_pose(Config())
NEAR = homed_pose(Config())._replace(a=0.3)
AWAY = homed_pose(Config())._replace(a=1.5)
TRAJECTORY = "trajectory_msgs/JointTrajectory"


@dataclass
class Behind:
    """A controller behind its server, and a client that has received every event."""

    controller: GalilController
    virtual: VirtualController
    bus: Bus
    client: BusNode
    told: list[ReportedEvent] = field(default_factory=list[ReportedEvent])

    @property
    def words(self) -> list[str]:
        return [told.word for told in self.told]

    async def home(self) -> tuple[GoalStatus, str]:
        ended = await self.client.do("/home", "maya_controller/Home", {})
        return ended.outcome, str(ended.result.get("code"))

    async def move(self, joints: Joints) -> tuple[GoalStatus, str]:
        ended = await self.client.do("/move", "maya_controller/Move", joints._asdict())
        return ended.outcome, str(ended.result.get("code"))

    async def begun(self, joints: Joints) -> asyncio.Task[tuple[GoalStatus, str]]:
        """Begin a move, and return once it is under way."""
        task = asyncio.ensure_future(self.move(joints))
        await self.until("moving")
        return task

    async def until(self, word: str) -> None:
        """Wait for the next event of a word."""
        told = len(self.told)
        for _ in range(10_000):
            if word in self.words[told:]:
                return
            await elapse(0.05)
        raise AssertionError(f"no {word} among {self.words}")

    async def at_rest(self, word: str) -> None:
        """See that nothing moves, and that this was the last event."""
        await elapse(0.1)
        assert self.words[-1] == word
        assert self.told[-1].standing.mode is Mode.IDLE
        assert not self.controller.state.moving

    async def trigger(self, name: str) -> Message:
        return await self.client.call(name, {}, "std_srvs/Trigger")


@asynccontextmanager
async def behind(*, live: bool = False, homed: bool = False, timer: MotionTimer | None = None) -> AsyncIterator[Behind]:
    """Put a controller behind its server; a `homed` one is at the pose where homing ends."""
    bus = Bus()
    client = bus.node("somebody")
    place = homed_pose(CALM)
    async with rig(CALM, start=StartPose(*place) if homed else None, live=live) as layer:
        if homed:
            await take_over(layer.controller, layer.virtual, place)
        async with ControllerServer(layer.controller, timer or timer_of(layer.controller), address="twin").open(
            bus.node("hw_simulator")
        ):
            seen = Behind(layer.controller, layer.virtual, bus, client)
            client.subscribe("/maya_event", "std_msgs/String", lambda event: seen.told.append(read(event["data"])))
            await elapse(0.01)
            yield seen


async def test_home_and_move_succeed_and_every_event_has_the_status() -> None:
    async with behind() as layer:
        assert layer.words == ["not_homed"]
        assert await layer.home() == (GoalStatus.SUCCEEDED, "")
        assert await layer.move(NEAR) == (GoalStatus.SUCCEEDED, "")
        await elapse(0.01)
        assert layer.words == ["not_homed", "homing", "homed", "moving", "idle"]
        modes = [told.standing.mode for told in layer.told]
        assert modes == [Mode.NOT_HOMED, Mode.HOMING, Mode.IDLE, Mode.MOVING, Mode.IDLE]
        assert layer.told[0].standing.strokes is None
        workspace = layer.controller.workspace
        assert layer.told[-1].standing.strokes == (workspace.boom, workspace.line_b, workspace.line_c)
        assert layer.controller.state.joints == pytest.approx(NEAR, abs=1e-3)


async def test_feedback_has_the_phases_of_a_homing_and_the_progress_of_a_motion() -> None:
    async with behind() as layer:
        phases, places = list[Message](), list[Message]()
        await layer.client.do("/home", "maya_controller/Home", {}, phases.append)
        assert phases[0] == {"phase": "homing"}
        assert len({phase["phase"] for phase in phases}) > 3
        before = asyncio.get_running_loop().time()
        await layer.client.do("/move", "maya_controller/Move", AWAY._asdict(), places.append)
        duration = asyncio.get_running_loop().time() - before
        assert len(places) == pytest.approx(duration * FEEDBACK_RATE, rel=0.1)
        progress = [place["progress"] for place in places]
        assert progress == sorted(progress)
        assert progress[-1] > 0.95


@pytest.mark.parametrize(
    ("joints", "code"),
    [
        (AWAY._replace(b=9.0), "2101"),
        (AWAY._replace(c=float("nan")), "4001"),
        (AWAY._replace(c=float("inf")), "4001"),
        (AWAY._replace(a=1e308), "4001"),
    ],
)
async def test_unreachable_target_is_rejected_with_its_code_and_moves_nothing(joints: Joints, code: str) -> None:
    async with behind(homed=True) as layer:
        assert await layer.move(joints) == (GoalStatus.REJECTED, code)
        assert layer.words == ["idle"]


async def test_motion_before_homing_is_rejected() -> None:
    async with behind() as layer:
        assert await layer.move(NEAR) == (GoalStatus.REJECTED, "2103")


async def test_a_second_goal_is_rejected_and_the_first_unharmed() -> None:
    async with behind(homed=True) as layer:
        first = await layer.begun(AWAY)
        assert await layer.move(NEAR) == (GoalStatus.REJECTED, "2104")
        assert await layer.home() == (GoalStatus.REJECTED, "2104")
        assert "2104: " in (await layer.client.call("/gripper", {"data": True}))["message"]
        assert await first == (GoalStatus.SUCCEEDED, "")
        assert layer.controller.state.joints == pytest.approx(AWAY, abs=1e-3)


async def test_a_cancel_stops_on_the_path() -> None:
    async with behind(homed=True) as layer:
        moving = await layer.begun(AWAY)
        await elapse(1.0)
        layer.client.advertise("/move/cancel", "actionlib_msgs/GoalID").publish({})
        assert await moving == (GoalStatus.PREEMPTED, "2202")
        await layer.at_rest("stopped")
        a, b, c = layer.controller.state.joints or (0.0, 0.0, 0.0)
        assert NEAR.a < a + 0.3 < AWAY.a + 0.3
        assert (b, c) == pytest.approx(AWAY[1:], abs=1e-3)


@pytest.mark.parametrize("name", ["/controller/stop", "/controller/abort"])
async def test_a_stop_ends_the_goal_of_another(name: str) -> None:
    async with behind(homed=True) as layer:
        moving = await layer.begun(AWAY)
        await elapse(1.0)
        answer = await layer.trigger(name)
        assert answer["success"]
        outcome, code = await moving
        assert (outcome, code) == (GoalStatus.PREEMPTED, "2201")
        if name == "/controller/stop":
            report = json.loads(answer["message"])
            assert report["was_moving"]
            assert report["duration"] > 0.0
            assert report["distance"][0] > 0.0


async def test_client_that_dies_stops_its_motion() -> None:
    async with behind(homed=True) as layer:
        other = layer.bus.node("other")
        task = asyncio.ensure_future(other.do("/move", "maya_controller/Move", AWAY._asdict()))
        await layer.until("moving")
        other.close()
        assert (await task).outcome is GoalStatus.LOST
        await layer.until("stopped")
        await layer.at_rest("stopped")
        assert await layer.move(NEAR) == (GoalStatus.SUCCEEDED, "")


async def test_closing_server_stops_the_motion() -> None:
    async with rig() as layer:
        await layer.controller.home()
        bus = Bus()
        client = bus.node("somebody")
        async with ControllerServer(layer.controller, timer_of(layer.controller)).open(bus.node("hw_simulator")):
            task = asyncio.ensure_future(client.do("/move", "maya_controller/Move", AWAY._asdict()))
            await elapse(2.0)
            assert layer.controller.state.mode is Mode.MOVING
        assert layer.controller.state.mode is Mode.IDLE
        ended = await task
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.PREEMPTED, "2202")
        assert await bus.directory.services() == {}


async def test_a_path_is_followed_in_every_space_and_takes_the_time_it_is_to_take() -> None:
    async with behind(homed=True) as layer:
        here = layer.controller.mechanism.fk(HOMED)
        there = here._replace(z=here.z + 0.1)
        path = Path.line(here, there._replace(z=here.z + 0.05), there)
        least = 2.0 * layer.controller.preview(path).duration
        goal = {"trajectory": path_to_message(path, least)}
        before = asyncio.get_running_loop().time()
        ended = await layer.client.do("/controller/follow", "maya_controller/Follow", goal)
        assert ended.outcome is GoalStatus.SUCCEEDED
        assert least <= asyncio.get_running_loop().time() - before < 1.1 * least
        assert layer.controller.state.point == pytest.approx(there, abs=1e-3)


class SlowTimer:
    """Computes the speed of a path as long as a test wants."""

    def __init__(self) -> None:
        self.asked = 0
        self.computed = asyncio.Event()

    async def speed_for(self, _path: Path, _least: float) -> float:
        self.asked += 1
        await self.computed.wait()
        return 1.0


@pytest.mark.parametrize("fault", [False, True])
async def test_a_stop_or_a_fault_while_a_speed_is_computed_ends_the_motion(*, fault: bool) -> None:
    timer = SlowTimer()
    async with behind(homed=True, live=True, timer=cast("MotionTimer", timer)) as layer:
        goal = {"trajectory": path_to_message([HOMED, AWAY], 30.0)}
        task = asyncio.ensure_future(layer.client.do("/controller/follow", "maya_controller/Follow", goal))
        await elapse(0.1)
        assert timer.asked == 1
        assert await layer.move(NEAR) == (GoalStatus.REJECTED, "2104")
        if fault:
            with abort_input(layer.virtual):
                await elapse(0.5)
            assert (await layer.trigger("/controller/recover"))["success"]
        else:
            assert (await layer.trigger("/controller/stop"))["success"]
        timer.computed.set()
        ended = await task
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.RECALLED, "2201")
        assert "moving" not in layer.words


async def test_a_path_that_starts_elsewhere_is_refused() -> None:
    async with behind(homed=True) as layer:
        goal = {"trajectory": path_to_message([NEAR, AWAY])}
        ended = await layer.client.do("/controller/follow", "maya_controller/Follow", goal)
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.REJECTED, "2107")
        nonsense = {"trajectory": {"joint_names": ["x"]}}
        ended = await layer.client.do("/controller/follow", "maya_controller/Follow", nonsense)
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.REJECTED, "4018")


async def test_path_on_the_topic_is_followed_and_its_refusal_is_an_event() -> None:
    async with behind(homed=True) as layer:
        command = layer.client.advertise("/controller/command", TRAJECTORY)
        command.publish(path_to_message([HOMED, AWAY]))
        await layer.until("moving")
        command.publish(path_to_message([HOMED, NEAR]))
        await layer.until("refused")
        assert (layer.told[-1].code, layer.told[-1].detail["topic"]) == (2104, "/controller/command")
        assert "follow" in str(layer.told[-1].detail["message"])
        assert layer.told[-1].standing.mode is Mode.MOVING
        await layer.until("idle")
        assert layer.controller.state.joints == pytest.approx(AWAY, abs=1e-3)
        command.publish(path_to_message([NEAR, AWAY]))
        await elapse(0.1)
        assert (layer.words[-1], layer.told[-1].code) == ("refused", 2107)


async def test_newest_of_many_fast_speeds_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    async with behind() as layer:
        asked, override = list[float](), layer.controller.override

        async def slowly(ratio: float) -> None:
            asked.append(ratio)
            await elapse(0.1)
            await override(ratio)

        monkeypatch.setattr(layer.controller, "override", slowly)
        speed = layer.client.advertise("/controller/speed", "std_msgs/Float64")
        for percent in range(10, 60):
            speed.publish({"data": percent / 100.0})
            await turn()
        await elapse(1.0)
        assert (asked, layer.controller.state.override) == ([0.1, 0.59], 0.59)
        speed.publish({"data": 0.7})
        await elapse(1.0)
        assert layer.controller.state.override == 0.7


async def test_speed_pause_and_resume_go_by_topic_and_service() -> None:
    async with behind(homed=True) as layer:
        speed = layer.client.advertise("/controller/speed", "std_msgs/Float64")
        speed.publish({"data": 0.5})
        await elapse(0.1)
        speed.publish({"data": 7.0})
        await elapse(0.1)
        assert [(told.word, told.code) for told in layer.told[1:]] == [("speed", 0), ("refused", 4001)]
        assert layer.told[-1].standing.override == 0.5
        refused = await layer.trigger("/controller/pause")
        assert refused["message"].startswith("2111: ")
        moving = await layer.begun(AWAY)
        await elapse(1.0)
        report = json.loads((await layer.trigger("/controller/pause"))["message"])
        assert report["was_moving"]
        await elapse(30.0)
        assert not moving.done()
        assert layer.told[-1].standing.mode is Mode.PAUSED
        assert (await layer.trigger("/controller/resume"))["success"]
        assert await moving == (GoalStatus.SUCCEEDED, "")
        assert (await layer.trigger("/controller/resume"))["message"].startswith("2112: ")


async def test_the_gripper_answers_and_its_new_state_is_an_event() -> None:
    async with behind() as layer:
        for open_, word in ((False, "gripper_closed"), (True, "gripper_open")):
            assert await layer.client.call("/gripper", {"data": open_}) == {"success": True, "message": ""}
            await elapse(0.01)
            assert layer.words[-1] == word
            assert layer.told[-1].standing.gripper_closed is not open_


async def test_a_fault_is_named_and_recovered_from() -> None:
    async with behind(live=True) as layer:
        assert (await layer.trigger("/controller/recover"))["message"].startswith("2108: ")
        homing = asyncio.ensure_future(layer.home())
        await elapse(1.0)
        with abort_input(layer.virtual):
            assert await homing == (GoalStatus.ABORTED, "2303")
            await elapse(0.1)
            assert (await layer.trigger("/controller/recover"))["message"].startswith("2303: ")
        assert layer.told[-1].standing.fault is not None
        assert layer.told[-1].standing.fault.code == layer.told[-1].code == 2303
        assert await layer.home() == (GoalStatus.REJECTED, "2105")
        assert (await layer.trigger("/controller/recover"))["success"]
        await elapse(0.1)
        assert "recovered" in layer.words
        assert layer.told[-1].standing.fault is None


async def test_late_subscriber_gets_the_status_and_diagnostics() -> None:
    async with behind(homed=True) as layer:
        await layer.move(NEAR)
        late, heard = layer.bus.node("late"), list[Message]()
        late.subscribe("/maya_event", "", heard.append)
        diagnostics = list[Message]()
        late.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", diagnostics.append)
        await elapse(5.0)
        assert [read(message["data"]).word for message in heard] == ["idle"]
        assert read(heard[0]["data"]).standing.strokes is not None
        assert len(diagnostics) == pytest.approx(5, abs=1)
        names = [status["name"] for status in diagnostics[0]["status"]]
        assert names == ["maya: controller", "maya: axes"]


async def test_change_without_an_event_is_published_when_seen_twice() -> None:
    async with rig() as layer:
        bus = Bus()
        heard = list[str]()
        bus.node("x").subscribe("/maya_event", "std_msgs/String", lambda message: heard.append(message["data"]))
        stands = Stands(layer.controller.state, layer.controller.workspace)
        teller = EventPublisher(stands, bus.node("y").advertise("/maya_event", "std_msgs/String", latch=True))
        teller.look()
        stands.state = replace(stands.state, mode=Mode.IDLE, homed=True)
        teller.look()
        teller.look()
        teller.look()
        await elapse(0.0)
        assert [read(text).word for text in heard] == ["not_homed", "idle"]


@dataclass
class Stands:
    state: State
    workspace: Workspace
