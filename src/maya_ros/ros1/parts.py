"""What stands on the twin's table, as parameters say it: parts by name and place, or the parts of a job file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from maya_un.config import Config, default_path
from maya_un.errors import InvalidValue
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.job import load_job
from maya_un.process.spec.poses import PoseStore
from maya_un.process.spec.tasks import starting_parts
from maya_un.values import Point


def on_the_table(config: Config, job: str, parts: Any) -> dict[str, Point]:
    """Return where parts stand [m]: those that the file `job` begins with ("" for none), and `parts` {NAME: [x, y, z]}.

    Raises `FileUnreadable`, `InvalidJob` and `InvalidValue`.
    """
    standing: dict[str, Point] = {}
    if job:
        book = PoseStore(Mechanism.of(config), default_path().with_name("poses.toml"))
        standing.update(starting_parts(load_job(Path(job)), config.cell.grasp_height, book.taught))
    if not isinstance(parts, Mapping):
        raise InvalidValue(key="parts", value=parts, reason="it is a table of names and places")
    standing.update({str(name): _place(name, place) for name, place in parts.items()})
    return standing


def _place(name: object, place: Any) -> Point:
    try:
        x, y, z = place
        return Point(float(x), float(y), float(z))
    except (TypeError, ValueError):
        raise InvalidValue(key=f"parts/{name}", value=place, reason="a place is [x, y, z] in m") from None
