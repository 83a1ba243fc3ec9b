"""The nodes: each module is one, and the scripts of the catkin packages call its `main`."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType


def _end(_number: int, _frame: FrameType | None) -> None:
    os._exit(0)


# The imports of a node take a second. Until then, the program can end at once: there is nothing to release.
if (
    threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, _end)
