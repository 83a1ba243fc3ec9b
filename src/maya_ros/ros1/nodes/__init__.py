"""The nodes: each module is one, and its `main` is what the scripts of the catkin packages call."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType


def _end(_number: int, _frame: FrameType | None) -> None:
    os._exit(0)


# The imports of a node take a second; until then an end leaves nothing behind.
if (
    threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, _end)
