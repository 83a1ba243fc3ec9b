"""The log of a node on /rosout, written in a thread: for each line rospy asks the master for a parameter, and waits."""

from __future__ import annotations

import logging
from contextlib import suppress
from logging.handlers import QueueHandler, QueueListener
from queue import Full, Queue

from rospy.impl.rosout import RosOutHandler

_WAITING = 1000
"""So many lines wait for /rosout; while more wait, later lines are on the screen and in the node's file only."""

_LOG = logging.getLogger("rosout")


class _Waiting(QueueHandler):
    """Hands lines to a thread, and leaves out those for which there is no room."""

    def enqueue(self, record: logging.LogRecord) -> None:
        """Put a line into the queue, where there is room."""
        with suppress(Full):
            self.queue.put_nowait(record)


def write_in_thread() -> None:
    """Write to /rosout in a thread from now on, so that no line waits for the master; after `rospy.init_node`."""
    slow = [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler)]
    if not slow:
        return
    waiting: Queue[logging.LogRecord] = Queue(_WAITING)
    listener = QueueListener(waiting, *slow)
    listener.start()  # a daemon: it ends with the program
    for handler in slow:
        _LOG.removeHandler(handler)
    _LOG.addHandler(_Waiting(waiting))


def leave() -> None:
    """Write nothing more to /rosout: where another node has this name now, it would be ended for that."""
    for handler in [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler | _Waiting)]:
        _LOG.removeHandler(handler)
