"""A pool for work in a worker process: takes requests from any loop, and answers the loop that asked.

Clients have their slices in turn, and of each client the oldest request comes first.
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

from maya_un.errors import InternalError, MayaError, TakesTooLong, TooLarge, TooMuchAsked, WorkerFailed
from maya_un.workers.wire import ClosedError, StuckError, WorkerAnswer, WorkerCommand, receive, send

OPEN = 4
"""Most people whose requests are under way at once in a worker; others need no memory yet."""


@dataclass(eq=False, slots=True)
class WorkRequest:
    """Something to be worked out: `payload` says what, `whose` for whom.

    `began` tells that the worker knows it, `parts` what it has handed over, `again` that it was begun once more
    after a worker had failed. It is `dropped` where nobody waits for it any more.
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
    """Holds requests, `most` in all and `each` of one principal; callers ensure that one thread acts at a time."""

    def __init__(self, most: int, each: int) -> None:
        self._most = most
        self._each = each
        self._waiting: dict[str, deque[WorkRequest]] = {}

    def __len__(self) -> int:
        return sum(map(len, self._waiting.values()))

    def __iter__(self) -> Any:
        return (request for requests in self._waiting.values() for request in requests)

    def put(self, request: WorkRequest, each: int | None = None) -> None:
        """Take a request in, where there are not `each` of the same one already; raises `TooMuchAsked`."""
        each = self._each if each is None else each
        if len(self._waiting.get(request.whose, ())) >= each:
            raise TooMuchAsked(most=each)
        if len(self) >= self._most:
            raise TooMuchAsked(most=self._most)
        self._waiting.setdefault(request.whose, deque()).append(request)

    def next(self) -> WorkRequest | None:
        """Return the request whose turn it is, and let the others of the circle come before its next; None for none."""
        began = sum(requests[0].began for requests in self._waiting.values())
        for whose, requests in self._waiting.items():
            if requests[0].began or began < OPEN:
                self._waiting[whose] = self._waiting.pop(whose)
                return requests[0]
        return None

    def remove(self, request: WorkRequest) -> None:
        """Take a request out."""
        requests = self._waiting.get(request.whose)
        if requests is not None and request in requests:
            requests.remove(request)
            if not requests:
                del self._waiting[request.whose]

    def each(self, do: Callable[[WorkRequest], None]) -> None:
        """Do something to all of them."""
        for request in list(self):
            do(request)


P = ParamSpec("P")
T = TypeVar("T")

Work = Callable[P, Generator[Any, None, T]]
"""A generator function of a module: it yields where another may have its turn, and what it hands over."""

_MAIN = "import sys; sys.path[:] = {path!r}; from maya_un.workers.child import main; main()"
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class WorkResult(NamedTuple, Generic[T]):
    """Outcome of work: the pieces that it handed over on the way, and its result."""

    parts: list[Any]
    value: T


@dataclass(frozen=True, slots=True)
class ComputeLimits:
    """How much may be asked: `seconds` of computing for one request, `memory` [bytes] of the process.

    `most` requests may wait or be under way in all, and `each` of one who asks. The priority of the process is lower by
    `nicer`. A process that takes or answers nothing for `patience` [s, by the wall] hangs, and is replaced.
    """

    seconds: float = 30.0
    memory: int = 1 << 30
    most: int = 32
    each: int = 4
    nicer: int = 0
    patience: float = 30.0


class WorkerSet(NamedTuple):
    """The workers beside the loop: one for the robot, one for the requests of people."""

    own: Workers
    people: Workers


class Workers:
    """A worker process, started when it is needed, and restarted after its end; `name` is its purpose.

    `prepare`, a function of a module, is called in it with `arguments` before anything else.
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
        self._prepare = pickle.dumps((bounds.memory, bounds.nicer, prepare, arguments))
        self._numbers = itertools.count(1)
        self._circle = RoundRobin(bounds.most, bounds.each)
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._wanted = False
        self._closed = False

    @property
    def process(self) -> int | None:
        """The number of the process, None where none runs."""
        process = self._process
        return None if process is None else process.pid

    def warm(self) -> None:
        """Have the process begin now, in the background, so that nobody waits for that."""
        with self._changed:
            self._wanted = True
            self._go()

    async def run(self, work: Work[..., T], *args: object, whose: str = "", each: int | None = None) -> WorkResult[T]:
        """Return what `work` comes to in the worker; being cancelled, nobody works on it any more.

        `whose` names the client: all clients have their turn. A client may have `each` requests here, without it as
        many as the bounds allow. A clock that jumps stands meanwhile. Raises the errors of `work`, `TooMuchAsked`,
        `TakesTooLong`, `TooLarge` and `WorkerFailed`.
        """
        payload = pickle.dumps((self._bounds.seconds, work, args), pickle.HIGHEST_PROTOCOL)
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
        """End the process; requests that wait are refused."""
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
        """Give turns until this is closed."""
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
            except Exception as defect:  # noqa: BLE001 - told to whoever asked; others must not wait for ever
                self._replaced(request, InternalError(reason=repr(defect)[:500]))
        self._kill()
        self._circle.each(lambda one: self._over(one, WorkerFailed(reason="the program is ending")))

    def _turn(self, request: WorkRequest | None) -> None:
        """Have a request worked on for a slice."""
        process = self._running()
        if request is None:
            return
        assert process.stdin is not None and process.stdout is not None
        within = self._bounds.patience
        with self._changed:  # a request that is dropped from here on is one that the worker knows
            began, dropped = request.began, request.dropped
            request.began = not dropped
        if dropped:
            if began:
                send(process.stdin.fileno(), WorkerCommand.FORGET, request.number, b"", within=within)
            self._over(request, None)
            return
        ask, payload = (WorkerCommand.GO_ON, b"") if began else (WorkerCommand.BEGIN, request.payload)
        send(process.stdin.fileno(), ask, request.number, payload, within=within)
        told, _, answer = receive(process.stdout.fileno(), within)
        self._take(request, told, answer)

    def _take(self, request: WorkRequest, told: WorkerAnswer, payload: bytes) -> None:
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
                # its contents are not worth keeping; the next begins small
                self._replaced(request, TooLarge(most=f"{self._bounds.memory >> 20} MB"))
            case WorkerAnswer.FAILED:
                self._over(request, WorkerFailed(reason=pickle.loads(payload)))

    def _running(self) -> subprocess.Popen[bytes]:
        """Return the process, begun where there is none; raises `OSError`, `ClosedError`."""
        if self._process is None:
            with self._changed:
                if self._closed:
                    raise ClosedError
                self._process = process = _started()
            assert process.stdin is not None
            os.set_blocking(process.stdin.fileno(), False)
            send(process.stdin.fileno(), WorkerCommand.PREPARE, 0, self._prepare, within=self._bounds.patience)
        return self._process

    def _ended(self, error: Exception) -> int:
        """Return how the process has ended, 0 where it never began."""
        process = self._process
        if process is None:
            return 0 if isinstance(error, OSError) else -signal.SIGKILL
        self._kill()
        return process.returncode or 0

    def _failed(self, request: WorkRequest | None, code: int) -> None:
        """Handle the end of the process: its requests are refused, or tried once more."""
        if request is not None and code == -signal.SIGXCPU:
            self._over(request, TakesTooLong(seconds=f"{self._bounds.seconds:g}"))
        elif request is not None and request.again:
            self._over(request, WorkerFailed(reason=f"it ended with {code}"))
        elif request is not None:
            request.again = True
        self._begin_again()

    def _replaced(self, request: WorkRequest | None, error: MayaError) -> None:
        """Refuse a request, and have the others done by another process."""
        if request is not None:
            self._over(request, error)
        self._kill()
        self._begin_again()

    def _begin_again(self) -> None:
        """Have everything that the process knew begun from the start by the next."""

        def begin(request: WorkRequest) -> None:
            request.began = False
            request.parts.clear()

        with self._changed:
            self._circle.each(begin)

    def _over(self, request: WorkRequest, outcome: object) -> None:
        """Answer a request and take it out."""
        with self._changed:
            self._circle.remove(request)
        with suppress(InvalidStateError):  # nobody waits for it any more
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
    """Begin a worker of this Python, which finds what this one finds; a signal of the terminal does not reach it."""
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
    """Return what holds a clock that jumps while somebody outside works."""
    external = getattr(asyncio.get_running_loop(), "external", None)
    return nullcontext() if external is None else external()
