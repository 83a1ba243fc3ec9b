"""The nodes: each module is one, and its `main` is what the scripts of the catkin packages call."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType


def _end(_number: int, _frame: FrameType | None) -> None:
    os._exit(0)


# What a node needs takes a second to be read in, and until then there is nothing that an end could leave behind.
if (
    threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, _end)
