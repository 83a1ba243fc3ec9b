"""`maya fleet list` and `maya fleet watch`."""

from __future__ import annotations

import asyncio
import json

from maya_un.cli import output
from maya_un.cli.fleet.words import word
from maya_un.cli.settings import OutputSettings
from maya_un.coms.settings import from_environment, where_of
from maya_un.supervisor import Event, Supervisor
from maya_un.supervisor.step import progress_of, result_of


def list_(url: str | None, settings: OutputSettings) -> int:
    """List the robots; raises `SupervisorsNotReached`."""
    found = asyncio.run(_robots(url))
    lines = [word("presence", settings.language, robot=name, state=state) for name, state in found.items()]
    none = word("no_robots", settings.language, where=where_of(url or from_environment().supervisors))
    robots = [{"name": name, "connection": state} for name, state in found.items()]
    return output.answer({"robots": robots}, "\n".join(lines) or none, settings)


async def _robots(url: str | None) -> dict[str, str]:
    async with Supervisor(url) as lab:
        return lab.robots


def watch(robot: str | None, url: str | None, settings: OutputSettings) -> int:
    """Show what robots publish until Ctrl-C; raises `SupervisorsNotReached`."""
    asyncio.run(_watch(robot, url, settings))
    return output.DONE


async def _watch(robot: str | None, url: str | None, settings: OutputSettings) -> None:
    async with Supervisor(url) as lab:
        async for event in lab.watch():
            if robot in {None, event.robot}:
                output.say(_json(event) if settings.json else _sentence(event, settings.language))


def _json(event: Event) -> str:
    return json.dumps({"robot": event.robot, "kind": event.kind, **event.data}, ensure_ascii=False)


def _sentence(event: Event, language: str) -> str:
    result, progress = result_of(event.data), progress_of(event.data)
    if result is not None:
        key = "succeeded" if result.error is None else "failed"
        return word(key, language, robot=event.robot, id=result.id, error=result.error, code=result.code)
    if progress is not None:
        return word(progress.state.value, language, robot=event.robot, id=progress.id)
    return word("presence", language, robot=event.robot, state=event.data.get("connection"))
