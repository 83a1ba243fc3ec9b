"""Start Python programs fast: fork them from a process that has loaded the packages.

To load the packages takes a second of processor time. A test whose subject is not the start can do without it.
A forked program is an ordinary process: it has its own number, environment, folder and output. It ends as a process of
`multiprocessing` does: threads end, exit handlers run, and output is written, but no object is destroyed. To destroy
what was loaded before the fork would take longer than most programs run.

The worker processes of a forked program are forked too (`maya_un.workers`).
"""

from __future__ import annotations

import atexit
import functools
import gc
import importlib
import json
import os
import pkgutil
import runpy
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from io import FileIO
from pathlib import Path

from maya_un.workers import child, pool

ROOT = Path(__file__).resolve().parents[1]

PACKAGES = ("maya_un", "dmc41x3", "maya_ros")
"""The packages that are loaded before the fork."""

LATER = ("maya_ros.ros1", "maya_un.plots", "dmc41x3.gclib.shim")
"""Modules that need ROS, replace others, or load what few programs use."""

STARTING = ("PYTHON", "LANG", "LC_", "TZ", "OPENBLAS_", "OMP_", "MKL_")
"""An interpreter reads variables with these prefixes when it starts."""

LARGEST = 1 << 17
"""Upper bound of the size of an order [bytes]."""


def starting(env: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that an interpreter reads when it starts."""
    return {name: value for name, value in env.items() if name.startswith(STARTING)}


_OURS = starting(os.environ)


@dataclass(frozen=True, slots=True)
class _Order:
    """A program to fork: a script, or `-m` and a module, and its arguments; no command for a worker.

    If it is `held`, the program has a session of its own. It is killed when the process that ordered it closes its
    connection.
    """

    command: list[str]
    env: dict[str, str]
    folder: str
    held: bool = False


class _Forked:
    """A forked process, with the part of `subprocess.Popen` that ends it and waits for its end."""

    def __init__(self, order: _Order, stdin: int, stdout: int, stderr: int) -> None:
        self._code, its_code = os.pipe()
        try:
            self.pid = _forker().fork(order, [stdin, stdout, stderr, its_code])
        finally:
            for end in {stdin, stdout, stderr, its_code}:
                os.close(end)
        self.returncode: int | None = None

    def poll(self, timeout: float | None = 0.0) -> int | None:
        """Return the exit code; None if the program still runs after `timeout` [s]."""
        if self.returncode is None:
            waiting = select.poll()
            waiting.register(self._code, select.POLLIN)
            if waiting.poll(None if timeout is None else 1000.0 * timeout):
                self.returncode = int(os.read(self._code, 16))
                os.close(self._code)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code; raises `subprocess.TimeoutExpired` if the program still runs after `timeout` [s]."""
        code = self.poll(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal if the program runs."""
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it ended, and its exit code is on the way
                os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill the program if it runs."""
        self.send_signal(signal.SIGKILL)


class WarmPopen(_Forked):
    """A forked program: a Python script, or `-m` and a module, and its arguments.

    The standard output is a pipe. The standard error goes to the same pipe, to the file `errors`, or is dropped if
    `quiet`.
    """

    stdin: FileIO | None = None
    """The pipe of the standard input, if the program was started `with_input`; else its input is empty."""

    def __init__(
        self,
        command: Sequence[str],
        env: Mapping[str, str] | None = None,
        *,
        quiet: bool = False,
        errors: Path | None = None,
        with_input: bool = False,
    ) -> None:
        order = _Order(list(command), dict(os.environ if env is None else env), str(Path.cwd()))
        if with_input:
            its_input, to_it = os.pipe()
            self.stdin = _stream(to_it, "wb")
        else:
            its_input = os.open(os.devnull, os.O_RDONLY)
        output, its_output = os.pipe()
        kept = os.devnull if quiet else errors
        its_errors = its_output if kept is None else os.open(kept, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        super().__init__(order, its_input, its_output, its_errors)
        self.stdout = _stream(output, "rb")

    def close(self) -> None:
        """Close the pipes."""
        self.stdout.close()
        if self.stdin is not None:
            self.stdin.close()

    @staticmethod
    def can(env: Mapping[str, str] | None) -> bool:
        """Tell whether a new interpreter would start with this environment as the forking one did."""
        return env is None or starting(env) == _OURS


class WarmWorker(_Forked):
    """A forked worker process of `maya_un.workers`: its standard input and output are pipes."""

    def __init__(self) -> None:
        its_input, to_it = os.pipe()
        from_it, its_output = os.pipe()
        order = _Order([], dict(os.environ), str(Path.cwd()))
        super().__init__(order, its_input, its_output, os.open(os.devnull, os.O_RDWR))
        self.stdin = _stream(to_it, "wb")
        self.stdout = _stream(from_it, "rb")


def _stream(end: int, mode: str) -> FileIO:
    """Return the stream of one end of a pipe, which its user closes."""
    return FileIO(end, mode)


class Forker:
    """A connection to the forking process, which ends when its first connection closes."""

    def __init__(
        self, connection: socket.socket, address: bytes, process: subprocess.Popen[bytes] | None = None
    ) -> None:
        self._lock = threading.Lock()
        self._socket = connection
        self._process = process
        self.address = address

    @classmethod
    def started(cls, python: str | Path, env: Mapping[str, str], module: str = "tests.fork_server") -> Forker:
        """Start the forking process: a Python with an environment, and the `main` of a module.

        It listens at `address`, an abstract one. Programs that connect while it starts wait for it.
        """
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
            listening.bind(b"")  # the kernel chooses the address
            listening.listen()
            address = listening.getsockname()
            process = subprocess.Popen(
                [python, "-c", f"from {module} import main; main({theirs.fileno()}, {listening.fileno()})"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,  # of the kind that forked programs have, whose streams were made for it
                stderr=subprocess.STDOUT,
                cwd=ROOT,
                env=env,
                pass_fds=[theirs.fileno(), listening.fileno()],
            )
        started = cls(ours, address, process)
        atexit.register(started._end)
        return started

    @classmethod
    def of_program(cls, address: bytes) -> Forker:
        """Connect a forked program to the process that forked it."""
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        connection.connect(address)
        return cls(connection, address)

    def fork(self, order: _Order, ends: Sequence[int]) -> int:
        """Return the number of a new process with these descriptors: 0, 1, 2, and one for its exit code."""
        with self._lock:
            socket.send_fds(self._socket, [json.dumps(asdict(order)).encode()], ends)
            answer = self._socket.recv(16)
        assert answer, "the forking process has ended"
        return int(answer)

    def _end(self) -> None:
        """End the forking process: it reads the end of the connection."""
        self._socket.close()
        if self._process is not None:
            self._process.communicate()


_address = b""
"""The address of the forking process; empty in a process that was not forked by it."""


@contextmanager
def forked_workers() -> Iterator[None]:
    """Fork the worker processes that this process starts while the block runs."""
    cold = pool._started
    pool._started = WarmWorker  # type: ignore[assignment]
    try:
        yield
    finally:
        pool._started = cold


@functools.cache
def _forker() -> Forker:
    if _address:
        return Forker.of_program(_address)
    same = {name: value for name, value in os.environ.items() if not name.startswith(STARTING)}
    return Forker.started(sys.executable, {**same, **_OURS})


def main(first: int, listening: int) -> None:
    """Load the packages of the command line, and serve."""
    serve(first, listening, _load)


def serve(first: int, listening: int, load: Callable[[], None], begin: Callable[[], None] | None = None) -> None:
    """Load, and fork what the other side of the `first` socket orders, until it closes.

    Programs that connect to the socket `listening` can order too. A forked process calls `begin`, then it carries out
    its order.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # a forked program gets it as soon as it can
    server = _ForkServer(first, listening)
    load()
    gc.collect()
    gc.freeze()
    order = server.serve()
    if order is not None:
        try:
            _carry_out(order, begin)
        except SystemExit as ending:
            _end(ending.code)
        _end(None)


def _load() -> None:
    for package in PACKAGES:
        for found in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not found.name.startswith(LATER):
                importlib.import_module(found.name)
    _build()


def _build() -> None:
    """Build what programs build at most once, each in its turn."""
    from dmc41x3.cli import parsing
    from maya_ros.graph import catalogue
    from maya_un.cli import app
    from maya_un.http.app import all_routes

    parsing.parser(app.app, "")
    all_routes()
    catalogue.kinds()


class _ForkServer:
    """Takes orders of a test and of the programs that it forked."""

    def __init__(self, first: int, listening: int) -> None:
        self._first = first
        self._listening = listening
        self._sockets = {end: socket.socket(fileno=end) for end in (listening, first)}
        self._address = self._sockets[listening].getsockname()
        self._codes: dict[int, tuple[int, int]] = {}  # by descriptor of a process: its number, and where its code goes
        self._held: dict[int, int] = {}  # by descriptor of a connection: the number of the process that it holds
        self._poller = select.poll()
        for end in self._sockets:
            self._poller.register(end, select.POLLIN)

    def serve(self) -> _Order | None:
        """Return the order in a forked process, and None in this process when the test orders nothing any more."""
        while True:
            for ready, _ in self._poller.poll():
                if ready in self._codes:
                    self._ended(ready)
                elif ready == self._listening:
                    connection, _ = self._sockets[ready].accept()
                    self._sockets[connection.fileno()] = connection
                    self._poller.register(connection, select.POLLIN)
                else:
                    order, ends = self._received(ready)
                    if order:
                        asked = _Order(**json.loads(order))
                        if self._forked(ready, asked, ends):
                            return asked
                    elif ready == self._first:
                        return None
                    else:
                        self._left(ready)

    def _received(self, asking: int) -> tuple[bytes, Sequence[int]]:
        """Return an order and its descriptors; no order from a connection whose program has ended."""
        try:
            order, ends, _, _ = socket.recv_fds(self._sockets[asking], LARGEST, 4)
        except ConnectionError:  # the program was killed before it read our answer
            return b"", ()
        return order, ends

    def _left(self, asking: int) -> None:
        """Forget a connection that has closed, and kill what it holds."""
        self._poller.unregister(asking)
        self._sockets.pop(asking).close()
        held = self._held.pop(asking, None)
        if held is not None:
            os.kill(held, signal.SIGKILL)

    def _forked(self, asking: int, order: _Order, ends: Sequence[int]) -> bool:
        """Fork for a connection; return whether this is the forked process."""
        number = os.fork()
        if number == 0:
            if order.held:
                os.setsid()
            for end in self._sockets.values():
                end.detach()  # `_become` closes them all
            _become(ends[:3], self._address)
            return True
        with suppress(ConnectionError):  # the asking program was killed; the new one will find its input closed
            self._sockets[asking].send(str(number).encode())
        process = os.pidfd_open(number)
        self._codes[process] = number, ends[3]
        if order.held:
            self._held[asking] = number
        self._poller.register(process, select.POLLIN)
        for end in ends[:3]:
            os.close(end)
        return False

    def _ended(self, process: int) -> None:
        """Report the exit code of a process that has ended."""
        self._poller.unregister(process)
        number, end = self._codes.pop(process)
        os.close(process)
        self._held = {asking: held for asking, held in self._held.items() if held != number}
        code = os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])
        try:
            os.write(end, str(code).encode())
        except BrokenPipeError:
            pass  # nobody asks
        finally:
            os.close(end)


def _become(ends: Sequence[int], address: bytes) -> None:
    """Have these descriptors as the standard ones, and no others."""
    global _address  # noqa: PLW0603 - a fork changes what this process is
    _address = address
    for standard, end in enumerate(ends):
        os.dup2(end, standard)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))


def _carry_out(order: _Order, begin: Callable[[], None] | None) -> None:
    os.environ.clear()
    os.environ.update(order.env)
    os.chdir(order.folder)
    if not order.command:
        os.setsid()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
        child.main()
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    pool._started = WarmWorker  # type: ignore[assignment]
    is_module = order.command[0] == "-m"
    sys.argv = order.command[is_module:]
    sys.path[0] = order.folder if is_module else str(Path(sys.argv[0]).parent)
    if begin is not None:
        begin()
    if is_module:
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(sys.argv[0], run_name="__main__")


def _end(code: object) -> None:
    """End this process as `sys.exit(code)` does, but without destroying the objects of the interpreter."""
    if not isinstance(code, int | None):
        sys.exit(code)  # type: ignore[arg-type]
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code or 0)
