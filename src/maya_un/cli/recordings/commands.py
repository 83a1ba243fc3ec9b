"""The commands for recordings: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import settings_of

Name = Annotated[str, typer.Argument(metavar="FILE", help="a file, or a name that `maya record list` shows")]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    about = "Recordings of the last minutes: states, events and controller traffic. Without a command, list them."
    group = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    group.callback(invoke_without_command=True, **how)(_unless_named)
    for name, command in (("list", listed), ("save", save), ("show", show), ("export", export)):
        group.command(name, **how)(command)
    app.add_typer(group, name="record")
    app.command("replay", **how)(replay)


def _unless_named(context: typer.Context) -> int | None:
    return listed(context) if context.invoked_subcommand is None else None


def listed(context: typer.Context) -> int:
    """List the recordings on this computer, newest first.

    Example: maya record list
    """
    from maya_un.cli.recordings import recordings

    return recordings.listed(settings_of(context))


def save(context: typer.Context) -> int:
    """Let the running robot save its last minutes now.

    Example: maya record save
    """
    from maya_un.cli.recordings import recordings

    return recordings.save(settings_of(context))


def show(context: typer.Context, file: Name) -> int:
    """Show why Maya saved a recording, and its contents.

    Example: maya record show 2026-11-26T14-03-12.maya
    """
    from maya_un.cli.recordings import recordings

    return recordings.show(file, settings_of(context))


def export(
    context: typer.Context,
    file: Name,
    mcap: Annotated[
        str | None, typer.Option(metavar="OUT", help="copy the MCAP file, for Foxglove and other programs")
    ] = None,
    csv: Annotated[str | None, typer.Option(metavar="OUT", help="write the states as CSV")] = None,
    wire: Annotated[
        str | None, typer.Option(metavar="OUT", help="write the bytes sent to and from the controller as CSV")
    ] = None,
) -> int:
    """Write a recording to files for other programs.

    Example: maya record export 2026-11-26T14-03-12.maya --csv states.csv
    """
    from maya_un.cli.recordings import recordings

    return recordings.export(file, mcap, csv, wire, settings_of(context))


def replay(
    context: typer.Context,
    file: Name,
    counts: Annotated[
        float | None,
        typer.Option(
            metavar="COUNTS",
            help="allowed difference of positions in counts  [default: 2 for a recording of a twin that starts at "
            "its power-up, else 50]",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="allowed difference of times in s  [default: 0.02 for a recording of a twin, 0.1 for one of the real "
            "machine]",
        ),
    ] = None,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="a picture of both: .svg, .png or .pdf")] = None,
) -> int:
    """Send the commands of a flight recording to a new twin, and list the differences.

    The recording is one of `maya record`. The twin runs faster than real time. Nothing real moves. The exit code is 1
    if there are differences.

    Example: maya replay 2026-11-26T14-03-12.maya
    """
    from maya_un.cli.recordings import replay as command

    return command.replay(file, command.ReplayOptions(counts, seconds, plot), settings_of(context))
