"""A ROS of a test's own: a master on a free port, and whatever is launched on it, all on the loopback."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from ipaddress import IPv4Address
from pathlib import Path
from types import TracebackType
from typing import Any, cast
from urllib.parse import urlsplit
from uuid import uuid1
from xmlrpc.client import ServerProxy

from tests.calm import CALM_FILE
from tests.errors_seen import SEEN
from tests.fork_server import starting
from tests.ports import free_port
from tests.ros.driver_client import Driver
from tests.ros.programs import Program
from tests.ros.warm_nodes import FORKER, warm
from tests.ros.workspace import BYTECODE, Workspace, python
from tests.waiting import eventually

HERE = Path(__file__).resolve().parent
SPEED = 20
"""Speed of the twin's clock in tests that set no other."""


ROSOUT = "/usr/lib/rosout/rosout"
"""The node that collects logs, as Debian installs it."""

ADDRESSES = itertools.count(os.getpid() * 256)
"""Numbers of loopback addresses, other ones in each process of the tests."""


def own_address() -> str:
    """Return an address on the loopback that no other program has."""
    return str(IPv4Address("127.1.0.0") + next(ADDRESSES) % 2**23)


class Ros:
    """A master with rosout, and everything that is started on it, until it is closed.

    These are the two programs that roscore starts, and the parameter that it sets. To load roscore itself takes longer
    than both programs, so it is started only where a test asks for it. Nodes of the launch files are forked from a
    process that has loaded ROS, or start from nothing if `cold`.
    """

    def __init__(
        self, folder: Path, workspace: Workspace, *, space: str = "devel", roscore: bool = False, cold: bool = False
    ) -> None:
        self.folder = folder
        self.port = free_port()
        self.rosbridge_port = free_port()
        self.uri = f"http://127.0.0.1:{self.port}"
        self.environment = {**workspace.environment(space), **places(folder), "ROS_MASTER_URI": self.uri}
        if not cold:
            self.environment |= warm(python(), self.environment)
        self._programs: list[Program] = []
        self._has_roscore = roscore
        self._master = self.start(*(["roscore"] if roscore else ["rosmaster", "--core"]), "-p", str(self.port))

    def __enter__(self) -> Ros:
        try:
            self.until(self._has_master, "a master")
            if not self._has_roscore:
                self.start(ROSOUT, "__name:=rosout")
                self.set_param("/run_id", str(uuid1()))
            self.set_param("/rosbridge/port", self.rosbridge_port)
            self.until_nodes("/rosout")
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def start(self, *command: str, environment: Mapping[str, str] | None = None) -> Program:
        """Start a program on this graph; `environment` is laid over its environment.

        If that changes how an interpreter starts, the nodes that the program starts are not forked.

        A program that uses rospy has an address of its own. The master keeps the address of a killed node, and nodes
        connect to it again and again: on a common address, its port may belong to a new node by then, also to one on
        another master. roscpp knows only one loopback address.
        """
        own = {"ROS_IP": own_address()} if command[0] in (str(python()), "rosservice", "rostopic") else {}
        over = {**own, **(environment or {})}
        known = {name: value for name, value in self.environment.items() if name != FORKER or not starting(over)}
        program = Program(command, {**known, **over})
        self._programs.append(program)
        return program

    def launch(
        self, package: str, file: str, environment: Mapping[str, str] | None = None, **arguments: Any
    ) -> Program:
        """Start a launch file, at `SPEED` and without a dashboard by default; True is written true."""
        told: dict[str, Any] = {"speed": SPEED, "core_debug": True, **arguments}
        if file == "process.launch":
            told = {"custom_gui": False, "skip_firebase": True, **told}
        words = [f"{name}:={str(value).lower() if isinstance(value, bool) else value}" for name, value in told.items()]
        return self.start("roslaunch", package, file, *words, environment=environment)

    def tool(self, *command: str, within: float = 40.0) -> str:
        """Run a program to its end and return its output; fails if the program fails, or takes longer [s]."""
        done = subprocess.run(
            command, env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, timeout=within, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}"
        return done.stdout

    def maya(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run `maya` on this graph and return how it ends."""
        command = [str(Path(sys.executable).with_name("maya")), *words]
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=40.0, check=False)
        SEEN.note_printed(done.stderr)
        return done

    def _has_master(self) -> bool:
        with suppress(OSError):
            self.ask_master("getPid")
            return True
        return False

    def driver(self) -> Driver:
        """Return a node that obeys the test."""
        return Driver(self.start(str(python()), str(HERE / "driver.py")))

    def ask_master(self, method: str, *arguments: Any) -> Any:
        """Call a method of the master's XML-RPC interface and return its value; fails where the master refuses."""
        with ServerProxy(self.uri, allow_none=True) as master:
            code, words, value = getattr(master, method)("/test", *arguments)
        assert code == 1, words
        return value

    def nodes(self) -> set[str]:
        """Return the names of the nodes that publish, subscribe or serve something."""
        return {node for kind in self.ask_master("getSystemState") for _, nodes in kind for node in nodes}

    def process(self, node: str) -> int:
        """Return the process of a node."""
        with ServerProxy(self.ask_master("lookupNode", node)) as at:
            _, _, pid = cast("tuple[int, str, int]", at.getPid("/test"))
        return pid

    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return dict(self.ask_master("getTopicTypes"))

    def services(self) -> set[str]:
        """Return the names of all services."""
        return {name for name, _ in self.ask_master("getSystemState")[2]}

    def param(self, name: str) -> Any:
        """Return a parameter; fails where there is none."""
        return self.ask_master("getParam", name)

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter."""
        self.ask_master("setParam", name, value)

    def lose_master(self) -> None:
        """End the master as a crash would."""
        os.kill(self.ask_master("getPid"), signal.SIGKILL)
        self._master.wait()

    @contextmanager
    def frozen_master(self) -> Iterator[None]:
        """Have the master hang while the block runs: it takes connections and does not answer."""
        pid = self.ask_master("getPid")
        os.kill(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(pid, signal.SIGCONT)

    @contextmanager
    def asking(self, service: str) -> Iterator[socket.socket]:
        """Give a connection to a service, ready for a request, which is hung up when the block ends."""
        with self._connected(service) as (link, _):
            yield link

    def connection_to(self, service: str) -> socket.socket:
        """Return a new connection to the node of a service, without a header."""
        at = urlsplit(self.ask_master("lookupService", service))
        return socket.create_connection((at.hostname or "", at.port or 0), 40.0)

    def service_type(self, service: str) -> str:
        """Return the type of a service, as `rosservice type` asks its node for it."""
        with self._connected(service, "probe=1") as (_, fields):
            return fields["type"]

    @contextmanager
    def _connected(self, service: str, *extra: str) -> Iterator[tuple[socket.socket, dict[str, str]]]:
        """Give a connection to a service, and the fields of the header that its node sends."""
        fields = [f"service={service}", "md5sum=*", "callerid=/test", *extra]
        header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
        with self.connection_to(service) as link:
            link.sendall(struct.pack("<I", len(header)) + header)
            (length,) = struct.unpack("<I", link.recv(4, socket.MSG_WAITALL))
            yield link, _fields(link.recv(length, socket.MSG_WAITALL))

    def until(self, fact: Callable[[], object], what: str, within: float = 40.0) -> None:
        """Return as soon as something of the graph is so; fails where that takes longer [s]."""
        eventually(fact, what, within, lambda: "\n".join(program.said for program in self._programs))

    def until_nodes(self, *names: str, within: float = 40.0) -> None:
        """Return when these nodes take part in the graph."""
        self.until(lambda: set(names) <= self.nodes(), f"nodes {names}", within)

    def close(self) -> None:
        """End everything at once, the latest first; tests of how programs end end them themselves."""
        while self._programs:
            self._programs.pop().kill()


def places(folder: Path) -> dict[str, str]:
    """Return the environment of programs that keep everything in a folder of the test, and use the loopback only."""
    named = {
        "HOME": "home", "ROS_HOME": "ros", "ROS_LOG_DIR": "log", "MAYA_STATE_DIR": "state", "MAYA_RUNTIME_DIR": "run",
        "XDG_CONFIG_HOME": "config", "XDG_STATE_HOME": "state", "XDG_RUNTIME_DIR": "xdg",
    }  # fmt: skip
    for place in set(named.values()):
        (folder / place).mkdir(parents=True, exist_ok=True, mode=0o700)
    return {
        **{name: str(folder / place) for name, place in named.items()},
        "MAYA_CONFIG": str(shutil.copy(CALM_FILE, folder / "maya.toml")),
        "ROS_IP": "127.0.0.1",
        "PORT": "0",  # of ros-coms: several launches run beside each other
        "PYTHONUNBUFFERED": "1",
        "PYTHONPYCACHEPREFIX": str(BYTECODE),
    }


def _fields(header: bytes) -> dict[str, str]:
    """Return the fields of a header of the TCPROS protocol."""
    found: dict[str, str] = {}
    while header:
        (length,) = struct.unpack_from("<I", header)
        name, _, value = header[4 : 4 + length].decode().partition("=")
        found[name], header = value, header[4 + length :]
    return found
