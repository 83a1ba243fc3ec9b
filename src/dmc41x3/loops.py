"""Event loops with their own clocks: a jumping one, a scaled one, and the ordinary one.

No module calls a wall clock or sleeps a thread; time is the loop's. In the jumping loop an hour of
motion takes milliseconds, because the clock is set to the next timer whenever nothing else is ready. In the
scaled loop the clock runs `speed` times as fast as real time (the twin's demonstration). See
docs/decisions/0004-time-is-the-event-loops.md.
"""

from __future__ import annotations

import asyncio
import contextvars
import heapq
import itertools
import selectors
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from math import inf
from typing import Any, TypeVar

T = TypeVar("T")


class Deadlock(RuntimeError):
    """Virtual time cannot continue: nothing is ready, no timer is set and nothing outside is awaited."""


class HorizonReached(RuntimeError):
    """Virtual time exceeds its horizon: a forgotten ticker, or a wait that never ends."""


_LOOK = 0.05
"""Longest wait for work outside the loop before the loop checks for it again [s, real time]."""

_LONGEST_LAPSE = 0.01
"""The scaled clock gains at most this between two readings while there is work [s, real time]."""


class _OrderedTimer(asyncio.TimerHandle):
    """A timer that runs in the order of creation if due times are equal (asyncio's heap does not ensure that)."""

    __slots__ = ("_order",)
    _count = itertools.count()

    def __init__(
        self,
        when: float,
        callback: Callable[..., object],
        args: tuple[Any, ...],
        loop: asyncio.AbstractEventLoop,
        context: contextvars.Context | None = None,
    ) -> None:
        super().__init__(when, callback, args, loop, context)
        self._order = next(self._count)

    def __lt__(self, other: object) -> bool:
        if isinstance(other, _OrderedTimer):
            return (self.when(), self._order) < (other.when(), other._order)
        return NotImplemented


class _JumpingSelector(selectors.SelectSelector):
    """Polls once, then moves the clock to the next timer instead of waiting for it.

    While callbacks are ready, it does not poll the loop's pipe, by which other threads wake the loop.
    """

    loop: JumpingLoop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout == 0 and len(self.get_map()) == 1:
            return []
        ready = super().select(0)
        if ready or timeout == 0:
            return ready
        if self.loop.outside:
            return super().select(_LOOK)
        if timeout is None:
            raise Deadlock("nothing is ready, no timer is set, nothing outside is awaited")
        self.loop.jump()
        return ready


class JumpingLoop(asyncio.SelectorEventLoop):
    """An event loop whose time starts at 0 and jumps to the next timer whenever nothing is ready.

    `horizon` [s] bounds virtual time; going past it raises `HorizonReached` out of `run_until_complete`.
    Work in an executor, and anything inside `external()`, freezes the clock until it is done.
    """

    def __init__(self, horizon: float = 1e6) -> None:
        selector = _JumpingSelector()
        selector.loop = self
        self._now = 0.0
        self._horizon = horizon
        self.outside = 0
        super().__init__(selector)

    def time(self) -> float:
        """Return virtual time [s]."""
        return self._now

    def jump(self) -> None:
        """Set the clock to the next timer's due time."""
        scheduled: list[asyncio.TimerHandle] = self._scheduled  # type: ignore[attr-defined]
        due = scheduled[0].when()
        if due > self._horizon:
            raise HorizonReached(f"virtual time would go past {self._horizon} s")
        self._now = max(self._now, due)

    def call_at(  # noqa: D102 - inherited
        self,
        when: float,
        callback: Callable[..., object],
        *args: Any,
        context: contextvars.Context | None = None,
    ) -> asyncio.TimerHandle:
        timer = _OrderedTimer(when, callback, args, self, context)
        heapq.heappush(self._scheduled, timer)  # type: ignore[attr-defined]
        timer._scheduled = True  # type: ignore[attr-defined]
        return timer

    @contextmanager
    def external(self) -> Iterator[None]:
        """Freeze the clock during the block, in which a thread, process or socket outside this loop works for it."""
        self.outside += 1
        try:
            yield
        finally:
            self.outside -= 1

    def run_in_executor(self, executor: Any, func: Callable[..., T], *args: Any) -> asyncio.Future[T]:  # type: ignore[override]
        """Run `func` in a thread; the clock is frozen until it returns."""
        future = super().run_in_executor(executor, func, *args)
        self.outside += 1

        def back(_: object) -> None:
            self.outside -= 1

        future.add_done_callback(back)
        return future

    async def shutdown_default_executor(self, timeout: float | None = None) -> None:
        """Wait for the executor's threads, which run outside virtual time."""
        with self.external():
            await super().shutdown_default_executor()


class ScaledLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock runs `speed` times as fast as real time, or slower if its work takes too long.

    Otherwise work that takes longer than its time slot would build up a backlog, and other callbacks would never run.
    It uses select() rather than epoll(), whose 1 ms step would be 50 ms of scaled time at speed 50.
    """

    def __init__(self, speed: float) -> None:
        selector = _ScaledSelector()
        selector.loop = self
        self._now = 0.0
        self._seen = time.monotonic()
        self.speed = speed
        """Factor of the clock against real time; it may be changed at any time."""
        super().__init__(selector)
        if not 0.0 < speed < float("inf"):
            self.close()
            raise ValueError("speed must be positive and finite")
        self._clock_resolution *= speed

    def time(self) -> float:
        """Return scaled time [s] since the loop was created."""
        self.count(_LONGEST_LAPSE)
        return self._now

    def count(self, most: float) -> None:
        """Advance the clock by `speed` times the real time since its last reading, at most `most` [s, real time]."""
        now = time.monotonic()
        self._now += min(now - self._seen, most) * self.speed
        self._seen = now


class _ScaledSelector(selectors.SelectSelector):
    """Shortens waits in real time; the clock gains the whole wait, but not a longer stop of the process."""

    loop: ScaledLoop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        wait = None if timeout is None else timeout / self.loop.speed
        self.loop.count(_LONGEST_LAPSE)
        ready = super().select(wait)
        self.loop.count(inf if wait is None else max(wait, 0.0) + _LONGEST_LAPSE)
        return ready


def run(main: Coroutine[Any, Any, T], loop_factory: Callable[[], asyncio.AbstractEventLoop] | None = None) -> T:
    """Run `main` to its end in a new loop, like `asyncio.run`, and return its result."""
    with asyncio.Runner(loop_factory=loop_factory) as runner:
        return runner.run(main)


def run_virtual(main: Coroutine[Any, Any, T], horizon: float = 1e6) -> T:
    """Run `main` in virtual time, where waits take no real time; raises the errors of `JumpingLoop`."""
    return run(main, lambda: JumpingLoop(horizon))
