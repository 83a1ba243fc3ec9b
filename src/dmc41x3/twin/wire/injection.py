"""Faults in effect, and the server that starts and ends them: lines of JSON over TCP on this computer.

Each request to the server is a line:

| request | what it does |
|---|---|
| `{"fault": NAME, "values": {...}, "seconds": S}` | begins a fault; values and seconds may be left out |
| `{"clear": NAME}`, `{"clear": null}` | ends the faults of one name, or all |
| `{}` | changes nothing |

Every request is answered by a line `{"active": [{"fault", "values", "seconds"}]}`, where `seconds` is the remaining
time or null, or by `{"error": {"code", "details"}}` with a code of `dmc41x3.errors`.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from functools import partial
from math import inf
from typing import Any, NamedTuple, cast

from dmc41x3 import listening
from dmc41x3.errors import CodedError, InvalidRequest
from dmc41x3.i18n import phrase
from dmc41x3.twin.wire.faults import Fault, FaultTarget, Timer, Value, Values, find


class Injection(NamedTuple):
    """An active fault; `until` is the loop's time of its end [s], None if it lasts until it is cleared."""

    fault: Fault
    values: Mapping[str, Value]
    until: float | None

    @property
    def key(self) -> tuple[Value, ...]:
        """Identity among the faults of a controller."""
        return (self.fault.name, *(self.values[p.name] for p in self.fault.parameters if p.selects))


class Faults:
    """The faults of one controller. Times are those of its loop."""

    def __init__(self, victim: FaultTarget) -> None:
        self._victim = victim
        self._active: dict[tuple[Value, ...], Injection] = {}
        self._timers: dict[tuple[Value, ...], Timer] = {}

    @property
    def active(self) -> list[Injection]:
        """The active faults, oldest first."""
        return list(self._active.values())

    def inject(self, name: str, values: Values | None = None, *, seconds: float | None = None) -> Injection:
        """Begin a fault; it ends after `seconds` (infinity: never), or by `clear`.

        It replaces an active fault with the same key. Raises `UnknownName` and `InvalidValue`.
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
        """End a fault, or the fault that replaced it; idempotent."""
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
        """Cancel the timers that end faults."""
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()


HOST = "127.0.0.1"
"""Address of the server."""

_LONGEST = 65536
_LASTS = 1e6
_VISITS = 4


class FaultControlServer:
    """Listens for requests about the faults of one virtual controller. Created in a running loop by `opened`."""

    def __init__(self, faults: Faults, server: listening.Listener) -> None:
        self._faults = faults
        self._server = server
        self._visits: dict[_Visit, None] = {}

    @classmethod
    async def opened(cls, faults: Faults) -> FaultControlServer:
        """Return a server that listens on a free port."""
        server = await listening.listen(HOST, 0, lambda: _Visit(control))
        control = cls(faults, server)
        return control

    @property
    def port(self) -> int:
        """The port."""
        return self._server.address[1]

    async def close(self) -> None:
        """Stop listening and end every connection."""
        self._server.close()
        for visit in list(self._visits):
            visit.close()
        await self._server.wait_closed()

    def answer(self, line: bytes) -> bytes:
        """Execute one request and return the answer, a line."""
        try:
            self._carry_out(_parsed(line))
        except CodedError as error:
            details = {key: str(value) for key, value in error.details.items()}
            return _line({"error": {"code": error.code, "details": details}})
        now = asyncio.get_running_loop().time()
        return _line({"active": [described(injection, now) for injection in self._faults.active]})

    def _carry_out(self, request: dict[str, Any]) -> None:
        if "clear" in request:
            self._faults.clear(request["clear"])
        elif "fault" in request:
            values = request.get("values", {})
            if not isinstance(values, dict):
                raise InvalidRequest(key="values", reason="it must be an object")
            self._faults.inject(str(request["fault"]), values, seconds=_seconds(request.get("seconds")))

    def entered(self, visit: _Visit) -> None:
        """Store a connection until it ends; if there are too many, end the oldest."""
        self._visits[visit] = None
        if len(self._visits) > _VISITS:
            next(iter(self._visits)).close()

    def left(self, visit: _Visit) -> None:
        """Remove a connection that ended."""
        self._visits.pop(visit, None)


class _Visit(asyncio.Protocol):
    """One connection to the server."""

    def __init__(self, control: FaultControlServer) -> None:
        self._control = control
        self._transport: asyncio.Transport | None = None
        self._pending = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._control.entered(self)

    def data_received(self, data: bytes) -> None:
        *lines, self._pending = (self._pending + data).split(b"\n")
        assert self._transport is not None
        for line in lines:
            self._transport.write(self._control.answer(line))
        if len(self._pending) > _LONGEST:
            self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._control.left(self)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        raise InvalidRequest(key="line", reason="it is no JSON") from None
    if not isinstance(request, dict):
        raise InvalidRequest(key="line", reason="it must be an object")
    if not isinstance(request.get("clear"), str | None):
        raise InvalidRequest(key="clear", reason="it must be a name or null")
    return request


def _seconds(value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= _LASTS:
        reason = phrase("it must be a number above 0 and at most {most:g}", most=_LASTS)
        raise InvalidRequest(key="seconds", reason=reason)
    return float(value)


def described(injection: Injection, now: float) -> dict[str, Any]:
    """Return the name, the values and the remaining time [s] of a fault, None if it stays."""
    left = None if injection.until is None else max(0.0, injection.until - now)
    return {"fault": injection.fault.name, "values": dict(injection.values), "seconds": left}


def _line(value: Any) -> bytes:
    return json.dumps(value).encode("utf-8") + b"\n"
