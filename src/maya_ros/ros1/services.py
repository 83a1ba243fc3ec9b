"""Services of a real graph: answered in the loop, or at once in a thread of rospy; and called without blocking.

The address of a known service is stored, so it can be called without a master.
"""

from __future__ import annotations

import asyncio
import select
import threading
from ast import literal_eval
from collections import defaultdict
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any

import genpy
import rosgraph
import rospy

from maya_ros.graph.protocol import Answer, Message, Quick, Request, by_name
from maya_ros.graph.table import ABORT, PAUSE, STOP
from maya_ros.ros1.convert import MessageClass, ServiceClass, converter_of, service_class
from maya_ros.ros1.master import REACH, Registrar, in_thread, service_type, told, whole
from maya_un.errors import MasterGone, MayaError, ServiceFailed, UnknownInterface

_LOOKUP = 0.3
"""Longest wait for the master's address of a known service [s]; then the former address is used."""

_AGAIN, _SELDOM = 1.0, 16.0
"""Time until a service that no node serves yet is looked up again [s]: it doubles from the first to the second."""

_LOOK = 0.2
"""Longest time until a disconnected caller is noticed [s]."""

_ANYHOW = frozenset({ABORT.name, PAUSE.name, STOP.name})
"""Services that are carried out even if the caller has disconnected: the sender of a stop may end at once."""

_HUNG_UP = select.POLLRDHUP | select.POLLHUP | select.POLLERR | select.POLLNVAL


class RosService:
    """A service that is served until it is closed (`graph.protocol.GraphHandle`)."""

    def __init__(
        self,
        registrar: Registrar,
        loop: asyncio.AbstractEventLoop,
        service: str,
        kind: str,
        answer: Answer,
        quick: Quick | None,
    ) -> None:
        found = service_class(kind)
        self._registrar = registrar
        self._loop = loop
        self._plain = converter_of(found.request).plain
        self._made = converter_of(found.response).made
        self._answer = answer
        self._quick = quick
        self._anyhow = service in _ANYHOW
        self._open = True
        self._held: _AwaitedService | None = None
        registrar(lambda: self._register(service, found.kind))

    @property
    def open(self) -> bool:
        """Whether it has not been closed."""
        return self._open

    def close(self) -> None:
        """Stop serving."""
        if self._open:
            self._open = False
            self._registrar(self._given_back)

    def _register(self, service: str, kind: type[genpy.Service]) -> None:
        if self._open:
            self._held = _AwaitedService(whole(service), kind, self._handle)

    def _given_back(self) -> None:
        if self._held is not None:
            self._held.shutdown("closed")

    def _handle(self, request: MessageClass) -> MessageClass:
        """Answer a request, in rospy's thread for the caller."""
        if not self._open:
            raise rospy.ServiceException("it is no longer served")
        plain = self._plain(request)
        try:
            said = None if self._quick is None else self._quick(plain)
            return self._made(self._answered(plain) if said is None else said)
        except MayaError as error:
            raise rospy.ServiceException(f"{error} [{error.code}]") from None
        except CancelledError:
            raise rospy.ServiceException("it is no longer wanted") from None

    def _answered(self, request: Message) -> Message:
        """Have the loop answer; raises `CancelledError` if the caller disconnects before or meanwhile."""
        if self._unwanted:
            raise CancelledError
        future = asyncio.run_coroutine_threadsafe(_awaited(self._answer, request), self._loop)
        while True:
            try:
                return future.result(_LOOK)
            except TimeoutError:
                if future.done():
                    raise  # raised by the answer itself
                if self._unwanted or self._loop.is_closed():
                    future.cancel()

    @property
    def _unwanted(self) -> bool:
        return not self._anyhow and _AwaitedService.asked_by_nobody()


async def _awaited(answer: Answer, request: Message) -> Message:
    return await answer(request)


class _AwaitedService(rospy.Service):
    """A service whose handler can check whether the caller still waits."""

    _asking = threading.local()

    @classmethod
    def asked_by_nobody(cls) -> bool:
        """Return whether the caller of this thread has disconnected."""
        return _hung_up(cls._asking.transport)

    def _handle_request(self, transport: Any, request: MessageClass) -> None:
        self._asking.transport = transport
        super()._handle_request(transport, request)


def _hung_up(transport: Any) -> bool:
    """Return whether the other end of a rospy connection is gone."""
    socket = transport.socket
    if socket is None:
        return True
    poll = select.poll()
    poll.register(socket.fileno(), select.POLLRDHUP)
    return any(event & _HUNG_UP for _, event in poll.poll(0))


class Calls:
    """Calls services over connections that are reused.

    A new connection costs ten times what a call costs. A service has as many connections as it had simultaneous calls.
    """

    def __init__(self) -> None:
        self._idle: defaultdict[tuple[str, str], list[_Proxy]] = defaultdict(list)
        self._busy: set[_Proxy] = set()
        self._addresses: dict[str, str] = {}
        self._expected: set[str] = set()
        self._closed = threading.Event()

    def expect(self, *services: str) -> None:
        """Look up services while the master answers, until each has a node: a node registers one after the other."""
        missing = [name for name in map(whole, services) if name not in self._expected]
        self._expected.update(missing)

        def look() -> None:
            pause = _AGAIN
            while missing:
                for service in tuple(missing):
                    with suppress(MasterGone, rosgraph.MasterException):
                        _located(service, self._addresses)
                        missing.remove(service)
                        self._expected.discard(service)
                if missing and self._closed.wait(pause):
                    break
                pause = min(2.0 * pause, _SELDOM)

        threading.Thread(target=look, name="maya-expect", daemon=True).start()

    async def call(self, service: str, request: Request, kind: str) -> Message:
        """Return the answer of a service; raises `ServiceFailed`, `UnknownInterface`, `InvalidMessage`.

        A cancelled call disconnects, which the server notices.
        """
        kind = kind or await in_thread(lambda: service_type(service))
        if not kind:
            raise UnknownInterface(form="service", name=service)
        found = service_class(kind)
        made = converter_of(found.request).made(by_name(kind, tuple(found.request.__slots__), request))
        key = (service, kind)
        proxy = self._taken(key, found)
        try:
            answer = await in_thread(lambda: proxy(made), f"maya-call {service}")
        except BaseException as error:
            self._dropped(proxy)
            if isinstance(error, rospy.ServiceException | rospy.ROSException | OSError):
                raise ServiceFailed(service=service, reason=_reason(error)) from None
            raise
        self._given_back(key, proxy)
        return converter_of(found.response).plain(answer)

    def close(self) -> None:
        """Close all connections."""
        self._closed.set()
        for proxy in (*self._busy, *(one for idle in self._idle.values() for one in idle)):
            proxy.drop()
        self._idle.clear()

    def _taken(self, key: tuple[str, str], found: ServiceClass) -> _Proxy:
        """Return an idle connection whose server still exists, or a new one, which connects at the call."""
        proxy = None
        while self._idle[key] and proxy is None:
            proxy = self._idle[key].pop()
            if _hung_up(proxy.transport):
                proxy.close()
                proxy = None
        if proxy is None:
            proxy = _Proxy(key[0], found.kind, self._addresses)
        self._busy.add(proxy)
        return proxy

    def _given_back(self, key: tuple[str, str], proxy: _Proxy) -> None:
        self._busy.discard(proxy)
        if self._closed.is_set():
            proxy.close()
        else:
            self._idle[key].append(proxy)

    def _dropped(self, proxy: _Proxy) -> None:
        self._busy.discard(proxy)
        proxy.drop()


class _Proxy(rospy.ServiceProxy):
    """A persistent connection to a service; if no master answers, it uses the last known address.

    rospy connects within a call. If the connection is dropped meanwhile, it is closed once it exists, before the
    request is sent.
    """

    def __init__(self, service: str, kind: type[genpy.Service], addresses: dict[str, str]) -> None:
        self._link: Any = None
        self._dropped = False
        super().__init__(whole(service), kind, persistent=True)
        self._addresses = addresses

    @property
    def transport(self) -> Any:
        """The connection, None while there is none."""
        return self._link

    @transport.setter
    def transport(self, link: Any) -> None:
        self._link = link
        if self._dropped and link is not None:
            link.close()

    def drop(self) -> None:
        """Close the connection for good; a call under way fails."""
        self._dropped = True
        self.close()

    def _get_service_uri(self, request: MessageClass) -> str:
        """Return the address of the service; raises `rospy.ServiceException`."""
        del request
        try:
            return _located(self.resolved_name, self._addresses)
        except rosgraph.MasterException:
            raise rospy.ServiceException("no node serves it") from None
        except MasterGone as gone:
            if self.resolved_name not in self._addresses:
                raise rospy.ServiceException(str(gone)) from None
            return self._addresses[self.resolved_name]


def _located(service: str, addresses: dict[str, str]) -> str:
    """Return the master's address of a service, and store it in `addresses`; raises as `master.told` does."""
    patience = _LOOKUP if service in addresses else REACH
    addresses[service] = told(lambda at: at.lookupService(service), patience)
    return addresses[service]


def _reason(error: BaseException) -> str:
    """Return why a call failed, in the server's words if it gave any."""
    before, said, quoted = str(error).partition("responded with an error: ")
    if not said:
        return before
    with suppress(ValueError, SyntaxError):
        quoted = bytes(literal_eval(quoted)).decode(errors="replace")
    return quoted.removeprefix("service cannot process request: ")
