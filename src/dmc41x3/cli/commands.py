"""The commands of `dmc`: their arguments, their help, and the module that carries each out."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from dmc41x3.address import PORT, SIM
from dmc41x3.cli import parsing
from dmc41x3.cli.console import ALONE, OutputSettings, Site, settings_of

_COMMAND = "{dmc}"
"""Placeholder in help texts for the words before the name of a tool; the `Site` of the group gives them."""

_REAL = "{real}"
"""Placeholder in help texts for the meaning of `real`; the `Site` of the group gives it."""

_PLACE = "HOST[:PORT] or a serial port (/dev/ttyUSB0, /dev/ttyUSB0@19200)"
_HOST = f"sim (a new twin that ends with the command), real ({_REAL}), {_PLACE}"
Host = Annotated[str, typer.Argument(metavar="HOST", help=_HOST)]
OwnOrHost = Annotated[str, typer.Argument(metavar="[HOST]", help=_HOST)]
Rate = Annotated[float, typer.Option(metavar="RATE", help="samples a second")]
File = Annotated[str, typer.Argument(metavar="FILE", help="lines of a DMC program")]
Label = Annotated[
    str | None,
    typer.Option(metavar="LABEL", help="after the download, run the program from this label; '' means line 0"),
]
Port = Annotated[int, typer.Option(metavar="PORT", min=0, max=65535, help="port; 0 takes any free port")]
AlsoPorts = Annotated[list[int], typer.Option(metavar="PORT", min=1, max=65535, help="one more port; may be repeated")]
Udp = Annotated[bool, typer.Option(help="listen on the same UDP ports too")]
MemoryFile = Annotated[
    str | None, typer.Option(metavar="FILE", help="file that stores the burned memory (BN, BP, BV) between runs")
]
Firmware = Annotated[str | None, typer.Option(metavar="LINE", help="text that the controller answers to ^R^V")]
Serial = Annotated[
    bool, typer.Option("--serial", help="offer a serial port too: a pseudo terminal, whose path is printed")
]
Bootp = Annotated[
    str | None,
    typer.Option(metavar="HOST[:PORT]", help="ask this BOOTP server for an address, as a controller without one does"),
]
Tolerance = Annotated[float, typer.Option(metavar="COUNTS", help="allowed difference of positions in counts")]

Command = Callable[..., int]


class OwnCommands(NamedTuple):
    """The commands that `dmc` and `maya dmc` define separately; those of the `twin` come first in the help."""

    twin: tuple[Command, ...]
    download: Command


def send(
    context: typer.Context,
    host: Annotated[str, typer.Argument(metavar="HOST", help=f"real ({_REAL}), {_PLACE}")],
    commands: Annotated[list[str], typer.Argument(metavar="CMD...", help='one argument each: TP, "SH A", "SH;TP"')],
) -> int:
    """Send commands to a controller and print its replies.

    It stops at the first command that the controller refuses.

    Example: {dmc} send 192.168.1.156 "SH A" TP
    """
    from dmc41x3.cli import connection as command

    return command.send(host, commands, settings_of(context))


def terminal(context: typer.Context, host: OwnOrHost = SIM) -> int:
    """Type commands for a controller, with the axes in view.

    Tab completes a command, F1 shows help, F12 stops the axes. Without a screen it reads commands from standard input
    and prints the answers.

    Example: {dmc} terminal 192.168.1.156
    """
    from dmc41x3.cli.terminal import start

    return start.terminal(host, settings_of(context))


def watch(
    context: typer.Context,
    host: Host,
    channels: Annotated[
        list[str] | None,
        typer.Argument(metavar="[EXPR]...", help="expressions of the DMC language, as in MG: _TPA, @IN[1], x"),
    ] = None,
    rate: Rate = 4.0,
    seconds: Annotated[float | None, typer.Option("--for", metavar="SECONDS", help="duration in s")] = None,
) -> int:
    """Show live values until Ctrl-C.

    Without EXPR it shows the positions and states of the axes. With --json it prints one line for each sample.

    Example: {dmc} watch sim _TPA "@IN[1]" --rate 10
    """
    from dmc41x3.cli import scope as command

    return command.watch(host, channels or [], rate, seconds, settings_of(context))


def scope(
    context: typer.Context,
    host: Host,
    channels: Annotated[
        str, typer.Option(metavar="OPERANDS", help="operands to record, separated by commas, like _TPA,_TEA,_TTB")
    ],
    rate: Rate = 50.0,
    seconds: Annotated[float, typer.Option("--for", metavar="SECONDS", help="length of the recording in s")] = 5.0,
    trigger: Annotated[
        str | None, typer.Option(metavar="EXPR", help="begin when this expression is not 0: _TPA>1000")
    ] = None,
    csv: Annotated[str | None, typer.Option(metavar="FILE", help="write a CSV table")] = None,
    png: Annotated[str | None, typer.Option(metavar="FILE", help="draw a picture")] = None,
) -> int:
    """Record values over time.

    It writes them to a table (--csv), a picture (--png), or the screen. Ctrl-C ends it early.

    Example: {dmc} scope 192.168.1.156 --channels _TPA,_TEA --for 3 --png scope.png
    """
    from dmc41x3.cli import scope as command

    request = command.ScopeRequest(command.split_channels(channels), rate, seconds, trigger, csv, png)
    return command.scope(host, request, settings_of(context))


def upload(
    context: typer.Context,
    host: Host,
    file: Annotated[
        str | None, typer.Argument(metavar="[FILE]", help="file to write; without it, the command prints the program")
    ] = None,
) -> int:
    """Save the program of a controller to a file, or print it.

    Example: {dmc} upload 192.168.1.156 program.dmc
    """
    from dmc41x3.cli import program as command

    return command.upload(host, file, settings_of(context))


def capture(
    context: typer.Context,
    host: Host,
    listen: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="port for the client; 0 takes any free port")
    ],
    out: Annotated[str, typer.Option(metavar="FILE", help="write one line of JSON for each packet of data")],
    local: Annotated[str, typer.Option("--host", metavar="HOST", help="address to listen on")] = "127.0.0.1",
) -> int:
    """Record the traffic between a Galil client and a controller.

    The command is a proxy. Connect the client to --listen; the command passes the traffic on to the controller. Ctrl-C
    ends it.

    Example: {dmc} capture 192.168.1.156 --listen 5023 --out capture.json
    """
    from dmc41x3.cli import recording as command

    return command.capture(host, local, listen, out, settings_of(context))


def replay(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="written by `{dmc} capture`")],
    host: OwnOrHost = SIM,
    tolerance: Tolerance = 50.0,
) -> int:
    """Replay a capture, and show the answers that differ.

    The command sends only what the client sent.

    Example: {dmc} replay capture.json
    """
    from dmc41x3.cli import recording as command

    return command.replay(file, host, tolerance, settings_of(context))


def conform(
    context: typer.Context,
    host: Annotated[str, typer.Argument(metavar="HOST[:PORT]", help=f"address of the controller, or real ({_REAL})")],
    moves: Annotated[
        bool, typer.Option("--moves", help="check motion too: motors turn by a few thousand counts")
    ] = False,
    bench: Annotated[
        bool,
        typer.Option(
            "--bench", help="check everything, on a controller without a machine; erases its memory: see above"
        ),
    ] = False,
) -> int:
    """Check whether a controller behaves like a DMC-41x3.

    Without --moves and --bench nothing moves, and the command restores each setting that it changes.

    Caution: --bench erases the program, variables, arrays and settings of the controller, also in its burned memory.
    Use it only if no machine is connected. It then checks all commands and outputs.

    Example: {dmc} conform 192.168.1.156
    """
    from dmc41x3.cli import conform as command

    return command.conform(host, moves, bench, settings_of(context))


def find(
    context: typer.Context,
    networks: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NETWORK]...", help="networks like 192.168.1.0/24  [default: those of this computer]"),
    ] = None,
    port: Annotated[int, typer.Option(metavar="PORT", min=1, max=65535, help="port of the controllers")] = PORT,
    serial: Annotated[bool, typer.Option("--serial", help="ask at the serial ports too, at 115200 baud")] = False,
) -> int:
    """Find the controllers in the network, and list serial ports.

    The command connects to each host and asks for its firmware line (^R^V). It sends nothing else. NETWORK
    is at most a /22. Without NETWORK, and if the network is larger than a /22, it searches only the /24 around this
    computer.

    Example: {dmc} find 192.168.1.0/24
    """
    from dmc41x3.cli import network as command

    return command.find(networks or [], port, serial, settings_of(context))


def assign(
    context: typer.Context,
    mac: Annotated[
        str | None, typer.Argument(metavar="[MAC]", help="hardware address of the controller: 00:50:4C:..")
    ] = None,
    address: Annotated[
        str | None, typer.Argument(metavar="[ADDRESS[:PORT]]", help="address that the controller gets")
    ] = None,
    mask: Annotated[str | None, typer.Option(metavar="MASK", help="subnet mask, like 255.255.255.0")] = None,
    burn: Annotated[bool, typer.Option("--burn", help="burn the address (DH 0, BN): it then needs no server")] = False,
    seconds: Annotated[float, typer.Option("--for", metavar="SECONDS", help="longest wait in s")] = 60.0,
    port: Annotated[int, typer.Option(metavar="PORT", min=1, max=65535, help="port of the server")] = 67,
) -> int:
    """Give an address to a controller that has none, by BOOTP or DHCP.

    Without MAC and ADDRESS it lists the Galil controllers that ask for an address, and lets you choose. It answers only
    the controller that is named. Port 67 needs root: run it with sudo. If another DHCP server gives addresses in this
    network, use that one.

    Example: sudo {dmc} assign 00:50:4C:08:01:1F 192.168.1.20 --mask 255.255.255.0 --burn
    """
    from dmc41x3.cli import assign as command

    options = command.AssignOptions(mask, port, seconds, burn)
    return command.assign(mac, address, options, settings_of(context))


def ip(
    context: typer.Context,
    host: Annotated[str, typer.Argument(metavar="HOST", help=f"real ({_REAL}), {_PLACE}")],
    address: Annotated[
        str | None, typer.Option("--set", metavar="ADDRESS", help="new address; DHCP goes off (DH 0, IA)")
    ] = None,
    mask: Annotated[str | None, typer.Option(metavar="MASK", help="new subnet mask (SM)")] = None,
    dhcp: Annotated[bool | None, typer.Option(help="whether the address comes from a DHCP server (DH)")] = None,
    burn: Annotated[
        bool, typer.Option("--burn", help="burn all present settings (BN), so that they hold after power-up")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="change without asking")] = False,
) -> int:
    """Show or change the network settings of a controller.

    After a change of the address the command connects to the new one, and burns only if the controller answers there.
    A controller of this kind has no setting for a gateway.

    Example: {dmc} ip 192.168.1.20 --set 192.168.1.30 --burn
    """
    from dmc41x3.cli import network as command

    return command.ip(host, command.IpChange(address, mask, dhcp, burn, yes), settings_of(context))


def add_to(group: typer.Typer, own: OwnCommands, site: Site, how: dict[str, Any], of_groups: dict[str, Any]) -> None:
    """Add the tools and the group's `own` commands to a group, in the order of its help.

    `how` holds the options of all commands, `of_groups` those of all groups.
    """
    command_class = _command_class(site)
    tools = (send, terminal, watch, scope, upload, own.download, capture, replay, conform, find, assign, ip)
    for command in (*own.twin, *tools):
        group.command(cls=command_class, **how)(command)
    group.add_typer(_gclib_group(how | {"cls": command_class}, of_groups), name="gclib")


def _command_class(site: Site) -> type[TyperCommand]:
    """Return a class of commands; their help explains `real` for `site`, and names the tools with its words."""

    class SiteCommand(TyperCommand):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            parameters: list[Any] = list(self.params)
            for parameter in parameters:
                parameter.help = told(parameter.help)
            self.help = told(self.help)

    def told(text: str | None) -> str | None:
        return text and text.replace(_REAL, site.real).replace(_COMMAND, site.command)

    return SiteCommand


def _gclib_group(how: dict[str, Any], group: dict[str, Any]) -> typer.Typer:
    gclib = typer.Typer(
        **group, help="Install or use a module that replaces Galil's gclib. Scripts then run unchanged."
    )
    gclib.command("install", **how)(gclib_install)
    gclib.command("uninstall", **how)(gclib_uninstall)
    gclib.command("status", **how)(gclib_status)
    context = how["context_settings"] | {"allow_interspersed_args": False}
    gclib.command("run", **how | {"context_settings": context})(gclib_run)
    return gclib


def gclib_install(
    context: typer.Context,
    force: Annotated[bool, typer.Option("--force", help="replace another module of that name")] = False,
) -> int:
    """Install a module gclib into this Python environment.

    Example: {dmc} gclib install
    """
    from dmc41x3.cli import gclib as command

    return command.install(settings_of(context), force=force)


def gclib_uninstall(context: typer.Context) -> int:
    """Remove the module gclib again.

    Example: {dmc} gclib uninstall
    """
    from dmc41x3.cli import gclib as command

    return command.uninstall(settings_of(context))


def gclib_status(context: typer.Context) -> int:
    """Show the module that `import gclib` finds here.

    Example: {dmc} gclib status
    """
    from dmc41x3.cli import gclib as command

    return command.status(settings_of(context))


def gclib_run(
    script: Annotated[str, typer.Argument(metavar="SCRIPT", help="a Python file")],
    arguments: Annotated[list[str] | None, typer.Argument(metavar="[ARG]...", help="arguments of the script")] = None,
) -> int:
    """Run a script that imports gclib, without installing anything.

    If the script has an option that {dmc} has too, like --json, write `run -- SCRIPT ...`.

    Example: {dmc} gclib run my_script.py
    """
    from dmc41x3.cli import gclib as command

    return command.run(script, arguments or ())


_EVERYWHERE = (
    "Every command also takes --json (print the answer as JSON) and --lang en|es (language of messages; "
    "help is in English)."
)
# Unknown options become arguments, so that a command may begin with a minus sign.
_CONTEXT = {"help_option_names": ["--help"], "ignore_unknown_options": True}
_HOW: dict[str, Any] = {"epilog": _EVERYWHERE, "context_settings": _CONTEXT}
_GROUP: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "epilog": _EVERYWHERE}


def run(arguments: list[str], settings: OutputSettings) -> int:
    """Execute a command line and return its exit code; raises `InvalidCommandLine` if it is not valid."""
    return parsing.run(group(), arguments, settings, "dmc")


@cache
def group() -> typer.Typer:
    """Return all commands."""
    dmc = typer.Typer(
        **_GROUP,
        help="Serve a virtual DMC-41x3, and use tools for any DMC-41x3.",
        pretty_exceptions_enable=False,
        no_args_is_help=True,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    add_to(dmc, OwnCommands((serve,), download), ALONE, _HOW, _GROUP)
    return dmc


def serve(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    host: Annotated[str, typer.Option(metavar="HOST", help="address to listen on")] = "127.0.0.1",
    port: Port = 5023,
    also_port: AlsoPorts = [],  # noqa: B006
    udp: Udp = True,
    axes: Annotated[int, typer.Option(metavar="N", min=1, max=8, help="number of servo motors")] = 3,
    memory: MemoryFile = None,
    firmware: Firmware = None,
    serial: Serial = False,
    bootp: Bootp = None,
    speed: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="factor of the twin's clock against real time, up to 1000")
    ] = None,
) -> int:
    """Serve a virtual DMC-41x3 on TCP and UDP.

    It simulates free servo motors. It prints its address when it listens; Ctrl-C ends it.

    Example: {dmc} serve --axes 4 --serial
    """
    from dmc41x3.cli import serve as command

    options = command.BenchOptions(host, port, also_port, udp, axes, memory, firmware, speed, serial, bootp)
    return command.serve(options, settings_of(context))


def download(context: typer.Context, host: Host, file: File, run: Label = None) -> int:
    """Replace the program of a controller by that of a file.

    The command reads the program back to verify it. It does not send REM lines, replaces tabs by blanks, and shortens
    a comment that makes a line too long, as Galil's tools do. If the controller refuses a line, the command restores
    the old program.

    Example: {dmc} download 192.168.1.156 program.dmc --run AUTO
    """
    from dmc41x3.cli import program as command

    return command.download(host, file, command.read(file), run, settings_of(context))
