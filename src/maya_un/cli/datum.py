"""The datum of a robot that cannot find its position alone: `maya datum`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer

from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.axes import AXES
from maya_un.cli.settings import settings_of
from maya_un.cli.units import OutputUnits, units_of
from maya_un.errors import UnknownName
from maya_un.quantities import ANGLE, LENGTH, joints_of, step

Pose = Annotated[
    tuple[str, str, str],
    typer.Argument(metavar="A B C", help="joints of the pose: angle in rad or like 30deg, lengths in m or like 1500mm"),
]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    about = (
        "Tell a robot without switches where it stands. Without a command, show the datum. Bring the robot to a known "
        "pose (`move`), give its joints (`give`), jog all three axes to another known pose, and confirm that "
        "(`confirm`)."
    )
    group = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    group.callback(invoke_without_command=True, **how)(show)
    for command in (move, give, confirm):
        group.command(**how)(command)
    app.add_typer(group, name="datum")


def show(context: typer.Context) -> int | None:
    """Show whether homing needs a person, and the datum.

    Example: maya datum
    """
    if context.invoked_subcommand is not None:
        return None
    from maya_un.client import requests

    return _answer(context, requests.datum())


def give(
    context: typer.Context,
    pose: Annotated[
        list[str] | None,
        typer.Argument(metavar="[A B C]", help="joints, as 30deg 1500mm 1300mm  [default: the homed pose]"),
    ] = None,
) -> int:
    """Tell Maya the present pose of the robot. Nothing moves.

    Without A B C, Maya assumes the homed pose. Until `maya datum confirm`, motion is slow and stays away from the ends
    of the strokes.

    Example: maya datum give 30deg 1500mm 1300mm
    """
    from maya_un.cli.client import ServiceClient
    from maya_un.client import requests

    if pose:
        a, b, c = joints_of(*_three(pose))
    else:
        a, b, c = ServiceClient.find().ask(requests.datum())["homed_pose"]
    return _answer(context, requests.give_datum((a, b, c)))


def confirm(context: typer.Context, pose: Pose) -> int:
    """Confirm the datum at a second pose. Nothing moves.

    First move each axis: a by at least 5.2 degrees, b and c by at least 50 mm. Then give the joints where the robot
    stands. If they differ from Maya's position by more than 2 degrees or 20 mm, the robot is no longer homed.

    Example: maya datum confirm 45deg 1400mm 1450mm
    """
    from maya_un.client import requests

    a, b, c = joints_of(*pose)
    return _answer(context, requests.confirm_datum((a, b, c)))


def move(
    context: typer.Context,
    axis: Annotated[str, typer.Argument(metavar="AXIS", help="a, b or c")],
    distance: Annotated[
        str, typer.Argument(metavar="DISTANCE", help="at most 5deg or 50mm; a negative length shortens a line")
    ],
) -> int:
    """Slowly move one axis of a robot that is not homed. Watch the robot.

    The move ends early at an active limit switch. With homing.torque_readings, it also ends when a line that it
    shortens carries twice the load.

    Example: maya datum move b -20mm
    """
    from maya_un.cli import moving
    from maya_un.client import requests

    if axis not in AXES:
        raise UnknownName(name=axis, known=", ".join(AXES))
    way = step(distance, "DISTANCE", ANGLE if axis == "a" else LENGTH)
    return moving.travel(requests.guarded_move(axis, way), settings_of(context))


def _three(words: Sequence[str]) -> tuple[str, str, str]:
    from dmc41x3.i18n import phrase
    from maya_un.errors import InvalidCommandLine

    if len(words) != len(AXES):
        raise InvalidCommandLine(reason=phrase("A B C are three values"), command="maya datum give")
    a, b, c = words
    return a, b, c


def _answer(context: typer.Context, request: Any) -> int:
    from maya_un.cli import output
    from maya_un.cli.client import ServiceClient

    settings = settings_of(context)
    found = ServiceClient.find().ask(request)
    return output.answer(found, _described(found, settings.language, units_of(settings)), settings)


def _described(found: dict[str, Any], language: str, units: OutputUnits) -> str:
    lines: list[str] = []
    if found["needed"]:
        reason = translate_phrase(found["reason"], language)
        lines.append(translate("Homing needs a person, because {reason}.", language, reason=reason))
    else:
        lines.append(translate("The robot finds its position alone: `maya home`.", language))
    lines.append(translate("Homed pose: {pose}", language, pose=units.joints(found["homed_pose"])))
    if found["given"] is not None:
        confirmed = marked("Datum: {pose}, confirmed by a second point. All motion is allowed.")
        given = marked("Datum: {pose}. Motion is slow until a second point confirms it: `maya datum confirm`.")
        lines.append(translate(confirmed if found["confirmed"] else given, language, pose=units.joints(found["given"])))
    elif found["needed"]:
        lines.append(translate("No datum is given: `maya datum give`.", language))
    return "\n".join(lines)
