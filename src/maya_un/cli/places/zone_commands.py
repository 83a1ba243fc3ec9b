"""The commands about zones: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

from maya_un.cli.settings import settings_of

Name = Annotated[str, typer.Argument(metavar="NAME", help="letters, digits, - and _")]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    about = "Zones that the robot must not enter. Changes last until `maya up` ends. Without a command, list them."
    group = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    group.callback(invoke_without_command=True, **how)(_unless_named)
    group.command("list", **how)(listed)
    group.command("add", **how)(add)
    group.command("remove", **how)(remove)
    app.add_typer(group, name="zones")


def _unless_named(context: typer.Context) -> int | None:
    return listed(context) if context.invoked_subcommand is None else None


def listed(context: typer.Context) -> int:
    """List all zones in the form that `maya zones add` accepts.

    Example: maya zones list
    """
    from maya_un.cli.places import zones

    return zones.listed(settings_of(context))


def add(
    context: typer.Context,
    name: Name,
    kind: Annotated[
        Literal["box", "cylinder", "half_space"], typer.Argument(metavar="KIND", help="box, cylinder or half_space")
    ],
    values: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[KEY=VALUE]...", help="coordinates and lengths in m, or like 50mm: low=0,1,0 margin=50mm"
        ),
    ] = None,
) -> int:
    """Add a zone, until `maya up` ends. It replaces a zone of the same name.

    KIND and its keys: box (low, high: opposite corners), cylinder (x, y, radius, low, high), half_space (point,
    normal). All kinds have margin, the distance to keep. Write permanent zones into the configuration, which explains
    all keys.

    Example: maya zones add pillar cylinder x=0.8 y=0.8 radius=100mm low=0 high=2
    """
    from maya_un.cli.places import zones

    return zones.add(name, kind, values or (), settings_of(context))


def remove(context: typer.Context, name: Name) -> int:
    """Remove a zone until `maya up` ends; the robot may then enter it.

    Example: maya zones remove pillar
    """
    from maya_un.cli.places import zones

    return zones.remove(name, settings_of(context))
