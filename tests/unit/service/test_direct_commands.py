"""Commands past the queue, on the twin in virtual time: waiting, refusals, and stops."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.controller.homing import homed_pose
from maya_un.errors import Busy, Cancelled, LeaseHeld, LeaseLost, Stopped
from maya_un.events import FaultEntered
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.pick import Pick
from maya_un.schema.jobs import QueueMode, TaskState
from maya_un.service.access.operations import ROS, Operation
from maya_un.service.service import Service
from maya_un.values import Mode, Point
from tests.campaign import Campaign
from tests.homing_mark import stand_homed
from tests.virtual_time import elapse, turn

CUBE = Point(0.5, 1.1, 0.4)
AWAY = homed_pose(Config())._replace(a=1.0)

Request = Callable[[Service], Awaitable[object]]

REQUESTS: dict[str, Request] = {
    "home": lambda service: service.direct.home(),
    "move": lambda service: service.direct.move(AWAY),
    "follow": lambda service: service.direct.follow([homed_pose(Config()), AWAY]),
    "primitive": lambda service: service.direct.primitive(Pick(CUBE)),
}


@asynccontextmanager
async def robot(*, homed: bool = True) -> AsyncIterator[Stack]:
    async with stack(Config(), live=False, parts={"cube": CUBE}) as layers:
        if homed:
            await stand_homed(layers)
        yield layers


async def begun(layers: Stack, request: Request) -> asyncio.Task[object]:
    """Begin a command as the ROS graph does, and return once the robot moves for it."""

    async def gated() -> object:
        return await layers.gate.call(ROS, Operation.COMMAND, request)

    task = asyncio.ensure_future(gated())
    while layers.controller.state.mode not in (Mode.MOVING, Mode.HOMING) and not task.done():
        await elapse(0.01)
    return task


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("name", [*REQUESTS, "jog"])
async def test_a_stop_in_the_next_turns_of_the_loop_ends_it(name: str, turns: int) -> None:
    asked: dict[str, Request] = {**REQUESTS, "jog": lambda service: service.jog("a", -0.2)}
    async with robot() as layers:
        before = layers.controller.state.counts
        request = asyncio.ensure_future(layers.gate.call(ROS, Operation.COMMAND, asked[name]))
        for _ in range(turns):
            await turn()
        stop = layers.gate.call(ROS, Operation.STOP, lambda service: service.stop())
        if turns:
            await stop
        else:
            await asyncio.gather(asyncio.wait({request}), stop)  # the request comes first, in the same turn
        (answer,) = await asyncio.gather(request, return_exceptions=True)
        assert isinstance(answer, Stopped)
        await elapse(60.0)
        assert layers.controller.state.counts == before


async def test_each_is_done_at_once() -> None:
    async with robot(homed=False) as layers:
        direct = layers.service.direct
        await direct.primitive(Home())
        await direct.move(AWAY)
        assert layers.controller.state.joints == pytest.approx(AWAY, abs=1e-3)
        await direct.gripper(open_=True)
        assert not layers.controller.state.gripper_closed
        await direct.primitive(Pick(CUBE))
        assert layers.robot.holding
        assert direct.doing == ""


async def test_first_of_two_simultaneous_commands_continues_unharmed() -> None:
    async with robot() as layers:
        direct = layers.service.direct
        first = asyncio.ensure_future(direct.primitive(Pick(CUBE)))
        second = asyncio.ensure_future(direct.move(AWAY))
        with pytest.raises(Busy):
            await second
        while not first.done():  # no other command starts between the legs of a primitive
            with pytest.raises(Busy):
                await direct.move(AWAY)
            await elapse(0.05)
        first.result()
        assert layers.robot.holding


async def test_direct_command_is_refused_while_a_job_runs() -> None:
    async with robot() as layers:
        job = await layers.service.command(Pick(CUBE), wait=False)
        with pytest.raises(Busy, match=f"job {job.id}"):
            await layers.service.direct.move(AWAY)
        assert (await layers.service.wait(job.id)).state is TaskState.DONE


async def test_due_job_waits_for_a_direct_command_and_then_begins() -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS["move"])
        job = await layers.service.command(Pick(CUBE), wait=False)
        await elapse(0.2)
        assert not task.done()
        assert (await layers.service.job(job.id)).state is TaskState.QUEUED
        await task
        assert (await layers.service.wait(job.id)).state is TaskState.DONE


async def test_a_step_of_a_paused_queue_is_refused_meanwhile() -> None:
    async with robot() as layers:
        await layers.service.queue.pause()
        job = await layers.service.submit({"steps": [{"approach": list(CUBE)}]})
        task = await begun(layers, REQUESTS["move"])
        with pytest.raises(Busy, match="move"):
            await layers.service.queue.step()
        await task
        await layers.service.queue.step()
        assert (await layers.service.wait(job.id)).state is TaskState.DONE


async def waiting(layers: Stack) -> int:
    """Submit a job, which must wait; return its number."""
    job = await layers.service.command(Pick(CUBE), wait=False)
    await elapse(0.2)
    assert (await layers.service.job(job.id)).state is TaskState.QUEUED
    return job.id


async def test_due_job_waits_for_a_jog_and_then_begins() -> None:
    async with robot() as layers:
        task = asyncio.ensure_future(layers.service.jog("b", -0.1))
        await elapse(0.5)
        job = await waiting(layers)
        assert not task.done()
        await task
        assert (await layers.service.wait(job)).state is TaskState.DONE


@pytest.mark.parametrize("end", ["release", "new press"])
async def test_due_job_waits_for_a_held_jog_in_every_direction_and_then_begins(end: str) -> None:
    async with robot() as layers:
        await layers.service.jog_hold("b", 1, press="first")
        await elapse(0.3)
        await layers.service.jog_hold("b", 1, press="first")
        job = await waiting(layers)
        for _ in range(20):
            assert (await layers.service.jog_hold("b", -1, press="first")).moving
            await elapse(0.1)
        if end == "new press":
            while not (await layers.service.jog_hold("c", 1, press="second")).moving:
                await elapse(0.1)
        assert (await layers.service.job(job)).state is TaskState.QUEUED
        await layers.service.jog_release("first" if end == "release" else "second")
        assert (await layers.service.wait(job)).state is TaskState.DONE


@pytest.mark.parametrize("direct", [False, True])
async def test_no_job_begins_because_a_held_key_is_not_renewed(*, direct: bool) -> None:
    """Its user may be gone, and was perhaps the only one who saw the robot."""
    async with robot() as layers:
        if direct:
            await layers.service.queue.pause()
        await layers.service.jog_hold("b", 1, press="first")
        job = await waiting(layers)
        await elapse(5.0)
        assert (await layers.service.job(job)).state is TaskState.QUEUED
        assert layers.controller.state.mode is Mode.IDLE
        await layers.service.queue.resume()
        assert (await layers.service.wait(job)).state is TaskState.DONE


@pytest.mark.parametrize("command", ["move", "primitive", "home"])
async def test_no_job_begins_because_a_direct_command_was_stopped_past_the_service(command: str) -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS[command])
        job = await waiting(layers)
        await layers.controller.stop()
        with pytest.raises(Stopped):
            await task
        await elapse(5.0)
        assert (await layers.service.job(job)).state is TaskState.QUEUED
        assert layers.service.queue.view().mode is QueueMode.PAUSED


async def test_due_job_waits_while_a_key_is_held_at_the_border() -> None:
    async with robot() as layers:
        while (await layers.service.jog_hold("b", 1)).moving:
            await elapse(0.2)
        job = await waiting(layers)
        await layers.service.jog_release()
        assert (await layers.service.wait(job)).state is TaskState.DONE


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("past", [False, True])
async def test_stop_of_a_jog_pauses_the_queue_and_the_jog_no_longer_keeps_it(*, held: bool, past: bool) -> None:
    async with robot() as layers:
        service = layers.service
        task = None if held else asyncio.ensure_future(service.jog("b", -0.1))
        if held:
            await service.jog_hold("b", 1)
        await elapse(0.2)
        job = await waiting(layers)
        if held:
            assert (await service.jog_hold("b", 1)).moving
        await (layers.controller.stop() if past else service.stop())
        await elapse(5.0)
        if task is not None:
            with pytest.raises(Stopped):
                await task
        assert (await service.job(job)).state is TaskState.QUEUED
        assert layers.controller.state.mode is Mode.IDLE
        await service.queue.resume()
        assert (await service.wait(job)).state is TaskState.DONE


TURNS: dict[str, tuple[int, float]] = {"direction": (-1, 1.0), "speed": (1, 0.5)}
"""Direction and speed of the key that is held after the first one."""


@pytest.mark.parametrize("later", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("second", ["p", "another"])
async def test_stop_past_the_service_while_a_held_jog_brakes_for_another_key_ends_the_press(
    second: str, turn: str, later: float
) -> None:
    """The next press may be another one than that of the jog which brakes."""
    direction, speed = TURNS[turn]
    async with robot() as layers:
        service = layers.service
        await service.jog_hold("b", 1, press="p")
        await elapse(0.2)
        job = await waiting(layers)
        assert (await service.jog_hold("b", 1, press="p")).moving
        task = asyncio.ensure_future(service.jog_hold("b", direction, speed=speed, press=second))
        await elapse(later)
        await layers.controller.stop()
        await asyncio.wait({task})
        for _ in range(10):
            with suppress(Stopped):
                await service.jog_hold("b", direction, speed=speed, press=second)
            await elapse(0.2)
        assert layers.controller.state.mode is Mode.IDLE
        await service.jog_release(second)
        await elapse(5.0)
        assert (await service.job(job)).state is TaskState.QUEUED


async def test_stop_past_the_service_ends_a_press_that_rests_at_the_border() -> None:
    async with robot() as layers:
        service = layers.service
        while (await service.jog_hold("b", 1, press="p")).moving:
            await elapse(0.2)
        job = await waiting(layers)
        await layers.controller.stop()
        assert not (await service.jog_hold("b", -1, press="p")).moving
        await service.jog_release("p")
        await elapse(5.0)
        assert layers.controller.state.mode is Mode.IDLE
        assert (await service.job(job)).state is TaskState.QUEUED


async def test_cancelled_jog_lets_jobs_begin() -> None:
    async with robot() as layers:
        task = asyncio.ensure_future(layers.service.jog("b", -0.1))
        await elapse(0.5)
        job = await waiting(layers)
        task.cancel()
        assert (await layers.service.wait(job)).state is TaskState.DONE
        assert task.cancelled()


async def test_jogs_refused_while_a_job_runs_let_the_next_one_begin() -> None:
    async with robot() as layers:
        job = await layers.service.command(Pick(CUBE), wait=False)
        for jog in (
            layers.service.jog("b", 0.1),
            layers.service.jog_hold("b", 1),
            layers.service.jog_vector((0, 0, 1)),
        ):
            with pytest.raises(Busy, match=f"job {job.id}"):
                await jog
        assert (await layers.service.wait(job.id)).state is TaskState.DONE
        again = await layers.service.command(Home(), wait=True)
        assert again.state is TaskState.DONE


async def test_jogs_and_zones_do_not_wait_and_are_refused_meanwhile() -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS["primitive"])
        with pytest.raises(Busy, match="pick"):
            await layers.service.jog("z", 0.05)
        with pytest.raises(Busy, match="pick"):
            await layers.service.remove_zone("wall")
        await task


async def test_command_beside_another_driver_is_refused_with_the_lease_code() -> None:
    async with robot() as layers:
        layers.lease.take("ana", "http")
        with pytest.raises(LeaseHeld):
            await layers.gate.call(ROS, Operation.COMMAND, REQUESTS["move"])
        assert layers.controller.state.joints == pytest.approx(homed_pose(Config()), abs=1e-3)


async def test_broken_lease_stops_it_on_its_path() -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS["move"])
        layers.lease.take("ana", "http", force=True)
        with pytest.raises(LeaseLost):
            await task
        assert layers.controller.state.mode is Mode.IDLE
        assert layers.service.direct.doing == ""


@pytest.mark.parametrize("name", REQUESTS)
async def test_a_stop_goes_past_it(name: str) -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS[name])
        await elapse(0.3)
        await layers.service.stop()
        with pytest.raises(Stopped):
            await task
        await still_and_able(layers)


@pytest.mark.parametrize("name", REQUESTS)
async def test_leaving_caller_stops_the_command_and_waits_for_rest(name: str) -> None:
    async with robot() as layers:
        task = await begun(layers, REQUESTS[name])
        await elapse(0.3)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert not layers.controller.state.moving
        await still_and_able(layers)


@pytest.mark.parametrize("name", REQUESTS)
async def test_stop_queue_cancels_it_at_any_instant(name: str, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=2, long=100)):
        async with robot() as layers:
            task = await begun(layers, REQUESTS[name])
            job = await layers.service.command(Pick(CUBE), wait=False)
            await elapse(campaign.rng(case).uniform(0.0, 6.0))
            await layers.service.direct.end_all()
            assert not layers.controller.state.moving
            with suppress(Cancelled, Stopped):
                await task  # it may have ended before
            assert (await layers.service.job(job.id)).state is TaskState.CANCELLED
            assert layers.service.queue.view().mode.value == "running"
            await still_and_able(layers)


async def test_the_end_of_everything_ends_the_job_under_way_and_those_that_wait() -> None:
    async with robot() as layers:
        jobs = [await layers.service.command(Pick(CUBE), wait=False) for _ in range(3)]
        await elapse(1.0)
        assert layers.controller.state.mode is Mode.MOVING
        await layers.service.direct.end_all()
        assert [(await layers.service.job(job.id)).state for job in jobs] == [TaskState.CANCELLED] * 3
        assert not layers.controller.state.moving
        await still_and_able(layers)


async def test_stop_queue_without_a_running_command_does_nothing() -> None:
    async with robot() as layers:
        before = len(layers.controller.events)
        await layers.service.direct.end_all()
        kinds = [type(event) for event in layers.controller.events.since(before)]
        assert FaultEntered not in kinds
        await layers.service.direct.move(AWAY)


async def still_and_able(layers: Stack) -> None:
    """Check that nothing moves by itself any more, and that the robot obeys the next command."""
    await elapse(2.0)
    await layers.controller._monitor.look()
    assert not layers.controller.state.moving
    if not layers.controller.state.homed:
        await layers.service.direct.home()
    await layers.service.direct.gripper(open_=True)
    await layers.service.direct.move(AWAY)
