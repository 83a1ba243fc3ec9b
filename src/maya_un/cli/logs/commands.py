"""The command `maya logs`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import settings_of
from maya_un.schema.choices import LogLevel


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(logs)


def logs(
    context: typer.Context,
    follow: Annotated[bool, typer.Option("--follow", help="follow new entries, until Ctrl-C")] = False,
    since: Annotated[
        str | None,
        typer.Option(metavar="WHEN", help="show entries from this time on: 10m, 2h (ago) or a date like 2026-11-20"),
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND", help="show only entries of this kind: fault, job, http, ...; may be repeated"),
    ] = None,
    level: Annotated[LogLevel, typer.Option(help="show entries of this level and above")] = "info",
    lines: Annotated[
        int, typer.Option(metavar="N", min=1, max=10_000, help="show the last N entries, if --since is not given")
    ] = 50,
) -> int:
    """Show events and log messages. `maya up` need not run.

    With --json every entry is one line of JSON.

    Example: maya logs --level warning --since 1h
    """
    from maya_un.cli.logs import show

    return show.show(show.wanted(lines, since, kind or (), level), settings_of(context), follow=follow)
