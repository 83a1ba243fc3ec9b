"""Start Python programs fast: fork them from a process that has loaded the packages.

To load the packages takes a second of processor time. A test whose subject is not the start can do without it.
A forked program is an ordinary process: it has its own number, environment, folder and output. It ends as a process of
`multiprocessing` does: threads end, exit handlers run, and output is written, but no object is destroyed. To destroy
what was loaded before the fork would take longer than most programs run.
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
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Lock

ROOT = Path(__file__).resolve().parents[1]

PACKAGES = ("maya_un", "dmc41x3")
"""The packages that are loaded before the fork."""

LATER = ("maya_un.ros", "maya_un.plots", "dmc41x3.gclib.shim")
"""Modules that need ROS, replace others, or load what few programs use."""

STARTING = ("PYTHON", "LANG", "LC_", "TZ", "OPENBLAS_", "OMP_", "MKL_")
"""An interpreter reads variables with these prefixes when it starts."""

LARGEST = 1 << 17
"""Upper bound of the size of an order [bytes]."""


def _starting(env: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in env.items() if name.startswith(STARTING)}


_OURS = _starting(os.environ)


@dataclass(frozen=True, slots=True)
class _Order:
    command: list[str]
    env: dict[str, str]
    folder: str


class WarmPopen:
    """A forked program, with the part of `subprocess.Popen` that tests use.

    `command` is a Python script and its arguments, or `-m`, a module and its arguments. The standard output is a pipe.
    The standard error goes to the same pipe, or is dropped if `quiet`.
    """

    def __init__(self, command: Sequence[str], env: Mapping[str, str] | None = None, *, quiet: bool = False) -> None:
        order = _Order(list(command), dict(os.environ if env is None else env), str(Path.cwd()))
        output, its_output = os.pipe()
        self._code, its_code = os.pipe()
        nothing = os.open(os.devnull, os.O_RDWR)
        try:
            self.pid = _forker().fork(order, [0, its_output, nothing if quiet else its_output, its_code])
        finally:
            for end in (its_output, its_code, nothing):
                os.close(end)
        self.stdout = open(output, "rb", buffering=0)  # noqa: PTH123, SIM115 - a pipe, which the owner closes
        self.returncode: int | None = None

    @staticmethod
    def can(env: Mapping[str, str] | None) -> bool:
        """Tell whether a new interpreter would start with this environment as the forking one did."""
        return env is None or _starting(env) == _OURS

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
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill the program if it runs."""
        self.send_signal(signal.SIGKILL)


class _Forker:
    """The test's side of the forking process. It ends with the test's process, whose socket closes then."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        env = {**{name: value for name, value in os.environ.items() if not name.startswith(STARTING)}, **_OURS}
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from tests.fork_server import main; main({theirs.fileno()})"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,  # of the kind that forked programs have, whose streams were made for it
                stderr=subprocess.STDOUT,
                cwd=ROOT,
                env=env,
                pass_fds=[theirs.fileno()],
            )

    def fork(self, order: _Order, ends: Sequence[int]) -> int:
        """Return the number of a new process with these descriptors: 0, 1, 2, and one for its exit code."""
        with self._lock:
            socket.send_fds(self._socket, [json.dumps(asdict(order)).encode()], ends)
            answer = self._socket.recv(16)
        assert answer, self._process.communicate()[0].decode()
        return int(answer)


@functools.cache
def _forker() -> _Forker:
    return _Forker()


def main(descriptor: int) -> None:
    """Fork what the other side of a socket orders, until it closes; a forked process carries out its order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _load()
    gc.collect()
    gc.freeze()
    order = _serve(socket.socket(fileno=descriptor))
    if order is not None:
        try:
            _carry_out(order)
        except SystemExit as ending:
            _end(ending.code)
        _end(None)


def _end(code: object) -> None:
    """End this process as `sys.exit(code)` does, but without destroying the objects of the interpreter."""
    if not isinstance(code, int | None):
        sys.exit(code)  # type: ignore[arg-type] - prints it
    threading._shutdown()  # type: ignore[attr-defined] - as multiprocessing does
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code or 0)


def _load() -> None:
    for package in PACKAGES:
        for found in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not found.name.startswith(LATER):
                importlib.import_module(found.name)


def _serve(orders: socket.socket) -> _Order | None:
    """Return the order in a forked process, and None in the forking process when nobody orders any more."""
    poller = select.poll()
    poller.register(orders, select.POLLIN)
    codes: dict[int, tuple[int, int]] = {}  # by descriptor of a process: its number, and where its exit code goes
    while True:
        for ready, _ in poller.poll():
            if ready in codes:
                poller.unregister(ready)
                number, code = codes.pop(ready)
                os.close(ready)
                _report(code, os.waitstatus_to_exitcode(os.waitpid(number, 0)[1]))
                continue
            order, ends, _, _ = socket.recv_fds(orders, LARGEST, 4)
            if not order:
                return None
            number = os.fork()
            if number == 0:
                orders.detach()
                _become(ends[:3])
                return _Order(**json.loads(order))
            orders.send(str(number).encode())
            process = os.pidfd_open(number)
            codes[process] = number, ends[3]
            poller.register(process, select.POLLIN)
            for end in ends[:3]:
                os.close(end)


def _report(end: int, code: int) -> None:
    try:
        os.write(end, str(code).encode())
    except BrokenPipeError:
        pass  # nobody asks
    finally:
        os.close(end)


def _become(ends: Sequence[int]) -> None:
    """Have these descriptors as the standard ones, and no others."""
    for standard, end in enumerate(ends):
        os.dup2(end, standard)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    signal.signal(signal.SIGINT, signal.default_int_handler)


def _carry_out(order: _Order) -> None:
    os.environ.clear()
    os.environ.update(order.env)
    os.chdir(order.folder)
    program, *arguments = order.command
    if program == "-m":
        sys.path[0] = order.folder
        sys.argv = arguments
        runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)
    else:
        sys.path[0] = str(Path(program).parent)
        sys.argv = order.command
        runpy.run_path(program, run_name="__main__")
