"""The commands of `dmc`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from dmc41x3.address import SIM
from dmc41x3.cli import commands as tools
from dmc41x3.cli import parsing
from dmc41x3.cli.commands import AlsoPorts, File, Firmware, Host, Label, MemoryFile, OwnOrHost, Port, Tolerance, Udp
from dmc41x3.cli.settings import OutputSettings, settings_of

_EVERYWHERE = "Everywhere: --json, --lang en|es. real is the controller in $DMC_ADDRESS."
# Unknown options become arguments, so that a command may begin with a minus sign.
_CONTEXT = {"help_option_names": ["--help"], "ignore_unknown_options": True}
_HOW: dict[str, Any] = {"epilog": _EVERYWHERE, "context_settings": _CONTEXT}
_GROUP: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "epilog": _EVERYWHERE}


def run(arguments: list[str], settings: OutputSettings) -> int:
    """Carry out a command line and return its exit code; raises `InvalidCommandLine` for one not understood."""
    return parsing.run(group(), arguments, settings, "dmc")


def group() -> typer.Typer:
    """Return all commands."""
    dmc = typer.Typer(
        **_GROUP,
        help="Tools for any DMC-41x3, and a virtual one.",
        pretty_exceptions_enable=False,
        no_args_is_help=True,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    tools.add_to(dmc, tools.OwnCommands((serve,), download, replay), _HOW, _GROUP)
    return dmc


def serve(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    host: Annotated[str, typer.Option(help="address to listen on")] = "127.0.0.1",
    port: Port = 5023,
    also_port: AlsoPorts = [],  # noqa: B006
    udp: Udp = True,
    axes: Annotated[int, typer.Option(min=1, max=8, help="how many servo motors")] = 3,
    memory: MemoryFile = None,
    firmware: Firmware = None,
    speed: Annotated[float | None, typer.Option(help="how fast the twin's clock runs, up to 1000")] = None,
) -> int:
    """Serve a virtual DMC-41x3 on TCP and UDP.

    Its servo motors stand on a bench. Prints its address when it listens; Ctrl-C ends it.
    """
    from dmc41x3.cli import serve as command

    options = command.BenchOptions(host, port, also_port, udp, axes, memory, firmware, speed)
    return command.serve(options, settings_of(context))


def download(context: typer.Context, host: Host, file: File, run: Label = None) -> int:
    """Replace the program of a controller by that of a file.

    It is read back, to make sure that it arrived. REM lines stay here, tabs become blanks, and a comment that makes
    a line too long is cut off, as Galil's tools do. If the controller refuses a line, it keeps its old program.
    """
    from dmc41x3.cli import program as command

    return command.download(host, file, command.read(file), run, settings_of(context))


def replay(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="written by `dmc capture`")],
    host: OwnOrHost = SIM,
    tolerance: Tolerance = 50.0,
) -> int:
    """Replay a recording, and show the answers that differ.

    Only the client's side is said.
    """
    from dmc41x3.cli import replay as command

    return command.replay(file, host, tolerance, settings_of(context))
