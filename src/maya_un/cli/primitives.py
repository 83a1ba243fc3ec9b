"""Commands that send one primitive or one motion to the running robot and wait for its end.

`maya home`, `maya pick` and the others that can be steps of a job are generated from the primitives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from math import degrees
from typing import Annotated, Any, Literal

import typer

from dmc41x3.cli.signals import as_ctrl_c
from dmc41x3.i18n import marked, translate
from maya_un.cli import output
from maya_un.cli.client import ANSWER, ServiceClient
from maya_un.cli.progress import chosen
from maya_un.cli.quantities import joints_of, length
from maya_un.cli.report import STEP_KEYS
from maya_un.cli.settings import OutputSettings, settings_of
from maya_un.cli.waiting import INTERRUPTION, PATIENCE, animate, follow
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import JointTarget, Primitive, Switch, Target


def request(primitive: Mapping[str, object], settings: OutputSettings) -> int:
    """Let the running robot carry out a primitive; return the exit code. Ctrl-C and SIGTERM cancel it.

    Raises `ServiceNotRunning` and immediate refusals of the service.
    """
    client = ServiceClient.find()
    with chosen(settings) as display, as_ctrl_c():
        since = client.ask(requests.status())["last_event"]
        accepted = client.ask(requests.task(primitive), timeout=ANSWER)
        report, interrupted = follow(client, accepted["id"], since, display, settings)
    step = report["steps"][0]
    if settings.json:
        output.emit({key: step[key] for key in STEP_KEYS})
    elif report["state"] == "done":
        output.say(translate("Done.", settings.language))
    return output.INTERRUPTED if interrupted else output.concluded(report, settings)


def jog(axis: str, distance: float, settings: OutputSettings) -> int:
    """Move the robot along an axis by `distance` (rad or m) and wait for the end; Ctrl-C and SIGTERM stop it."""
    client = ServiceClient.find()
    with chosen(settings) as display, as_ctrl_c(), ThreadPoolExecutor(1) as other:
        jogging = other.submit(client.ask, requests.jog_by(axis, distance))
        try:
            while not wait({jogging}, PATIENCE).done:
                animate(client, display)
        except KeyboardInterrupt:
            display.note(translate(INTERRUPTION, settings.language))
            client.ask(requests.stop())
            raise
    gone = jogging.result()
    return output.answer(gone, _moved(gone, settings.language), settings)


def _moved(gone: Mapping[str, Any], language: str) -> str:
    way = gone["distance"]
    text = f"{degrees(way):z.2f}°" if gone["axis"] == "a" else f"{way * 1e3:z.1f} mm"
    moved = (
        marked("Moved {axis} by {way}. It stopped because {reason}.")
        if gone["limit"]
        else marked("Moved {axis} by {way}.")
    )
    return translate(moved, language, axis=gone["axis"], way=text, reason=gone["reason"])


def pause(settings: OutputSettings) -> int:
    """Stop the running robot on its path and hold all motion; raises `CannotPause`."""
    report = ServiceClient.find().ask(requests.pause())
    text = (
        marked("Pausing: at rest within {seconds:.2f} s. `maya resume` continues.")
        if report["was_moving"]
        else marked("Paused. `maya resume` continues.")
    )
    said = translate(text, settings.language, seconds=report["duration"])
    return output.answer(report, said, settings)


def speed(ratio: float, settings: OutputSettings) -> int:
    """Scale the speed of all motion of the running robot by `ratio` (0.01 to 1)."""
    answer = ServiceClient.find().ask(requests.speed(ratio))
    return output.answer(
        answer,
        translate("Speed {percent:g} % from now on.", settings.language, percent=100.0 * answer["ratio"]),
        settings,
    )


def recover(settings: OutputSettings, *, take_over: bool) -> int:
    """Clear the fault of the running robot; with `take_over`, take its controller from another program that owns it."""
    answer = ServiceClient.find().ask(requests.recover(take_over=take_over))
    return output.answer(answer, translate("Recovered: the fault is cleared.", settings.language), settings)


def abort(settings: OutputSettings) -> int:
    """Stop the running robot without deceleration; return the exit code."""
    return output.answer(
        ServiceClient.find().ask(requests.abort()),
        translate(
            "Aborted: the axes are at rest. If motors are off, `maya recover` switches them on.", settings.language
        ),
        settings,
    )


def resume(settings: OutputSettings) -> int:
    """Resume the motion of the running robot after a pause."""
    return output.answer(
        ServiceClient.find().ask(requests.resume()), translate("Resumed.", settings.language), settings
    )


Spot = Annotated[
    str,
    typer.Argument(metavar="NAME|X", help="a taught pose, a place in a pallet like tray[1,2], or x in m or like 120mm"),
]
MaybeY = Annotated[str | None, typer.Argument(metavar="[Y]", help="y in m, or like 120mm")]
MaybeZ = Annotated[str | None, typer.Argument(metavar="[Z]", help="z in m, or like 120mm")]
GraspZ = Annotated[
    str | None,
    typer.Argument(metavar="[Z]", help="z in m, or like 120mm  [default: cell.grasp_height of the configuration]"),
]
Goal = Annotated[
    str, typer.Argument(metavar="NAME|A", help="a taught pose, or the angle of the boom in rad, or like 30deg")
]
MaybeB = Annotated[str | None, typer.Argument(metavar="[B]", help="length of line b in m, or like 120mm")]
MaybeC = Annotated[str | None, typer.Argument(metavar="[C]", help="length of line c in m, or like 120mm")]

Run = Callable[..., int]


def register(app: typer.Typer, **how: Any) -> None:
    """Add a command for every primitive to `app`; `how` are Typer's settings of each command."""
    for name, primitive in PRIMITIVES.items():
        if primitive.in_jobs:
            app.command(name, help=primitive.help(), **how)(_command(primitive))


def _command(primitive: type[Primitive]) -> Run:
    run = partial(_run, primitive)
    match primitive.argument:
        case Target(grasps=True):
            return _to_part(run)
        case Target():
            return _to_place(run)
        case JointTarget():
            return _to_joints(run)
        case Switch() as switch:
            return _to_state(run, switch)
        case _:
            return _to_nothing(run)


def _run(primitive: type[Primitive], context: typer.Context, value: object = None) -> int:

    argument = {primitive.argument.key: value} if primitive.argument.key else {}
    return request({"command": primitive.command, **argument}, settings_of(context))


def _to_nothing(run: Run) -> Run:
    def command(context: typer.Context) -> int:
        return run(context)

    return command


def _to_part(run: Run) -> Run:
    def command(context: typer.Context, x: Spot, y: MaybeY = None, z: GraspZ = None) -> int:
        return run(context, _name(context, x, "Y") if y is None else _lengths(x, y, z))

    return command


def _to_place(run: Run) -> Run:
    def command(context: typer.Context, x: Spot, y: MaybeY = None, z: MaybeZ = None) -> int:
        if y is None:
            return run(context, _name(context, x, "Y"))
        if z is None:
            raise InvalidCommandLine(reason="Z is missing", command=context.command_path)
        return run(context, _lengths(x, y, z))

    return command


def _to_joints(run: Run) -> Run:
    def command(context: typer.Context, a: Goal, b: MaybeB = None, c: MaybeC = None) -> int:
        if b is None:
            return run(context, _name(context, a, "B"))
        if c is None:
            raise InvalidCommandLine(reason="C is missing", command=context.command_path)
        return run(context, list(joints_of(a, b, c)))

    return command


def _to_state(run: Run, switch: Switch) -> Run:
    def command(context: typer.Context, state: str) -> int:
        return run(context, state == switch.on)

    command.__annotations__["state"] = Annotated[Literal[switch.on, switch.off], typer.Argument()]
    return command


def _lengths(x: str, y: str, z: str | None) -> list[float]:
    given = {"x": x, "y": y} | ({} if z is None else {"z": z})
    return [length(text, name) for name, text in given.items()]


def _name(context: typer.Context, text: str, missing: str) -> str:
    """Return the name of a place; raises `InvalidCommandLine` for a number, because others must follow it."""
    if not text[:1].isalpha():
        raise InvalidCommandLine(reason=f"{missing} is missing", command=context.command_path)
    return text
