"""How a node ends: by a signal, or because the graph says so; at rest, and in time."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from types import FrameType

from maya_un.ros import rosout
from maya_un.ros.threads import LoopCalls

PATIENCE = 12.0
"""A node that is told to end has ended after this time [s], be it by force: roslaunch waits for 15 s."""


class NodeShutdown:
    """Is told that the node is to end, from any thread and at any time, and tells the loop once there is one."""

    def __init__(self) -> None:
        self.over = threading.Event()
        self._wanted = False
        self._asked: asyncio.Event | None = None
        self._post: LoopCalls | None = None

    def listen(self) -> None:
        """Take signals from now on; in the main thread."""
        for kind in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(kind, self._signalled)

    async def asked(self) -> None:
        """Wait until the node is to end."""
        self._post = LoopCalls(asyncio.get_running_loop())
        self._asked = asyncio.Event()
        if self._wanted:
            self._asked.set()
        await self._asked.wait()

    def ask(self) -> None:
        """Ask for the end; the second time changes nothing."""
        if self._wanted:
            return
        self._wanted = True
        force = threading.Timer(PATIENCE, os._exit, (1,))
        force.daemon = True
        force.start()
        if self._post is not None and self._asked is not None:
            self._post(self._asked.set)

    def ask_and_wait(self) -> None:
        """Request the end and wait for it; for rospy, which releases everything when this returns."""
        rosout.leave()
        self.ask()
        self.over.wait(PATIENCE)

    def _signalled(self, _number: int, _frame: FrameType | None) -> None:
        self.ask()
