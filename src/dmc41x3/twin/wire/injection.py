"""What is going wrong with a virtual controller now: faults begun, replaced and ended."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import inf
from typing import NamedTuple

from dmc41x3.twin.wire.faults import Fault, FaultTarget, Timer, Value, Values, find


class Injection(NamedTuple):
    """A fault that lasts; `until` is the loop's time of its end [s], None for until cleared."""

    fault: Fault
    values: Mapping[str, Value]
    until: float | None

    @property
    def key(self) -> tuple[Value, ...]:
        """What tells it from others that may stand beside it."""
        return (self.fault.name, *(self.values[p.name] for p in self.fault.parameters if p.selects))


class Faults:
    """What is going wrong with one controller. Times are those of its loop."""

    def __init__(self, victim: FaultTarget) -> None:
        self._victim = victim
        self._active: dict[tuple[Value, ...], Injection] = {}
        self._timers: dict[tuple[Value, ...], Timer] = {}

    @property
    def active(self) -> list[Injection]:
        """The faults that last, oldest first."""
        return list(self._active.values())

    def inject(self, name: str, values: Values | None = None, *, seconds: float | None = None) -> Injection:
        """Begin a fault; it ends by itself after `seconds` (infinity: never), or by `clear`.

        One like it that stands is replaced. Raises `UnknownName` and `InvalidValue`.
        """
        fault = find(name)
        chosen = fault.read(values or {})
        lasts = seconds
        if lasts is None and fault.duration:
            lasts = float(chosen[fault.duration])
        lasts = None if lasts == inf else lasts
        injection = Injection(fault, chosen, None if lasts is None else self._victim.time() + lasts)
        self.end(injection)
        fault.begin(self._victim, chosen)
        if fault.end is not None:
            self._active[injection.key] = injection
            if lasts is not None:
                self._timers[injection.key] = self._victim.later(lasts, partial(self.end, injection))
        self._victim.look()
        return injection

    def end(self, injection: Injection) -> None:
        """End a fault, or what stands in its place; again is harmless."""
        timer = self._timers.pop(injection.key, None)
        if timer is not None:
            timer.cancel()
        standing = self._active.pop(injection.key, None)
        if standing is not None and standing.fault.end is not None:
            standing.fault.end(self._victim, standing.values)
            self._victim.look()

    def clear(self, name: str | None = None) -> None:
        """End all faults, or all of one name; raises `UnknownName`."""
        fault = None if name is None else find(name)
        for injection in self.active:
            if fault is None or injection.fault is fault:
                self.end(injection)

    def close(self) -> None:
        """Let no fault end by itself any more."""
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()
