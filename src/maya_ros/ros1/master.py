"""The ROS master: names, registrations and parameters, with calls that block in threads.

Each call runs in a new thread instead of a pool: a stop must not wait for a free thread, and a thread that waits for
another process must not keep the program from ending.

The code uses the manual's absolute names ("/maya_event"). In the graph, the namespace of the node precedes them.
Without a namespace both names are equal.

rospy tries for ever to register publishers, subscribers and services, and holds its locks meanwhile. So the thread
calls the master first, and calls rospy only after an answer.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections import defaultdict
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from http.client import HTTPConnection, HTTPException
from queue import Empty, SimpleQueue
from typing import Any, TypeVar
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rospy
import rosservice
from rosgraph.network import ROSHandshakeException

from maya_ros.graph.protocol import NodeInfo
from maya_un.errors import MasterGone
from maya_un.namespace import VARIABLE

R = TypeVar("R")


class LoopCalls:
    """Schedules calls in a loop from any thread, in order; once the loop is closed, calls are dropped."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop

    def __call__(self, call: Callable[..., object], *args: object) -> None:
        """Schedule `call`."""
        with suppress(RuntimeError):  # the loop is closed: no receiver is left
            self._loop.call_soon_threadsafe(call, *args)


async def in_thread(work: Callable[[], R], name: str = "maya-ros") -> R:
    """Do `work` in a thread and return its result; a cancelled caller no longer waits for it."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[R] = loop.create_future()
    post = LoopCalls(loop)

    def run() -> None:
        try:
            result = work()
        except BaseException as error:  # noqa: BLE001 - every error is raised in the waiting caller
            post(_fail, future, error)
        else:
            post(_settle, future, result)

    threading.Thread(target=run, name=name, daemon=True).start()
    return await future


def _settle(future: asyncio.Future[R], result: R) -> None:
    if not future.done():
        future.set_result(result)


def _fail(future: asyncio.Future[R], error: BaseException) -> None:
    if not future.done():
        future.set_exception(error)


Named = TypeVar("Named")


def settle_namespace() -> None:
    """Set $ROS_NAMESPACE, also if an argument (`__ns:=`) names the namespace: it determines the files of this Maya."""
    os.environ[VARIABLE] = rospy.get_namespace()


def whole(name: str) -> str:
    """Return the name in the graph for the manual's `name`; "~NAME" is private to this node."""
    return rospy.resolve_name(name.lstrip("/") or rospy.get_namespace())


def inner(name: str) -> str | None:
    """Return the manual's name for a name in the graph, None for one outside of the namespace."""
    space = rospy.get_namespace()
    return name[len(space) - 1 :] if name.startswith(space) else None


def inner_names(names: Iterable[str]) -> list[str]:
    """Return the manual's names for names in the graph, without those outside of the namespace."""
    return [found for name in names if (found := inner(name)) is not None]


def inner_keys(values: Mapping[str, Named]) -> dict[str, Named]:
    """Return values under the manual's names instead of those in the graph, without those outside of the namespace."""
    return {found: value for name, value in values.items() if (found := inner(name)) is not None}


T = TypeVar("T")

REACH = 5.0
"""Longest wait for a peer [s]: one that accepts no connection is absent, one that does not answer hangs."""

NO_ANSWER = (OSError, ValueError, HTTPException, XmlRpcError, ExpatError)
"""Errors of a peer that does not answer XML-RPC."""


class BoundedTransport(Transport):
    """An XML-RPC transport that waits at most `patience` [s] for a connection and for an answer each."""

    def __init__(self, patience: float = REACH) -> None:
        super().__init__()
        self._patience = patience

    def make_connection(self, host: tuple[str, dict[str, str]] | str) -> HTTPConnection:
        """Return the connection for a request."""
        connection = super().make_connection(host)
        connection.timeout = self._patience
        return connection


def master(name: str = "", patience: float = REACH) -> rosgraph.Master:
    """Return a link to the master for this thread; `name` is the caller's, by default this node's.

    A request waits for `patience` [s] at most.
    """
    link = rosgraph.Master(name or rospy.get_name())
    link.handle = ServerProxy(link.master_uri, BoundedTransport(patience))
    return link


def told(ask: Callable[[rosgraph.Master], T], patience: float = REACH) -> T:
    """Return the answer of the master; raises `MasterGone`, and `rosgraph.MasterError` for a refusal.

    The request runs in a thread, never in the loop: a master that hangs takes `patience` [s].
    """
    try:
        return ask(master(patience=patience))
    except NO_ANSWER:
        raise MasterGone(uri=rosgraph.get_master_uri()) from None


def published() -> frozenset[str]:
    """Return the topics that have a publisher."""
    publishers, _, _ = told(lambda at: at.getSystemState())
    return frozenset(name for name, _ in publishers)


def publishers_of(topic: str, kind: str) -> frozenset[str]:
    """Return the XML-RPC addresses of the nodes that publish `topic`, to which this node subscribes.

    Only a repeated registration gives the addresses in one call; it changes nothing.
    """
    return frozenset(told(lambda at: at.registerSubscriber(topic, kind, rospy.get_node_uri())))


def connect_to(topic: str, publishers: Iterable[str]) -> None:
    """Have rospy connect to `publishers`, addresses as `publishers_of` returns them, as if the master had sent them."""
    with ServerProxy(rospy.get_node_uri(), BoundedTransport()) as own:
        own.publisherUpdate(rospy.get_name(), topic, list(publishers))


def service_uri(service: str) -> str:
    """Return the address of a service from the master, "" if no node serves it."""
    try:
        return told(lambda at: at.lookupService(whole(service)))
    except rosgraph.MasterError:
        return ""


def service_type(service: str) -> str:
    """Return the type of a service, "" if no node serves it, or its server does not answer."""
    uri = service_uri(service)
    return (_kind(service, uri) or "") if uri else ""


def _kinds(services: Sequence[str], uri: str) -> Mapping[str, str]:
    """Return the types of services of one process; after a missing answer, request no more."""
    found = dict.fromkeys(services, "")
    for service in services if uri else ():
        kind = _kind(service, uri)
        if kind is None:
            break
        found[service] = kind
    return found


def _kind(service: str, uri: str) -> str | None:
    """Return the type of a service from its server, "" if it no longer serves it, None without an answer."""
    try:
        return rosservice.get_service_headers(whole(service), uri).get("type", "")
    except (rosservice.ROSServiceIOException, OSError):
        return None
    except (rosservice.ROSServiceException, ROSHandshakeException):
        return ""


class RosDirectory:
    """The names in this node's namespace (`graph.protocol.Directory`). Raises `MasterGone`.

    `settled` waits until the master knows all registrations of this node, at most the given time [s].
    """

    def __init__(self, settled: Callable[[float], Awaitable[None]]) -> None:
        self._settled = settled

    async def topics(self) -> Mapping[str, str]:
        """Return the type of every topic that has a publisher or a subscriber, "" if unknown."""
        await self._settled(REACH)
        found = await in_thread(lambda: told(lambda at: at.getTopicTypes()))
        return inner_keys({name: "" if kind == "*" else kind for name, kind in found})

    def topic_type(self, topic: str) -> None:
        """Return None: only the master knows the type."""

    async def services(self) -> Mapping[str, str]:
        """Return the type of every service from its server; "" if the server does not answer.

        The services of one process are requested one after another: rospy accepts few connections at once, and retries
        a refused one only after a second. Different processes are requested in parallel.
        """
        names = await self.service_names()
        places = await in_thread(lambda: {name: service_uri(name) for name in names})
        processes: defaultdict[str, list[str]] = defaultdict(list)
        for name, uri in places.items():
            processes[uri].append(name)
        asked = (in_thread(lambda uri=uri, own=own: _kinds(own, uri)) for uri, own in processes.items())
        found = {name: kind for kinds in await asyncio.gather(*asked) for name, kind in kinds.items()}
        return {name: found[name] for name in names}

    async def service_names(self) -> Sequence[str]:
        """Return the names of all services, as the master knows them."""
        await self._settled(REACH)
        _, _, served = await in_thread(lambda: told(lambda at: at.getSystemState()))
        return inner_names(name for name, _ in served)

    async def service_type(self, service: str) -> str:
        """Return the type of one service, "" if no node serves it, or its server does not answer."""
        await self._settled(REACH)
        return await in_thread(lambda: service_type(service))

    async def service_host(self, service: str) -> str:
        """Return the machine that serves a service, "" if no node serves it."""
        await self._settled(REACH)
        return urlsplit(await in_thread(lambda: service_uri(service))).hostname or ""

    async def nodes(self) -> Mapping[str, NodeInfo]:
        """Return what every node publishes, subscribes and serves."""
        await self._settled(REACH)
        parts = await in_thread(lambda: told(lambda at: at.getSystemState()))
        done: defaultdict[str, tuple[list[str], list[str], list[str]]] = defaultdict(lambda: ([], [], []))
        for place, part in enumerate(parts):
            for name, nodes in part:
                for node in nodes:
                    done[node][place].append(name)
        found = {node: NodeInfo(*(tuple(sorted(inner_names(names))) for names in does)) for node, does in done.items()}
        return inner_keys(found)


class RosParameters:
    """The parameters in this node's namespace (`graph.protocol.ParameterServer`). Raises `MasterGone`."""

    async def get(self, name: str, default: Any = None) -> Any:
        """Return the value at `name` or a dict of the values below it; `default` if none exists."""
        try:
            return await in_thread(lambda: told(lambda at: at.getParam(whole(name))))
        except rosgraph.MasterError:
            return default

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`; None values in a dict are left out."""
        await in_thread(lambda: told(lambda at: at.setParam(whole(name), _sendable(value))))

    async def delete(self, name: str) -> None:
        """Delete `name`, if it exists."""
        with suppress(rosgraph.MasterError):
            await in_thread(lambda: told(lambda at: at.deleteParam(whole(name))))

    async def names(self) -> Sequence[str]:
        """Return the names of all values."""
        return sorted(inner_names(await in_thread(lambda: told(lambda at: at.getParamNames()))))


def _sendable(value: Any) -> Any:
    """Return a value without None in dicts, which XML-RPC cannot encode."""
    if isinstance(value, Mapping):
        return {str(key): _sendable(one) for key, one in value.items() if one is not None}
    if isinstance(value, list | tuple):
        return [_sendable(one) for one in value]
    return value


LOOK = 0.5
"""Wait before the next call of a master that does not answer [s]."""

BURST = 10
"""Number of consecutive registrations after one answer of the master."""

QUIET = 1.0
"""Time without registrations before the publishers of new subscriptions are checked [s]."""

Work = Callable[[], object]


class Registrar:
    """Does work that needs the master in a separate thread, in order; every call returns at once.

    While no master answers, only this thread waits; until then, other nodes do not find the new names.
    `speed` is how fast the loop's clock runs.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed
        self._work: SimpleQueue[Work] = SimpleQueue()
        self._checks: list[Work] = []
        self._wait = threading.Event()
        threading.Thread(target=self._run, name="maya-register", daemon=True).start()

    def __call__(self, work: Work) -> None:
        """Do `work` after all earlier work."""
        self._work.put(work)

    def once_quiet(self, check: Work) -> None:
        """Do `check` once no work has come for `QUIET`; only work that this thread does may call this."""
        self._checks.append(check)

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
            work = self._next()
            self._await_master()
            for one in work:
                if rospy.is_shutdown():
                    return
                _done(one)

    def _next(self) -> list[Work]:
        """Return the waiting work, `BURST` pieces at most; if none arrives within `QUIET`, return the checks."""
        try:
            work = [self._work.get(timeout=QUIET if self._checks else None)]
        except Empty:
            work, self._checks = self._checks, []
            return work
        while len(work) < BURST and not self._work.empty():
            work.append(self._work.get())
        return work

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
    except Exception as error:  # noqa: BLE001 - an error must not block later registrations
        rospy.logerr("a registration with the ROS master failed: %r", error)
