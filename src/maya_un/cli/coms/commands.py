"""The command `maya coms`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import OutputSettings


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Put the command under `app`; `how` is what all commands have in common."""
    app.command(**how)(coms)


def coms(
    context: typer.Context,
    connect: Annotated[bool, typer.Option("--connect", help="connect at once, not at POST /connect")] = False,
    url: Annotated[
        str | None, typer.Option(metavar="URL", help="the supervisors' server, like mqtt://localhost  [MAYA_COMS_URL]")
    ] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="of this program's HTTP server; 0: any  [PORT, else 3000]")
    ] = None,
    ip: Annotated[
        str | None,
        typer.Option("--rosbridge", metavar="URL", help="the robot's rosbridge  [IP, else ws://localhost:9090]"),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="of the robot  [NAME, else coms.name of the configuration, else MAYA]"),
    ] = None,
) -> int:
    """Carry the steps of remote processes from supervisors to the robot, and the results back.

    POST /connect, POST /disconnect and GET /status control it. Without a URL of supervisors it stays idle. Example:
    `maya up --rosbridge` in one terminal, `maya coms --url mqtt://localhost --connect` in another.
    """
    from maya_un.cli.coms import run

    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return run.coms(settings, connect=connect, url=url, port=port, rosbridge=ip, name=name)
