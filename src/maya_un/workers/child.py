"""The worker process: takes requests from a pipe, works on each for a slice of time at most, and answers.

It bounds its own memory, and lowers its priority if configured. The kernel ends it if one slice takes far too long. It
ends when the process that started it has gone.
"""

from __future__ import annotations

import os
import pickle
import resource
import signal
from collections.abc import Callable, Generator
from typing import Any

from maya_un.errors import MayaError
from maya_un.workers.wire import ClosedError, WorkerAnswer, WorkerCommand, pickled, receive, send

SLICE = 0.02
"""Duration of a request's slice [s, computing]."""

LONGEST = 5
"""Longest slice before the kernel ends the worker [s, computing]."""

_Work = Generator[Any, None, Any]


def main() -> None:
    """Serve the pipes at the standard input and output until they are closed."""
    come, go = os.dup(0), os.dup(1)
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)  # text that is printed by mistake must not become an answer
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    worker = _Worker(go)
    try:
        while True:
            what, number, payload = receive(come)
            worker.take(WorkerCommand(what), number, payload)
    except ClosedError:
        os._exit(0)


class _Worker:
    """Holds the requests that are under way, by their numbers."""

    def __init__(self, answers: int) -> None:
        self._answers = answers
        self._under_way: dict[int, _WorkerTask] = {}

    def take(self, ask: WorkerCommand, number: int, payload: bytearray) -> None:
        """Execute a command and answer it; a dropped request gets no answer."""
        match ask:
            case WorkerCommand.PREPARE:
                memory, nicer, prepare, arguments = pickle.loads(payload)
                os.nice(nicer)
                resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
                prepare(*arguments)
            case WorkerCommand.BEGIN:
                self._work(number, lambda: _WorkerTask.begun(payload))
            case WorkerCommand.GO_ON:
                request = self._under_way.pop(number)
                self._work(number, lambda: request)
            case WorkerCommand.FORGET:
                self._under_way.pop(number, None)

    def _work(self, number: int, taken: Callable[[], _WorkerTask]) -> None:
        """Work on a request for a slice, and report the progress."""
        _bound(LONGEST)
        try:
            request = taken()
            told, payload = request.go_on()
        except MayaError as error:
            told, payload = WorkerAnswer.REFUSED, pickled(error)
        except MemoryError:
            told, payload = WorkerAnswer.TOO_LARGE, b""
        except Exception as defect:  # noqa: BLE001 - reported to the caller
            told, payload = WorkerAnswer.FAILED, pickled(repr(defect)[:500])
        else:
            if told in {WorkerAnswer.MORE, WorkerAnswer.PART}:
                self._under_way[number] = request
        send(self._answers, told, number, payload)


class _WorkerTask:
    """Work under way, which may take `seconds` of computing in all."""

    def __init__(self, work: _Work, seconds: float) -> None:
        self._work = work
        self._left = seconds

    @classmethod
    def begun(cls, payload: bytearray) -> _WorkerTask:
        """Return the requested work."""
        seconds, function, arguments = pickle.loads(payload)
        return cls(function(*arguments), seconds)

    def go_on(self) -> tuple[WorkerAnswer, bytes]:
        """Work until a slice of time is over, a piece is ready, or the work is done; return the answer."""
        began = _computed()
        try:
            while True:
                part = next(self._work)
                spent = _computed() - began
                if self._left < spent:
                    return WorkerAnswer.TOO_LONG, b""
                if part is not None:
                    self._left -= spent
                    return WorkerAnswer.PART, pickled(part)
                if spent >= SLICE:
                    self._left -= spent
                    return WorkerAnswer.MORE, b""
        except StopIteration as end:
            return WorkerAnswer.DONE, pickled(end.value)


def _computed() -> float:
    """Return the processor time of this process [s]."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _bound(seconds: int) -> None:
    """Make the kernel end this process (SIGXCPU) if it computes for `seconds` more [s] without returning here."""
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(_computed()) + 1 + seconds, hard))
