"""Commands as processes of their own: started, waited for by what they say, ended."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.secrecy import MARK

MAYA = str(Path(sys.executable).with_name("maya"))
"""The installed command."""

CALM_FILE = Path(__file__).parents[1] / "calm.toml"
CALM = f"--config {CALM_FILE}"
"""For `maya up --speed`: fewer data records and beats, where they are not what is tested, and nothing is taught."""


class Process:
    """A command that runs; what is `before` it runs it. `env` is added to this process's environment."""

    def __init__(self, line: str, before: Sequence[str] = (), env: Mapping[str, str] | None = None) -> None:
        self._popen = subprocess.Popen(
            [*before, MAYA, *line.split()],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
            env=None if env is None else {**os.environ, **env},
        )

    @property
    def number(self) -> int:
        """The number of the process."""
        return self._popen.pid

    def until(self, text: str) -> str:
        """Return the first line that holds `text`; fails where the command ends before."""
        assert self._popen.stdout is not None
        said: list[str] = []
        for line in self._popen.stdout:
            assert MARK not in line
            said.append(line)
            if text in line:
                return line.strip()
        raise AssertionError(f"never said {text!r}, but:\n{''.join(said)}")

    def send(self, kind: signal.Signals) -> None:
        """Send a signal."""
        self._popen.send_signal(kind)

    def end(self, within: float = 120.0) -> tuple[int, str]:
        """Return exit code and the rest of what it says; it may take so long [s]."""
        rest, _ = self._popen.communicate(timeout=within)
        assert MARK not in rest
        return self._popen.returncode, rest

    def kill(self) -> None:
        """End it whatever it does, even if it is stopped; neither its command line nor what it printed has a secret."""
        shown = "" if self._popen.returncode is not None else Path(f"/proc/{self.number}/cmdline").read_text()
        self._popen.kill()
        self._popen.wait()
        assert self._popen.stdout is not None
        if not self._popen.stdout.closed:
            shown += _held(self._popen.stdout.fileno())
            self._popen.stdout.close()
        assert MARK not in shown


def _held(pipe: int) -> str:
    """Return what a pipe holds now; a process that was left behind may keep it open."""
    data = b""
    os.set_blocking(pipe, False)
    with suppress(BlockingIOError):
        while more := os.read(pipe, 65536):
            data += more
    return data.decode(errors="replace")


@contextmanager
def running(line: str, env: Mapping[str, str] | None = None) -> Iterator[Process]:
    """Run a command while the block runs; `env` is added to the environment."""
    process = Process(line, env=env)
    try:
        yield process
    finally:
        process.kill()


def done(line: str, within: float = 120.0, env: Mapping[str, str] | None = None) -> tuple[int, str]:
    """Run a command to its end, `within` so long [s]; return exit code and what it said."""
    with running(line, env) as process:
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
