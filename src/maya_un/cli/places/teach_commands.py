"""The commands about taught places: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import settings_of

Name = Annotated[str, typer.Argument(metavar="NAME", help="a letter, then letters, digits, dots, hyphens, underscores")]
Replace = Annotated[bool, typer.Option("--replace", help="replace an existing name")]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    app.command(**how)(teach)
    app.command("teach-pallet", **how)(teach_pallet)
    for name, about in (
        ("poses", "List, remove or rename taught poses."),
        ("pallets", "List, remove or rename taught pallets."),
    ):
        group = typer.Typer(add_completion=False, rich_markup_mode=None, help=f"{about} Without a command, list them.")
        group.callback(invoke_without_command=True, **how)(_lister(name))
        group.command("remove", **how)(_remover(name))
        group.command("rename", **how)(_renamer(name))
        app.add_typer(group, name=name)


def teach(context: typer.Context, name: Name, replace: Replace = False) -> int:
    """Store the present position of the gripper as a pose.

    You can use its name in commands (`maya pick NAME`) and in jobs.

    Example: maya teach above_tray
    """
    from maya_un.cli.places import teach as command

    return command.teach(name, settings_of(context), replacing=replace)


def teach_pallet(
    context: typer.Context,
    name: Name,
    rows: Annotated[int, typer.Option(metavar="N", help="number of rows")],
    columns: Annotated[int, typer.Option(metavar="N", help="number of columns")],
    corners: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[POSE]...",
            help="taught poses of the corners; without them the command asks you to move the gripper to each corner",
        ),
    ] = None,
    replace: Replace = False,
) -> int:
    """Store a grid of poses as a pallet.

    Give 3 or 4 corner poses: first and last place of the first row, first and (optional) last place of the last row.
    For a single row or column, give its two ends.

    Example: maya teach-pallet box --rows 3 --columns 4 first right below
    """
    from maya_un.cli.places import teach as command

    grid = command.PalletRequest(name, rows, columns, corners or ())
    return command.teach_pallet(grid, settings_of(context), replacing=replace)


def _lister(what: str) -> Any:
    def lister(context: typer.Context) -> int | None:
        if context.invoked_subcommand is not None:
            return None
        from maya_un.cli.places import teach as command

        return command.poses(settings_of(context)) if what == "poses" else command.pallets(settings_of(context))

    return lister


def _remover(what: str) -> Any:
    def remover(context: typer.Context, name: Name) -> int:
        from maya_un.cli.places import teach as command

        return command.remove(what, name, settings_of(context))

    remover.__doc__ = f"Remove NAME from the {what}.\n\nExample: maya {what} remove above_tray"
    return remover


def _renamer(what: str) -> Any:
    def renamer(
        context: typer.Context, old: Name, new: Annotated[str, typer.Argument(metavar="NEW", help="the new name")]
    ) -> int:
        from maya_un.cli.places import teach as command

        return command.rename(what, old, new, settings_of(context))

    renamer.__doc__ = f"Rename one of the {what}.\n\nExample: maya {what} rename above_tray tray"
    return renamer
