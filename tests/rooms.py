"""How the tests are shared between workers: file by file, those of ROS as one, and first what starts programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

TOGETHER = "tests/ros/"
"""A folder that is one worker's: a launch starts ten processes at once, with a robot much faster than real time."""
FIRST = (TOGETHER, "tests/system/")
"""Folders whose tests start programs and wait for them: minutes a file. The others fill the end."""


class Rooms(LoadScopeScheduling):
    """Hands out the tests of a file together, so that what a module sets up is set up once."""

    def _split_scope(self, nodeid: str) -> str:
        return TOGETHER if nodeid.startswith(TOGETHER) else nodeid.partition("::")[0]


def in_order(items: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Return tests in the order in which workers take them."""

    def rank(item: pytest.Item) -> int:
        return next((number for number, folder in enumerate(FIRST) if item.nodeid.startswith(folder)), len(FIRST))

    return sorted(items, key=rank)


def scheduler(config: Any, log: Any) -> Rooms:
    """Return what shares the tests of a run (pytest-xdist)."""
    config.option.loadscopereorder = False  # the order is `in_order`
    return Rooms(config, log)
