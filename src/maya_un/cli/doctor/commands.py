"""The command `maya doctor`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import OutputSettings


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Put the command under `app`; `how` is what all commands have in common."""
    app.command(**how)(doctor)


def doctor(
    context: typer.Context,
    address: Annotated[
        str | None, typer.Option(metavar="WHERE", help="the controller to check: real, HOST or HOST:PORT")
    ] = None,
) -> int:
    """Find faults and show remedies; moves nothing, changes nothing.

    A service that runs here is asked; a controller gets a handle of its own only where none does.
    """
    from maya_un.cli.doctor import show

    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return show.doctor(address, settings)
