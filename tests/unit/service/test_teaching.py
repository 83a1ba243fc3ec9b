"""Teaching in the service: the position gets a name, and the name is a place from then on."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from math import pi

import pytest

from maya_un.errors import (
    Busy,
    InvalidJob,
    InvalidRequest,
    InvalidValue,
    NameTaken,
    NotConnected,
    NotHomed,
    NotTaught,
    UnknownName,
)
from maya_un.events import PlacesChanged
from maya_un.process.process import Process
from maya_un.process.spec.poses import PoseStore
from maya_un.robot.robot import MayaRobot
from maya_un.service.places import at_rest
from maya_un.service.service import Service
from maya_un.values import Mode, Point
from tests.fakes import FakeController, state_of

DAY = "2026-11-21T16:02:21+00:00"
CORNERS = [[0.3, 1.0, 0.4], [0.6, 1.0, 0.4], [0.3, 1.2, 0.4]]


@asynccontextmanager
async def opened_service() -> AsyncIterator[tuple[FakeController, Service]]:
    controller = FakeController()
    robot, store = MayaRobot(controller, controller.config), PoseStore(controller.mechanism)
    process = Process(robot, controller, controller.config, store.taught)
    try:
        yield controller, Service(process, robot, controller, controller.config, store=store)
    finally:
        await process.close()


async def test_pose_is_the_position_of_the_robot() -> None:
    async with opened_service() as (controller, service):
        pose = service.teaching.teach("shelf", DAY)
        assert (pose.joints, pose.point, pose.taught) == (controller.state.joints, controller.state.point, DAY)
        assert service.teaching.poses() == [pose]
        assert service.teaching.pose("shelf") == pose
        assert controller.calls == []


async def test_every_change_of_the_taught_places_is_an_event() -> None:
    async with opened_service() as (controller, service):
        service.teaching.teach("shelf", DAY)
        service.teaching.rename_pose("shelf", "rack")
        service.teaching.teach_pallet("tray", {"corners": CORNERS, "rows": 3, "columns": 4}, DAY)
        service.teaching.rename_pallet("tray", "box")
        with pytest.raises(NotTaught):
            service.teaching.forget_pose("shelf")
        service.teaching.forget_pallet("box")
        service.teaching.forget_pose("rack")
    changes = [event for event in controller.events.since(0) if isinstance(event, PlacesChanged)]
    assert [event.name for event in changes] == ["shelf", "rack", "tray", "box", "box", "rack"]


async def test_teaching_is_refused_in_motion_or_at_an_unknown_position() -> None:
    controller = FakeController()
    controller.state = replace(controller.state, moving=True)
    with pytest.raises(Busy):
        at_rest(controller)
    controller.state = replace(controller.state, mode=Mode.MOVING)
    with pytest.raises(Busy, match="moving"):
        at_rest(controller)
    controller.state = state_of(None)
    with pytest.raises(NotHomed):
        at_rest(controller)
    controller.state = replace(controller.state, mode=Mode.DISCONNECTED)
    with pytest.raises(NotConnected):
        at_rest(controller)


async def test_taught_name_is_a_place_of_commands_and_jobs() -> None:
    async with opened_service() as (controller, service):
        pose = service.teaching.teach("here", DAY)
        picked = await service.command({"command": "approach", "target": "here"})
        assert (picked.name, picked.steps[0].step, picked.state.value) == ("approach", "approach here", "done")
        back = await service.command({"command": "move", "joints": "here"})
        assert back.state.value == "done"
        assert controller.state.joints == pose.joints
        job = await service.submit({"steps": [{"approach": "here"}, {"move": "here"}]})
        assert (await service.wait(job.id)).state.value == "done"


async def test_cell_of_a_taught_pallet_is_a_place_of_commands() -> None:
    async with opened_service() as (_, service):
        service.teaching.teach_pallet("tray", {"corners": CORNERS, "rows": 3, "columns": 4}, DAY)
        report = await service.command({"command": "pick", "target": "tray[1,2]"})
        assert report.steps[0].step == "pick tray[1,2]"
        assert report.state.value == "done"
        with pytest.raises(InvalidJob, match="rows 1 to 3 and columns 1 to 4"):
            await service.command({"command": "pick", "target": "tray[9,9]"})


@pytest.mark.parametrize(
    ("command", "error"),
    [
        ({"command": "pick", "target": "nowhere"}, UnknownName),
        ({"command": "pick", "target": ""}, UnknownName),
        ({"command": "pick", "target": "tray[next]"}, InvalidValue),
        ({"command": "pick", "target": "here", "speed": 1}, InvalidRequest),
        ({"command": "gripper", "open": "here"}, InvalidValue),
        ({"command": "home", "target": "here"}, InvalidRequest),
        ({"command": ["pick"], "target": "here"}, UnknownName),
    ],
)
async def test_command_for_an_unknown_place_is_refused_at_once(
    command: dict[str, object], error: type[Exception]
) -> None:
    async with opened_service() as (controller, service):
        service.teaching.teach("here", DAY)
        with pytest.raises(error):
            await service.command(command)
        assert controller.calls == []


async def test_job_shows_its_number_of_tasks_and_bad_pallets() -> None:
    async with opened_service() as (_, service):
        slanted = {"corners": [*CORNERS[:2], [0.4, 1.1, 0.4]], "rows": 2, "columns": 3}
        loop = {"for_each": "tray", "do": [{"pick": "tray[each]"}, {"place": [1.1, 0.5]}]}
        job = await service.submit({"pallets": {"tray": slanted}, "steps": ["home", loop], "repeat": 2})
        assert job.steps == 26
        assert (await service.job(job.id)).remarks == ("tray: its corners are 45.0 degrees off a right angle",)
        plain = await service.submit({"steps": ["home"]})
        assert (plain.steps, (await service.job(plain.id)).remarks) == (1, ())


async def test_pallet_shows_its_shape() -> None:
    async with opened_service() as (_, service):
        corners = [*CORNERS, [0.6, 1.2, 0.42]]
        info = service.teaching.teach_pallet("tray", {"corners": corners, "rows": 3, "columns": 4}, DAY)
        assert info.corners == tuple(tuple(corner) for corner in corners)
        assert info.flatness == pytest.approx(0.005, rel=0.01)
        assert info.squareness is not None
        assert info.squareness < pi / 180
        assert info.remarks == ("its corners are 5.0 mm off a plane",)
        assert service.teaching.pallets() == [info]
        assert service.teaching.pallet("tray") == info


async def test_invalid_pose_or_pallet_is_refused() -> None:
    async with opened_service() as (_, service):
        teaching = service.teaching
        teaching.teach("here", DAY)
        teaching.teach_pallet("tray", {"corners": CORNERS, "rows": 3, "columns": 4}, DAY)
        for request in (teaching.pose, teaching.forget_pose, lambda name: teaching.rename_pose(name, "x")):
            with pytest.raises(NotTaught, match=r"'tray'\. Known: here"):
                request("tray")
        for request in (teaching.pallet, teaching.forget_pallet, lambda name: teaching.rename_pallet(name, "x")):
            with pytest.raises(NotTaught, match=r"'here'\. Known: tray"):
                request("here")
        with pytest.raises(NameTaken):
            teaching.teach("here", DAY)
        assert teaching.rename_pose("here", "there").name == "there"
        assert teaching.rename_pallet("tray", "box").rows == 3
        teaching.forget_pose("there")
        teaching.forget_pallet("box")
        assert (teaching.poses(), teaching.pallets()) == ([], [])


@pytest.mark.parametrize(
    ("grid", "key"),
    [
        ({}, "corners"),
        ({"corners": CORNERS, "rows": 2}, "columns"),
        ({"corners": CORNERS, "rows": 2.5, "columns": 2}, "rows"),
        ({"corners": [[1]], "rows": 1, "columns": 1}, "corners.0"),
        ({"corners": CORNERS[:2], "rows": 2, "columns": 2}, "pallet"),
        ({"corners": CORNERS, "rows": 2, "columns": 2, "full": True}, "full"),
    ],
)
async def test_invalid_grid_is_refused_at_its_key(grid: dict[str, object], key: str) -> None:
    async with opened_service() as (_, service):
        with pytest.raises(InvalidRequest) as caught:
            service.teaching.teach_pallet("tray", grid, DAY)
        assert caught.value.details["key"] == key


async def test_pallet_with_degenerate_corners_is_reported() -> None:
    async with opened_service() as (controller, service):
        service.teaching.teach("corner", DAY)
        away = (0.3, 1.2, 0.4)
        service.teaching.teach_pallet("line", {"corners": ["corner", list(away)], "rows": 1, "columns": 2}, DAY)
        controller.state = state_of(controller.mechanism.ik(Point(*away)))
        service.teaching.teach("corner", DAY, replacing=True)
        info = service.teaching.pallet("line")
        assert info.corners is None
        assert "the same place" in info.remarks[0]
