"""The commands for several robots: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import settings_of

_ABOUT = "Several robots, over an MQTT broker: see them, send them steps, carry out a process."
_CREDENTIALS = (
    "\n\nThe environment variables MAYA_COMS_USER, MAYA_COMS_PASSWORD_FILE, MAYA_COMS_CA, MAYA_COMS_CERT and "
    "MAYA_COMS_KEY hold the credentials for the broker."
)

Url = Annotated[
    str | None,
    typer.Option(metavar="URL", help="the broker, like mqtt://localhost or mqtts://lab  [default: $MAYA_COMS_URL]"),
]
Deadline = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help="the step must begin within this time, otherwise the robot refuses it; in s, or like 90s, 5min  "
        "[default: 60s]",
    ),
]
ProcessFile = Annotated[str, typer.Argument(metavar="FILE", help="a YAML or JSON file")]
StateFile = Annotated[
    str | None,
    typer.Option(
        "--state",
        metavar="FILE",
        help="file that stores the progress of the process  [default: FILE.state, in the folder of FILE]",
    ),
]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    fleet = typer.Typer(add_completion=False, rich_markup_mode=None, epilog=how["epilog"], help=_ABOUT + _CREDENTIALS)
    fleet.command("list", **how)(list_)
    for command in (watch, send, run):
        fleet.command(**how)(command)
    app.add_typer(fleet, name="fleet")


def list_(
    context: typer.Context,
    url: Url = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="list them again after each change, with their steps, until Ctrl-C")
    ] = False,
) -> int:
    """List the robots, and whether each is connected.

    With --follow the list also shows which step each robot carries out, for which supervisor, and how its last step
    ended. Steps that began before the command are not shown. If the broker does not answer, the command waits for it.
    With --json, each list is a line with one JSON object, as in GET /v1/fleet.

    Example: maya fleet list --url mqtt://localhost
    """
    from maya_un.cli.fleet import robots

    settings = settings_of(context)
    return robots.follow(url, settings) if follow else robots.list_(url, settings)


def watch(
    context: typer.Context,
    robot: Annotated[
        str | None, typer.Argument(metavar="[ROBOT]", help="name of the robot  [default: all robots]")
    ] = None,
    url: Url = None,
) -> int:
    """Show the activity of robots until Ctrl-C.

    It shows connections, accepted and begun steps, and results. With --json, each line is one JSON object.

    Example: maya fleet watch MAYA --url mqtt://localhost
    """
    from maya_un.cli.fleet import robots

    return robots.watch(robot, url, settings_of(context))


def send(
    context: typer.Context,
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="name of the robot")],
    command: Annotated[
        str,
        typer.Argument(
            metavar="COMMAND",
            help="pick, place, approach, gripper, home, or can_teleop (asks whether the robot is ready; nothing moves)",
        ),
    ],
    values: Annotated[
        list[str] | None, typer.Argument(metavar="[VALUE]...", help="X Y Z in m or like 120mm; open or close")
    ] = None,
    url: Url = None,
    deadline: Deadline = None,
) -> int:
    """Send a robot one step and wait for its result.

    Example: maya fleet send MAYA pick 0.5 1.1 0.4
    """
    from maya_un.cli.fleet import robots

    return robots.send(robot, command, values or [], url, deadline, settings_of(context))


def run(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    file: ProcessFile,
    url: Url = None,
    check: Annotated[bool, typer.Option("--check", help="only check the file")] = False,
    state: StateFile = None,
    again: Annotated[bool, typer.Option("--again", help="start over; forget the finished steps")] = False,
    retry: Annotated[list[str], typer.Option(metavar="STEP", help="send this failed step again; may be repeated")] = [],  # noqa: B006
    skip: Annotated[
        list[str], typer.Option(metavar="STEP", help="mark this failed step as skipped and continue; may be repeated")
    ] = [],  # noqa: B006
    abort: Annotated[bool, typer.Option("--abort", help="end the process; running steps continue")] = False,
) -> int:
    """Carry out a process: steps for several robots.

    A step begins when the steps in its `after` are done. The command checks the whole file before it sends anything.
    If you interrupt it, run it again: it continues and repeats no step. If a step fails, the steps after it wait
    until you decide. On a terminal the command asks you.

    Example: maya fleet run hand-over.yaml --retry fetch
    """
    from maya_un.cli.fleet import running

    options = running.FleetRunOptions(file, url, state, check, again, tuple(retry), tuple(skip), abort)
    return running.run(options, settings_of(context))
