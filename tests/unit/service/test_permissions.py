"""The forecast of what a caller may do: each is compared with the action itself."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import NamedTuple

import pytest

from maya_un.config import Config
from maya_un.errors import MayaError, MotorOff
from maya_un.process.process import Process
from maya_un.robot.robot import MayaRobot
from maya_un.service.access.operations import LOCAL, Caller, Operation, Role
from maya_un.service.permissions import ACTIONS
from maya_un.service.service import Gate, Service
from maya_un.testing import Rig, rig
from tests.unit.controller.bench import FAR, HERE, foreign, homed
from tests.virtual_time import elapse

DONE: dict[str, tuple[Operation, Callable[[Service], Awaitable[object]]]] = {
    "stop": (Operation.STOP, lambda service: service.stop()),
    "home": (Operation.COMMAND, lambda service: service.direct.home()),
    "move": (Operation.COMMAND, lambda service: service.direct.move(HERE._replace(b=1.6))),
    "gripper": (Operation.COMMAND, lambda service: service.direct.gripper(True)),
    "jog": (Operation.JOG, lambda service: service.jog("b", 0.01)),
    "speed": (Operation.SPEED, lambda service: service.speed(0.5)),
    "pause": (Operation.PAUSE, lambda service: service.pause()),
    "resume": (Operation.RESUME, lambda service: service.resume()),
    "recover": (Operation.RECOVER, lambda service: service.recover()),
    "pause queue": (Operation.PAUSE, lambda service: service.queue.pause()),
    "resume queue": (Operation.RESUME, lambda service: service.queue.resume()),
    "step queue": (Operation.STEP, lambda service: service.queue.step()),
}
"""Actions whose outcome shows whether they were allowed."""

CALLERS = {
    "local": LOCAL,
    "viewer": Caller("vic", Role.VIEWER, "lab"),
    "student": Caller("ana", Role.STUDENT, "lab"),
    "operator": Caller("ben", Role.OPERATOR, "lab"),
}


class Scene(NamedTuple):
    """A robot and its service."""

    bench: Rig
    service: Service

    async def ask(self, name: str, caller: Caller) -> MayaError | None:
        """Do an action and return the error that refused it."""
        operation, work = DONE[name]
        gate = Gate(self.service, self.service.access.lease)
        doing = asyncio.ensure_future(gate.call(caller, operation, work))
        doing.add_done_callback(asyncio.Future.exception)  # the end of the test stops what it began
        await asyncio.wait({doing}, timeout=2.0)
        if not doing.done():
            return None
        error = doing.exception()
        assert error is None or isinstance(error, MayaError)
        return error


async def _nothing(scene: Scene) -> None:
    """Leave the robot as it is."""


async def _motion(scene: Scene) -> None:
    asyncio.ensure_future(scene.service.direct.move(FAR)).add_done_callback(asyncio.Future.exception)
    await elapse(3.0)


async def _homing(scene: Scene) -> None:
    asyncio.ensure_future(scene.service.direct.home()).add_done_callback(asyncio.Future.exception)
    await elapse(3.0)


async def _job(scene: Scene) -> None:
    await scene.service.submit({"steps": [{"move": list(FAR)}]})
    await elapse(3.0)


async def _paused_job(scene: Scene) -> None:
    await _job(scene)
    await scene.service.pause()
    await elapse(2.0)


async def _fault(scene: Scene) -> None:
    await foreign(scene.bench, "MOC")
    with pytest.raises(MotorOff):
        await scene.service.direct.move(FAR)


SCENES = {
    "at rest": _nothing, "in motion": _motion, "homing": _homing, "a job": _job, "a paused job": _paused_job,
    "a fault": _fault,
}  # fmt: skip


@asynccontextmanager
async def scene_of(name: str) -> AsyncIterator[Scene]:
    async with rig() if name == "not homed" else homed() as bench:
        config = Config()
        robot = MayaRobot(bench.controller, config)
        process = Process(robot, bench.controller, config)
        scene = Scene(bench, Service(process, robot, bench.controller, config))
        try:
            await SCENES.get(name, _nothing)(scene)
            yield scene
        finally:
            await bench.controller.stop()
            await process.close()


async def held(scene: Scene, caller: Caller) -> Caller:
    """Return a caller who has taken the lease."""
    taken = scene.service.access.lease.take(caller.name, caller.source, force=True)
    return replace(caller, lease=taken.id)


@pytest.mark.parametrize("name", [*SCENES, "not homed"])
@pytest.mark.parametrize("who", CALLERS)
async def test_what_is_forecast_to_be_refused_is_refused_with_the_same_error(name: str, who: str) -> None:
    async with scene_of(name) as scene:
        caller = CALLERS[who]
        for _ in range(2):  # the second time with the lease
            forecast = scene.service.refusals(caller)
            assert forecast.keys() == ACTIONS.keys()
            for action in DONE:
                expected = forecast[action]
                if expected is not None:
                    found = await scene.ask(action, caller)
                    assert (found and found.code, action) == (expected.code, action)
            caller = await held(scene, caller) if caller.role > Role.VIEWER else caller


async def test_refusals_are_equal_as_long_as_the_circumstances_are() -> None:
    known: dict[tuple[object, Caller], object] = {}

    async def look(scene: Scene, lease: str = "") -> None:
        for caller in (*CALLERS.values(), replace(CALLERS["operator"], lease=lease)):
            found = {name: error and error.code for name, error in scene.service.refusals(caller).items()}
            assert known.setdefault((scene.service.circumstances, caller), found) == found

    for name in (*SCENES, "not homed"):
        async with scene_of(name) as scene:
            await look(scene)
            lease = scene.service.access.lease
            with lease.driving("ros", "ros", direct=True):
                await look(scene)
            await look(scene)
            taken = await held(scene, CALLERS["operator"])
            await look(scene, taken.lease)
            lease.release(taken.lease, taken.name)
            await look(scene, taken.lease)
    assert len({str(circumstances) for circumstances, _ in known}) > len(SCENES)


@pytest.mark.parametrize("name", [*SCENES, "not homed"])
@pytest.mark.parametrize("action", DONE)
async def test_what_is_forecast_to_be_allowed_is_allowed(name: str, action: str) -> None:
    async with scene_of(name) as scene:
        if scene.service.refusals()[action] is None:
            assert await scene.ask(action, LOCAL) is None
