"""How the tests are shared between workers: what works by the real clock is one worker's, file by file the rest."""

from __future__ import annotations

from typing import Any

from xdist.scheduler import LoadScopeScheduling

ONE_AT_A_TIME = ("tests/ros", "tests/system")
"""Folders whose tests start programs and sockets; two of one folder at once would only wait for each other."""


class Rooms(LoadScopeScheduling):
    """Hands out tests by file, those of `ONE_AT_A_TIME` by folder, so that what a module sets up is set up once."""

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.partition("::")[0]
        return next((folder for folder in ONE_AT_A_TIME if path.startswith(f"{folder}/")), path)


def scheduler(config: Any, log: Any) -> Rooms:
    """Return what shares the tests of a run (pytest-xdist)."""
    return Rooms(config, log)
