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
    follow: Annotated[bool, typer.Option("--follow", help="follow new entries, until Ctrl-C")] = False,
    since: Annotated[str | None, typer.Option(metavar="WHEN", help="begin 10m or 2h ago, or at a date")] = None,
    kind: Annotated[list[str] | None, typer.Option(metavar="KIND", help="like fault, job, http; repeatable")] = None,
    level: Annotated[Level, typer.Option(help="the least level to show")] = "info",
    lines: Annotated[int, typer.Option(min=1, max=10_000, help="number of the newest entries, without --since")] = 50,
) -> int:
    """Show events and log messages; needs no running `maya up`.

    With --json every entry is one line of JSON.
    """
    from maya_un.cli.logs import show

    return show.show(show.wanted(lines, since, kind or (), level), settings_of(context), follow=follow)
