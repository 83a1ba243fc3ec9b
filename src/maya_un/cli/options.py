"""Options that commands of several groups have."""

from __future__ import annotations

from typing import Annotated

import typer

TakeOver = Annotated[
    bool,
    typer.Option("--take-over", help="take the controller from the program that owns it; refused while an axis moves"),
]
