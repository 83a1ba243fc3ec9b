"""A day of operation in virtual time, on a real file: memory, handles and the journal's log stay what they are.

Everything that is kept bounded (events, ended jobs, plans, the recorder's past) is filled first; from then on nothing
may grow.
"""

from __future__ import annotations

import asyncio
import gc
import os
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from dmc41x3.loops import JumpingLoop, run
from maya_un.assembly import controller as assembled
from maya_un.assembly.stack import Stack, stack
from maya_un.config.files import parse
from maya_un.events import SpeedChanged
from maya_un.process.journal import file
from maya_un.process.journal.protocol import Filter, JobOptions
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.process.queue import entries
from maya_un.recorder.store import RecordingStore
from maya_un.schema.jobs import TaskState
from tests.campaign import Campaign
from tests.system.kill_worker import MACHINE, Carry, Ledger, standing
from tests.virtual_time import elapse

CONFIG = parse({"controller": {"stream_rate": 1.0}, "safety": {"guard_time": 5.0}, "recorder": {"seconds": 120.0}})
"""Settings of a host that is polled seldom: this makes no difference to the stored data, and a day affordable."""
HERE, THERE = (0.5, 1.1, 0.4), (1.1, 0.5, 0.4)
CARRY = [
    {"name": "there", "steps": [{"pick": list(HERE)}, {"place": list(THERE)}]},
    {"name": "back", "steps": [{"pick": list(THERE)}, {"place": list(HERE)}]},
]
EVENTS, REMEMBERED = 40, 4
"""Number of events and ended jobs in memory: it is reached soon."""
WARM = 2
"""Number of rounds after which everything has been done once."""
ROUND = 600.0
"""A job comes this often [s]."""
RECORDING = 250
"""Number of objects that come and go with a recording, which takes several rounds."""
MINUTE = 60.0


@dataclass(frozen=True, slots=True)
class Health:
    """Quantities that must not grow: objects of the collector, memory [bytes], open files, threads, the log [bytes]."""

    objects: int
    memory: int
    files: int
    threads: int
    log: int

    @classmethod
    def of(cls, journal: SqliteJournal) -> Health:
        """Look at this process, with everything collected that can be."""
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return cls(
            len(gc.get_objects()),
            pages * os.sysconf("SC_PAGE_SIZE"),
            len(list(Path("/proc/self/fd").iterdir())),
            threading.active_count(),
            file.beside(journal.path, "-wal").stat().st_size,
        )


async def fill(robot: Stack) -> None:
    """Bring everything that is bounded to its bound."""
    robot.controller.events._kept = EVENTS
    for _ in range(2 * EVENTS):
        robot.controller.events.emit(SpeedChanged(ratio=1.0))
    held = JobOptions(held=True)
    await asyncio.gather(*(robot.service.submit(CARRY[0], options=held) for _ in range(REMEMBERED)))
    await robot.service.queue.clear()
    await robot.service.command({"command": "gripper", "open": True})


async def one_round(robot: Stack, number: int) -> None:
    """Carry a part to and, the next time, fro; look at things as people do, and change one's mind."""
    loop = asyncio.get_running_loop()
    until = loop.time() + ROUND
    there, again = [(await robot.service.submit(CARRY[(number + more) % 2])).id for more in (0, 1)]
    await robot.service.cancel(again)
    await robot.journal.page(Filter(text="there", limit=50))
    report = await robot.service.wait(there)
    assert report.state is TaskState.DONE, report.message
    await robot.service.status()
    await elapse(until - loop.time())


async def operate(folder: Path, minutes: float) -> list[Health]:
    """Operate a robot for so long; return how it was after every round."""
    journal = await SqliteJournal.open(folder / "maya.db", CONFIG.storage)
    ledger = Ledger(folder)
    twin = standing({"job": [Carry("part", HERE, THERE)]}, ledger, powered=True)
    store = RecordingStore.of(CONFIG.recorder, folder / "recordings", time.time_ns)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assembled, "make_twin", lambda *_, **__: twin)
        patch.setattr(entries, "REMEMBERED", REMEMBERED)
        async with stack(CONFIG, journal=journal, skip_home=True, recordings=store) as robot:
            await fill(robot)
            found: list[Health] = []
            for number in range(WARM + round(minutes * MINUTE / ROUND)):
                await one_round(robot, number)
                ledger.lines.clear()
                found.append(Health.of(journal))
    await journal.close()
    return found[WARM:]


@pytest.mark.system
def test_a_day_of_operation_leaves_memory_and_handles_as_they_were(campaign: Campaign, tmp_path: Path) -> None:
    minutes = campaign.size(ci=40, long=24 * 60)
    assert MACHINE.config.geometry == CONFIG.geometry
    found = run(operate(tmp_path, minutes), lambda: JumpingLoop(1e6))
    third = -(-len(found) // 3)
    first, last = found[:third], found[-third:]
    assert max(one.objects for one in last) <= max(one.objects for one in first) + RECORDING
    assert max(one.memory for one in last) <= max(one.memory for one in first) + 4_000_000
    assert {one.files for one in found} == {found[0].files}
    assert {one.threads for one in found} == {found[0].threads}
    assert max(one.log for one in found) <= file.WAL_LIMIT
