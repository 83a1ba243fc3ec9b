"""The group `maya dmc`: the tools of `dmc`, and tools specific to the robot."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from dmc41x3.cli import commands as tools
from dmc41x3.cli.commands import (
    AlsoPorts,
    Bootp,
    File,
    Firmware,
    Host,
    Label,
    MemoryFile,
    Port,
    Serial,
    Udp,
)
from maya_un.cli.dmc_tools.site import MAYA
from maya_un.cli.settings import settings_of

_FACTOR = "factor of the twin's clock against real time, up to 1000"
Speed = Annotated[
    float | None, typer.Option(metavar="FACTOR", help=f"{_FACTOR}; not for a real controller  [default: 1]")
]
TwinSpeed = Annotated[float | None, typer.Option("--speed", metavar="FACTOR", help=f"{_FACTOR}  [default: 1]")]
Seed = Annotated[
    int | None, typer.Option(metavar="N", help="seed of the random position of the twin at power-up  [default: 0]")
]
Truth = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="how the twin's machine differs from the configuration: a file with only the keys that differ, or the "
        "word drawn (small random differences) or miswired (one mistake in the wiring). --seed selects them  "
        "[default: no differences]",
    ),
]
Table = Annotated[str | None, typer.Option(metavar="JOB", help="put the parts of this job on the twin's table")]


def group(how: dict[str, Any], of_groups: dict[str, Any]) -> typer.Typer:
    """Return the group; `how` and `of_groups` are the options of all commands and groups."""
    dmc = typer.Typer(**of_groups, help="Serve a virtual DMC-41x3, and use tools for any DMC-41x3.")
    tools.add_to(dmc, tools.OwnCommands((serve, fault), download), MAYA, how, of_groups)
    return dmc


def serve(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    host: Annotated[str, typer.Option(metavar="HOST", help="address to listen on")] = "127.0.0.1",
    port: Port = 5023,
    also_port: AlsoPorts = [],  # noqa: B006
    udp: Udp = True,
    bench: Annotated[
        bool, typer.Option("--bench", help="simulate free servo motors instead of Maya's mechanics")
    ] = False,
    axes: Annotated[
        int | None, typer.Option(metavar="N", min=1, max=8, help="number of axes, with --bench  [default: 3]")
    ] = None,
    memory: MemoryFile = None,
    firmware: Firmware = None,
    serial: Serial = False,
    bootp: Bootp = None,
    speed: TwinSpeed = None,
    seed: Seed = None,
    truth: Truth = None,
    table: Table = None,
    record: Annotated[str | None, typer.Option(metavar="FILE", help="append a record of the mechanics")] = None,
) -> int:
    """Serve a twin, a virtual DMC-41x3, on TCP and UDP.

    It prints its address when it listens; Ctrl-C ends it. `maya dmc fault` injects faults.

    --record FILE appends one line of JSON for each 50 ms of motion, for each contact with an obstacle, and for each
    pick-up, release and drop of a part.

    Example: maya dmc serve --port 5023 --serial
    """
    from maya_un.cli.dmc_tools import serve as command

    options = command.ServeOptions(
        host, port, also_port, udp, axes, bench, memory, firmware, speed, seed, truth, table, record, serial, bootp
    )
    return command.serve(options, settings_of(context))


def fault(
    context: typer.Context,
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="kind of fault; without it, list all kinds")
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PARAMETER=VALUE...]", help="parameters of the fault, like seconds=0.2"),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for", metavar="SECONDS", help="end the fault after this time  [default: it stays until --clear]"
        ),
    ] = None,
    clear: Annotated[bool, typer.Option("--clear", help="end the fault NAME; without NAME, end all faults")] = False,
    active: Annotated[bool, typer.Option("--active", help="list the active faults")] = False,
    twin: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="address of the twin, HOST:PORT or PORT  [default: the twin that runs, if there is only one]",
        ),
    ] = None,
) -> int:
    """Inject a fault into a running twin, or end one.

    The twin is that of `maya up`, or one that `maya dmc serve` runs.

    Example: maya dmc fault latency seconds=0.2 --for 30
    """
    from maya_un.cli.dmc_tools import fault as command

    settings = settings_of(context)
    command.check(name, values or (), seconds, clear=clear, active=active)
    if clear:
        return command.clear(name, twin, settings)
    if active:
        return command.active(twin, settings)
    if name is None:
        return command.kinds(settings)
    return command.inject(name, values or (), seconds, twin, settings)


def download(  # noqa: D103 - its docstring is that of the tool, see below
    context: typer.Context,
    host: Host,
    file: File,
    run: Label = None,
    guard: Annotated[
        bool, typer.Option("--guard", help="append Maya's watchdog program (the guard), as `maya up` does")
    ] = False,
) -> int:
    from dmc41x3.cli import program as command
    from maya_un.cli.dmc_tools.site import guarded

    settings = settings_of(context)
    source = guarded(file, settings) if guard else command.read(file)
    return command.download(host, file, source, run, settings)


download.__doc__ = (tools.download.__doc__ or "").replace("192.168.1.156", "real")
