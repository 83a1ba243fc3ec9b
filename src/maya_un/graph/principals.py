"""Whose wish it is that is carried out in a graph: known where it comes in, asked for where it meets the gate.

It goes with what a message sets going, tasks included, so that nobody on the way has to hand it on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from maya_un.api.access.caller import ROS, Caller

Who = Callable[[], Caller]
"""Tells who it is at this instant."""

_CALLER: ContextVar[Caller] = ContextVar("caller", default=ROS)


def caller() -> Caller:
    """Return whose wish this is: the graph's own (`ROS`) where nobody else's."""
    return _CALLER.get()


@contextmanager
def acting_for(who: Caller) -> Iterator[None]:
    """Have everything that begins in the block be the wish of `who`."""
    token = _CALLER.set(who)
    try:
        yield
    finally:
        _CALLER.reset(token)
