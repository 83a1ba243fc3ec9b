"""The command `maya logs`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

from maya_un.cli.settings import settings_of

Level = Literal["debug", "info", "warning", "error", "critical"]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Put the command under `app`; `how` is what all commands have in common."""
    app.command(**how)(logs)


def logs(
    context: typer.Context,
    follow: Annotated[bool, typer.Option("--follow", help="go on with what comes, until Ctrl-C")] = False,
    since: Annotated[str | None, typer.Option(metavar="WHEN", help="so long ago, like 10m or 2h, or a date")] = None,
    kind: Annotated[list[str] | None, typer.Option(metavar="KIND", help="like fault, job, http; repeatable")] = None,
    level: Annotated[Level, typer.Option(help="nothing less grave")] = "info",
    lines: Annotated[int, typer.Option(min=1, max=10_000, help="so many of the newest, without --since")] = 50,
) -> int:
    """Tell what has happened: events, and what the log says; `maya up` need not run.

    With --json every entry is one line of JSON.
    """
    from maya_un.cli.logs import show

    return show.show(show.wanted(lines, since, kind or (), level), settings_of(context), follow=follow)
