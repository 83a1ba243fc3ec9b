"""How long the event loop of the robot is ever held while a long job is accepted, checked, carried out, and cancelled.

The loop runs all that it runs in `maya up`: the twin, the queue with its journal, the recorder, and the stream, which a
hundred readers follow. Worker processes compute and a thread serves HTTP, as there. Only the clock of the twin is
faster. A stop that comes during a step waits for its end. Steps are measured in CPU time of the loop's thread, which
leaves out what other processes of a busy machine take. The goal is about the best of the rounds: the longest step of a
run is an extreme, and a page fault or a full cache makes it longer.
"""

from __future__ import annotations

import asyncio
import gc
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness import Case, Goal, Sample, measure, report
from job import parsed
from stream_client import Client

from dmc41x3.loops import ScaledLoop, run
from maya_un.assembly.controller import patient
from maya_un.assembly.stack import stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.interpreter import quiet_collector
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.process.spec.job import MOST_TASKS, Job
from maya_un.recorder.store import RecordingStore

PAIRS = 499
"""As many as the file of a job may hold."""

LARGEST = parsed(PAIRS).model_copy(update={"repeat": MOST_TASKS // (2 * PAIRS + 1)})
"""As many tasks as a job may have."""

SPEED = 50.0
"""Speed of the twin's clock. A faster one would leave the loop no idle time, and the readers no states."""

DONE = 20
"""Tasks that are carried out before the job is cancelled."""

READERS = 100
REQUEST = {"type": "subscribe", "state": {"rate": 10}, "queue": True, "motion": True}


class TimedLoop(ScaledLoop):
    """A loop that notes its longest step [s] while `timing`: all that is ready, run once."""

    def __init__(self) -> None:
        super().__init__(SPEED)
        self.timing = False
        self.longest = 0.0
        self.longest_own = 0.0
        self._collecting = 0.0

    def _run_once(self) -> None:
        self._collecting = 0.0
        start = time.thread_time()
        super()._run_once()  # type: ignore[misc]
        if self.timing:
            took = time.thread_time() - start
            self.longest = max(self.longest, took)
            self.longest_own = max(self.longest_own, took - self._collecting)

    def collecting(self, phase: str, _: dict[str, int]) -> None:
        """Note how long the collector takes within a step; it may also run in another thread."""
        if threading.get_ident() == self._thread_id:  # type: ignore[attr-defined]
            now = time.thread_time()
            self._collecting += now if phase == "stop" else -now


async def carry_out(job: Job, folder: Path) -> None:
    """Have a job accepted, checked whole and carried out in part, and cancel it; the loop notes its steps."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, TimedLoop)
    config = patient(Config(), SPEED)
    parts = job.part_points(config.cell.grasp_height)
    recordings = RecordingStore.of(config.recorder, folder / "recordings", time.time_ns)
    journal = await SqliteJournal.open(folder / "maya.db")
    try:
        with staffed(config) as staff, bound_socket(0) as near:
            async with stack(
                config, parts=parts, speed=SPEED, journal=journal, recordings=recordings, staff=staff
            ) as robot:
                app = create_app(Bridge(loop, robot.service, gate=robot.gate, journal=journal))
                async with served(app, near) as url:
                    with readers(int(url.rpartition(":")[2])):
                        await asyncio.sleep(SPEED)
                        loop.timing = True
                        accepted = await robot.service.submit(job)
                        while (await robot.service.job(accepted.id)).line.done < DONE:  # noqa: ASYNC110 - a step apart
                            await asyncio.sleep(SPEED)
                        await robot.service.cancel(accepted.id)
                        await robot.service.wait(accepted.id)
                        loop.timing = False
    finally:
        await journal.close()


@contextmanager
def readers(port: int) -> Iterator[None]:
    """Keep clients that read the stream, in a thread of their own."""
    reading = asyncio.new_event_loop()
    thread = threading.Thread(target=reading.run_forever)
    thread.start()

    async def enter() -> list[Client]:
        clients: list[Client] = []
        for _ in range(READERS):
            _, client = await reading.create_connection(
                lambda: Client(REQUEST, lambda _text, _now: None), "127.0.0.1", port
            )
            await client.open.wait()
            clients.append(client)
        return clients

    clients = asyncio.run_coroutine_threadsafe(enter(), reading).result(30.0)
    try:
        yield
    finally:
        for client in clients:
            reading.call_soon_threadsafe(client.close)
        reading.call_soon_threadsafe(reading.stop)
        thread.join()
        reading.close()


def timed_loop(job: Job) -> TimedLoop:
    """Return the loop in which a job was carried out."""
    loops: list[TimedLoop] = []

    def made() -> TimedLoop:
        loops.append(TimedLoop())
        gc.callbacks.append(loops[0].collecting)
        return loops[0]

    with tempfile.TemporaryDirectory() as folder:
        run(carry_out(job, Path(folder)), made)
    gc.callbacks.remove(loops[0].collecting)
    return loops[0]


def both(job: Job) -> tuple[Sample, Sample]:
    """Return samples of the longest step of the same run, with and without garbage collection [s]."""
    last: list[TimedLoop] = []

    def with_collection() -> float:
        last[:] = [timed_loop(job)]
        return last[0].longest

    return with_collection, lambda: last[0].longest_own


def main() -> None:
    quiet_collector()  # as the commands do that own their process
    goal = Goal(10.0)
    cases: list[Case] = []
    for job in (parsed(PAIRS), LARGEST):
        with_collection, own = both(job)
        tasks = (2 * PAIRS + 1) * job.repeat
        cases.append(Case(f"job of {tasks} tasks, {READERS} readers: longest step", with_collection, "ms", goal))
        cases.append(Case(f"job of {tasks} tasks: the same without garbage collection", own, "ms", goal))
    report(measure(cases, rounds=3))


if __name__ == "__main__":
    main()
