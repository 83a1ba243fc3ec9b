"""The commands that use the parser: their arguments, their help, and the function of each."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Literal

import typer

from dmc41x3.address import SIM
from dmc41x3.cli import parsing
from dmc41x3.i18n import phrase
from maya_un.axes import JOG_AXES
from maya_un.cli import datum, migrate, primitives
from maya_un.cli.access import commands as access
from maya_un.cli.calibrate import commands as calibrate
from maya_un.cli.commission import commands as commission
from maya_un.cli.completion import commands as completion
from maya_un.cli.coms import commands as coms
from maya_un.cli.dmc_tools import commands as dmc
from maya_un.cli.dmc_tools.commands import Seed, Speed, Table, Truth
from maya_un.cli.dmc_tools.site import MAYA
from maya_un.cli.doctor import commands as doctor
from maya_un.cli.fleet import commands as fleet
from maya_un.cli.help import EVERYWHERE
from maya_un.cli.logs import commands as logs
from maya_un.cli.options import TakeOver
from maya_un.cli.places import teach_commands, zone_commands
from maya_un.cli.queueing import commands as queueing
from maya_un.cli.recordings import commands as recordings
from maya_un.cli.settings import OutputSettings, settings_of
from maya_un.errors import InvalidCommandLine, UnknownName
from maya_un.quantities import ANGLE, LENGTH, joints_of, length, point_of, share, step

# Unknown options become arguments, so that `maya pick -0.2 1.1` means a place and not an option.
_CONTEXT = {"help_option_names": ["--help"], "ignore_unknown_options": True}
_HOW: dict[str, Any] = {"epilog": EVERYWHERE, "context_settings": _CONTEXT}

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, no_args_is_help=True)
_GROUP: dict[str, Any] = {"add_completion": False, "rich_markup_mode": None, "epilog": EVERYWHERE}
config = typer.Typer(**_GROUP, help="Show, check or create the configuration.")
dmc_tools = dmc.group(_HOW, _GROUP)
app.add_typer(dmc_tools, name="dmc")
app.add_typer(config, name="config")
plot = typer.Typer(**_GROUP, help="Draw pictures as SVG, PNG or PDF.")
app.add_typer(plot, name="plot")

Boom = Annotated[str, typer.Argument(help="angle of the boom in rad, or like 30deg")]
LineB = Annotated[str, typer.Argument(help="length of line b in m, or like 120mm")]
LineC = Annotated[str, typer.Argument(help="length of line c in m, or like 120mm")]
Coordinate = Annotated[str, typer.Argument(help="coordinate of the gripper in m, or like 120mm")]
_ADDRESSES = (
    "sim, real (the controller at controller.address of the configuration), HOST, HOST:PORT or a serial port "
    "(/dev/ttyUSB0)"
)
Address = Annotated[str, typer.Option(metavar="WHERE", help=_ADDRESSES)]
SkipHome = Annotated[
    bool,
    typer.Option("--skip-home", help="do not home: use the homing that the controller has stored since its last reset"),
]
_KINDS = "file to write, .svg, .png or .pdf; default:"
WorkspacePicture = Annotated[str | None, typer.Option(metavar="FILE", help=f"{_KINDS} maya-workspace.svg")]
JobPicture = Annotated[str | None, typer.Option(metavar="FILE", help=f"{_KINDS} maya-job.svg")]
File = Annotated[
    str | None,
    typer.Argument(
        metavar="[FILE]", help="the file  [default: that of --config, else the configuration file of this user]"
    ),
]


def run(arguments: list[str], settings: OutputSettings) -> int:
    """Carry out a command line and return its exit code; raises `InvalidCommandLine` for an invalid one.

    Example: maya run examples/01_pick_and_place.yaml --dry-run
    """
    return parsing.run(app, arguments, settings._replace(site=MAYA), "maya", others=("status", "stop"))


@app.command(**_HOW)
def up(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    address: Address = SIM,
    speed: Speed = None,
    port: Annotated[
        int,
        typer.Option(
            metavar="PORT", min=0, max=65535, help="port of the HTTP server on loopback; 0 takes any free port"
        ),
    ] = 4133,
    seed: Seed = None,
    truth: Truth = None,
    table: Table = None,
    skip_home: SkipHome = False,
    take_over: TakeOver = False,
    journal: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="file that stores the queue; the word memory stores nothing  [default: maya.db in the state folder "
            "of this user]",
        ),
    ] = None,
    on_exit: Annotated[
        Literal["stop", "finish"], typer.Option(help="when `maya up` ends: stop the current step, or finish it")
    ] = "stop",
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="HOST[:PORT]",
            help="also listen on this address, for other computers; needs a certificate, or --plain  [default port: "
            "4134]",
        ),
    ] = None,
    tls_cert: Annotated[str | None, typer.Option(metavar="FILE", help="the certificate for --listen, in PEM")] = None,
    tls_key: Annotated[
        str | None, typer.Option(metavar="FILE", help="the private key of the certificate, in PEM")
    ] = None,
    plain: Annotated[
        bool,
        typer.Option(
            "--plain",
            help="with --listen: no encryption; others can read tokens on the network, so use it in a trusted network "
            "only",
        ),
    ] = False,
    origin: Annotated[
        list[str],
        typer.Option(
            metavar="URL", help="origin of a web page that may send commands, like https://lab.example; may be repeated"
        ),
    ] = [],  # noqa: B006
    clients_per_address: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=16,
            max=256,
            help="clients (programs or pages in a browser) to expect from one address of another computer, like a "
            "class behind one router; a larger number raises the limits of requests, connections and streams of each "
            "address",
        ),
    ] = 16,
    rosbridge: Annotated[bool, typer.Option("--rosbridge", help="serve rosbridge too, on loopback")] = False,
    rosbridge_port: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="serve rosbridge at this port; 0 takes any free port  [default: 9090]",
        ),
    ] = None,
    ros2: Annotated[
        bool,
        typer.Option(
            "--ros2", help="also appear in the ROS 2 graph of the domain $ROS_DOMAIN_ID; ROS 2 need not be installed"
        ),
    ] = False,
    ros_namespace: Annotated[
        str, typer.Option("--ros-namespace", metavar="NAME", help="the robot's namespace in the ROS 2 graph")
    ] = "",
    ros_remap: Annotated[
        list[str] | None,
        typer.Option("--ros-remap", metavar="FROM:=TO", help="another name for a name in the ROS 2 graph; repeatable"),
    ] = None,
    coms: Annotated[bool, typer.Option("--coms", help="also start `maya coms`, and rosbridge, which it needs")] = False,
    show: Annotated[
        bool, typer.Option("--open", help="open the dashboard in the default browser of this computer")
    ] = False,
) -> int:
    """Run the control program of a robot, real or virtual, and serve it to commands on this computer.

    The queue is stored: it survives the end of `maya up` and power cuts. After a restart nothing moves until a person
    decides. Ctrl-C or `maya down` ends `maya up`.

    Example: maya up --speed 20 --open
    """
    from maya_un.cli.service import up as command
    from maya_un.cli.service.listeners import RemoteAccess

    remote = RemoteAccess(listen, tls_cert, tls_key, plain, origin, clients_per_address)
    finish = on_exit == "finish"
    endpoint = command.ROSBRIDGE_PORT if (rosbridge or coms) and rosbridge_port is None else rosbridge_port
    options = command.UpOptions(
        address, speed, port, seed, truth, table, skip_home, journal, finish, remote, endpoint, take_over, coms, show,
        command.ros2_of(ros_namespace, ros_remap or ()) if ros2 else None,
    )  # fmt: skip
    return command.up(options, settings_of(context))


@app.command(**_HOW)
def down(
    context: typer.Context,
    finish: Annotated[bool, typer.Option("--finish", help="finish the current step first")] = False,
) -> int:
    """End the running `maya up` and wait until it has ended.

    The robot decelerates along the path. The running job is interrupted; after the next start a person decides about
    it with `maya queue recover`.

    Example: maya down --finish
    """
    from maya_un.cli.service import down as command

    return command.down(settings_of(context), finish=finish)


@app.command("run", **_HOW)
def run_job(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    job: Annotated[str, typer.Argument(metavar="JOB", help="a YAML or JSON file")],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="only simulate the job on a twin, faster than real time; nothing moves")
    ] = False,
    speed: Speed = None,
    seed: Seed = None,
    truth: Truth = None,
    address: Annotated[str | None, typer.Option(metavar="WHERE", help=_ADDRESSES)] = None,
    skip_home: SkipHome = False,
    take_over: TakeOver = False,
    plot: Annotated[
        str | None, typer.Option(metavar="FILE", help="with --dry-run: draw the motion into FILE (.svg, .png or .pdf)")
    ] = None,
) -> int:
    """Carry out a job and report every step.

    The robot that `maya up` runs carries it out. If none runs, or with one of --address, --speed, --seed, --truth,
    --skip-home and --take-over, the command itself connects to the controller or twin at --address (default: sim).

    Example: maya run examples/01_pick_and_place.yaml --dry-run
    """
    from maya_un.cli import run as command

    options = command.RunOptions(dry_run, address, speed, seed, truth, skip_home, plot, take_over)
    return command.run(job, options, settings_of(context))


primitives.register(app, **_HOW)


@app.command(**_HOW)
def jog(
    context: typer.Context,
    axis: Annotated[
        str | None,
        typer.Argument(
            metavar="[AXIS]",
            help="a, b or c (joint); x, y or z (gripper); r (horizontal distance of the gripper from the axis of the "
            "boom; positive is outward)",
        ),
    ] = None,
    distance: Annotated[
        str | None,
        typer.Argument(
            metavar="[DISTANCE]",
            help="distance, like 5deg or 20mm; negative moves back. A number without a unit is in rad (at most 0.2) or "
            "m (at most 0.1)",
        ),
    ] = None,
) -> int:
    """Move along an axis from the present position, as far as the workspace allows.

    Without AXIS and DISTANCE, the terminal shows the position and the nearest limits, and you move the robot with
    keys.

    Example: maya jog b -20mm
    """
    from maya_un.cli import moving

    if axis is None and sys.stdin.isatty() and sys.stdout.isatty():
        from maya_un.cli.pendant import screen

        return screen.jog(settings_of(context))
    if axis is None or distance is None:
        missing = "AXIS" if axis is None else "DISTANCE"
        raise InvalidCommandLine(reason=phrase("{name} is missing", name=missing), command="maya jog")
    if axis not in JOG_AXES:
        raise UnknownName(name=axis, known=", ".join(JOG_AXES))
    return moving.jog(axis, step(distance, "DISTANCE", ANGLE if axis == "a" else LENGTH), settings_of(context))


@app.command(**_HOW)
def abort(context: typer.Context) -> int:
    """Stop without deceleration.

    Motors may switch off; then run `maya recover`. To stop normally, use `maya stop`.

    Example: maya abort
    """
    from maya_un.cli import moving

    return moving.abort(settings_of(context))


@app.command(**_HOW)
def pause(context: typer.Context) -> int:
    """Pause all motion until `maya resume`: the robot decelerates along the path and waits.

    Example: maya pause
    """
    from maya_un.cli import moving

    return moving.pause(settings_of(context))


@app.command(**_HOW)
def resume(context: typer.Context) -> int:
    """Continue after `maya pause`.

    Example: maya resume
    """
    from maya_un.cli import moving

    return moving.resume(settings_of(context))


@app.command(**_HOW)
def speed(
    context: typer.Context,
    ratio: Annotated[
        str, typer.Argument(metavar="RATIO", help="share of the full speed, like 50% or 0.5; from 1% to 100%")
    ],
) -> int:
    """Set the speed of all motion as a share of the full speed.

    It also applies to the motion in progress.

    Example: maya speed 50%
    """
    from maya_un.cli import moving

    return moving.speed(share(ratio, "RATIO"), settings_of(context))


@app.command(**_HOW)
def recover(context: typer.Context, take_over: TakeOver = False) -> int:
    """Clear a fault. Remove its cause first. Nothing moves.

    Example: maya recover
    """
    from maya_un.cli import moving

    return moving.recover(settings_of(context), take_over=take_over)


@app.command(**_HOW)
def call(
    context: typer.Context,
    operation: Annotated[
        str | None, typer.Argument(metavar="[OPERATION]", help="name of the operation; without it, list all operations")
    ] = None,
    given: Annotated[
        list[str],
        typer.Argument(metavar="[NAME=VALUE]...", help="parameters of the operation; the value is JSON or text"),
    ] = [],  # noqa: B006
) -> int:
    """Send one operation of the HTTP interface and print the answer as JSON.

    Example: maya call pause_queue when=now
    """
    from maya_un.cli import call as command

    return command.call(operation, given, settings_of(context))


@app.command(**_HOW)
def fk(context: typer.Context, a: Boom, b: LineB, c: LineC) -> int:
    """Show the gripper position at joints a, b, c.

    Example: maya fk 30deg 1500mm 1300mm
    """
    from maya_un.cli import offline

    return offline.fk(joints_of(a, b, c), settings_of(context))


@app.command(**_HOW)
def ik(context: typer.Context, x: Coordinate, y: Coordinate, z: Coordinate) -> int:
    """Show the joint values at which the gripper is at x, y, z.

    Example: maya ik 0.5 1.1 0.4
    """
    from maya_un.cli import offline

    return offline.ik(point_of(x, y, z), settings_of(context))


@app.command(**_HOW)
def reach(context: typer.Context, x: Coordinate, y: Coordinate, z: Coordinate) -> int:
    """Check whether the gripper can reach x, y, z.

    If not, show the reason and the nearest reachable point.

    Example: maya reach 500mm 1100mm 400mm
    """
    from maya_un.cli import offline

    return offline.reach(point_of(x, y, z), settings_of(context))


@plot.command("workspace", **_HOW)
def plot_workspace(
    context: typer.Context,
    view: Annotated[
        Literal["section", "plan", "3d", "all"], typer.Option(help="section: from the side; plan: from above; 3d; all")
    ] = "all",
    height: Annotated[
        str | None,
        typer.Option(
            metavar="Z", help="height at which the plan view is drawn, in m or like 400mm  [default: the grasp height]"
        ),
    ] = None,
    point: Annotated[
        tuple[str, str, str] | None,
        typer.Option(metavar="X Y Z", help="mark this point, and the nearest reachable point if it is not reachable"),
    ] = None,
    output: WorkspacePicture = None,
) -> int:
    """Draw the workspace of the gripper.

    The picture shows the ends of the strokes, the tensions of the lines and the zones.

    Example: maya plot workspace --point 0.5 1.1 0.4
    """
    from maya_un.cli import plot as command

    high = None if height is None else length(height, "--height")
    request = command.PlotRequest(view, high, None if point is None else point_of(*point), output)
    return command.workspace(request, settings_of(context))


datum.register(app, _HOW)
teach_commands.register(app, _HOW)
zone_commands.register(app, _HOW)
recordings.register(app, _HOW)
queueing.register(app, _HOW)
logs.register(app, _HOW)
coms.register(app, _HOW)
fleet.register(app, _HOW)
doctor.register(app, _HOW)
commission.register(app, _HOW)
completion.register(app, _HOW)
access.register(app, _HOW)
migrate.register(app, _HOW)


@plot.command("job", **_HOW)
def plot_job(
    context: typer.Context,
    job: Annotated[str, typer.Argument(metavar="JOB", help="a YAML or JSON file")],
    output: JobPicture = None,
) -> int:
    """Draw a job before it runs.

    The picture shows the axes over time with their limits, the tensions of the lines and the path of the gripper. The
    job starts at the homed pose. Nothing moves.

    Example: maya plot job examples/01_pick_and_place.yaml --output job.png
    """
    from maya_un.cli import plot as command

    return command.plot(job, output, settings_of(context))


calibrate.register(app, _HOW)


@config.command(**_HOW)
def show(context: typer.Context) -> int:
    """Print all constants with the values that Maya uses.

    Example: maya config show
    """
    from maya_un.cli import configure

    return configure.show(settings_of(context))


@config.command(**_HOW)
def check(context: typer.Context, file: File = None) -> int:
    """Check a configuration file.

    Example: maya config check maya.toml
    """
    from maya_un.cli import configure

    return configure.check(file, settings_of(context))


@config.command(**_HOW)
def init(context: typer.Context, file: File = None) -> int:
    """Write a configuration file to start from.

    Example: maya config init maya.toml
    """
    from maya_un.cli import configure

    return configure.init(file, settings_of(context))
