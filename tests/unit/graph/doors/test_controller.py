"""The controller floor behind its door, on a bus, in virtual time."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import pytest

from maya_un.controller.controller import GalilController
from maya_un.controller.homing import homed_pose
from maya_un.graph.bus import Bus, BusNode
from maya_un.graph.doors.controller import ControllerDoor
from maya_un.graph.events import Told, read
from maya_un.graph.outcome import error_of
from maya_un.graph.paths import to_message
from maya_un.graph.protocol import Message, Outcome
from maya_un.motion.path import Path
from maya_un.testing.rig import rig
from maya_un.values import Joints, Mode

HOMED = {"success": True, "code": "", "message": ""}


@dataclass
class Behind:
    """A controller behind its door, and somebody on the other side who has heard every event."""

    controller: GalilController
    bus: Bus
    client: BusNode
    told: list[Told] = field(default_factory=list[Told])

    @property
    def words(self) -> list[str]:
        return [told.word for told in self.told]

    async def home(self) -> None:
        ended = await self.client.do("/home", "maya_controller/Home", {})
        assert ended.result == HOMED

    async def move(self, joints: Joints) -> tuple[Outcome, str]:
        ended = await self.client.do("/move", "maya_controller/Move", joints._asdict())
        return ended.outcome, str(ended.result.get("code"))

    async def trigger(self, name: str) -> Message:
        return await self.client.call(name, {}, "std_srvs/Trigger")


@asynccontextmanager
async def behind(*, live: bool = False) -> AsyncIterator[Behind]:
    bus = Bus()
    client = bus.node("somebody")
    async with rig(live=live) as floor, ControllerDoor(floor.controller).open(bus.node("hw_simulator")):
        seen = Behind(floor.controller, bus, client)
        client.subscribe("/maya_event", "std_msgs/String", lambda event: seen.told.append(read(event["data"])))
        await asyncio.sleep(0)
        yield seen


def near(config: GalilController) -> Joints:
    """Return joints a little away from where homing ends."""
    return homed_pose(config.config)._replace(a=0.3)


async def test_home_and_move_succeed_and_every_event_says_how_everything_stands() -> None:
    async with behind() as floor:
        assert floor.words == ["not_homed"]
        await floor.home()
        assert await floor.move(near(floor.controller)) == (Outcome.SUCCEEDED, "")
        await asyncio.sleep(0)
        assert floor.words == ["not_homed", "homing", "homed", "moving", "idle"]
        modes = [told.standing.mode for told in floor.told]
        assert modes == [Mode.NOT_HOMED, Mode.HOMING, Mode.IDLE, Mode.MOVING, Mode.IDLE]
        assert floor.told[0].standing.strokes is None
        workspace = floor.controller.workspace
        assert floor.told[-1].standing.strokes == (workspace.boom, workspace.line_b, workspace.line_c)
        assert floor.controller.state.joints == pytest.approx(near(floor.controller), abs=1e-3)
