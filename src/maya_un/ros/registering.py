"""Registrations of this node with the master, in a thread, where rospy may wait for a master that does not answer.

rospy tries for ever to register publishers, subscribers and services, and holds its locks meanwhile. So the thread
calls the master first, and calls rospy only after an answer.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue

import rosgraph
import rospy

from maya_un.errors import MasterGone
from maya_un.ros.master import told
from maya_un.ros.threads import LoopCalls

LOOK = 0.5
"""Wait before the next call of a master that does not answer [s]."""

BURST = 10
"""Number of consecutive registrations after one answer of the master."""

Work = Callable[[], object]


class Registrar:
    """Does work that needs the master in a separate thread, in order; every call returns at once.

    While no master answers, only this thread waits; until then, other nodes do not find the new names.
    `speed` is how fast the loop's clock runs.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed
        self._work: SimpleQueue[Work] = SimpleQueue()
        self._wait = threading.Event()
        threading.Thread(target=self._run, name="maya-register", daemon=True).start()

    def __call__(self, work: Work) -> None:
        """Do `work` after all earlier work."""
        self._work.put(work)

    async def settled(self, within: float | None = None) -> None:
        """Wait until all earlier work is done, at most `within` [s, real time].

        Without a master, it is done when the master is back.
        """
        done = asyncio.Event()
        post = LoopCalls(asyncio.get_running_loop())
        self(lambda: post(done.set))
        with suppress(TimeoutError):
            async with asyncio.timeout(None if within is None else within * self._speed):
                await done.wait()

    def _run(self) -> None:
        while True:
            work = [self._work.get()]
            while len(work) < BURST and not self._work.empty():
                work.append(self._work.get())
            self._await_master()
            for one in work:
                if rospy.is_shutdown():
                    return
                _done(one)

    def _await_master(self) -> None:
        missed = False
        while not rospy.is_shutdown():
            try:
                told(lambda at: at.getPid())
            except (MasterGone, rosgraph.MasterException) as gone:
                if not missed:
                    rospy.logwarn("%s Until it does, other nodes do not find new names of this one.", gone)
                missed = True
                self._wait.wait(LOOK)
            else:
                return


def _done(work: Work) -> None:
    try:
        work()
    except Exception as error:  # noqa: BLE001 - what fails here must not keep the rest from being registered
        rospy.logerr("a registration with the ROS master failed: %r", error)
