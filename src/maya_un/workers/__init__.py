"""Worker processes for long computations outside the robot's loop, bounded in time, memory and number.

    wire       how the two processes talk: length, then a pickle
    child      the worker: works on one request after the other, a slice of each in turn
    turns      whose request has its turn
    pool       the other side: requests come in from any loop, answers go back to it

Work is a generator function of a module: it yields whenever another may have its turn, what it yields besides None is
handed over at once, and what it returns is the answer. See docs/decisions/0039-planning-leaves-the-loop.md.
"""

from __future__ import annotations

from maya_un.workers.pool import ComputeLimits, Work, Workers, WorkerSet, WorkResult

__all__ = ["ComputeLimits", "Work", "WorkResult", "WorkerSet", "Workers"]
