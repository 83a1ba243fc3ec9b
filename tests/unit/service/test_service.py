from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from math import pi

import pytest

from maya_un.errors import Busy, InvalidJob, InvalidRequest, NotFound, Unreachable
from maya_un.events import Event, FaultEntered
from maya_un.process.journal.protocol import Filter
from maya_un.process.process import Process
from maya_un.robot.primitives import Home
from maya_un.robot.robot import MayaRobot
from maya_un.schema.encoding import to_data, to_json
from maya_un.schema.robot import EventMessage, Jogged
from maya_un.service.service import Service
from maya_un.values import Joints, Point
from tests.fakes import FakeController
from tests.virtual_time import elapse

CRATE: dict[str, object] = {"name": "crate", "kind": "box", "low": [0.3, 0.9, 0], "high": [0.7, 1.3, 0.5]}
WALL: dict[str, object] = {"name": "wall", "kind": "half_space", "point": [0, 2, 0], "normal": [0, -1, 0]}
JOB = {"parts": {"cube": [0.5, 1.1]}, "steps": [{"pick": "cube"}, {"place": [1.1, 0.5]}]}


@asynccontextmanager
async def opened_service(*, homed: bool = True) -> AsyncIterator[tuple[FakeController, Service]]:
    controller = FakeController(homed=homed)
    robot = MayaRobot(controller, controller.config)
    process = Process(robot, controller, controller.config)
    try:
        yield controller, Service(process, robot, controller, controller.config, address="sim", speed=20.0)
    finally:
        await process.close()


async def past(service: Service, above: int = 0) -> list[Event]:
    """Return the events there are with numbers above one, as the stream asks for them."""
    following = service.follow_events(above)
    return [await anext(following) for _ in range((await service.status()).last_event - above)]


async def test_job_is_submitted_and_its_report_returned() -> None:
    async with opened_service() as (_, service):
        accepted = await service.submit(JOB)
        assert (accepted.id, accepted.steps) == (1, 2)
        assert (await service.job(1)).state.value == "running"
        assert (await service.wait(1)).state.value == "done"
        assert [line.done for line in await service.history.page(Filter())] == [2]


async def test_command_is_awaited_or_not() -> None:
    async with opened_service() as (_, service):
        assert (await service.command({"command": "home"}, wait=False)).state.value == "running"
        assert (await service.command(Home())).state.value == "done"


async def test_refused_command_reports_the_refusal() -> None:
    async with opened_service() as (controller, service):
        report = await service.command({"command": "pick", "target": [3, 3]})
        assert (report.state.value, report.code) == ("failed", 2101)
        assert controller.calls == []


async def test_invalid_request_is_refused_by_the_service() -> None:
    async with opened_service() as (_, service):
        with pytest.raises(InvalidJob):
            await service.submit({"steps": []})
        with pytest.raises(InvalidRequest):
            await service.command({"command": "pick"})
        with pytest.raises(NotFound):
            await service.wait(7)
        assert await service.history.page(Filter()) == []


async def test_stop_ends_the_job_and_pauses_the_queue() -> None:
    async with opened_service() as (controller, service):
        await service.submit(JOB)
        await service.submit(JOB)
        await elapse(3.0)
        report = await service.stop()
        assert report.was_moving
        assert (await service.wait(1)).state.value == "cancelled"
        await elapse(10.0)
        view = service.queue.view()
        assert (view.mode.value, view.reason, view.counts) == ("paused", "stop", {"queued": 1})
        assert controller.names() == ["follow", "stop"]


async def test_stop_before_the_first_step_lets_none_begin() -> None:
    async with opened_service() as (controller, service):
        await service.submit(JOB)
        await service.stop()
        assert (await service.wait(1)).state.value == "cancelled"
        assert controller.names() == ["stop"]


async def test_recover_starts_nothing() -> None:
    async with opened_service() as (controller, service):
        await service.recover()
        await elapse(10.0)
        assert controller.names() == ["recover"]


async def test_jog_does_not_wait() -> None:
    async with opened_service() as (controller, service):
        await service.jog("b", 0.01, speed=0.5)
        assert controller.calls == [("jog", ("b", 0.01, 0.5, True))]
        await service.submit(JOB)
        await elapse(1.0)
        with pytest.raises(Busy, match="job 1"):
            await service.jog("b", 0.01)


async def test_a_jog_of_peoples_goes_as_far_as_it_can_and_says_how_far() -> None:
    async with opened_service() as (_, service):
        assert await service.jog("x", -2.0) == Jogged("x", -0.1, "fake", "it would come too far")
        assert await service.jog("x", -2.0, clip=False) == Jogged("x", -2.0)


async def test_a_held_jog_is_for_when_no_job_runs() -> None:
    async with opened_service() as (controller, service):
        assert (await service.jog_hold("b", 1)).moving
        await service.jog_release()
        await service.submit(JOB)
        await elapse(1.0)
        with pytest.raises(Busy, match="job 1"):
            await service.jog_hold("b", 1)
        assert controller.names()[:2] == ["jog", "at rest"]


async def test_a_stop_ends_a_held_jog() -> None:
    async with opened_service() as (controller, service):
        await service.jog_hold("b", 1)
        await service.stop()
        await elapse(1.0)
        assert controller.names() == ["jog", "stop", "at rest"]
        assert not (await service.jog_hold("b", 1)).moving


async def test_a_job_is_paused_also_between_its_motions() -> None:
    async with opened_service() as (controller, service):
        await service.pause()
        await service.submit(JOB)
        await elapse(1.0)
        await service.pause()
        await service.resume()
        await service.speed(0.5)
        calls = [call for call in controller.calls if call[0] != "follow"]
        assert calls == [("pause", False), ("pause", True), ("resume", None), ("override", 0.5)]
        assert (await service.status()).state.override == 0.5


async def test_status_shows_the_current_state() -> None:
    async with opened_service() as (controller, service):
        assert (await service.status()).can_teleop
        await service.submit(JOB)
        await elapse(1.0)
        status = await service.status()
        assert (status.address, status.speed, status.can_teleop, status.holding) == ("sim", 20.0, False, False)
        assert [(line.id, line.state.value, line.steps) for line in status.jobs] == [(1, "running", 2)]
        assert status.last_event == len(controller.events)


async def test_events_are_numbered_without_gaps_for_everyone() -> None:
    async with opened_service() as (_, service):
        await service.submit(JOB)
        await service.wait(1)
        events = await past(service)
        assert [event.seq for event in events] == list(range(1, len(events) + 1))
        assert await past(service, above=3) == events[3:]


async def test_preview_starts_here_or_at_the_end_of_homing() -> None:
    async with opened_service(homed=False) as (controller, service):
        here = await service.preview(JOB)
        assert here.refusal is not None
        assert here.refusal.notice.code == 2103
        homed = await service.preview(JOB, from_homed=True)
        assert homed.refusal is None
        assert controller.calls == []


async def test_kinematics_are_computed_by_the_service() -> None:
    async with opened_service() as (_, service):
        joints = await service.previews.ik(Point(0.5, 1.1, 0.4))
        assert tuple(await service.previews.fk(joints)) == pytest.approx((0.5, 1.1, 0.4))
        with pytest.raises(Unreachable):
            await service.previews.fk(Joints(0.0, 0.6, 0.6))


async def test_reach_gives_the_reason_and_an_alternative() -> None:
    async with opened_service() as (_, service):
        there = await service.previews.reach(Point(0.5, 1.1, 0.4))
        assert (there.reachable, there.reason) == (True, None)
        answer = await service.previews.reach(Point(0.5, 1.1, 2.2))
        assert not answer.reachable
        assert answer.reason
        assert answer.nearest is not None
        assert (await service.previews.reach(answer.nearest)).reachable


async def test_reach_measures_possible_points_and_names_the_others() -> None:
    async with opened_service() as (_, service):
        await service.set_zone(CRATE)
        there = await service.previews.reach(Point(0.5, 1.1, 0.9))
        assert there.joints is not None
        margins = {one.zone or one.limit: (one.margin, one.unit) for one in there.margins}
        assert margins["crate"] == (pytest.approx(0.35), "m")
        assert margins["boom"] == (pytest.approx(min(there.joints.a, 2 * pi / 3 - there.joints.a)), "rad")
        assert margins["tension_b"] == (pytest.approx(5.0 - (there.tensions or (0, 0))[0]), "load")
        answer = await service.previews.reach(Point(0.5, 1.1, 0.4))
        assert [(one.limit, one.zone) for one in answer.broken] == [("zone", "crate")]
        assert answer.reason == answer.broken[0].text


async def test_zones_are_added_and_removed_by_name() -> None:
    async with opened_service() as (controller, service):
        assert await service.zones() == []
        taken = await service.set_zone(CRATE)
        assert (taken.name, taken.margin) == ("crate", 0.05)
        await service.set_zone(CRATE | {"margin": 0.1})
        await service.set_zone(WALL)
        zones = await service.zones()
        assert [(zone.name, zone.margin) for zone in zones] == [("crate", 0.1), ("wall", 0.05)]
        assert [zone.name for zone in controller.zones] == ["crate", "wall"]
        assert to_data(zones) == [to_data(zone) for zone in zones]
        await service.remove_zone("crate")
        assert [zone.name for zone in controller.zones] == ["wall"]
        with pytest.raises(NotFound, match="no zone crate"):
            await service.remove_zone("crate")


async def test_invalid_zone_is_refused_with_its_key() -> None:
    async with opened_service() as (_, service):
        with pytest.raises(InvalidRequest, match="high"):
            await service.set_zone({"name": "crate", "kind": "box", "low": [0, 0, 0]})
        assert await service.zones() == []


async def test_zones_stay_as_they_are_while_a_job_runs() -> None:
    async with opened_service() as (_, service):
        await service.submit(JOB)
        await elapse(1.0)
        with pytest.raises(Busy, match="job 1"):
            await service.set_zone(CRATE)
        with pytest.raises(Busy, match="job 1"):
            await service.remove_zone("crate")


async def test_everything_that_leaves_is_json() -> None:
    async with opened_service() as (_, service):
        await service.submit(JOB)
        report = await service.wait(1)
        preview = await service.preview(JOB, from_homed=True)
        status = await service.status()
        messages = (report, preview, status, *map(EventMessage.of, await past(service)))
        for message in (*messages, await service.previews.reach(Point(0.5, 1.1, 0.4)), await service.stop()):
            assert json.loads(to_json(message)) == to_data(message)
        assert to_data(report)["steps"][0]["end_point"] == list(report.steps[0].end_point or ())
        assert to_data(report)["parts"] == {"cube": [1.1, 0.5, 0.4]}


def test_details_that_are_not_plain_become_text() -> None:
    message = EventMessage.of(FaultEntered(code=2308, more={"axis": "b", "where": (1, 2), "n": 3}))
    assert message.detail == {"axis": "b", "where": "(1, 2)", "n": 3}


async def test_waiting_does_not_hold_up_others() -> None:
    async with opened_service() as (_, service):
        await service.submit(JOB)
        waiters = [asyncio.create_task(service.wait(1)) for _ in range(3)]
        await elapse(1.0)
        assert (await service.status()).jobs[0].id == 1
        assert len({(await waiter).duration for waiter in waiters}) == 1
