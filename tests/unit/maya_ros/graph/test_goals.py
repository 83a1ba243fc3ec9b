"""Goals by the topics of ROS 1, as roslib's ActionClient speaks them, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from dmc41x3.loops import JumpingLoop
from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.goals import KEPT, MANY, MOST, PERIOD
from maya_ros.graph.outcome import ENDED, failure
from maya_ros.graph.protocol import Feedback, GoalRefused, GoalStatus, GraphHandle, Message
from maya_un.errors import MayaError, NotHomed, Stopped
from tests.virtual_time import elapse

MOVE = "maya_controller/Move"
DONE = {"success": True, "code": "", "message": ""}


@dataclass
class Acts:
    """A server whose goals end as scripted: by the `a` of the goal."""

    ways: dict[float, asyncio.Future[Message]] = field(default_factory=dict[float, asyncio.Future[Message]])
    feedbacks: dict[float, Feedback] = field(default_factory=dict[float, Feedback])
    rest: float = 0.0

    async def __call__(self, goal: Message, feedback: Feedback) -> Message:
        self.feedbacks[goal["a"]] = feedback
        self.ways[goal["a"]] = asyncio.get_running_loop().create_future()
        try:
            return await self.ways[goal["a"]]
        except asyncio.CancelledError:
            await elapse(self.rest)
            raise


@dataclass
class Line:
    """A client that speaks the five topics."""

    bus: Bus
    acts: Acts
    server: GraphHandle
    results: list[Message] = field(default_factory=list[Message])
    statuses: list[list[Message]] = field(default_factory=list[list[Message]])
    feedbacks: list[Message] = field(default_factory=list[Message])
    client: BusNode = field(init=False)

    def __post_init__(self) -> None:
        self.client = self.bus.node("web")
        self._goals = self.client.advertise("/move/goal", f"{MOVE}ActionGoal")
        self._cancels = self.client.advertise("/move/cancel", "actionlib_msgs/GoalID")
        listen = self.client.subscribe
        listen("/move/result", f"{MOVE}ActionResult", self.results.append)
        listen("/move/feedback", f"{MOVE}ActionFeedback", self.feedbacks.append)
        listen("/move/status", "", lambda message: self.statuses.append(message["status_list"]))

    def send(self, id_: str, a: float = 1.0, secs: int = 0) -> None:
        self._goals.publish({"goal_id": {"id": id_, "stamp": {"secs": secs, "nsecs": 0}}, "goal": {"a": a}})

    def cancel(self, id_: str = "", secs: int = 0) -> None:
        self._cancels.publish({"id": id_, "stamp": {"secs": secs, "nsecs": 0}})

    def outcomes(self) -> dict[str, GoalStatus]:
        return {status["goal_id"]["id"]: GoalStatus(status["status"]) for status in self.statuses[-1]}

    def course(self, id_: str) -> list[GoalStatus]:
        """Return through which states a goal has gone, each once."""
        seen: list[GoalStatus] = []
        for statuses in self.statuses:
            for status in statuses:
                if status["goal_id"]["id"] == id_ and (not seen or seen[-1] != status["status"]):
                    seen.append(GoalStatus(status["status"]))
        return seen


@asynccontextmanager
async def line(rest: float = 0.0, since: float = 0.0) -> AsyncIterator[Line]:
    loop = asyncio.get_running_loop()
    bus, acts = Bus(lambda: since + loop.time()), Acts(rest=rest)
    server = bus.node("server").act("/move", MOVE, acts)
    yield Line(bus, acts, server)
    server.close()
    await elapse(5.0)


async def test_a_goal_is_pending_until_it_begins_and_succeeds() -> None:
    async with line() as link:
        link.send("one", 2.0)
        await elapse(0.01)
        assert link.outcomes() == {"one": GoalStatus.PENDING}
        link.acts.feedbacks[2.0]({"a": 0.5, "progress": 0.25})
        await elapse(0.01)
        assert link.outcomes() == {"one": GoalStatus.ACTIVE}
        link.acts.ways[2.0].set_result(DONE)
        await elapse(0.01)
        assert [result["result"] for result in link.results] == [DONE]
        assert link.results[0]["status"] == {
            "goal_id": {"id": "one", "stamp": link.results[0]["status"]["goal_id"]["stamp"]},
            "status": GoalStatus.SUCCEEDED,
            "text": "",
        }
        assert link.feedbacks[0]["feedback"] == {"a": 0.5, "b": 0.0, "c": 0.0, "progress": 0.25}
        assert link.feedbacks[0]["status"]["status"] == GoalStatus.ACTIVE


async def test_goal_that_ends_without_feedback_was_active() -> None:
    async with line() as link:
        link.send("one")
        await elapse(0.01)
        link.acts.ways[1.0].set_result(DONE)
        await elapse(0.01)
        assert link.course("one") == [GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.SUCCEEDED]


@pytest.mark.parametrize(
    ("begun", "error", "course"),
    [
        (False, GoalRefused(failure(NotHomed(command="maya home"))), [GoalStatus.PENDING, GoalStatus.REJECTED]),
        (
            True,
            GoalRefused(failure(NotHomed(command="maya home"))),
            [GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.ABORTED],
        ),
        (False, NotHomed(command="maya home"), [GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.ABORTED]),
        (True, NotHomed(command="maya home"), [GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.ABORTED]),
        (True, Stopped(), [GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTED]),
        (False, Stopped(), [GoalStatus.PENDING, GoalStatus.RECALLED]),
    ],
)
async def test_error_decides_the_status_of_a_goal(begun: bool, error: Exception, course: list[GoalStatus]) -> None:
    async with line() as link:
        link.send("one")
        await elapse(0.01)
        if begun:
            link.acts.feedbacks[1.0]({})
            await elapse(0.01)
        link.acts.ways[1.0].set_exception(error)
        await elapse(0.01)
        assert link.course("one") == course
        code = str(error.code) if isinstance(error, MayaError) else "2103"
        assert link.results[0]["result"]["code"] == code
        assert link.results[0]["status"]["text"] == link.results[0]["result"]["message"] != ""


async def test_a_cancel_by_its_id_preempts_it_once_all_is_at_rest() -> None:
    async with line(rest=3.0) as link:
        link.send("one", 1.0)
        link.send("two", 2.0)
        await elapse(0.01)
        link.acts.feedbacks[1.0]({})
        link.cancel("one")
        await elapse(1.0)
        assert link.outcomes() == {"one": GoalStatus.PREEMPTING, "two": GoalStatus.PENDING}
        link.cancel("one")  # once more must not cut the braking short
        link.cancel()  # nor all of them
        await elapse(1.0)
        assert link.outcomes() == {"one": GoalStatus.PREEMPTING, "two": GoalStatus.RECALLING}
        await elapse(3.0)
        assert link.outcomes() == {"one": GoalStatus.PREEMPTED, "two": GoalStatus.RECALLED}
        assert [result["result"]["code"] for result in link.results] == ["2202", "2202"]


async def test_a_goal_that_is_cancelled_in_the_same_breath_never_begins() -> None:
    async with line() as link:
        link.send("one")
        link.cancel("one")
        await elapse(0.01)
        assert link.outcomes() == {"one": GoalStatus.RECALLED}
        assert link.acts.ways == {}


async def test_cancel_before_its_goal_is_kept_for_it() -> None:
    async with line() as link:
        link.cancel("one")
        await elapse(0.01)
        assert link.outcomes() == {"one": GoalStatus.RECALLING}
        link.send("one")
        await elapse(0.01)
        assert link.outcomes() == {"one": GoalStatus.RECALLED}
        assert link.results[0]["status"]["status"] == GoalStatus.RECALLED
        assert link.acts.ways == {}


async def test_cancel_by_time_ends_earlier_and_late_goals() -> None:
    async with line(since=1000.0) as link:
        link.send("old", 1.0, secs=100)
        link.send("new", 2.0, secs=200)
        await elapse(0.01)
        link.cancel(secs=150)
        await elapse(0.01)
        assert link.outcomes() == {"old": GoalStatus.RECALLED, "new": GoalStatus.PENDING}
        link.send("late", 3.0, secs=150)
        link.send("later", 4.0, secs=151)
        await elapse(0.01)
        assert link.outcomes()["late"] is GoalStatus.RECALLED
        assert link.outcomes()["later"] is GoalStatus.PENDING
        assert 3.0 not in link.acts.ways


async def test_cancel_from_the_future_ends_present_goals_only() -> None:
    async with line(since=1000.0) as link:
        link.send("before", 1.0)
        await elapse(1.0)
        link.cancel(secs=4_000_000_000)
        await elapse(0.01)
        assert link.outcomes() == {"before": GoalStatus.RECALLED}
        await elapse(1.0)
        link.send("after", 2.0, secs=1002)
        link.send("too late", 3.0, secs=1000)
        await elapse(0.01)
        assert link.outcomes()["after"] is GoalStatus.PENDING
        assert link.outcomes()["too late"] is GoalStatus.RECALLED


async def test_repeated_goal_runs_once() -> None:
    async with line() as link:
        link.send("one")
        link.send("one")
        await elapse(0.01)
        link.acts.ways[1.0].set_result(DONE)
        await elapse(0.01)
        link.send("one")
        await elapse(0.01)
        assert len(link.results) == 1


async def test_flood_of_goals_and_cancels_is_published_by_the_clock_and_bounded() -> None:
    async with line() as link:
        link.send("running", 0.5)
        await elapse(0.01)
        link.acts.feedbacks[0.5]({})
        for number in range(500):
            link.cancel(f"unknown {number}")
            link.send(f"unknown {number}", 1.0)
            if number % 50 == 0:
                await elapse(1e-4)
        await elapse(1e-4)
        assert len(link.results) == 500
        assert {message["result"]["code"] for message in link.results} == {"2202"}
        assert len(link.statuses) < 4 * MANY
        await elapse(PERIOD)
        assert link.outcomes()["running"] is GoalStatus.ACTIVE
        assert len(link.outcomes()) == MOST + 1
        link.cancel()
        await elapse(KEPT + 0.1)
        assert link.results[-1]["status"]["goal_id"]["id"] == "running"
        assert link.results[-1]["status"]["status"] == GoalStatus.PREEMPTED
        await elapse(PERIOD)
        assert link.outcomes() == {}


async def test_a_goal_without_a_name_gets_one() -> None:
    async with line() as link:
        link.send("")
        await elapse(0.01)
        (name,) = link.outcomes()
        assert name
        link.cancel(name)
        await elapse(0.01)
        assert link.outcomes() == {name: GoalStatus.RECALLED}


async def test_ended_goal_is_in_the_status_for_five_seconds_at_5_hz() -> None:
    async with line() as link:
        link.send("one")
        await elapse(0.01)
        link.acts.ways[1.0].set_result(DONE)
        await elapse(0.01)
        before = len(link.statuses)
        await elapse(KEPT - 0.1)
        assert link.outcomes() == {"one": GoalStatus.SUCCEEDED}
        assert len(link.statuses) - before == pytest.approx(KEPT / PERIOD, abs=2)
        await elapse(0.2)
        assert link.outcomes() == {}
        await elapse(1.0)
        told = len(link.statuses)
        await elapse(60.0)
        assert len(link.statuses) == told


async def test_late_subscriber_gets_the_status_of_all_goals() -> None:
    async with line() as link:
        heard: list[Message] = []
        link.bus.node("late").subscribe("/move/status", "", heard.append)
        await elapse(0.01)
        assert [message["status_list"] for message in heard] == [[]]


async def test_feedback_after_the_end_is_nobodys() -> None:
    async with line() as link:
        link.send("one")
        await elapse(0.01)
        link.acts.ways[1.0].set_result(DONE)
        await elapse(0.01)
        link.acts.feedbacks[1.0]({})
        await elapse(0.01)
        assert link.feedbacks == []


async def test_closing_server_cancels_and_still_reports_the_result() -> None:
    async with line(rest=2.0) as link:
        link.send("one")
        await elapse(0.01)
        link.acts.feedbacks[1.0]({})
        link.server.close()
        link.server.close()
        link.send("two", 2.0)
        await elapse(3.0)
        assert [result["status"]["status"] for result in link.results] == [GoalStatus.PREEMPTED]
        assert 2.0 not in link.acts.ways


async def test_defect_of_the_server_is_reported_as_a_defect() -> None:
    async with line() as link:
        told: list[dict[str, Any]] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        link.send("one")
        await elapse(0.01)
        link.acts.ways[1.0].set_exception(ZeroDivisionError())
        await elapse(0.01)
        assert link.results[0]["result"]["code"] == "5999"
        assert isinstance(told[0]["exception"], ZeroDivisionError)


async def test_goals_of_a_client_that_vanished_are_cancelled_and_no_others() -> None:
    async with line() as link:
        other = link.bus.node("other")
        goals = other.advertise("/move/goal", f"{MOVE}ActionGoal")
        goals.publish({"goal_id": {"id": "deaf"}, "goal": {"a": 2.0}})  # it never listened, so nobody misses it
        link.send("one")
        await elapse(0.01)
        link.client.close()
        other.close()
        await elapse(0.01)
        assert link.acts.ways[1.0].cancelled()
        assert not link.acts.ways[2.0].done()


class GoalsMachine(RuleBasedStateMachine):
    """Goals and cancels in any order: no goal leaves its graph of states, each ends once, none is acted on twice."""

    def __init__(self) -> None:
        super().__init__()
        self.loop = JumpingLoop()
        self.sent: set[str] = set()
        self.begun: set[str] = set()
        self.told: dict[str, GoalStatus] = {}

    @initialize()
    def begin(self) -> None:
        async def made() -> Line:
            bus, acts = Bus(), Acts(rest=0.5)
            return Line(bus, acts, bus.node("server").act("/move", MOVE, acts))

        self.line = self.loop.run_until_complete(made())

    def teardown(self) -> None:
        async def over() -> None:
            self.line.server.close()
            await elapse(1.0)

        if hasattr(self, "line"):
            self.loop.run_until_complete(over())
        self.loop.close()

    def do(self, work: Any) -> None:
        async def done() -> None:
            work()

        self.loop.run_until_complete(done())

    @rule(number=st.integers(0, 5), secs=st.integers(0, 3))
    def send(self, number: int, secs: int) -> None:
        self.sent.add(f"goal {number}")
        self.do(lambda: self.line.send(f"goal {number}", float(number), secs))

    @rule(number=st.integers(0, 5))
    def cancel(self, number: int) -> None:
        self.do(lambda: self.line.cancel(f"goal {number}"))

    @rule(secs=st.integers(0, 3))
    def cancel_until(self, secs: int) -> None:
        self.do(lambda: self.line.cancel(secs=secs))

    @rule(time=st.sampled_from([0.0, 0.1, 1.0]))
    def wait(self, time: float) -> None:
        self.loop.run_until_complete(elapse(time))

    @precondition(lambda self: self.line.acts.ways)
    @rule(data=st.data(), end=st.sampled_from(["feedback", "done", "refused", "failed"]))
    def go_on(self, data: st.DataObject, end: str) -> None:
        a = data.draw(st.sampled_from(sorted(self.line.acts.ways)))
        way = self.line.acts.ways[a]
        if way.done():
            return
        match end:
            case "feedback":
                self.begun.add(f"goal {a:.0f}")
                self.do(lambda: self.line.acts.feedbacks[a]({}))
            case "done":
                self.do(lambda: way.set_result(DONE))
            case "refused":
                self.do(lambda: way.set_exception(GoalRefused(failure(NotHomed(command="maya home")))))
            case _:
                self.do(lambda: way.set_exception(NotHomed(command="maya home")))

    @invariant()
    def states_follow_one_another_as_in_actionlib(self) -> None:
        self.loop.run_until_complete(elapse(0))
        for statuses in self.line.statuses:
            for status in statuses:
                name, outcome = status["goal_id"]["id"], GoalStatus(status["status"])
                before = self.told.get(name)
                if before is not None and before is not outcome and before not in ENDED:
                    assert outcome in FOLLOW[before], (name, before, outcome)
                self.told[name] = outcome
        self.line.statuses.clear()

    @invariant()
    def each_ends_once_and_only_what_was_sent(self) -> None:
        for result in self.line.results:
            assert result["status"]["goal_id"]["id"] in self.sent
            assert GoalStatus(result["status"]["status"]) in ENDED
        self.line.results.clear()


FOLLOW = {
    GoalStatus.PENDING: {GoalStatus.ACTIVE, GoalStatus.RECALLING, GoalStatus.REJECTED, GoalStatus.RECALLED},
    GoalStatus.ACTIVE: {GoalStatus.PREEMPTING, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.PREEMPTED},
    GoalStatus.RECALLING: {GoalStatus.PREEMPTING, GoalStatus.REJECTED, GoalStatus.RECALLED},
    GoalStatus.PREEMPTING: {GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED},
}
"""Allowed transitions (wiki.ros.org/actionlib/DetailedDescription, the server's states)."""

TestGoalsMachine = GoalsMachine.TestCase
TestGoalsMachine.settings = settings(max_examples=30, stateful_step_count=30, deadline=None)
