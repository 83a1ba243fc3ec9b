"""A node: one per process, with rospy beside an asyncio loop; its checks at the start, its log, its end.

    def main() -> int:
        return run("hw_simulator", serve)       # async def serve(node: Node) -> None

`serve` is cancelled when the node must end: after a signal, rosnode kill, or the start of another node of its name.
`serve` then releases its resources and brings motion to rest. Only then the node leaves the graph.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass
from logging.handlers import QueueHandler, QueueListener
from queue import Full, Queue
from types import FrameType
from typing import Any, cast
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from rospy.impl.rosout import RosOutHandler
from rospy.impl.tcpros_base import TCPROSServer

import maya_ros
from dmc41x3.i18n import phrase
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop
from maya_ros.ros1.graph import RosGraph
from maya_ros.ros1.master import (
    NO_ANSWER,
    REACH,
    BoundedTransport,
    LoopCalls,
    in_thread,
    master,
    settle_namespace,
    whole,
)
from maya_un.errors import AlreadyRunning, InternalError, InvalidValue, MasterGone, MayaError
from maya_un.interpreter import prompt_loop

_CALLER = "/maya"
"""The caller name of a program that is not yet a node."""


def require_master() -> None:
    """Raise `MasterGone` if no master answers; rospy would wait for one for ever."""
    try:
        master(_CALLER).getPid()
    except (*NO_ANSWER, rosgraph.MasterException):
        raise MasterGone(uri=rosgraph.get_master_uri()) from None


def require_sole(name: str) -> None:
    """Raise `AlreadyRunning` if a node of this name runs or hangs; an argument may replace `name`.

    The master would end that node as soon as this one registers, whether or not this one can do its work.
    """
    own = rospy.resolve_name(rospy.names.get_mappings().get("__name", name))
    try:
        uri = master(_CALLER).lookupNode(own)
        at = urlsplit(uri)
        socket.create_connection((at.hostname or "", at.port or 80), REACH).close()
    except (*NO_ANSWER, rosgraph.MasterException):
        return
    try:
        with ServerProxy(uri, BoundedTransport()) as other:
            _, _, process = cast("tuple[int, str, int]", other.getPid(_CALLER))
    except TimeoutError:
        raise AlreadyRunning(pid="?") from None
    except NO_ANSWER:
        return  # the port belongs to another program now
    raise AlreadyRunning(pid=process)


PATIENCE = 12.0
"""Time after which a node is ended by force [s]: roslaunch waits for 15 s."""


class NodeShutdown:
    """Takes requests to end the node, from any thread at any time, and passes them to the loop once it exists."""

    def __init__(self) -> None:
        self.over = threading.Event()
        self._wanted = False
        self._asked: asyncio.Event | None = None
        self._post: LoopCalls | None = None

    def listen(self) -> None:
        """Handle signals from now on; call this in the main thread."""
        for kind in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(kind, self._signalled)

    async def asked(self) -> None:
        """Wait until the node must end."""
        self._post = LoopCalls(asyncio.get_running_loop())
        self._asked = asyncio.Event()
        if self._wanted:
            self._asked.set()
        await self._asked.wait()

    def ask(self) -> None:
        """Request the end; a second request changes nothing."""
        if self._wanted:
            return
        self._wanted = True
        force = threading.Timer(PATIENCE, os._exit, (1,))
        force.daemon = True
        force.start()
        if self._post is not None and self._asked is not None:
            self._post(self._asked.set)

    def ask_and_wait(self) -> None:
        """Request the end and wait for it; for rospy, which releases everything when this returns."""
        leave()
        self.ask()
        self.over.wait(PATIENCE)

    def _signalled(self, _number: int, _frame: FrameType | None) -> None:
        self.ask()


_WAITING = 1000
"""Most lines that wait for /rosout; further lines appear only on the screen and in the node's file."""

_LOG = logging.getLogger("rosout")


class _LogQueue(QueueHandler):
    """Passes lines to a thread, and drops lines if the queue is full."""

    def enqueue(self, record: logging.LogRecord) -> None:
        """Put a line into the queue, unless it is full."""
        with suppress(Full):
            self.queue.put_nowait(record)


def write_in_thread() -> None:
    """Write to /rosout in a thread from now on, so no line waits for the master; call after `rospy.init_node`."""
    slow = [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler)]
    if not slow:
        return
    waiting: Queue[logging.LogRecord] = Queue(_WAITING)
    listener = QueueListener(waiting, *slow)
    listener.start()  # a daemon: it ends with the program
    for handler in slow:
        _LOG.removeHandler(handler)
    _LOG.addHandler(_LogQueue(waiting))


def leave() -> None:
    """Write nothing more to /rosout, because that would end another node of this name."""
    for handler in [handler for handler in _LOG.handlers if isinstance(handler, RosOutHandler | _LogQueue)]:
        _LOG.removeHandler(handler)


HEADER_TIMEOUT = 5.0
"""Longest wait for bytes of the header of a new connection [s]."""

HEADERS_AT_ONCE = 64
"""Most connections whose headers are read at a time; further ones wait."""


def read_headers_in_threads() -> None:
    """Read the header of each new connection in a thread, with a bound; call before `rospy.init_node`.

    rospy reads it in the thread that accepts connections, without a bound. So a client that sends nothing would keep
    all others from connecting, also one that calls a stop. Such a client exists: the master keeps the address of a
    killed node, others connect to it again, and the port may belong to this node by then.
    """
    handle = TCPROSServer._tcp_server_callback
    free = threading.BoundedSemaphore(HEADERS_AT_ONCE)

    def read(server: TCPROSServer, link: socket.socket, address: object) -> None:
        try:
            handle(server, link, address)
        finally:
            free.release()

    def accept(server: TCPROSServer, link: socket.socket, address: object) -> None:
        free.acquire()
        link.settimeout(HEADER_TIMEOUT)  # until rospy answers the header: then it makes the socket blocking again
        threading.Thread(target=read, args=(server, link, address), name="maya-header", daemon=True).start()

    TCPROSServer._tcp_server_callback = accept


DONE = 0
"""Exit code of a node that ended on request."""

FAILED = 1
"""Exit code of a node that ended because the machine did something unexpected, or by a defect."""

REFUSED = 2
"""Exit code of a node that did not start: a parameter, the configuration, or what it needs is wrong or missing."""

SPEED = "/maya/speed"
"""The parameter with the factor of the twin's clock; for the machine it is 1."""

FASTEST = 1000.0
"""Largest factor of the twin's clock."""

SIMULATED = "/maya/sim_mode"
"""The parameter that is true if the robot is the twin."""


@dataclass(frozen=True, slots=True)
class RosNode:
    """Resources of a node: its graph, and the speed of its clock (1 except for the twin)."""

    graph: RosGraph
    speed: float

    def say(self, sentence: str) -> None:
        """Write a line to the log: on the screen, in the node's file, on /rosout."""
        rospy.loginfo("%s", sentence)

    async def say_ready(self, sentence: str) -> None:
        """Write a line to the log once other nodes can find all that this node offers."""
        await self.graph.registered()
        self.say(sentence)

    def warn(self, sentence: str) -> None:
        """Write a warning for a person to the log."""
        rospy.logwarn("%s", sentence)

    def complain(self, error: MayaError) -> None:
        """Write an error with its code to the log."""
        rospy.logerr("error %d: %s", error.code, error)

    async def parameter(self, name: str, default: Any) -> Any:
        """Return the parameter "~NAME" of this node if it is set, else /maya/NAME, else `default`."""
        found = await self.graph.parameters.get(f"~{name}")
        return await self.graph.parameters.get(f"/maya/{name}", default) if found is None else found

    async def flag(self, name: str, *, default: bool = False) -> bool:
        """Return a parameter that is true or false; raises `InvalidValue`."""
        return _flag(name, await self.parameter(name, default))

    async def number(self, name: str, default: int) -> int:
        """Return a parameter that is a whole number; raises `InvalidValue`."""
        found = await self.parameter(name, default)
        if type(found) is not int:
            raise InvalidValue(key=name, value=repr(found), reason="it must be a whole number")
        return found


Serve = Callable[[RosNode], Awaitable[None]]
"""The work of a node until it is cancelled."""


def run(name: str, serve: Serve, *, scaled: bool = True) -> int:
    """Run the node `name` (roslaunch may replace it) until the node must end; return the exit code.

    A node that is an edge is not `scaled`: its clock is real time at any speed of the twin. With --help, print the
    description of the node, which needs no master.
    """
    if not {"-h", "--help"}.isdisjoint(sys.argv[1:]):
        print((sys.modules[serve.__module__].__doc__ or name).strip())
        return DONE
    ending = NodeShutdown()
    ending.listen()
    try:
        reserve_descriptors()
        prompt_loop()
        settle_namespace()
        require_master()
        require_sole(name)
        read_headers_in_threads()
        rospy.init_node(name, disable_signals=True)
        write_in_thread()
        rospy.on_shutdown(ending.ask_and_wait)
        logging.getLogger(maya_ros.__name__).addHandler(_Shown(logging.WARNING))
        speed, serve = _clocked(serve) if scaled else (1.0, serve)
        with asyncio.Runner(loop_factory=lambda: ScaledLoop(speed)) as runner:
            return runner.run(_live(serve, ending, speed))
    except MayaError as error:
        return _refused(error)
    except rospy.ROSInitException as error:
        return _refused(InternalError(reason=str(error)))


class _Shown(logging.Handler):
    """Writes warnings of this project, such as a refused command on a topic, to the node's log."""

    def emit(self, record: logging.LogRecord) -> None:
        rospy.logwarn("%s", record.getMessage())


def clock_factor() -> float:
    """Return how fast the clock runs: `SPEED` for the twin, 1 for the machine. Raises `InvalidValue`."""
    simulated = _flag(SIMULATED, rospy.get_param(whole(SIMULATED), default=True))
    speed = rospy.get_param(whole(SPEED), 1.0) if simulated else 1.0
    if isinstance(speed, bool) or not isinstance(speed, int | float) or not 0.0 < speed <= FASTEST:
        raise InvalidValue(
            key=SPEED, value=repr(speed), reason=phrase("it must be above 0 and at most {most:g}", most=FASTEST)
        )
    return float(speed)


def _flag(name: str, found: object) -> bool:
    """Return a flag; raises `InvalidValue` if it is not true or false: the text "false" would count as true."""
    if not isinstance(found, bool):
        raise InvalidValue(key=name, value=repr(found), reason="it must be true or false")
    return found


def _clocked(serve: Serve) -> tuple[float, Serve]:
    """Return how fast the clock runs, and `serve`; for an invalid speed, a replacement that raises the error."""
    try:
        return clock_factor(), serve
    except InvalidValue as refusal:
        error = refusal

    async def refuse(_: RosNode) -> None:
        raise error

    return 1.0, refuse


async def _live(serve: Serve, ending: NodeShutdown, speed: float) -> int:
    asyncio.get_running_loop().set_exception_handler(_defect)
    ours = RosGraph(speed=speed)
    work = asyncio.ensure_future(serve(RosNode(ours, speed)))
    asked = asyncio.ensure_future(ending.asked())
    await asyncio.wait({work, asked}, return_when=asyncio.FIRST_COMPLETED)
    asked.cancel()
    work.cancel()
    await asyncio.wait({work})
    code = _code(work)
    await ours.close()
    ending.over.set()
    await in_thread(lambda: rospy.signal_shutdown("ended"))
    for _ in range(20):  # another thread may be shutting down
        if rospy.is_shutdown():
            break
        await asyncio.sleep(0.1 * speed)
    return code


def _code(work: asyncio.Future[None]) -> int:
    """Return the exit code of a node's work, and log the error that ended it."""
    error = None if work.cancelled() else work.exception()
    if error is None:
        return DONE
    if isinstance(error, MayaError):
        return _refused(error)
    rospy.logfatal("%s", "".join(traceback.format_exception(error)))
    return _refused(InternalError(reason=repr(error)))


def _refused(error: MayaError) -> int:
    """Log why a node ends, and return its exit code."""
    with suppress(OSError):
        if rospy.core.is_initialized():
            rospy.logfatal("error %d: %s", error.code, error)
        else:
            print(f"maya: error {error.code}: {error}", file=sys.stderr, flush=True)
    return REFUSED if 4000 <= error.code < 5999 else FAILED


def _defect(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error that no caller receives."""
    error = context.get("exception")
    trace = "" if error is None else "".join(traceback.format_exception(error))
    rospy.logerr("%s\n%s", context.get("message", "a defect"), trace)
