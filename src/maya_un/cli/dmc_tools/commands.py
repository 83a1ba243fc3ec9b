"""The tools' places under `maya dmc`: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.address import SIM
from maya_un.cli.settings import settings_of

_HOST = "sim (a twin of its own), real (the configured controller), or HOST[:PORT]"
Host = Annotated[str, typer.Argument(metavar="HOST", help=_HOST)]
OwnOrHost = Annotated[str, typer.Argument(metavar="[HOST]", help=_HOST)]
Rate = Annotated[float, typer.Option(help="samples a second")]


def register(dmc: typer.Typer, how: dict[str, Any]) -> None:
    """Put the tools under `dmc`; `how` is what all commands have in common."""
    for command in (terminal, watch, scope, upload, download, capture, replay):
        dmc.command(**how)(command)


def terminal(context: typer.Context, host: OwnOrHost = SIM) -> int:
    """Talk to a controller by hand, with the axes in view.

    Tab completes, F1 helps, F12 stops motion. Without a screen it reads commands from standard input and prints the
    answers.
    """
    from maya_un.cli.dmc_tools.terminal import start

    return start.terminal(host, settings_of(context))


def watch(
    context: typer.Context,
    host: Host,
    channels: Annotated[list[str] | None, typer.Argument(metavar="[EXPR]...", help="as in MG: _TPA, @IN[1], x")] = None,
    rate: Rate = 4.0,
    seconds: Annotated[float | None, typer.Option("--for", help="duration [s]")] = None,
) -> int:
    """Show live values until Ctrl-C.

    Without EXPR, those of the axes. With --json, one line a sample.
    """
    from maya_un.cli.dmc_tools import watch as command

    return command.watch(host, channels or [], rate, seconds, settings_of(context))


def scope(
    context: typer.Context,
    host: Host,
    channels: Annotated[str, typer.Option(help="separated by commas: _TPA,_TEA,_TTB")],
    rate: Rate = 50.0,
    seconds: Annotated[float, typer.Option("--for", help="length of the recording [s]")] = 5.0,
    trigger: Annotated[str | None, typer.Option(help="begin when this expression is not 0: _TPA>1000")] = None,
    csv: Annotated[str | None, typer.Option(metavar="FILE", help="a table")] = None,
    png: Annotated[str | None, typer.Option(metavar="FILE", help="a picture")] = None,
) -> int:
    """Record values over time, to a table, a picture, or the screen.

    Ctrl-C ends it early.
    """
    from maya_un.cli.dmc_tools import scope as command

    request = command.ScopeRequest(command.split_channels(channels), rate, seconds, trigger, csv, png)
    return command.scope(host, request, settings_of(context))


def upload(
    context: typer.Context,
    host: Host,
    file: Annotated[str | None, typer.Argument(metavar="[FILE]", help="default: the screen")] = None,
) -> int:
    """Keep the program of a controller in a file."""
    from maya_un.cli.dmc_tools import program as command

    return command.upload(host, file, settings_of(context))


def download(
    context: typer.Context,
    host: Host,
    file: Annotated[str, typer.Argument(metavar="FILE", help="lines of a DMC program")],
    run: Annotated[str | None, typer.Option(metavar="LABEL", help="then run it from this label; '' is line 0")] = None,
    guard: Annotated[bool, typer.Option("--guard", help="add Maya's guard behind it, as `maya up` does")] = False,
) -> int:
    """Replace the program of a controller by that of a file.

    It is read back, to make sure that it arrived. REM lines stay here, tabs become blanks, and a comment that makes
    a line too long is cut off, as Galil's tools do. If the controller refuses a line, it keeps its old program.
    """
    from maya_un.cli.dmc_tools import program as command

    settings = settings_of(context)
    source = command.guarded(file, settings) if guard else command.read(file)
    return command.download(host, file, source, run, settings)


def capture(
    context: typer.Context,
    host: Host,
    listen: Annotated[int, typer.Option(min=0, max=65535, help="port for the client; 0: any")],
    out: Annotated[str, typer.Option(metavar="FILE", help="one JSON line for each piece of the wire")],
    local: Annotated[str, typer.Option("--host", help="address to listen on")] = "127.0.0.1",
) -> int:
    """Record the traffic between a Galil client and a controller.

    The client connects to this, and this to the controller, until Ctrl-C.
    """
    from maya_un.cli.dmc_tools import capture as command

    return command.capture(host, local, listen, out, settings_of(context))


def replay(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="written by `maya dmc capture`")],
    host: OwnOrHost = SIM,
    tolerance: Annotated[float, typer.Option(help="tolerance of positions [counts]")] = 50.0,
) -> int:
    """Replay a recording, and show the answers that differ.

    Only the client's side is said.
    """
    from maya_un.cli.dmc_tools import replay as command

    return command.replay(file, host, tolerance, settings_of(context))
