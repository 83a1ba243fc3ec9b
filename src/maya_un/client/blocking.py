"""The blocking driver: executes plans with httpx and websockets in the calling thread."""

from __future__ import annotations

import json
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from typing import Any, TypeVar, cast

import httpx
from websockets.sync.client import ClientConnection, connect

from maya_un.client import transport
from maya_un.client.request import TIMEOUT, Request
from maya_un.client.steps import (
    Blocking,
    Connect,
    Emit,
    Line,
    Plan,
    PlanRunner,
    ReadClock,
    Receive,
    Send,
    Sleep,
    Step,
    StreamPlan,
)
from maya_un.client.transport import Finder, HeldLease, ServiceAddress
from maya_un.errors import ServiceNotAnswering, ServiceNotRunning

T = TypeVar("T")


class BlockingDriver(Blocking):
    """Executes plans against the service that `find` finds; `trust` checks its certificate.

    Threads may share it. It needs no event loop, so it also works inside a running one, as in a notebook.
    """

    def __init__(self, find: Finder, trust: ssl.SSLContext, held: HeldLease | None = None) -> None:
        self._find = find
        self._trust = trust
        self._http = httpx.Client(verify=trust, trust_env=False)
        self._urgent = httpx.Client(verify=trust, trust_env=False)
        self._closed = threading.Event()
        self.held = HeldLease() if held is None else held

    @property
    def address(self) -> str:
        """The address of the service, if known."""
        try:
            return self._find().url
        except ServiceNotRunning:
            return "nowhere: nothing is running"

    def perform(self, plan: Plan[T]) -> T:
        """Return the result of a plan; an interruption is raised in the plan, so that it can clean up."""
        course: PlanRunner[T] = PlanRunner(plan)
        with ExitStack() as lines:
            while (step := course.step) is not None:
                self._advance(course, step, lines)
        return course.result

    def iterate(self, source: StreamPlan[T]) -> Iterator[T]:
        """Yield the items of a source as they arrive."""
        course: PlanRunner[None] = PlanRunner(source)
        with closing(course), ExitStack() as lines:
            while (step := course.step) is not None:
                if isinstance(step, Emit):
                    yield cast("Emit[T]", step).value
                    course.answered(None)
                else:
                    self._advance(course, step, lines)

    def close(self) -> None:
        """Close all connections; a thread that sleeps in a plan raises `ServiceNotAnswering` at once."""
        self._closed.set()
        self._http.close()
        self._urgent.close()

    def _advance(self, course: PlanRunner[Any], step: Step | Emit[Any], lines: ExitStack) -> None:
        try:
            answer = self._carry_out(step, lines)
        except BaseException as error:  # noqa: BLE001 - the plan handles it
            course.failed(error)
        else:
            course.answered(answer)

    def _carry_out(self, step: Step | Emit[Any], lines: ExitStack) -> Any:
        match step:
            case Request():
                return self._ask(step)
            case Sleep():
                return self._rest(step.seconds)
            case ReadClock():
                return time.monotonic()
            case Connect():
                return self._dial(step.path, lines)
            case Send() | Receive():
                return _conversed(step)
            case Emit():
                return None

    def beside(self) -> BlockingDriver:
        """Return a driver with separate connections and the same lease."""
        return BlockingDriver(self._find, self._trust, self.held)

    def _ask(self, request: Request[T]) -> T:
        if not request.urgent:
            self.held.require()
        url, headers, content = transport.encoded(request, self._find(), self.held.id)
        http = self._urgent if request.urgent else self._http
        with transport.translated():
            answer = http.request(request.method, url, headers=headers, content=content, timeout=request.timeout)
        return transport.decoded(request, answer.status_code, answer.headers, answer.content)

    def _rest(self, seconds: float) -> None:
        if self._closed.wait(max(0.0, seconds)):
            raise ServiceNotAnswering(reason="this client was closed")

    def _dial(self, path: str, lines: ExitStack) -> Line:
        lines.close()
        with transport.translated():
            return Line(lines.enter_context(self._connected(self._find(), path)))

    def _connected(self, service: ServiceAddress, path: str) -> ClientConnection:
        return connect(
            transport.stream_url(service, path),
            ssl=self._trust if service.url.startswith("https") else None,
            additional_headers=transport.identity(service.token),
            compression=None,
            proxy=None,
            open_timeout=TIMEOUT,
            close_timeout=1.0,
        )


def _conversed(step: Send | Receive) -> str | bytes | None:
    socket = cast("ClientConnection", step.line)
    with transport.translated(), suppress(TimeoutError):
        if isinstance(step, Receive):
            return socket.recv(timeout=0.0 if step.now else None)
        socket.send(json.dumps(step.message))
    return None
