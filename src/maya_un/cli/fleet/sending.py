"""`maya fleet send`."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Sequence

from maya_un.cli import output
from maya_un.cli.fleet.words import word
from maya_un.cli.quantities import angle, duration, length
from maya_un.cli.settings import OutputSettings
from maya_un.errors import InvalidCommandLine, UnknownName
from maya_un.graph.step_text import ARGUMENTS, StepEnd
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.arguments import Switch
from maya_un.supervisor import Supervisor
from maya_un.supervisor.lab import DEADLINE, ONLINE
from maya_un.supervisor.step import check

_COMMAND = "maya fleet send"


def send(
    robot: str, command: str, values: Sequence[str], url: str | None, deadline: str | None, settings: OutputSettings
) -> int:
    """Send a step and wait for its result; raises the error by which it failed, and `UnknownName`."""
    args = _args(command, values)
    check(command, args)
    until = DEADLINE if deadline is None else duration(deadline, "--deadline")
    result = asyncio.run(_send(robot, command, args, url, until, settings))
    return output.answer(json.loads(result.text), word("done", settings.language, robot=robot), settings)


def _args(command: str, values: Sequence[str]) -> dict[str, float]:
    names = ARGUMENTS.get(command)
    if names is None:
        raise UnknownName(name=command, known=", ".join(ARGUMENTS))
    if len(values) != len(names):
        needed = " ".join(name.upper() for name in names) or "no values"
        raise InvalidCommandLine(reason=f"{command} takes {needed}", command=_COMMAND)
    argument = PRIMITIVES[command].argument
    if not isinstance(argument, Switch):
        return {
            name: (angle if name == "a" else length)(value, name) for name, value in zip(names, values, strict=True)
        }
    if values[0] not in {argument.on, argument.off}:
        raise InvalidCommandLine(reason=f"{command} takes {argument.on} or {argument.off}", command=_COMMAND)
    return {names[0]: values[0] == argument.on}


async def _send(
    robot: str, command: str, args: dict[str, float], url: str | None, deadline: float, settings: OutputSettings
) -> StepEnd:
    async with Supervisor(url, deadline=deadline) as lab:
        state = lab.robots.get(robot)
        if state is None:
            raise UnknownName(name=robot, known=", ".join(lab.robots) or "no robots")
        if state != ONLINE and not settings.json:
            print(word("waits_for", settings.language, robot=robot, state=state), file=sys.stderr, flush=True)
        step = lab.robot(robot).do(command, **args)
        async for report in step:
            if not settings.json:
                output.say(word(report.state.value, settings.language, robot=robot, id=report.id))
        return await step
