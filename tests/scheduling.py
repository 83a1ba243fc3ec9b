"""Share the tests between workers file by file. Files that start programs come first, in a mix of folders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from zlib import crc32

import pytest
from xdist.scheduler import LoadScopeScheduling

TOGETHER = ("tests/ros/shared/", "tests/conventions/")
"""Folders that one worker runs: their files share a launch, or the parsed source.

The files of tests/dashboard share a robot, but it starts in a second, and every file has a browser of its own.
"""

APART = ("tests/system/test_random_jobs.py",)
"""Files whose cases share nothing and take half an hour each in the long run: each case goes to any worker."""

FIRST = ("tests/conventions/", "tests/dashboard/", "tests/ros/", "tests/system/")
"""Folders of long scopes, for example all conventions, which one worker runs; short files fill the end."""


class Rooms(LoadScopeScheduling):
    """Hands out the tests of a file together, so that the fixtures of a module are set up once."""

    def _split_scope(self, nodeid: str) -> str:
        return _scope(nodeid)

    def mark_test_complete(self, node: Any, item_index: int, duration: float = 0) -> None:
        """Note the end of a test; forget its file after the last one, for every report counts all tests of a worker."""
        super().mark_test_complete(node, item_index, duration)
        of_node = self.assigned_work[node]
        scope = self._split_scope(self.registered_collections[node][item_index])
        if len(of_node) > 1 and all(of_node.get(scope, {"": False}).values()):
            del of_node[scope]


def in_order(items: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Return tests in the order in which workers take them.

    The files of ROS lie evenly among those of tests/system: a launch starts ten processes at once, and two launches
    side by side would keep each other waiting. Within a folder the checksum of a name decides: neighbours in the
    alphabet are about one thing, so they would all wait, or all compute, at the same time.
    """
    folders: dict[str, list[str]] = {}
    for scope in sorted({_scope(item.nodeid) for item in items}, key=lambda scope: crc32(scope.encode())):
        folders.setdefault(_folder(scope), []).append(scope)
    late = folders.pop("", [])
    ranks = {scope: (place / len(of), folder) for folder, of in folders.items() for place, scope in enumerate(of)}
    ranks |= dict.fromkeys(late, (1.0, ""))
    return sorted(items, key=lambda item: ranks[_scope(item.nodeid)])


def _folder(scope: str) -> str:
    return next((folder for folder in FIRST if scope.startswith(folder)), "")


def _scope(nodeid: str) -> str:
    if nodeid.startswith(APART):
        return nodeid
    return next((folder for folder in TOGETHER if nodeid.startswith(folder)), nodeid.partition("::")[0])


def scheduler(config: Any, log: Any) -> Rooms:
    """Return what shares the tests of a run (pytest-xdist)."""
    config.option.loadscopereorder = False  # the order is `in_order`
    return Rooms(config, log)
