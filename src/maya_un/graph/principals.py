"""The principal of each command in a graph: set where the command comes in, read where it meets the gate.

It follows the work that a message starts, tasks included, so handlers need not pass it on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from maya_un.api.access.caller import ROS, Caller

Who = Callable[[], Caller]
"""Returns the present principal."""

_CALLER: ContextVar[Caller] = ContextVar("caller", default=ROS)


def caller() -> Caller:
    """Return the principal of this command: the graph itself (`ROS`) unless another one is set."""
    return _CALLER.get()


@contextmanager
def acting_for(who: Caller) -> Iterator[None]:
    """Make `who` the principal of all work that begins in the block."""
    token = _CALLER.set(who)
    try:
        yield
    finally:
        _CALLER.reset(token)
