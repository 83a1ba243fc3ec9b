"""Completion values that only the running robot knows: printed fast, or not at all."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import MayaError

PATIENCE = 0.3
"""Longest wait of a completion [s]."""

_VALUES: dict[str, tuple[Request[Any], str]] = {
    "jobs": (requests.jobs(limit=50), "id"),
    "places": (requests.poses(), "name"),
}
"""The request that lists the values of a kind, and the key of a value."""


def run(arguments: list[str]) -> int:
    """Print values of the requested kind, one per line; print nothing if the service cannot be reached."""
    if len(arguments) == 1 and arguments[0] in _VALUES:
        request, key = _VALUES[arguments[0]]
        with suppress(MayaError, KeyError, TypeError):
            found: Any = ServiceClient.find(PATIENCE).ask(request)
            lines = "\n".join(str(one[key]) for one in found)
            if lines:
                output.say(lines)
    return output.DONE
