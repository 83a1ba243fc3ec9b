"""Commands by name: a command for a named place is a job of one step."""

from __future__ import annotations

from collections.abc import Mapping

from maya_un.errors import InvalidValue
from maya_un.process.cells import read_reference
from maya_un.process.job import Job
from maya_un.robot.primitives import PRIMITIVES


def named(wish: Mapping[str, object]) -> Job | None:
    """Return the job of a command like {"command": "pick", "target": "shelf"}, None for one that names nothing.

    Raises `InvalidValue` for the cell of a pallet that only a job can tell.
    """
    command = wish.get("command")
    primitive = PRIMITIVES.get(command) if isinstance(command, str) else None
    if primitive is None or not primitive.argument.nameable:
        return None
    key = primitive.argument.key
    name = wish.get(key)
    if not isinstance(name, str) or len(wish) != 2:
        return None
    reference = read_reference(name)
    if reference is not None and isinstance(reference.which, str):
        raise InvalidValue(key=key, value=name, reason="next and each are for jobs; name a cell by row and column")
    return Job.parse({"name": command, "steps": [{command: name}]})
