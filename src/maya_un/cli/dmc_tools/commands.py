"""The group `maya dmc`: the tools of `dmc`, with those that know the robot."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from dmc41x3.address import SIM
from dmc41x3.cli import commands as tools
from dmc41x3.cli.commands import AlsoPorts, File, Firmware, Host, Label, MemoryFile, OwnOrHost, Port, Tolerance, Udp
from maya_un.cli.settings import settings_of

Speed = Annotated[float | None, typer.Option(help="speed of the twin's clock, up to 1000; the twin only")]
Seed = Annotated[int | None, typer.Option(help="seed of the twin's position at power-up  [default: 0]")]
Table = Annotated[str | None, typer.Option(metavar="JOB", help="put the parts of this job on the twin's table")]


def group(how: dict[str, Any], of_groups: dict[str, Any]) -> typer.Typer:
    """Return the group; `how` and `of_groups` are the options that all commands and groups have."""
    dmc = typer.Typer(**of_groups, help="A virtual DMC-41x3, and tools for any.")
    tools.add_to(dmc, tools.OwnCommands((serve, fault), download, replay), how, of_groups)
    return dmc


def serve(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    host: Annotated[str, typer.Option(help="address to listen on")] = "127.0.0.1",
    port: Port = 5023,
    also_port: AlsoPorts = [],  # noqa: B006
    udp: Udp = True,
    bench: Annotated[bool, typer.Option("--bench", help="servo motors on a bench, not Maya's mechanics")] = False,
    axes: Annotated[int | None, typer.Option(min=1, max=8, help="how many, with --bench  [default: 3]")] = None,
    memory: MemoryFile = None,
    firmware: Firmware = None,
    speed: Speed = None,
    seed: Seed = None,
    table: Table = None,
    record: Annotated[
        str | None, typer.Option(metavar="FILE", help="append a record of motion, loads, stalls and drops")
    ] = None,
) -> int:
    """Serve a virtual DMC-41x3 on TCP and UDP.

    Prints its address when it listens; Ctrl-C ends it. `maya dmc fault` injects faults.
    --record writes one line of JSON for each contact and drop, and one for every 50 ms of motion.
    """
    from maya_un.cli.dmc_tools import serve as command

    options = command.ServeOptions(
        host, port, also_port, udp, axes, bench, memory, firmware, speed, seed, table, record
    )
    return command.serve(options, settings_of(context))


def fault(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="without one, all kinds are listed")] = None,
    values: Annotated[list[str] | None, typer.Argument(metavar="[PARAMETER=VALUE...]", help="seconds=0.2")] = None,
    seconds: Annotated[float | None, typer.Option("--for", metavar="SECONDS", help="default: until cleared")] = None,
    clear: Annotated[bool, typer.Option("--clear", help="end the fault NAME, without one all faults")] = False,
    active: Annotated[bool, typer.Option("--active", help="list the active faults")] = False,
    twin: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="or PORT; default: the only running one")
    ] = None,
) -> int:
    """Inject a fault into a virtual controller, or end one.

    The controller is one that `maya dmc serve` runs.
    """
    from maya_un.cli.dmc_tools import serve as command

    settings = settings_of(context)
    command.check(name, values or (), seconds, clear=clear, active=active)
    if clear:
        return command.clear(name, twin, settings)
    if active:
        return command.active(twin, settings)
    if name is None:
        return command.kinds(settings)
    return command.inject(name, values or (), seconds, twin, settings)


def download(
    context: typer.Context,
    host: Host,
    file: File,
    run: Label = None,
    guard: Annotated[bool, typer.Option("--guard", help="add Maya's guard behind it, as `maya up` does")] = False,
) -> int:
    """Replace the program of a controller by that of a file.

    It is read back, to make sure that it arrived. REM lines stay here, tabs become blanks, and a comment that makes
    a line too long is cut off, as Galil's tools do. If the controller refuses a line, it keeps its old program.
    """
    from dmc41x3.cli import program as command
    from maya_un.cli.dmc_tools.site import guarded

    settings = settings_of(context)
    source = guarded(file, settings) if guard else command.read(file)
    return command.download(host, file, source, run, settings)


def replay(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="written by `maya dmc capture`")],
    host: OwnOrHost = SIM,
    tolerance: Tolerance = 50.0,
) -> int:
    """Replay a recording, and show the answers that differ.

    Only the client's side is said.
    """
    from dmc41x3.cli import recording as command

    return command.replay(file, host, tolerance, settings_of(context))
