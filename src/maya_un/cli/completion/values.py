"""Values that only the running robot knows: printed quickly, or not at all."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from maya_un.cli import output
from maya_un.cli.client import Client
from maya_un.errors import MayaError

PATIENCE = 0.3
"""Who presses TAB does not wait longer than that [s]."""

_PATHS = {"jobs": ("/v1/jobs?limit=50", "id"), "places": ("/v1/poses", "name")}


def run(arguments: list[str]) -> int:
    """Print values of the kind that is asked for, one a line; nothing where nobody can be asked."""
    if len(arguments) == 1 and arguments[0] in _PATHS:
        path, key = _PATHS[arguments[0]]
        with suppress(MayaError, KeyError, TypeError):
            found: Any = Client.find(PATIENCE).get(path)
            lines = "\n".join(str(one[key]) for one in found)
            if lines:
                output.say(lines)
    return output.DONE
