"""The nodes: each module is one, and the scripts of the catkin packages call its `main`."""

from __future__ import annotations

import _signal as signals  # `signal` is slow to import: until then, Ctrl-C would show a traceback
import os


def _end(_number: int, _frame: object) -> None:
    os._exit(0)


# The imports of a node take a second. Until then, the program can end at once: there is nothing to release.
if signals.getsignal(signals.SIGINT) is signals.default_int_handler:
    try:  # noqa: SIM105 - contextlib is slow to import too
        signals.signal(signals.SIGINT, _end)
    except ValueError:  # only the main thread may set a handler
        pass
