"""Programs as processes of their own: started, waited for by what they say, ended with all that they started."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from threading import Condition, Thread
from time import monotonic

ENDS = 10.0
"""Longest time until the output of a killed program ends [s]; no test waits for ever."""

MARK = "TEST_PROGRAM"
"""The variable that everything which a program starts inherits: roslaunch gives every node a session of its own."""

_NUMBERS = itertools.count(1)


class Program:
    """A program in its own session; its output is stored line by line."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        self.command = " ".join(command)
        self.lines: list[str] = []
        self._news = Condition()
        self._closed = False
        self._mark = f"{os.getpid()}.{next(_NUMBERS)}"
        self._popen = subprocess.Popen(
            command, env={**environment, MARK: self._mark},
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, bufsize=1, errors="replace", start_new_session=True,
        )  # fmt: skip
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Its process."""
        return self._popen.pid

    @property
    def said(self) -> str:
        """All output so far."""
        return "\n".join(self.lines)

    @property
    def runs(self) -> bool:
        """Whether it has not ended."""
        return self._popen.poll() is None

    def until(self, text: str, within: float = 40.0) -> str:
        """Return the first line that holds `text`; fails where the program ends before, or takes longer [s]."""
        end = monotonic() + within
        looked = 0
        with self._news:
            while True:
                for line in self.lines[looked:]:
                    if text in line:
                        return line
                looked = len(self.lines)
                if self._closed or not self._news.wait(end - monotonic()):
                    raise AssertionError(f"{self.command} never said {text!r}, but:\n{self.said}")

    def follow(self) -> Iterator[str]:
        """Yield every line, earlier ones included, until the program ends."""
        for number in itertools.count():
            with self._news:
                while number >= len(self.lines) and not self._closed:
                    self._news.wait()
                if number >= len(self.lines):
                    return
            yield self.lines[number]

    def write(self, line: str) -> None:
        """Write one line to its standard input."""
        assert self._popen.stdin is not None
        self._popen.stdin.write(f"{line}\n")
        self._popen.stdin.flush()

    def send(self, kind: signal.Signals) -> None:
        """Send a signal to the program alone."""
        self._popen.send_signal(kind)

    def wait(self, within: float = 40.0) -> int:
        """Return its exit code; it may take so long [s] to end by itself."""
        try:
            code = self._popen.wait(within)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.command} does not end:\n{self.said}") from None
        self._reader.join(within)
        return code

    def end(self, kind: signal.Signals = signal.SIGINT, within: float = 40.0) -> int:
        """Send a signal and return the exit code."""
        self.send(kind)
        return self.wait(within)

    def close(self, within: float = 15.0) -> None:
        """End it gently if it can be, and everything it started in any case."""
        if self.runs:
            self.send(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._popen.wait(within)
        self.kill()

    def kill(self) -> None:
        """End it and everything it started, whatever they do."""
        while processes := _marked(self._mark):  # one of them may have started another meanwhile
            for process in processes:
                _kill(process)
        self._popen.wait()
        self._reader.join(ENDS)
        assert not self._reader.is_alive(), f"something that {self.command} started holds its output"
        for pipe in (self._popen.stdin, self._popen.stdout):
            assert pipe is not None
            pipe.close()

    def _read(self) -> None:
        assert self._popen.stdout is not None
        for line in self._popen.stdout:
            with self._news:
                self.lines.append(line.rstrip("\n"))
                self._news.notify_all()
        with self._news:
            self._closed = True
            self._news.notify_all()


def _marked(mark: str) -> list[int]:
    """Return the processes that inherited a mark and have not ended."""
    wanted = f"{MARK}={mark}".encode()
    found: list[int] = []
    for process in filter(str.isdigit, os.listdir("/proc")):  # noqa: PTH208 - pathlib looks into what may end meanwhile
        with contextlib.suppress(OSError):
            if wanted in Path("/proc", process, "environ").read_bytes().split(b"\0"):
                found.append(int(process))
    return found


def _kill(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)
