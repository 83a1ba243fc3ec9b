"""The options that only the twin has: where it powers up, and what stands on its table."""

from __future__ import annotations

from pathlib import Path

from maya_un.address import SIM
from maya_un.config import Config
from maya_un.errors import InvalidCommandLine
from maya_un.process.files import load_job
from maya_un.values import Point


def require_twin(address: str, command: str, **options: object) -> None:
    """Raise `InvalidCommandLine` where one of the `options` (None: not given) is for a real machine."""
    given = [name for name, value in options.items() if value is not None]
    if given and address != SIM:
        reason = f"--{given[0]} is for the twin, and {address} is a real machine"
        raise InvalidCommandLine(reason=reason, command=command)


def on_the_table(table: str | None, config: Config) -> dict[str, Point]:
    """Return where the parts of a job file stand at its start [m], none without a file; raises as `load_job`."""
    return {} if table is None else load_job(Path(table)).part_points(config.cell.grasp_height)
