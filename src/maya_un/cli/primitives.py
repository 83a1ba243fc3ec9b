"""A command for each primitive that can be a step of a job, like `maya home` and `maya pick`, from its declaration."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal

import typer

from dmc41x3.i18n import phrase
from maya_un.cli.settings import settings_of
from maya_un.errors import InvalidCommandLine
from maya_un.quantities import joints_of, length
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import JointTarget, Primitive, Switch, Target

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
            app.command(name, help=f"{primitive.help()}\n\n{_example(primitive)}", **how)(_command(primitive))


def _example(primitive: type[Primitive]) -> str:
    match primitive.argument:
        case Target(grasps=True):
            words = "500mm 1100mm"
        case Target():
            words = "500mm 1100mm 600mm"
        case JointTarget():
            words = "30deg 1500mm 1300mm"
        case Switch() as switch:
            words = switch.on
        case _:
            words = ""
    return f"Example: maya {primitive.command} {words}".rstrip()


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
    from maya_un.cli import moving

    argument = {primitive.argument.key: value} if primitive.argument.key else {}
    return moving.request({"command": primitive.command, **argument}, settings_of(context))


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
            raise InvalidCommandLine(reason=phrase("{name} is missing", name="Z"), command=context.command_path)
        return run(context, _lengths(x, y, z))

    return command


def _to_joints(run: Run) -> Run:
    def command(context: typer.Context, a: Goal, b: MaybeB = None, c: MaybeC = None) -> int:
        if b is None:
            return run(context, _name(context, a, "B"))
        if c is None:
            raise InvalidCommandLine(reason=phrase("{name} is missing", name="C"), command=context.command_path)
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
        raise InvalidCommandLine(reason=phrase("{name} is missing", name=missing), command=context.command_path)
    return text
