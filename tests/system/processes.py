"""Commands as processes of their own: started, waited for by what they say, ended."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
from codecs import getincrementaldecoder
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import IncrementalNewlineDecoder
from math import inf
from pathlib import Path
from time import monotonic

from tests.calm import CALM_FILE
from tests.errors_seen import SEEN
from tests.fork_server import WarmPopen
from tests.secrecy import MARK

MAYA = str(Path(sys.executable).with_name("maya"))
"""The installed command."""

CALM = f"--config {CALM_FILE}"
"""For `maya up --speed`: fewer data records and beats, where they are not what is tested, and nothing is taught."""


class Process:
    """A command that runs. `env` is added to this process's environment.

    The command is forked from a process that has loaded the package (`tests.fork_server`). It starts from nothing if
    `cold`,
    if another command stands `before` it, or if its environment changes how an interpreter starts. If `quiet`, its
    standard error is dropped.
    """

    def __init__(
        self,
        line: str,
        before: Sequence[str] = (),
        env: Mapping[str, str] | None = None,
        *,
        cold: bool = False,
        quiet: bool = False,
    ) -> None:
        self._command = [*before, MAYA, *line.split()]
        whole = {**os.environ, **(env or {})}
        self._popen: subprocess.Popen[bytes] | WarmPopen
        if cold or before or not WarmPopen.can(whole):
            stderr = subprocess.DEVNULL if quiet else subprocess.STDOUT
            self._popen = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=stderr, bufsize=0, env=whole)
        else:
            self._popen = WarmPopen(self._command, whole, quiet=quiet)
        assert self._popen.stdout is not None
        self._stdout = self._popen.stdout
        self._decoder = IncrementalNewlineDecoder(getincrementaldecoder("utf-8")("replace"), translate=True)
        self._unread = ""

    @property
    def number(self) -> int:
        """The number of the process."""
        return self._popen.pid

    @property
    def command_line(self) -> str:
        """The command line that other users of the machine can read while it runs."""
        if isinstance(self._popen, WarmPopen):
            return " ".join(self._command)
        return Path(f"/proc/{self.number}/cmdline").read_text()

    def until(self, text: str) -> str:
        """Return the first line that holds `text`; fails where the command ends before."""
        said: list[str] = []
        while line := self._line():
            assert MARK not in line
            said.append(line)
            SEEN.note_printed(line)
            if text in line:
                return line.strip()
        raise AssertionError(f"never said {text!r}, but:\n{''.join(said)}")

    def send(self, kind: signal.Signals) -> None:
        """Send a signal."""
        self._popen.send_signal(kind)

    def end(self, within: float = 120.0) -> tuple[int, str]:
        """Return exit code and the rest of the output, within a time [s]."""
        until = monotonic() + within
        while self._more(until):
            pass
        code = self._popen.wait(max(0.0, until - monotonic()))
        self._stdout.close()
        rest, self._unread = self._unread, ""
        assert MARK not in rest
        SEEN.note_printed(rest)
        return code, rest

    def kill(self) -> None:
        """End it whatever it does, even if it is stopped; neither its command line nor what it printed has a secret."""
        shown = "" if self._popen.returncode is not None else self.command_line
        self._popen.kill()
        self._popen.wait()
        if not self._stdout.closed:
            shown += self._unread + _held(self._stdout.fileno())
            self._stdout.close()
        assert MARK not in shown

    def _line(self) -> str:
        """Return the next line, or what is left when the command ends."""
        while "\n" not in self._unread and self._more():
            pass
        line, end, self._unread = self._unread.partition("\n")
        return line + end

    def _more(self, until: float = inf) -> bool:
        """Read the next output; return whether there was any. Raises `TimeoutError` without output."""
        waiting = select.poll()
        waiting.register(self._stdout, select.POLLIN)
        if not waiting.poll(None if until == inf else max(0.0, 1000.0 * (until - monotonic()))):
            raise TimeoutError(f"{' '.join(self._command)} goes on; it said:\n{self._unread}")
        data = os.read(self._stdout.fileno(), 65536)
        self._unread += self._decoder.decode(data, final=not data)
        return bool(data)


def _held(pipe: int) -> str:
    """Return what a pipe holds now; a process that was left behind may keep it open."""
    data = b""
    os.set_blocking(pipe, False)
    with suppress(BlockingIOError):
        while more := os.read(pipe, 65536):
            data += more
    return data.decode(errors="replace")


@contextmanager
def running(line: str, env: Mapping[str, str] | None = None, *, cold: bool = False) -> Iterator[Process]:
    """Run a command while the block runs; `env` is added to the environment; `cold` is as for `Process`."""
    process = Process(line, env=env, cold=cold)
    try:
        yield process
    finally:
        process.kill()


def done(
    line: str, within: float = 120.0, env: Mapping[str, str] | None = None, *, cold: bool = False
) -> tuple[int, str]:
    """Run a command to its end, `within` a time [s]; return exit code and output."""
    with running(line, env, cold=cold) as process:
        return process.end(within)


class Wire:
    """A handle of a controller of one's own."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host, int(port)), timeout=10.0)

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def say(self, command: str) -> bytes:
        """Send one command and return what it prints; one that is refused fails."""
        self._socket.sendall(f"{command}\r".encode())
        reply = b""
        while not reply.endswith((b":", b"?")):
            reply += self._socket.recv(1024)
        assert reply.endswith(b":"), f"{command} is refused"
        return reply[:-1]

    def numbers(self, operands: str) -> list[float]:
        """Return what MG prints for operands."""
        return [float(word) for word in self.say(f"MG {operands}").split()]

    @property
    def time(self) -> float:
        """The controller's clock [s]."""
        return self.numbers("TIME")[0] / 1024.0
