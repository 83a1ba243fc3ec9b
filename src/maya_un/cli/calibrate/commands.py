"""`maya calibrate`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from dmc41x3.i18n import phrase
from maya_un.cli.settings import settings_of
from maya_un.errors import InvalidCommandLine

MaybeFile = Annotated[
    str | None,
    typer.Argument(
        metavar="[FILE]",
        help="CSV table of measured points with columns a,b,c,x,y,z and optionally sigma, the error of the "
        "measurement; docs/how-to/calibrate.md gives the units",
    ),
]
_HOLD = "keep the present value of a constant: height, phi, length, delta, zero_b, ...; may be repeated"
_COMMAND = "maya calibrate"


class _WithDefault(TyperGroup):
    """A group that passes other arguments to its command `fit`: `maya calibrate FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert `fit` before arguments that name no command."""
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["fit", *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add `calibrate` to `app`; `how` contains the options of all commands."""
    group = typer.Typer(
        cls=_WithDefault,
        add_completion=False,
        rich_markup_mode=None,
        epilog=how["epilog"],
        help="Fit the machine's constants to measured points. To fit: `maya calibrate FILE [--hold NAME] "
        "[--apply]`. To undo the last --apply: `maya calibrate --revert`. `maya calibrate fit --help` lists "
        "the options.",
    )
    for command in (fit, collect, history):
        group.command(**how)(command)
    app.add_typer(group, name="calibrate")


def fit(
    context: typer.Context,
    file: MaybeFile = None,
    hold: Annotated[list[str] | None, typer.Option(metavar="NAME", help=_HOLD)] = None,
    apply: Annotated[bool, typer.Option("--apply", help="write the values into the configuration file")] = False,
    revert: Annotated[bool, typer.Option("--revert", help="restore the values before the last --apply")] = False,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="a picture of the residuals: svg, png, pdf")] = None,
    author: Annotated[
        str | None, typer.Option(metavar="NAME", help="your name in the history  [default: login name]")
    ] = None,
) -> int:
    """Fit the constants to the points of FILE and show them.

    You may omit the word fit. The command changes nothing without --apply.

    Example: maya calibrate points.csv --apply
    """
    from maya_un.cli.calibrate import fit as command

    if revert:
        if file is not None or apply or hold or plot:
            raise InvalidCommandLine(reason="--revert takes no other argument", command=_COMMAND)
        return command.revert(author, settings_of(context))
    if file is None:
        raise InvalidCommandLine(reason=phrase("{name} is missing", name="FILE"), command=_COMMAND)
    return command.fit(file, command.FitOptions(hold or (), apply, plot, author), settings_of(context))


def collect(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="the file to begin or continue")],
    number: Annotated[
        int, typer.Option("--points", metavar="N", min=4, max=500, help="stop when FILE has this many points")
    ] = 20,
) -> int:
    """Move to the most informative poses and measure points there.

    The robot that `maya up` runs moves. You measure the position at each pose. s skips a pose; q ends. The command
    writes each point to FILE at once.

    Example: maya calibrate collect points.csv --points 12
    """
    from maya_un.cli.calibrate import collect as command

    return command.collect(file, number, settings_of(context))


def history(context: typer.Context) -> int:
    """List the calibrations that were applied and reverted.

    Example: maya calibrate history
    """
    from maya_un.cli.calibrate import fit as command

    return command.show_history(settings_of(context))
