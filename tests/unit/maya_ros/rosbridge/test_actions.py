"""Actions by the operations of the newer protocol: goals that clients send, and those that they carry out."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from maya_ros.graph.outcome import failure
from maya_ros.graph.protocol import Feedback, GoalRefused, GoalResult, GoalStatus, Message
from maya_ros.rosbridge.limits import UNDER_WAY
from maya_un.errors import Busy, Cancelled, NotHomed
from tests.rosbridge_clients import BusClient, ClientBus, Said, client_bus, settled

TASK = "maya_robot/Task"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
DONE = {"success": True, "code": "", "message": ""}


class Acting:
    """Serves /task; a command contains the end of its goal."""

    def __init__(self, one: ClientBus) -> None:
        self.begun = 0
        self.cancelled = 0
        self.finishes = asyncio.Event()
        one.robot.act("/task", TASK, self.act)

    async def act(self, goal: Message, feedback: Feedback) -> Message:
        self.begun += 1
        command = goal["task"]["command"]
        if command == "refused":
            raise GoalRefused(failure(Busy(doing="another")))
        feedback({"phase": command, "progress": 0.5})
        if command == "fails":
            raise NotHomed(command="maya home")
        if command == "waits":
            try:
                await asyncio.Event().wait()
            finally:
                self.cancelled += 1
        if command == "too late":
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                return DONE
        return DONE


def goal(command: str) -> Said:
    return {"action": "/task", "action_type": TASK, "args": {"task": {"command": command}}}


async def test_a_goal_has_feedback_and_a_result() -> None:
    async with client_bus() as one:
        Acting(one)
        told = await one.talker().ask("send_action_goal", id="g", feedback=True, **goal("home"))
        feedback, result = told
        assert feedback["op"] == "action_feedback"
        assert (feedback["id"], feedback["action"], feedback["values"]["phase"]) == ("g", "/task", "home")
        assert result == {
            "op": "action_result", "id": "g", "action": "/task", "values": DONE, "status": SUCCEEDED, "result": True,
        }  # fmt: skip


async def test_feedback_goes_only_to_its_client_and_the_type_of_a_row_is_known() -> None:
    async with client_bus() as one:
        Acting(one)
        told = await one.talker().ask("send_action_goal", action="task", args=goal("home")["args"])
        assert [message["op"] for message in told] == ["action_result"]
        assert told[0]["action"] == "task"


async def test_a_goal_that_fails_says_why() -> None:
    async with client_bus() as one:
        Acting(one)
        (told,) = await one.talker().ask("send_action_goal", id="g", **goal("fails"))
        assert (told["status"], told["result"], told["values"]["code"]) == (ABORTED, True, "2103")


async def test_a_goal_that_is_refused_was_not_carried_out() -> None:
    async with client_bus() as one:
        Acting(one)
        (told,) = await one.talker().ask("send_action_goal", id="g", **goal("refused"))
        assert (told["result"], told["status"]) == (False, 0)
        assert told["values"].startswith("2104: ")


async def test_a_goal_that_is_cancelled_ends_as_its_server_says() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        assert await talker.ask("send_action_goal", id="g", **goal("waits")) == []
        (told,) = await talker.ask("cancel_action_goal", action="/task", id="g")
        assert (told["id"], told["status"], told["result"], told["values"]["code"]) == ("g", CANCELED, True, "2202")
        assert acting.cancelled == 1


async def test_goal_that_is_cancelled_before_it_begins_ends_and_counts_no_longer() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        cancelled = {"action": "/task", "values": failure(Cancelled()), "status": CANCELED, "result": True}
        for _ in range(UNDER_WAY + 1):
            talker.say("send_action_goal", id="g", **goal("waits"))
            talker.say("cancel_action_goal", id="g", action="/task")
            assert await talker.told() == [{"op": "action_result", "id": "g", **cancelled}]
        talker.say("send_action_goal", id="g", action="/own", action_type="nothing/Known", args={})
        (told,) = await talker.ask("cancel_action_goal", id="g", action="/own")
        assert (told["op"], told["id"], told["result"]) == ("action_result", "g", False)
        assert acting.begun == 0
        (told,) = await talker.ask("send_action_goal", id="g", **goal("home"))
        assert told["status"] == SUCCEEDED


async def test_late_cancel_is_answered_with_the_success() -> None:
    async with client_bus() as one:
        Acting(one)
        talker = one.talker()
        await talker.ask("send_action_goal", id="g", **goal("too late"))
        (told,) = await talker.ask("cancel_action_goal", action="/task", id="g")
        assert (told["status"], told["values"]) == (SUCCEEDED, DONE)


async def test_goals_of_a_client_that_goes_are_cancelled() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        await talker.ask("send_action_goal", **goal("waits"))
        await one.leave(talker)
        assert acting.cancelled == 1


async def test_goal_without_a_server_is_reported() -> None:
    async with client_bus() as one:
        (told,) = await one.talker().ask("send_action_goal", id="g", **goal("home"))
        assert (told["op"], told["result"]) == ("action_result", False)
        assert told["values"].startswith("1011: ")


@pytest.mark.parametrize(
    ("op", "message", "kind"),
    [
        ("send_action_goal", {"action": "/unknown"}, "action_result"),
        ("send_action_goal", {"action": "/task", "args": 5}, "action_result"),
        ("send_action_goal", {"action": "/task", "args": {"nothing": 1}}, "action_result"),
        ("send_action_goal", {"action": "/task", "action_type": "maya_robot/Nothing"}, "action_result"),
        ("cancel_action_goal", {"action": "/task", "id": "unknown"}, "status"),
        ("cancel_action_goal", {"action": "/home", "id": "g"}, "status"),
    ],
)
async def test_invalid_goal_is_reported_and_begins_nothing(op: str, message: Said, kind: str) -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        await talker.ask("send_action_goal", id="g", **goal("waits"))
        assert [told["op"] for told in await talker.ask(op, **message)] == [kind]
        assert (acting.begun, acting.cancelled) == (1, 0)


async def test_a_second_goal_of_the_same_name_is_refused_and_the_first_unharmed() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        await talker.ask("send_action_goal", id="g", **goal("waits"))
        assert [told["code"] for told in await talker.ask("send_action_goal", id="g", **goal("home"))] == [4005]
        assert acting.cancelled == 0


async def test_a_client_has_only_so_many_goals_under_way() -> None:
    async with client_bus() as one:
        Acting(one)
        talker = one.talker()
        for number in range(UNDER_WAY + 1):
            talker.say("send_action_goal", id=number, **goal("waits"))
        (told,) = await talker.told()
        assert (told["id"], told["result"]) == (UNDER_WAY, False)


async def carrying_out(one: ClientBus) -> BusClient:
    server = one.talker()
    assert await server.ask("advertise_action", action="/mine", type=TASK) == []
    return server


def requested(one: ClientBus, feedback: Feedback | None = None) -> asyncio.Task[GoalResult]:
    return asyncio.ensure_future(one.robot.do("/mine", TASK, {"task": {"command": "pick"}}, feedback))


async def test_a_client_carries_a_goal_out_for_others() -> None:
    async with client_bus() as one:
        server, feedbacks = await carrying_out(one), list[Message]()
        ended = requested(one, feedbacks.append)
        (told,) = await server.told()
        assert (told["op"], told["action"], told["action_type"], told["feedback"]) == (
            "send_action_goal", "/mine", TASK, True,
        )  # fmt: skip
        assert told["args"]["task"]["command"] == "pick"
        same = {"id": told["id"], "action": "/mine"}
        server.say("action_feedback", **same, values={"progress": 0.25})
        await settled()
        assert [feedback["progress"] for feedback in feedbacks] == [0.25]
        server.say("action_result", **same, values={"success": True}, status=SUCCEEDED, result=True)
        assert await ended == GoalResult(GoalStatus.SUCCEEDED, DONE)


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [
        ({"values": "broken", "result": False}, GoalStatus.ABORTED),
        ({"status": ABORTED, "values": {}, "result": True}, GoalStatus.ABORTED),
        ({"status": CANCELED, "values": {}, "result": True}, GoalStatus.PREEMPTED),
        ({"values": {"success": False}}, GoalStatus.ABORTED),
    ],
)
async def test_client_reports_the_end_of_a_goal(answer: Said, outcome: GoalStatus) -> None:
    async with client_bus() as one:
        server = await carrying_out(one)
        ended = requested(one)
        (told,) = await server.told()
        server.say("action_feedback", id=told["id"], action="/mine", values={})
        server.say("action_result", id=told["id"], action="/mine", **answer)
        assert (await ended).outcome is outcome


async def test_client_learns_that_its_goal_is_cancelled_and_awaited() -> None:
    async with client_bus() as one:
        server = await carrying_out(one)
        ended = requested(one)
        (begun,) = await server.told()
        server.say("action_feedback", id=begun["id"], action="/mine", values={})
        await settled()
        ended.cancel()
        (told,) = await server.told()
        assert told == {"op": "cancel_action_goal", "id": begun["id"], "action": "/mine"}
        assert not ended.done()
        server.say("action_result", id=begun["id"], action="/mine", status=CANCELED, result=True)
        await asyncio.wait({ended})
        assert ended.cancelled()


@pytest.mark.parametrize("leaves", [True, False])
async def test_caller_learns_that_the_serving_client_left(leaves: bool) -> None:
    async with client_bus() as one:
        server = await carrying_out(one)
        ended = requested(one)
        await settled()
        if leaves:
            await one.leave(server)
        else:
            await server.ask("unadvertise_action", action="/mine")
        assert (await ended).outcome not in (GoalStatus.SUCCEEDED, GoalStatus.ACTIVE)
        assert "/mine/goal" not in await one.bus.directory.topics()


@pytest.mark.parametrize("name", ["/task", "/home", "/theirs"])
async def test_action_of_another_server_cannot_be_taken(name: str) -> None:
    async def never(_: Message, __: Feedback) -> Message:
        return {}

    async with client_bus() as one:
        one.robot.act("/theirs", TASK, never)
        told = await one.talker().ask("advertise_action", action=name, type=TASK)
        assert [status["code"] for status in told] == [4005]


@pytest.mark.parametrize(
    ("op", "message"),
    [
        ("action_feedback", {"action": "/mine", "id": "no"}),
        ("action_feedback", {"action": "/other", "id": "no"}),
        ("action_result", {"action": "/mine", "id": ["no"]}),
        ("advertise_action", {"action": "/new", "type": "maya_robot/Nothing"}),
    ],
)
async def test_message_for_an_unknown_goal_is_reported(op: str, message: dict[str, Any]) -> None:
    async with client_bus() as one:
        server = await carrying_out(one)
        assert [status["level"] for status in await server.ask(op, **message)] == ["error"]
