"""The log of a node on /rosout, written in a thread, because rospy calls the master for each line."""

from __future__ import annotations

import logging
from contextlib import suppress
from logging.handlers import QueueHandler, QueueListener
from queue import Full, Queue

from rospy.impl.rosout import RosOutHandler

_WAITING = 1000
"""Most lines that wait for /rosout; further lines appear only on the screen and in the node's file."""

_LOG = logging.getLogger("rosout")


class _LogQueue(QueueHandler):
    """Passes lines to a thread, and drops lines if the queue is full."""

    def enqueue(self, record: logging.LogRecord) -> None:
        """Put a line into the queue, unless it is full."""
        with suppress(Full):
            self.queue.put_nowait(record)


def write_in_thread() -> None:
    """Write to /rosout in a thread from now on, so no line waits for the master; call after `rospy.init_node`."""
    slow = [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler)]
    if not slow:
        return
    waiting: Queue[logging.LogRecord] = Queue(_WAITING)
    listener = QueueListener(waiting, *slow)
    listener.start()  # a daemon: it ends with the program
    for handler in slow:
        _LOG.removeHandler(handler)
    _LOG.addHandler(_LogQueue(waiting))


def leave() -> None:
    """Write nothing more to /rosout, because that would end another node of this name."""
    for handler in [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler | _LogQueue)]:
        _LOG.removeHandler(handler)
