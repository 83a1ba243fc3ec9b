"""The command `maya coms`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import OutputSettings


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(coms)


def coms(
    context: typer.Context,
    connect: Annotated[
        bool,
        typer.Option("--connect", help="connect at the start; without it, connect when a program sends POST /connect"),
    ] = False,
    url: Annotated[
        str | None,
        typer.Option(metavar="URL", help="the supervisors' server, like mqtt://localhost  [default: $MAYA_COMS_URL]"),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            metavar="PORT",
            help="port of the HTTP server of this program; 0 takes any free port  [default: $PORT, else 3000]",
        ),
    ] = None,
    ip: Annotated[
        str | None,
        typer.Option(
            "--rosbridge", metavar="URL", help="the robot's rosbridge  [default: $IP, else ws://localhost:9090]"
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="name of the robot  [default: $NAME, else coms.name of the configuration, else MAYA]"
        ),
    ] = None,
) -> int:
    """Connect this robot to a server where supervisor programs send steps.

    The server is an MQTT broker or Firebase. maya coms passes the steps to the robot and returns the results. POST
    /connect, POST /disconnect and GET /status control it. Without --url it stays idle. The robot runs with `maya up
    --rosbridge` in another terminal.

    Example: maya coms --url mqtt://localhost --connect
    """
    from maya_un.cli.coms import run

    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return run.coms(settings, connect=connect, url=url, port=port, rosbridge=ip, name=name)
