"""Worker processes for long computations outside the robot's loop, bounded in time, memory and number.

    wire       the protocol between the two processes: length, then a pickle
    child      the worker: works on its requests in turn, a slice of time each
    pool       the client side: takes requests from any loop, chooses the next, returns answers to their loops

Work is a generator function of a module: it yields whenever another request may run. A yielded value other than None is
sent to the caller at once, and the returned value is the answer. See docs/decisions/0039-planning-leaves-the-loop.md.
"""

from __future__ import annotations

from maya_un.workers.pool import ComputeLimits, Work, Workers, WorkerSet, WorkResult

__all__ = ["ComputeLimits", "Work", "WorkResult", "WorkerSet", "Workers"]
