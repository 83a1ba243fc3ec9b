"""A pytest plugin that ends what outlives even the time limit of a test.

pytest-timeout raises once in the test. A task may catch that exception; after any failure its timer is off while
fixtures end. This plugin then ends the whole process, with its stacks on standard error. A new worker (`scheduling`)
replaces it, and the interrupted test is listed among the failures.
"""

from __future__ import annotations

import faulthandler
import os
from collections.abc import Iterator
from typing import Any

import pytest

TIMES = 2.0
"""Longest time of a test with its fixtures, as a multiple of its limit."""

STDERR = pytest.StashKey[int]()
LIMIT = pytest.StashKey[float]()


def pytest_configure(config: pytest.Config) -> None:
    """Keep standard error as it is before pytest captures it."""
    config.stash[STDERR] = os.dup(2)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Restore standard error, unless the run ended before it was kept."""
    if STDERR in config.stash:
        os.close(config.stash[STDERR])


@pytest.hookimpl(wrapper=True)
def pytest_timeout_set_timer(item: pytest.Item, settings: Any) -> Iterator[None]:
    """Begin the last limit with the ordinary one."""
    item.stash[LIMIT] = TIMES * settings.timeout
    _begin(item)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_exception_interact(node: pytest.Item | pytest.Collector) -> Iterator[None]:
    """Restart the limit after a failure, which switches off all other timers."""
    try:
        return (yield)
    finally:
        _begin(node)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """End it when everything of the test is over."""
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


def _begin(node: pytest.Item | pytest.Collector) -> None:
    limit = node.stash.get(LIMIT, 0.0)
    if limit > 0.0:
        faulthandler.dump_traceback_later(limit, exit=True, file=node.config.stash[STDERR])
