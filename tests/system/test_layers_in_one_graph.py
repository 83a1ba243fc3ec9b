"""All layers as nodes of a graph, in virtual time: jobs done, ended at any instant, and deaths of nodes.

The record of the twin's mechanics decides: position of the part, drops, motion.
"""

from __future__ import annotations

import asyncio
from random import Random

import pytest

from maya_ros.graph.conversions import primitive_to_message
from maya_ros.graph.distributed import robot_layer
from maya_ros.graph.outcome import error_of
from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.servers.forwarding import tasks_forwarded
from maya_ros.graph.table import FOLLOW, TASK
from maya_un.errors import AbortInput, Busy, Cancelled, NodeGone, NotConnected, NotOverRos, Stopped
from maya_un.events import Disconnected, Event, GripperClosed, MotionEnded, PhaseBegun
from maya_un.process.spec.job import Job
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.schema.jobs import QueueMode, TaskState
from maya_un.testing import faults
from maya_un.values import Mode, Point
from tests.calm import CALM
from tests.campaign import Campaign
from tests.graphs import LayerNodes, layer_nodes
from tests.virtual_time import elapse

pytestmark = pytest.mark.system

CUBE, TRAY = Point(0.50, 1.10, 0.40), Point(1.10, 0.50, 0.40)
LONGEST = 120.0
"""Pick and place of a homed robot have ended by then [s]."""


def job(*steps: object) -> Job:
    """Return a job with a cube and a tray."""
    return Job.parse({"parts": {"cube": list(CUBE)}, "places": {"tray": list(TRAY)}, "steps": list(steps)})


PICK_AND_PLACE = job({"pick": "cube"}, {"place": "tray"})


def moved(layers: LayerNodes) -> bool:
    """Whether the part stands on the tray, by the mechanics, and nothing ever fell."""
    x, y, _ = layers.mechanics.parts["cube"]
    assert not layers.mechanics.record.whole.drops
    return abs(x - TRAY.x) < 0.002 and abs(y - TRAY.y) < 0.002


async def stands_still(layers: LayerNodes, seconds: float = 30.0) -> None:
    """See that nothing moves for so long."""
    before = layers.mechanics.true_joints()
    await elapse(seconds)
    assert layers.mechanics.true_joints() == pytest.approx(before, abs=2e-5)


async def ended(layers: LayerNodes, number: int) -> tuple[TaskState, int]:
    """Wait until a job has ended; return its state and code."""
    report = await layers.process.result(number)
    return report.state, report.code


async def finishes(layers: LayerNodes) -> None:
    """Have the robot do what is left of its task, as a person would after whatever happened."""
    steps = [{"place": "tray"}] if layers.robot.holding else [{"gripper": "open"}, {"pick": "cube"}, {"place": "tray"}]
    if not layers.controller.state.homed:
        steps = ["home", *steps]
    if layers.process.views.mode is not QueueMode.RUNNING:
        await layers.process.scheduler.resume("a person")
    number = await layers.process.submit(job(*steps))
    assert await ended(layers, number) == (TaskState.DONE, 0)
    assert moved(layers)


async def test_a_job_from_power_up_to_the_part_on_the_tray() -> None:
    async with layer_nodes(parts={"cube": CUBE}, homed=False) as layers:
        steps = ("home", {"pick": "cube"}, {"place": "tray"}, {"line": [1.1, 0.5, 0.6]}, {"move": [0.3, 1.5, 1.3]})
        assert await ended(layers, await layers.process.submit(job(*steps))) == (TaskState.DONE, 0)
        assert moved(layers)
        assert layers.robot.holding is False
        assert layers.controller.state.joints == layers.controller_node.rig.controller.state.joints


@pytest.mark.parametrize("step", [{"wait_for": {"input": 1, "is": "on"}}, {"move": [0.3, 1.5, 1.3], "speed": 0.5}])
async def test_a_step_that_no_message_carries_fails_and_moves_nothing(step: dict[str, object]) -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        assert await ended(layers, await layers.process.submit(job(step))) == (TaskState.FAILED, NotOverRos.code)
        await stands_still(layers)


async def test_phases_are_those_of_the_layer_in_its_order() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        phases: list[str] = []
        await layers.robot.run(Pick(CUBE), phases.append)
        assert phases == ["approach", "down", "close", "up"]
        assert layers.robot.holding is True
        await layers.robot.run(Place(TRAY), phases.append)
        assert phases[4:] == ["approach", "down", "open", "up"]
        told = [event.detail["name"] for event in layers.controller.events.since(0) if isinstance(event, PhaseBegun)]
        assert told == phases


async def test_preview_equals_the_later_run_of_the_layer() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        preview = layers.robot.preview(Pick(CUBE), layers.robot.pose)
        began = asyncio.get_running_loop().time()
        await layers.robot.run(Pick(CUBE))
        assert preview.duration is not None
        assert asyncio.get_running_loop().time() - began == pytest.approx(preview.duration, abs=1.5)
        assert layers.robot.pose == preview.end


async def test_refusal_of_a_layer_is_raised_unchanged() -> None:
    async with layer_nodes() as layers:
        task = {"task": primitive_to_message(Pick(Point(0.3, 1.0, 2.3)))}
        there = await layers.nodes["process_controller"].do(TASK.name, TASK.type, task)
        with pytest.raises(Exception, match="cannot be reached") as raised:
            await layers.robot.run(Pick(Point(0.3, 1.0, 2.3)))
        assert there.outcome is GoalStatus.REJECTED
        assert (str(getattr(raised.value, "code", 0)), str(raised.value)) == (
            there.result["code"],
            there.result["message"],
        )


async def test_an_empty_gripper_that_a_person_has_seen_is_opened_for_the_pick() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        await layers.controller_node.rig.controller.gripper(open_=False)
        await layers.controller.settled()
        layers.robot.seen(holding=False)
        await layers.robot.run(Pick(CUBE))
        await layers.robot.run(Place(TRAY))
        assert moved(layers)


@pytest.mark.parametrize("how", ["cancel", "stop"])
async def test_job_ended_at_any_instant_leaves_a_usable_robot(how: str, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=1, long=100)):
        rng = campaign.rng(case)
        async with layer_nodes(parts={"cube": CUBE}) as layers:
            number = await layers.process.submit(PICK_AND_PLACE)
            await elapse(rng.uniform(0.0, LONGEST))
            over = (await layers.process.views.report(number)).state.ended
            if how == "cancel":
                await layers.process.cancel(number)
            elif not over:
                layers.process.scheduler.halt(Stopped())
                await layers.controller.stop()
            state, code = await ended(layers, number)
            assert (state, code) in {
                (TaskState.CANCELLED, Cancelled.code if how == "cancel" else Stopped.code),
                (TaskState.DONE, 0),
            }
            await stands_still(layers)
            await finishes(layers)


async def test_homing_is_stopped_at_any_instant_and_restarted(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=1, long=60)):
        rng = campaign.rng(case)
        async with layer_nodes(homed=False) as layers:
            number = await layers.process.submit(job("home"))
            await elapse(rng.uniform(0.0, 250.0))
            layers.process.scheduler.halt(Stopped())
            await layers.controller.stop()
            state, _ = await ended(layers, number)
            await stands_still(layers)
            if state is not TaskState.DONE:
                assert state is TaskState.CANCELLED
                assert layers.controller.state.mode is Mode.NOT_HOMED
                assert await ended(layers, await layers.process.submit(job("home"))) == (TaskState.DONE, 0)


async def test_paused_and_slowed_job_ends_like_an_undisturbed_one(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=1, long=60)):
        rng = campaign.rng(case)
        async with layer_nodes(parts={"cube": CUBE}) as layers:
            number = await layers.process.submit(PICK_AND_PLACE)
            for _ in range(3):
                await elapse(rng.uniform(1.0, 30.0))
                if (await layers.process.views.report(number)).state.ended:
                    break
                await layers.controller.override(rng.choice([0.3, 0.6, 1.0]))
                await _held(layers, rng)
            assert await ended(layers, number) == (TaskState.DONE, 0)
            assert moved(layers)


async def _held(layers: LayerNodes, rng: Random) -> None:
    await layers.process.scheduler.pause("a person", now=True)
    await elapse(1.5)
    await stands_still(layers, rng.uniform(1.0, 60.0))
    await layers.process.scheduler.resume("a person")


async def test_a_fault_ends_the_job_pauses_the_queue_and_is_recovered_from() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        first = await layers.process.submit(PICK_AND_PLACE)
        second = await layers.process.submit(job({"approach": "tray"}))
        await elapse(15.0)
        with faults.abort_input(layers.controller_node.rig.virtual):
            assert await ended(layers, first) == (TaskState.FAILED, AbortInput.code)
            assert layers.controller.state.mode is Mode.FAULT
            assert (layers.process.views.mode, layers.process.views.reason) == (QueueMode.PAUSED, "fault")
        await layers.controller.recover()
        await stands_still(layers)
        assert not (await layers.process.views.report(second)).state.ended
        await layers.process.cancel(second)
        await finishes(layers)


async def test_a_second_task_is_refused_and_the_first_unharmed() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        number = await layers.process.submit(PICK_AND_PLACE)
        somebody = layers.bus.node("somebody")
        await elapse(10.0)
        for _ in range(3):
            other = await somebody.do(TASK.name, TASK.type, {"task": primitive_to_message(Approach(TRAY))})
            assert other.outcome is GoalStatus.REJECTED
            assert isinstance(error_of(other.result), Busy)
            await elapse(20.0)
        assert await ended(layers, number) == (TaskState.DONE, 0)
        assert moved(layers)


async def test_due_job_waits_for_another_clients_task() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        somebody = layers.bus.node("somebody")
        other = asyncio.ensure_future(somebody.do(TASK.name, TASK.type, {"task": primitive_to_message(Approach(TRAY))}))
        await elapse(2.0)
        number = await layers.process.submit(PICK_AND_PLACE)
        assert (await other).outcome is GoalStatus.SUCCEEDED
        assert await ended(layers, number) == (TaskState.DONE, 0)
        assert moved(layers)


@pytest.mark.parametrize("name", ["robot_controller", "primitive_server"])
async def test_death_of_a_middle_node_stops_the_robot_and_the_queue(name: str, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=1, long=60)):
        rng = campaign.rng(case)
        async with layer_nodes(parts={"cube": CUBE}) as layers:
            first = await layers.process.submit(PICK_AND_PLACE)
            second = await layers.process.submit(job({"approach": "tray"}))
            await elapse(rng.uniform(0.5, 50.0))
            await layers.dies(name)
            assert await ended(layers, first) == (TaskState.FAILED, NodeGone.code)
            assert (layers.process.views.mode, layers.process.views.reason) == (QueueMode.PAUSED, "fault")
            await elapse(2.0)
            await stands_still(layers)
            assert layers.controller_node.rig.controller.state.mode is Mode.IDLE
            node = layers.bus.node(name)
            again = robot_layer(node, CALM) if name == "robot_controller" else tasks_forwarded(node)
            async with again:
                await stands_still(layers)
                assert not (await layers.process.views.report(second)).state.ended
                await layers.process.cancel(second)
                await finishes(layers)


async def test_death_of_the_controller_node_is_reported_by_all_above() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        first = await layers.process.submit(PICK_AND_PLACE)
        second = await layers.process.submit(job({"approach": "tray"}))
        await elapse(15.0)
        await layers.dies("hw_simulator")
        assert await ended(layers, first) == (TaskState.FAILED, NodeGone.code)
        await elapse(0.5)
        assert layers.controller.state.mode is Mode.DISCONNECTED
        assert (layers.process.views.mode, layers.process.views.reason) == (QueueMode.PAUSED, "fault")
        gone = [event for event in layers.controller.events.since(0) if isinstance(event, Disconnected)]
        assert [event.code for event in gone] == [NodeGone.code]
        with pytest.raises(NotConnected):
            await layers.process.submit(PICK_AND_PLACE)
        with pytest.raises(NotConnected):
            await layers.controller.stop()
        assert not (await layers.process.views.report(second)).state.ended


async def test_death_of_the_process_node_stops_the_robot() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        number = await layers.process.submit(PICK_AND_PLACE)
        await elapse(15.0)
        await layers.dies("process_controller")
        await elapse(2.0)
        assert layers.controller_node.rig.controller.state.mode is Mode.IDLE
        await stands_still(layers)
        await layers.process.result(number)


async def test_death_of_a_client_stops_its_path() -> None:
    async with layer_nodes() as layers:
        somebody = layers.bus.node("somebody")
        points = [{"positions": [0.3, 1.5, 1.3]}, {"positions": [1.2, 1.0, 1.8]}]
        goal = {"trajectory": {"joint_names": ["a", "b", "c"], "points": points}}
        following = asyncio.ensure_future(somebody.do(FOLLOW.name, FOLLOW.type, goal))
        await elapse(5.0)
        assert layers.controller.state.mode is Mode.MOVING
        somebody.close()
        assert (await following).outcome is GoalStatus.LOST
        await elapse(2.0)
        assert layers.controller.state.mode is Mode.IDLE
        await stands_still(layers)


@pytest.mark.parametrize("word", ["stop", "abort"])
@pytest.mark.parametrize("kind", [MotionEnded, GripperClosed])
async def test_a_stop_between_two_motions_of_a_primitive_ends_it_too(word: str, kind: type[Event]) -> None:
    """Just there nothing moves that could be stopped: the next motion is still on its way over the graph."""
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        somebody, saying = layers.bus.node("somebody"), list[asyncio.Task[object]]()

        def hear(event: Event) -> None:
            if isinstance(event, kind) and not saying:
                call = somebody.call(f"/controller/{word}", {}, "std_srvs/Trigger")
                saying.append(asyncio.get_running_loop().create_task(call))

        layers.controller_node.rig.controller.events.heard_by(hear)
        with pytest.raises(Stopped):
            await layers.robot.run(Pick(CUBE))
        assert saying
        await elapse(1.0)
        await stands_still(layers)
        assert layers.controller_node.rig.controller.state.mode in {Mode.IDLE, Mode.FAULT, Mode.NOT_HOMED}


async def test_a_stop_as_a_task_sets_out_ends_it() -> None:
    async with layer_nodes(parts={"cube": CUBE}) as layers:
        somebody = layers.bus.node("somebody")
        running = asyncio.ensure_future(layers.robot.run(Pick(CUBE)))
        await somebody.call("/controller/stop", {}, "std_srvs/Trigger")
        await asyncio.wait({running})
        assert isinstance(running.exception(), Stopped)
        await stands_still(layers)
