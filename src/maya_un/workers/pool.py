"""A pool for work in a worker process: takes requests from any loop, and returns the answer to that loop.

Clients get slices in turn, and of each client the oldest request comes first.
"""

from __future__ import annotations

import asyncio
import itertools
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future, InvalidStateError
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar

from dmc41x3.i18n import phrase
from maya_un.errors import InternalError, MayaError, TakesTooLong, TooLarge, TooMuchAsked, WorkerFailed
from maya_un.workers.wire import ClosedError, StuckError, WorkerAnswer, WorkerCommand, pickled, receive, send

OPEN = 4
"""Most clients whose requests are under way at once in a worker; the others use no memory yet."""


@dataclass(eq=False, slots=True)
class WorkRequest:
    """A request to the worker: `payload` is the work, `whose` the client.

    `began`: the worker has received it. `parts`: the pieces that it has sent. `again`: the request was started once
    more after a worker had failed. `dropped`: no caller waits for it any more.
    """

    number: int
    whose: str
    payload: bytes
    answer: Future[Any] = field(default_factory=Future[Any])
    parts: list[Any] = field(default_factory=list[Any])
    began: bool = False
    again: bool = False
    dropped: bool = False


class RoundRobin:
    """Holds requests, at most `most` in all and `each` per principal; callers ensure that one thread acts at a time."""

    def __init__(self, most: int, each: int) -> None:
        self._most = most
        self._each = each
        self._waiting: dict[str, deque[WorkRequest]] = {}

    def __len__(self) -> int:
        return sum(map(len, self._waiting.values()))

    def __iter__(self) -> Any:
        return (request for requests in self._waiting.values() for request in requests)

    def put(self, request: WorkRequest, each: int | None = None) -> None:
        """Add a request, unless its principal has `each` requests already; raises `TooMuchAsked`."""
        each = self._each if each is None else each
        if len(self._waiting.get(request.whose, ())) >= each:
            raise TooMuchAsked(most=each)
        if len(self) >= self._most:
            raise TooMuchAsked(most=self._most)
        self._waiting.setdefault(request.whose, deque()).append(request)

    def next(self) -> WorkRequest | None:
        """Return the next request, and move its principal to the end of the order; None without a request."""
        began = sum(requests[0].began for requests in self._waiting.values())
        for whose, requests in self._waiting.items():
            if requests[0].began or began < OPEN:
                self._waiting[whose] = self._waiting.pop(whose)
                return requests[0]
        return None

    def remove(self, request: WorkRequest) -> None:
        """Remove a request."""
        requests = self._waiting.get(request.whose)
        if requests is not None and request in requests:
            requests.remove(request)
            if not requests:
                del self._waiting[request.whose]

    def each(self, do: Callable[[WorkRequest], None]) -> None:
        """Call `do` for all requests."""
        for request in list(self):
            do(request)


P = ParamSpec("P")
T = TypeVar("T")

Work = Callable[P, Generator[Any, None, T]]
"""A generator function of a module: it yields None where another request may run, or a piece of the result."""

_MAIN = "import sys; sys.path[:] = {path!r}; from maya_un.workers.child import main; main()"
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class WorkResult(NamedTuple, Generic[T]):
    """Outcome of work: the pieces that it sent on the way, and its result."""

    parts: list[Any]
    value: T


@dataclass(frozen=True, slots=True)
class ComputeLimits:
    """Limits of computing: `seconds` for one request, `memory` [bytes] of the process.

    `most` requests may wait or be under way in all, and `each` of one client. `nicer` lowers the priority of the
    process. A process that neither reads nor writes for `patience` [s, by the wall] hangs, and is replaced.
    """

    seconds: float = 30.0
    memory: int = 1 << 30
    most: int = 32
    each: int = 4
    nicer: int = 0
    patience: float = 30.0


class WorkerSet(NamedTuple):
    """The workers beside the loop: one for the robot, one for users' requests."""

    own: Workers
    people: Workers


class Workers:
    """A worker process, started when it is needed, and restarted after its end; `name` is its purpose.

    It first calls `prepare`, a function of a module, with `arguments`.
    """

    def __init__(
        self,
        name: str,
        bounds: ComputeLimits,
        prepare: Callable[..., object],
        *arguments: object,
    ) -> None:
        self._name = name
        self._bounds = bounds
        self._prepare = pickled((bounds.memory, bounds.nicer, prepare, arguments))
        self._numbers = itertools.count(1)
        self._circle = RoundRobin(bounds.most, bounds.each)
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._wanted = False
        self._closed = False

    @property
    def process(self) -> int | None:
        """The process id, None if no process runs."""
        process = self._process
        return None if process is None else process.pid

    def warm(self) -> None:
        """Start the process now, in the background, so that no request waits for its start."""
        with self._changed:
            self._wanted = True
            self._go()

    async def run(self, work: Work[..., T], *args: object, whose: str = "", each: int | None = None) -> WorkResult[T]:
        """Return the result of `work` in the worker; a cancelled request is dropped.

        `whose` names the client: all clients get slices in turn. A client may have `each` requests here, by default as
        many as the bounds allow. A simulated clock stands still meanwhile. Raises the errors of `work`, `TooMuchAsked`,
        `TakesTooLong`, `TooLarge` and `WorkerFailed`.
        """
        payload = pickled((self._bounds.seconds, work, args))
        request = WorkRequest(next(self._numbers), whose, payload)
        with self._changed:
            if self._closed:
                raise WorkerFailed(reason="the program is ending")
            self._circle.put(request, each)
            self._go()
        with _standing_still():
            try:
                return await asyncio.wrap_future(request.answer)
            except asyncio.CancelledError:
                self._drop(request)
                raise

    def close(self) -> None:
        """End the process; waiting requests fail with `WorkerFailed`."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            if self._process is not None:
                self._process.kill()
        if self._thread is not None:
            self._thread.join()

    def _go(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._serve, name=f"maya-{self._name}", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _drop(self, request: WorkRequest) -> None:
        with self._changed:
            request.dropped = True
            if not request.began:
                self._circle.remove(request)
            self._changed.notify_all()

    def _serve(self) -> None:
        """Give the requests slices in turn until closed."""
        while True:
            with self._changed:
                request = self._circle.next()
                while request is None and not self._closed and not (self._wanted and self._process is None):
                    self._changed.wait()
                    request = self._circle.next()
                if self._closed:
                    break
                self._wanted = False
            try:
                self._turn(request)
            except (ClosedError, OSError) as error:
                self._failed(request, self._ended(error))
            except StuckError:
                self._replaced(request, TakesTooLong(seconds=f"{self._bounds.patience:g}"))
            except Exception as defect:  # noqa: BLE001 - reported to the caller; others must not wait for ever
                self._replaced(request, InternalError(reason=repr(defect)[:500]))
        self._kill()
        self._circle.each(lambda one: self._over(one, WorkerFailed(reason="the program is ending")))

    def _turn(self, request: WorkRequest | None) -> None:
        """Work on a request for a slice."""
        process = self._running()
        if request is None:
            return
        assert process.stdin is not None and process.stdout is not None
        within = self._bounds.patience
        with self._changed:  # a request that is dropped from here on is known to the worker
            began, dropped = request.began, request.dropped
            request.began = not dropped
        if dropped:
            if began:
                send(process.stdin.fileno(), WorkerCommand.FORGET, request.number, within=within)
            self._over(request, None)
            return
        ask, payload = (WorkerCommand.GO_ON, b"") if began else (WorkerCommand.BEGIN, request.payload)
        send(process.stdin.fileno(), ask, request.number, payload, within)
        told, _, answer = receive(process.stdout.fileno(), within)
        self._take(request, WorkerAnswer(told), answer)

    def _take(self, request: WorkRequest, told: WorkerAnswer, payload: bytearray) -> None:
        match told:
            case WorkerAnswer.MORE:
                pass
            case WorkerAnswer.PART:
                request.parts.append(pickle.loads(payload))
            case WorkerAnswer.DONE:
                self._over(request, WorkResult(request.parts, pickle.loads(payload)))
            case WorkerAnswer.REFUSED:
                self._over(request, pickle.loads(payload))
            case WorkerAnswer.TOO_LONG:
                self._over(request, TakesTooLong(seconds=f"{self._bounds.seconds:g}"))
            case WorkerAnswer.TOO_LARGE:
                # its memory is not worth keeping; the next process starts small
                self._replaced(request, TooLarge(most=f"{self._bounds.memory >> 20} MB"))
            case WorkerAnswer.FAILED:
                self._over(request, WorkerFailed(reason=pickle.loads(payload)))

    def _running(self) -> subprocess.Popen[bytes]:
        """Return the process, started if necessary; raises `OSError`, `ClosedError`."""
        if self._process is None:
            with self._changed:
                if self._closed:
                    raise ClosedError
                self._process = process = _started()
            assert process.stdin is not None
            os.set_blocking(process.stdin.fileno(), False)
            send(process.stdin.fileno(), WorkerCommand.PREPARE, 0, self._prepare, self._bounds.patience)
        return self._process

    def _ended(self, error: Exception) -> int:
        """Return the exit code of the process, 0 if it never started."""
        process = self._process
        if process is None:
            return 0 if isinstance(error, OSError) else -signal.SIGKILL
        self._kill()
        return process.returncode or 0

    def _failed(self, request: WorkRequest | None, code: int) -> None:
        """Handle the end of the process: its request fails, or is tried once more."""
        if request is not None and code == -signal.SIGXCPU:
            self._over(request, TakesTooLong(seconds=f"{self._bounds.seconds:g}"))
        elif request is not None and request.again:
            self._over(request, WorkerFailed(reason=phrase("it ended with {status}", status=code)))
        elif request is not None:
            request.again = True
        self._begin_again()

    def _replaced(self, request: WorkRequest | None, error: MayaError) -> None:
        """Fail a request, and let another process do the others."""
        if request is not None:
            self._over(request, error)
        self._kill()
        self._begin_again()

    def _begin_again(self) -> None:
        """Mark every request as not started, for the next process."""

        def begin(request: WorkRequest) -> None:
            request.began = False
            request.parts.clear()

        with self._changed:
            self._circle.each(begin)

    def _over(self, request: WorkRequest, outcome: object) -> None:
        """Return the outcome of a request and remove it."""
        with self._changed:
            self._circle.remove(request)
        with suppress(InvalidStateError):  # the caller no longer waits
            if isinstance(outcome, BaseException):
                request.answer.set_exception(outcome)
            elif outcome is not None:
                request.answer.set_result(outcome)

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()


def _started() -> subprocess.Popen[bytes]:
    """Start a worker of this Python, with the same module path; signals of the terminal do not reach it."""
    return subprocess.Popen(
        [sys.executable, "-c", _MAIN.format(path=sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
        start_new_session=True,
        env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
    )


def _standing_still() -> AbstractContextManager[object]:
    """Return a context in which a simulated clock stands still while an outside process works."""
    external = getattr(asyncio.get_running_loop(), "external", None)
    return nullcontext() if external is None else external()
