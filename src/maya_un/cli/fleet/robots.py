"""`maya fleet list`, `watch` and `send`: the robots at a broker, and single commands to them."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Iterator, Sequence
from random import Random

from dmc41x3.i18n import marked, phrase, translate, visible
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.coms.settings import from_environment, where_of
from maya_un.coms.transport import first_to_end, keep
from maya_un.errors import InvalidCommandLine, MayaError, UnknownName, translated
from maya_un.http import dates
from maya_un.quantities import angle, duration, length
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import Switch
from maya_un.schema.encoding import to_json
from maya_un.schema.fleet import FleetRobot, FleetStep, FleetView
from maya_un.steps.text import ARGUMENTS, StepEnd
from maya_un.supervisor import Event, Supervisor
from maya_un.supervisor.fleet import FleetBoard
from maya_un.supervisor.lab import DEADLINE, ONLINE
from maya_un.supervisor.step import StepProgress, StepState, check, check_deadline, progress_of, result_of


def list_(url: str | None, settings: OutputSettings) -> int:
    """List the robots; raises `SupervisorsNotReached`."""
    found = asyncio.run(_robots(url))
    lines = [visible(_presence(name, state, settings.language)) for name, state in found.items()]
    none = translate(
        "The broker {where} knows no robot. Start one with `maya up --coms`.",
        settings.language,
        where=where_of(url or from_environment().supervisors),
    )
    robots = [{"name": name, "connection": state} for name, state in found.items()]
    return output.answer({"robots": robots}, "\n".join(lines) or none, settings)


async def _robots(url: str | None) -> dict[str, str]:
    async with Supervisor(url) as lab:
        return lab.robots


_PERIOD = 0.25
"""Shortest time between two lists [s]."""

_RATE = 100_000
"""Greatest length of lists a second, so that a large fleet does not keep readers busy [bytes/s]."""

_NICER = 5
"""By this the program yields to others: a robot on this computer comes first."""


def follow(url: str | None, settings: OutputSettings) -> int:
    """List the robots with their steps after each change, until Ctrl-C. The broker need not answer."""
    os.nice(_NICER)
    asyncio.run(_follow(url, settings))
    return output.DONE


async def _follow(url: str | None, settings: OutputSettings) -> None:
    board = FleetBoard(where_of(url or from_environment().supervisors))
    changed = asyncio.Event()

    async def watched() -> None:
        async with Supervisor(url) as lab:
            async for event in lab.watch(everything=True):
                board.take(event, dates.moment())
                changed.set()

    def failed(error: MayaError) -> None:
        board.failed(error, dates.moment())
        changed.set()

    await first_to_end(keep(watched, failed, Random()), _list_changes(board, changed, settings))


async def _list_changes(board: FleetBoard, changed: asyncio.Event, settings: OutputSettings) -> None:
    while True:
        await changed.wait()
        changed.clear()
        view = board.view()
        if settings.json:
            text = to_json(view).decode()
        else:
            text = "\n".join([*map(visible, _lines(view, settings.language)), ""])
        output.say(text)
        await asyncio.sleep(max(_PERIOD, len(text) / _RATE))


def _lines(view: FleetView, language: str) -> Iterator[str]:
    if view.trouble is not None:
        yield f"{translated(view.trouble.code, view.trouble.message, language)} ({view.trouble.code})"
    if view.refused:
        yield translate("The broker {where} does not show this user the steps of robots.", language, where=view.broker)
    for robot in view.robots:
        yield _line(robot, language)


def _line(robot: FleetRobot, language: str) -> str:
    step = robot.step or (robot.last[0] if robot.last else None)
    state = translate(_STATES[robot.state], language)
    return "  ".join([robot.name, state, *([] if step is None else _parts(step))])


def _parts(step: FleetStep) -> Iterator[str]:
    yield " ".join([step.command or step.id, *(f"{value}" for value in step.args.values())])
    if step.supervisor:
        yield step.supervisor
    if step.error:
        yield f"{step.error} ({step.code})"


_STATES = {
    "idle": marked("idle"),
    "waiting": marked("a step waits"),
    "working": marked("working"),
    "failed": marked("last step failed"),
    "offline": marked("offline"),
    "lost": marked("link lost"),
    "unknown": marked("unknown"),
}


def watch(robot: str | None, url: str | None, settings: OutputSettings) -> int:
    """Show the messages of all robots, or of `robot` only, until Ctrl-C; raises `SupervisorsNotReached`."""
    asyncio.run(_watch(robot, url, settings))
    return output.DONE


async def _watch(robot: str | None, url: str | None, settings: OutputSettings) -> None:
    async with Supervisor(url) as lab:
        async for event in lab.watch():
            if robot in {None, event.robot}:
                output.say(_json(event) if settings.json else visible(_sentence(event, settings.language)))


def _json(event: Event) -> str:
    return json.dumps({"robot": event.robot, "kind": event.kind, **event.data}, ensure_ascii=False)


def _sentence(event: Event, language: str) -> str:
    result, progress = result_of(event.data), progress_of(event.data)
    if result is not None:
        return end_text(event.robot, result.id, result, language)
    if progress is not None:
        return progress_text(event.robot, progress, language)
    return _presence(event.robot, event.data.get("connection"), language)


def _presence(robot: str, state: object, language: str) -> str:
    return translate("{robot}  {state}", language, robot=robot, state=state)


def waiting_text(robot: str, state: str, language: str) -> str:
    """Return a line about a robot that is not connected."""
    return translate(
        "{robot} is {state}. Its steps wait for it until their deadline.", language, robot=robot, state=state
    )


def progress_text(robot: str, progress: StepProgress, language: str) -> str:
    """Return a line about a step that a robot has accepted or started."""
    return translate(_PROGRESS[progress.state], language, robot=robot, id=progress.id)


_PROGRESS = {
    StepState.ACCEPTED: marked("{robot}  accepted   {id}"),
    StepState.EXECUTING: marked("{robot}  executing  {id}"),
}


def end_text(robot: str, id_: str | None, end: StepEnd, language: str) -> str:
    """Return a line about a step that has ended."""
    done, failed = marked("{robot}  done       {id}"), marked("{robot}  failed     {id}: {error} ({code})")
    text = done if end.error is None else failed
    return translate(text, language, robot=robot, id=id_, error=end.error, code=end.code)


_COMMAND = "maya fleet send"


def send(
    robot: str, command: str, values: Sequence[str], url: str | None, deadline: str | None, settings: OutputSettings
) -> int:
    """Send a step and wait for its result; raises the error with which it failed, and `UnknownName`."""
    args = _args(command, values)
    check(command, args)
    until = DEADLINE if deadline is None else duration(deadline, "--deadline")
    check_deadline(until, "--deadline")
    result = asyncio.run(_send(robot, command, args, url, until, settings))
    return output.answer(
        json.loads(result.text), translate("Done by {robot}.", settings.language, robot=robot), settings
    )


def _args(command: str, values: Sequence[str]) -> dict[str, float]:
    names = ARGUMENTS.get(command)
    if names is None:
        raise UnknownName(name=command, known=", ".join(ARGUMENTS))
    if len(values) != len(names):
        needed = " ".join(name.upper() for name in names) or phrase("no values")
        raise InvalidCommandLine(
            reason=phrase("{command} takes {arguments}", command=command, arguments=needed), command=_COMMAND
        )
    argument = PRIMITIVES[command].argument
    if not isinstance(argument, Switch):
        return {
            name: (angle if name == "a" else length)(value, name) for name, value in zip(names, values, strict=True)
        }
    if values[0] not in {argument.on, argument.off}:
        raise InvalidCommandLine(
            reason=phrase("{command} takes {on} or {off}", command=command, on=argument.on, off=argument.off),
            command=_COMMAND,
        )
    return {names[0]: values[0] == argument.on}


async def _send(
    robot: str, command: str, args: dict[str, float], url: str | None, deadline: float, settings: OutputSettings
) -> StepEnd:
    async with Supervisor(url, deadline=deadline) as lab:
        state = lab.robots.get(robot)
        if state is None:
            raise UnknownName(name=robot, known=", ".join(lab.robots) or "no robots")
        if state != ONLINE and not settings.json:
            print(visible(waiting_text(robot, state, settings.language)), file=sys.stderr, flush=True)
        step = lab.robot(robot).do(command, **args)
        async for report in step:
            if not settings.json:
                output.say(visible(progress_text(robot, report, settings.language)))
        return await step
