"""The commands that go through the parser: their arguments, their help, and where each is carried out."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Literal

import typer

from maya_un.address import SIM
from maya_un.cli import output, primitives, record_commands, teach_commands, zone_commands
from maya_un.cli.access import commands as access
from maya_un.cli.calibrate import commands as calibrate
from maya_un.cli.completion import commands as completion
from maya_un.cli.coms import commands as coms
from maya_un.cli.dmc_tools import commands as dmc_tools
from maya_un.cli.doctor import commands as doctor
from maya_un.cli.fleet import commands as fleet
from maya_un.cli.help import EVERYWHERE
from maya_un.cli.logs import commands as logs
from maya_un.cli.quantities import angle, joints_of, length, point_of, share
from maya_un.cli.queueing import commands as queueing
from maya_un.cli.settings import OutputSettings, settings_of
from maya_un.errors import InvalidCommandLine, UnknownName
from maya_un.values import JOG_AXES

# Unknown options become arguments, so that `maya pick -0.2 1.1` means a place and not an option.
_CONTEXT = {"help_option_names": ["--help"], "ignore_unknown_options": True}
_HOW: dict[str, Any] = {"epilog": EVERYWHERE, "context_settings": _CONTEXT}

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, no_args_is_help=True)
_GROUP: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "epilog": EVERYWHERE}
dmc = typer.Typer(**_GROUP, help="A virtual DMC-41x3, and tools for any.")
config = typer.Typer(**_GROUP, help="The machine's constants.")
app.add_typer(dmc, name="dmc")
app.add_typer(config, name="config")
plot = typer.Typer(**_GROUP, help="Pictures: SVG, PNG or PDF.")
app.add_typer(plot, name="plot")
gclib = typer.Typer(**_GROUP, help="A module gclib for scripts written for Galil's.")
dmc.add_typer(gclib, name="gclib")

Length = Annotated[str, typer.Argument(help="a length in m, or like 120mm")]
Angle = Annotated[str, typer.Argument(help="an angle in rad, or like 30deg")]
Speed = Annotated[float | None, typer.Option(help="speed of the twin's clock, up to 1000; the twin only")]
Seed = Annotated[int | None, typer.Option(help="seed of the twin's position at power-up  [default: 0]")]
Table = Annotated[str | None, typer.Option(metavar="JOB", help="put the parts of this job on the twin's table")]
_ADDRESSES = "sim, real (the configured controller), HOST or HOST:PORT"
Address = Annotated[str, typer.Option(help=_ADDRESSES)]
SkipHome = Annotated[bool, typer.Option("--skip-home", help="accept the homing that the controller's mark records")]
TakeOver = Annotated[
    bool, typer.Option("--take-over", help="take the controller from the program that owns it; only at rest")
]
_KINDS = "ends in .svg, .png or .pdf; default:"
WorkspacePicture = Annotated[str | None, typer.Option(metavar="FILE", help=f"{_KINDS} maya-workspace.svg")]
JobPicture = Annotated[str | None, typer.Option(metavar="FILE", help=f"{_KINDS} maya-job.svg")]
File = Annotated[str | None, typer.Argument(metavar="[FILE]", help="default: --config, else the user's own")]


def run(arguments: list[str], settings: OutputSettings) -> int:
    """Carry out a command line and return its exit code; raises `InvalidCommandLine` for one not understood."""
    command = typer.main.get_command(app)
    try:
        code = command.main(arguments, prog_name="maya", standalone_mode=False, obj=settings)
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        reason = _clause(error.format_message()) or "the command is incomplete"
        raise InvalidCommandLine(reason=reason, command=context.command_path if context else "maya") from error
    return code if isinstance(code, int) else output.DONE


def _clause(message: str) -> str:
    """Return the parser's words without the end that the sentence of the error adds."""
    return " ".join(message.split()).replace(" Did you mean", " Perhaps you meant").rstrip(".?")


@app.command(**_HOW)
def up(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    address: Address = SIM,
    speed: Speed = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="of the HTTP server on loopback; 0: any")] = 4133,
    seed: Seed = None,
    table: Table = None,
    skip_home: SkipHome = False,
    take_over: TakeOver = False,
    journal: Annotated[
        str | None, typer.Option(metavar="FILE", help="file of the queue; memory: no file  [default: the user's]")
    ] = None,
    on_exit: Annotated[Literal["stop", "finish"], typer.Option(help="what the current step does at the end")] = "stop",
    listen: Annotated[str | None, typer.Option(metavar="HOST[:PORT]", help="serve other machines too")] = None,
    tls_cert: Annotated[str | None, typer.Option(metavar="FILE", help="the certificate for --listen, in PEM")] = None,
    tls_key: Annotated[str | None, typer.Option(metavar="FILE", help="its key")] = None,
    plain: Annotated[bool, typer.Option("--plain", help="--listen without TLS, in a trusted network")] = False,
    origin: Annotated[list[str], typer.Option(metavar="URL", help="web page that may send commands; repeatable")] = [],  # noqa: B006
    rosbridge: Annotated[bool, typer.Option("--rosbridge", help="serve rosbridge too, on loopback")] = False,
    rosbridge_port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="serve rosbridge at this port; 0: any  [default: 9090]")
    ] = None,
    coms: Annotated[bool, typer.Option("--coms", help="start `maya coms` too, with rosbridge")] = False,
) -> int:
    """Keep a robot running, real or virtual, and serve it on loopback.

    The queue survives its end and power cuts; nothing moves by itself when it starts again. Ctrl-C or
    `maya down` end it.
    """
    from maya_un.cli import up as command
    from maya_un.cli.remote import RemoteAccess

    remote = RemoteAccess(listen, tls_cert, tls_key, plain, origin)
    finish = on_exit == "finish"
    endpoint = command.ROSBRIDGE_PORT if (rosbridge or coms) and rosbridge_port is None else rosbridge_port
    options = command.UpOptions(
        address, speed, port, seed, table, skip_home, journal, finish, remote, endpoint, take_over, coms
    )
    return command.up(options, settings_of(context))


@app.command(**_HOW)
def down(
    context: typer.Context,
    finish: Annotated[bool, typer.Option("--finish", help="after the current step")] = False,
) -> int:
    """End the `maya up` that runs, and wait until it has.

    The robot stops on its path; the running job is interrupted and waits for the next start.
    """
    from maya_un.cli import down as command

    return command.down(settings_of(context), finish=finish)


@app.command("run", **_HOW)
def run_job(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    job: Annotated[str, typer.Argument(metavar="JOB", help="a YAML or JSON file")],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="in virtual time, on the twin: nothing real moves")
    ] = False,
    speed: Speed = None,
    seed: Seed = None,
    address: Annotated[str | None, typer.Option(help=_ADDRESSES)] = None,
    skip_home: SkipHome = False,
    take_over: TakeOver = False,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="with --dry-run: a picture of it")] = None,
) -> int:
    """Carry out a job and report every step.

    The running robot does it, if there is one. Without one, or with --address, --speed, --seed, --skip-home or
    --take-over, the command connects to a controller or a twin itself.
    """
    from maya_un.cli import run as command

    options = command.RunOptions(dry_run, address, speed, seed, skip_home, plot, take_over)
    return command.run(job, options, settings_of(context))


primitives.register(app, **_HOW)


@app.command(**_HOW)
def jog(
    context: typer.Context,
    axis: Annotated[
        str | None, typer.Argument(metavar="[AXIS]", help="a, b, c; x, y, z of the gripper, or r, outward")
    ] = None,
    distance: Annotated[
        str | None, typer.Argument(metavar="[DISTANCE]", help="in rad or m, or like 5deg, 20mm")
    ] = None,
) -> int:
    """Move along an axis from the present position, as far as the workspace allows.

    Without AXIS and DISTANCE, on a terminal: by keys, with the position and the nearest limits in view.
    """
    from maya_un.cli import wishes

    if axis is None and sys.stdin.isatty() and sys.stdout.isatty():
        from maya_un.cli.pendant import screen

        return screen.jog(settings_of(context))
    if axis is None or distance is None:
        missing = "AXIS" if axis is None else "DISTANCE"
        raise InvalidCommandLine(reason=f"{missing} is missing", command="maya jog")
    if axis not in JOG_AXES:
        raise UnknownName(name=axis, known=", ".join(JOG_AXES))
    way = angle(distance, "DISTANCE") if axis == "a" else length(distance, "DISTANCE")
    return wishes.jog(axis, way, settings_of(context))


@app.command(**_HOW)
def abort(context: typer.Context) -> int:
    """Stop without deceleration; the motors may go off, then run `maya recover`."""
    from maya_un.cli import wishes

    return wishes.abort(settings_of(context))


@app.command(**_HOW)
def pause(context: typer.Context) -> int:
    """Stop on the path and hold all motion until `maya resume`."""
    from maya_un.cli import wishes

    return wishes.pause(settings_of(context))


@app.command(**_HOW)
def resume(context: typer.Context) -> int:
    """Continue after `maya pause`."""
    from maya_un.cli import wishes

    return wishes.resume(settings_of(context))


@app.command(**_HOW)
def speed(
    context: typer.Context,
    ratio: Annotated[str, typer.Argument(metavar="RATIO", help="of the full speed, like 50% or 0.5; at least 1%")],
) -> int:
    """Scale the speed of all motion, the current one included."""
    from maya_un.cli import wishes

    return wishes.speed(share(ratio, "RATIO"), settings_of(context))


@app.command(**_HOW)
def recover(context: typer.Context, take_over: TakeOver = False) -> int:
    """Clear a fault after its cause is removed; moves nothing."""
    from maya_un.cli import wishes

    return wishes.recover(settings_of(context), take_over=take_over)


@app.command(**_HOW)
def call(
    context: typer.Context,
    operation: Annotated[str | None, typer.Argument(metavar="[OPERATION]", help="default: list them all")] = None,
    given: Annotated[list[str], typer.Argument(metavar="[NAME=VALUE]...", help="its parameters, as JSON or text")] = [],  # noqa: B006
) -> int:
    """Send any operation of the HTTP interface, by its name, and print the answer as JSON.

    Example: maya call pause_queue when=now
    """
    from maya_un.cli import call as command

    return command.call(operation, given, settings_of(context))


@app.command(**_HOW)
def fk(context: typer.Context, a: Angle, b: Length, c: Length) -> int:
    """Show the gripper position at joints a, b, c."""
    from maya_un.cli import offline

    return offline.fk(joints_of(a, b, c), settings_of(context))


@app.command(**_HOW)
def ik(context: typer.Context, x: Length, y: Length, z: Length) -> int:
    """Show the joints that hold the gripper at x, y, z."""
    from maya_un.cli import offline

    return offline.ik(point_of(x, y, z), settings_of(context))


@app.command(**_HOW)
def reach(context: typer.Context, x: Length, y: Length, z: Length) -> int:
    """Tell whether x, y, z can be reached; if not, why, and the nearest reachable place."""
    from maya_un.cli import offline

    return offline.reach(point_of(x, y, z), settings_of(context))


@plot.command("workspace", **_HOW)
def plot_workspace(
    context: typer.Context,
    view: Annotated[Literal["section", "plan", "3d", "all"], typer.Option(help="the view")] = "all",
    height: Annotated[str | None, typer.Option(metavar="Z", help="of the plan  [default: the grasp height]")] = None,
    point: Annotated[
        tuple[str, str, str] | None, typer.Option(metavar="X Y Z", help="marks a place and the nearest reachable one")
    ] = None,
    output: WorkspacePicture = None,
) -> int:
    """Draw the workspace of the gripper.

    With the ends of the strokes, the tensions of the lines, and the zones.
    """
    from maya_un.cli import plot as command

    high = None if height is None else length(height, "--height")
    request = command.PlotRequest(view, high, None if point is None else point_of(*point), output)
    return command.workspace(request, settings_of(context))


teach_commands.register(app, _HOW)
zone_commands.register(app, _HOW)
record_commands.register(app, _HOW)
queueing.register(app, _HOW)
logs.register(app, _HOW)
coms.register(app, _HOW)
fleet.register(app, _HOW)
doctor.register(app, _HOW)
completion.register(app, _HOW)
access.register(app, _HOW)


@plot.command("job", **_HOW)
def plot_job(
    context: typer.Context,
    job: Annotated[str, typer.Argument(metavar="JOB", help="a YAML or JSON file")],
    output: JobPicture = None,
) -> int:
    """Draw a job before it runs.

    Axes over time against their limits, tensions, the gripper's path; from the homed pose on, and nothing moves.
    """
    from maya_un.cli import plot_job as command

    return command.plot(job, output, settings_of(context))


@dmc.command(**_HOW)
def serve(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    host: Annotated[str, typer.Option(help="address to listen on")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any")] = 5023,
    also_port: Annotated[list[int], typer.Option(min=1, max=65535, help="one more port; may be repeated")] = [],  # noqa: B006
    udp: Annotated[bool, typer.Option(help="listen on the same UDP ports too")] = True,
    bench: Annotated[bool, typer.Option("--bench", help="servo motors on a bench, not Maya's mechanics")] = False,
    axes: Annotated[int | None, typer.Option(min=1, max=8, help="how many, with --bench  [default: 3]")] = None,
    memory: Annotated[str | None, typer.Option(metavar="FILE", help="file of the burned memory (BN, BP, BV)")] = None,
    firmware: Annotated[str | None, typer.Option(metavar="LINE", help="the answer to ^R^V")] = None,
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
    from maya_un.cli import serve as command

    options = command.ServeOptions(
        host, port, also_port, udp, axes, bench, memory, firmware, speed, seed, table, record
    )
    return command.serve(options, settings_of(context))


@dmc.command(**_HOW)
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
    from maya_un.cli import fault as command

    settings = settings_of(context)
    command.check(name, values or (), seconds, clear=clear, active=active)
    if clear:
        return command.clear(name, twin, settings)
    if active:
        return command.active(twin, settings)
    if name is None:
        return command.kinds(settings)
    return command.inject(name, values or (), seconds, twin, settings)


@dmc.command(**_HOW)
def send(
    context: typer.Context,
    host: Annotated[str, typer.Argument(metavar="HOST[:PORT]", help="or real: the configured controller")],
    commands: Annotated[list[str], typer.Argument(metavar="CMD...", help='one argument each: TP, "SH A", "SH;TP"')],
) -> int:
    """Send commands to a controller and print its replies.

    Ends at the first refused command.
    """
    from maya_un.cli import dmc as command

    return command.send(host, commands, settings_of(context))


dmc_tools.register(dmc, _HOW)
calibrate.register(app, _HOW)


@dmc.command(**_HOW)
def conform(
    context: typer.Context,
    host: Annotated[str, typer.Argument(metavar="HOST[:PORT]", help="or real: the configured controller")],
    moves: Annotated[
        bool, typer.Option("--moves", help="check motion too: motors turn by a few thousand counts")
    ] = False,
    bench: Annotated[
        bool, typer.Option("--bench", help="check everything, on a controller without a machine: see above")
    ] = False,
) -> int:
    """Check whether a controller answers as a DMC-41x3 does.

    Without --moves and --bench nothing moves, and each changed setting is restored.

    --bench is for a controller without a machine. It restores the factory settings, erases program,
    variables and arrays, burns that, and resets the controller. Then it checks all commands, outputs included.
    """
    from maya_un.cli import conform as command

    return command.conform(host, moves, bench, settings_of(context))


@gclib.command("install", **_HOW)
def gclib_install(
    context: typer.Context,
    force: Annotated[bool, typer.Option("--force", help="replace another module of that name")] = False,
) -> int:
    """Install Maya's module gclib into this Python environment."""
    from maya_un.cli import gclib as command

    return command.install(settings_of(context), force=force)


@gclib.command("uninstall", **_HOW)
def gclib_uninstall(context: typer.Context) -> int:
    """Remove Maya's module gclib again."""
    from maya_un.cli import gclib as command

    return command.uninstall(settings_of(context))


@gclib.command("status", **_HOW)
def gclib_status(context: typer.Context) -> int:
    """Show the module that `import gclib` finds here."""
    from maya_un.cli import gclib as command

    return command.status(settings_of(context))


@gclib.command("run", epilog=EVERYWHERE, context_settings=_CONTEXT | {"allow_interspersed_args": False})
def gclib_run(
    script: Annotated[str, typer.Argument(metavar="SCRIPT", help="a Python file")],
    arguments: Annotated[list[str] | None, typer.Argument(metavar="[ARG]...", help="arguments of the script")] = None,
) -> int:
    """Run a script that imports gclib, without installing anything.

    Write `run -- SCRIPT` if the script itself has --json, --lang or --config.
    """
    from maya_un.cli import gclib as command

    return command.run(script, arguments or ())


@config.command(**_HOW)
def show(context: typer.Context) -> int:
    """Print every constant in force."""
    from maya_un.cli import configure

    return configure.show(settings_of(context))


@config.command(**_HOW)
def check(context: typer.Context, file: File = None) -> int:
    """Check a configuration file."""
    from maya_un.cli import configure

    return configure.check(file, settings_of(context))


@config.command(**_HOW)
def init(context: typer.Context, file: File = None) -> int:
    """Write a configuration file to start from."""
    from maya_un.cli import configure

    return configure.init(file, settings_of(context))
