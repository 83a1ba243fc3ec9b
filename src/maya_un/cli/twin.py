"""The options that only the twin has: where it powers up, and what stands on its table."""

from __future__ import annotations

from pathlib import Path

from dmc41x3.address import SIM
from maya_un.cli.configure import taught_places
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config
from maya_un.errors import InvalidCommandLine
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.book import PoseStore
from maya_un.process.files import load_job
from maya_un.process.job import Job
from maya_un.process.tasks import starting_parts
from maya_un.values import Point


def require_twin(address: str, command: str, **options: object) -> None:
    """Raise `InvalidCommandLine` where one of the `options` (None: not given) is for a real machine."""
    given = [name for name, value in options.items() if value is not None]
    if given and address != SIM:
        reason = f"--{given[0]} is for the twin, and {address} is a real machine"
        raise InvalidCommandLine(reason=reason, command=command)


def on_the_table(table: str | None, config: Config, settings: OutputSettings) -> dict[str, Point]:
    """Return where the parts of a job file stand at its start [m], none without a file.

    Raises as `load_job` and `starting_parts`.
    """
    return {} if table is None else parts_of(load_job(Path(table)), config, settings)


def parts_of(job: Job, config: Config, settings: OutputSettings) -> dict[str, Point]:
    """Return where the parts of a job stand at its start [m]; raises as `starting_parts`."""
    book = PoseStore(Mechanism.of(config), taught_places(settings))
    return starting_parts(job, config.cell.grasp_height, book.taught)
