"""The command `maya commission`: its arguments and its help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from dmc41x3.address import REAL
from maya_un.cli.dmc_tools.commands import Seed, Truth, TwinSpeed
from maya_un.cli.options import TakeOver
from maya_un.cli.settings import settings_of


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(commission)


def commission(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    address: Annotated[
        str,
        typer.Option(
            metavar="WHERE", help="the controller: real, HOST, HOST:PORT or a serial port; sim rehearses on a twin"
        ),
    ] = REAL,
    restart: Annotated[
        bool, typer.Option("--restart", help="begin again, instead of continuing an interrupted commissioning")
    ] = False,
    answers: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help='with sim: a TOML file that answers some questions by their keys, like "limits.ready" = "quit"; a '
            "simulated person answers the others",
        ),
    ] = None,
    report: Annotated[
        str | None, typer.Option(metavar="FILE", help="write the report to this file, as Markdown")
    ] = None,
    seed: Seed = None,
    truth: Truth = None,
    speed: TwinSpeed = None,
    take_over: TakeOver = False,
) -> int:
    """Check the wiring of a new machine, step by step, together with you.

    Each step says what will move and how far, waits for Enter, and names a mistake with its remedy. Ctrl-C stops; a
    later call continues. At the end it shows the changes of the configuration, and writes them if you confirm.

    Example: maya commission --address sim --truth miswired --seed 3
    """
    from maya_un.cli.commission import run as command

    options = command.CommissionOptions(address, restart, answers, report, seed, truth, speed, take_over)
    return command.commission(options, settings_of(context))
