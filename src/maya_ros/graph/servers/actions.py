"""Goals one at a time: refused while another is under way, followed by feedback once they have begun."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import nullcontext

from maya_ros.graph.outcome import failure, success
from maya_ros.graph.protocol import Feedback, GoalRefused, Message
from maya_ros.graph.servers.events import EventSource
from maya_un.cancellation import run_to_end
from maya_un.errors import Busy, Cancelled, RequestError, Stopped
from maya_un.events import Event, HomingBegun, MotionBegun, PhaseBegun

FEEDBACK_RATE = 10.0
"""So often a motion says how far it has come [Hz]; phases are told as they begin."""


class ActionProgress:
    """How a wish goes on: by events and, while something moves, ten times a second.

    `look` returns the feedback now, in a phase of that name. `speed` is how fast the loop's clock runs.
    """

    def __init__(self, feedback: Feedback, look: Callable[[str], Message], *, ticks: bool, speed: float = 1.0) -> None:
        self.begun = False
        self._feedback = feedback
        self._look = look
        self._period = max(1.0, speed) / FEEDBACK_RATE if ticks else 0.0
        self._phase = ""
        self._closed = False
        self._timer: asyncio.TimerHandle | None = None

    def hear(self, event: Event) -> None:
        """Take an event of the floor that the wish is at."""
        match event:
            case PhaseBegun(name):
                self.enter(name)
            case HomingBegun() | MotionBegun():
                self.enter(event.kind)
            case _:
                pass

    def enter(self, phase: str) -> None:
        """Tell that a phase begins; what comes from another loop may come late."""
        if self._closed:
            return
        self._phase = phase
        if self._timer is not None:
            self._timer.cancel()
        self._tell()

    def close(self) -> None:
        """Tell no more."""
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tell(self) -> None:
        self.begun = True
        self._feedback(self._look(self._phase))
        if self._period:
            self._timer = asyncio.get_running_loop().call_later(self._period, self._tell)


class ActionSlot:
    """Lets one wish be carried out at a time, which hears of the `events` of its floor where there are any."""

    def __init__(self, events: EventSource | None = None) -> None:
        self._events = events
        self._doing = ""
        self._free = asyncio.Event()
        self._free.set()

    @property
    def doing(self) -> str:
        """What is under way, "" where nothing is."""
        return self._doing

    async def do(self, name: str, work: Callable[[], Awaitable[None]], course: ActionProgress) -> None:
        """Carry out a wish; raises `Busy` while another is under way, and what `work` raises."""
        if self._doing:
            raise Busy(doing=self._doing)
        self._doing = name
        self._free.clear()
        try:
            with nullcontext() if self._events is None else self._events.listening(course.hear):
                await work()
        finally:
            course.close()
            self._doing = ""
            self._free.set()

    async def act(self, name: str, work: Callable[[], Awaitable[None]], course: ActionProgress) -> Message:
        """Carry out a wish as the goal of an action; what is wrong with it before anything began is a refusal."""
        try:
            await self.do(name, work, course)
        except RequestError as error:
            if course.begun or isinstance(error, Stopped | Cancelled):
                raise
            raise GoalRefused(failure(error)) from error
        return success()

    async def free(self) -> None:
        """Return when nothing is under way, however often this is cancelled meanwhile."""
        await run_to_end(self._free.wait())
