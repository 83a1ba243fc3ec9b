"""The commands that go through the parser: their arguments, their help, and where each is carried out."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Literal

import typer

from dmc41x3.address import SIM
from dmc41x3.cli import parsing
from maya_un.cli import primitives
from maya_un.cli.access import commands as access
from maya_un.cli.calibrate import commands as calibrate
from maya_un.cli.completion import commands as completion
from maya_un.cli.coms import commands as coms
from maya_un.cli.dmc_tools import commands as dmc
from maya_un.cli.dmc_tools.commands import Seed, Speed, Table
from maya_un.cli.dmc_tools.site import MAYA
from maya_un.cli.doctor import commands as doctor
from maya_un.cli.fleet import commands as fleet
from maya_un.cli.help import EVERYWHERE
from maya_un.cli.logs import commands as logs
from maya_un.cli.places import teach_commands, zone_commands
from maya_un.cli.quantities import angle, joints_of, length, point_of, share
from maya_un.cli.queueing import commands as queueing
from maya_un.cli.recordings import commands as recordings
from maya_un.cli.settings import OutputSettings, settings_of
from maya_un.errors import InvalidCommandLine, UnknownName
from maya_un.values import JOG_AXES

# Unknown options become arguments, so that `maya pick -0.2 1.1` means a place and not an option.
_CONTEXT = {"help_option_names": ["--help"], "ignore_unknown_options": True}
_HOW: dict[str, Any] = {"epilog": EVERYWHERE, "context_settings": _CONTEXT}

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, no_args_is_help=True)
_GROUP: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "epilog": EVERYWHERE}
config = typer.Typer(**_GROUP, help="The machine's constants.")
dmc_tools = dmc.group(_HOW, _GROUP)
app.add_typer(dmc_tools, name="dmc")
app.add_typer(config, name="config")
plot = typer.Typer(**_GROUP, help="Pictures: SVG, PNG or PDF.")
app.add_typer(plot, name="plot")

Length = Annotated[str, typer.Argument(help="a length in m, or like 120mm")]
Angle = Annotated[str, typer.Argument(help="an angle in rad, or like 30deg")]
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
    return parsing.run(app, arguments, settings._replace(site=MAYA), "maya")


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
    from maya_un.cli.service import up as command
    from maya_un.cli.service.listeners import RemoteAccess

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
    from maya_un.cli.service import down as command

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
    from maya_un.cli import primitives

    if axis is None and sys.stdin.isatty() and sys.stdout.isatty():
        from maya_un.cli.pendant import screen

        return screen.jog(settings_of(context))
    if axis is None or distance is None:
        missing = "AXIS" if axis is None else "DISTANCE"
        raise InvalidCommandLine(reason=f"{missing} is missing", command="maya jog")
    if axis not in JOG_AXES:
        raise UnknownName(name=axis, known=", ".join(JOG_AXES))
    way = angle(distance, "DISTANCE") if axis == "a" else length(distance, "DISTANCE")
    return primitives.jog(axis, way, settings_of(context))


@app.command(**_HOW)
def abort(context: typer.Context) -> int:
    """Stop without deceleration; the motors may go off, then run `maya recover`."""
    from maya_un.cli import primitives

    return primitives.abort(settings_of(context))


@app.command(**_HOW)
def pause(context: typer.Context) -> int:
    """Stop on the path and hold all motion until `maya resume`."""
    from maya_un.cli import primitives

    return primitives.pause(settings_of(context))


@app.command(**_HOW)
def resume(context: typer.Context) -> int:
    """Continue after `maya pause`."""
    from maya_un.cli import primitives

    return primitives.resume(settings_of(context))


@app.command(**_HOW)
def speed(
    context: typer.Context,
    ratio: Annotated[str, typer.Argument(metavar="RATIO", help="of the full speed, like 50% or 0.5; at least 1%")],
) -> int:
    """Scale the speed of all motion, the current one included."""
    from maya_un.cli import primitives

    return primitives.speed(share(ratio, "RATIO"), settings_of(context))


@app.command(**_HOW)
def recover(context: typer.Context, take_over: TakeOver = False) -> int:
    """Clear a fault after its cause is removed; moves nothing."""
    from maya_un.cli import primitives

    return primitives.recover(settings_of(context), take_over=take_over)


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
recordings.register(app, _HOW)
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
    from maya_un.cli import plot as command

    return command.plot(job, output, settings_of(context))


calibrate.register(app, _HOW)


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
