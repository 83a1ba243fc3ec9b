"""The command `maya doctor`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import OutputSettings


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(doctor)


def doctor(
    context: typer.Context,
    address: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE",
            help="the controller to check if `maya up` does not run: real, HOST, HOST:PORT or a serial port",
        ),
    ] = None,
) -> int:
    """Find faults and show remedies. The command does not move the robot and changes nothing.

    If `maya up` runs on this computer, doctor asks it about the controller. Only if none runs does doctor itself
    connect to the controller (this uses one of its handles).

    Example: maya doctor --address real
    """
    from maya_un.cli.doctor import show

    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return show.doctor(address, settings)
