"""The path of the motion under way, compared with the motion itself."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.schema.robot import MotionView
from maya_un.service.motion import POINTS
from maya_un.service.service import Service
from tests.unit.controller.bench import FAR, HERE, now
from tests.unit.service.test_permissions import scene_of
from tests.virtual_time import elapse


def view(service: Service) -> MotionView:
    snapshot = service.motion()
    assert snapshot is not None
    return snapshot.view()


async def test_path_leads_from_the_start_to_the_end_and_predicts_every_point() -> None:
    async with scene_of("at rest") as (bench, service):
        assert service.motion() is None
        moving = asyncio.ensure_future(service.direct.move(FAR))
        await elapse(0.5)
        shown = view(service)
        assert len(shown.path) == POINTS
        assert shown.path[0].joints == pytest.approx(HERE, abs=1e-4)
        assert shown.path[-1].joints == pytest.approx(FAR, abs=1e-4)
        assert shown.began is not None
        for one in shown.path[5::5]:
            assert one.time is not None
            assert one.point == bench.controller.mechanism.fk(one.joints)
            await elapse(shown.began + one.time - now())
            bench.virtual.sync()
            assert bench.mechanics.true_joints() == pytest.approx(one.joints, abs=2e-3)
        await moving
        assert service.motion() is None


async def test_every_change_of_speed_makes_another_move() -> None:
    async with scene_of("at rest") as (_, service):
        assert service.move is None
        moving = asyncio.ensure_future(service.direct.move(FAR))
        await elapse(2.0)
        first, whole = service.move, view(service).path[-1].time
        await elapse(1.0)
        assert service.move is first
        await service.speed(0.5)
        slower = view(service).path[-1].time
        assert service.move is not first
        assert whole is not None and slower is not None
        assert slower > 1.5 * whole
        await service.pause()
        assert [one.time for one in view(service).path][-1] is None
        await service.stop()
        await asyncio.wait({moving})
        assert service.move is None
        moving.exception()
