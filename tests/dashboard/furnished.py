"""A robot that has been used: its queue, its history, its places, the points of a calibration."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from maya_un.config import Config
from maya_un.errors import NotHomed
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from maya_un.values import Joints
from tests.dashboard.inside import Options, TwinService, twin_service
from tests.journals import job_row

FAILED = 7
"""The number of a job that failed."""

MEASURED = (
    *(Joints(0.3, 1.2, 1.7), Joints(0.7, 1.7, 1.2), Joints(1.1, 1.4, 1.3)),
    *(Joints(1.5, 1.25, 1.5), Joints(1.8, 1.6, 1.5), Joints(0.5, 1.5, 1.5)),
)
"""Places all over the workspace, at which the gripper is measured for a calibration."""

PALLET = {"corners": [[0.3, 1.0, 0.4], [0.6, 1.0, 0.4], [0.3, 1.2, 0.4]], "rows": 3, "columns": 4}
ZONE = {"kind": "box", "low": [0.1, 1.0, 0.0], "high": [0.2, 1.1, 0.1]}
JOB = {"name": "open", "steps": [{"gripper": "open"}]}
"""A job that waits in the paused queue."""


async def write_history(file: Path, jobs: int) -> None:
    """Store ended jobs in the journal at `file`: one a minute until now, each with a name of its own."""
    journal = await SqliteJournal.open(file)
    now = datetime.now(UTC)
    dates = [(now - timedelta(minutes=jobs - number)).isoformat(timespec="seconds") for number in range(jobs + 1)]
    ended = [
        job_row(
            number,
            name=f"tray {number:05}",
            state=TaskState.DONE,
            done=2,
            submitted=dates[number - 1],
            began=dates[number - 1],
            ended=dates[number],
            predicted=58.0,
            duration=60.0,
        )
        for number in range(1, jobs + 1)
    ]
    ended[FAILED - 1] = replace(
        ended[FAILED - 1], state=TaskState.FAILED, code=NotHomed.code, message=str(NotHomed(command="maya home"))
    )
    await journal.add(*ended)
    await journal.close()


def write_places(folder: Path, poses: int) -> None:
    """Write taught poses, and measured points of a calibration, as a person may do with an editor."""
    date, mechanism = "2026-11-21T16:02:21+00:00", Mechanism.of(Config())
    joints = [Joints(0.3 + 1.5 * i / poses, 1.3 + 0.4 * (i % 7) / 7, 1.35 + 0.3 * (i % 5) / 5) for i in range(poses)]
    taught = (
        f'[poses.shelf{i:03}]\njoints = [{at.a}, {at.b}, {at.c}]\ntaught = "{date}"\n' for i, at in enumerate(joints)
    )
    (folder / "poses.toml").write_text("".join(taught), encoding="utf-8")
    rows = ["a_rad,b_m,c_m,x,y,z\n"]
    for i, at in enumerate(MEASURED):
        point = mechanism.fk(at)
        rows.append(f"{at.a},{at.b},{at.c},{point.x + 1e-3 * (i % 3)},{point.y - 2e-3 * (i % 2)},{point.z}\n")
    (folder / "calibration.csv").write_text("".join(rows), encoding="utf-8")


@contextmanager
def furnished_robot(folder: Path, *, jobs: int, poses: int) -> Iterator[TwinService]:
    """Run a robot with so many ended jobs and poses, and one of everything else; its queue is paused."""
    in_thread(write_history(folder / "maya.db", jobs))
    write_places(folder, poses)
    with twin_service(folder, Options(stored=True)) as robot:
        robot.ask("PUT /v1/pallets/tray", PALLET)
        robot.ask("PUT /v1/zones/lamp", ZONE)
        robot.ask("POST /v1/queue/pause", {"when": "now"})
        robot.ask("POST /v1/jobs", JOB)
        robot.ask("POST /v1/recordings")
        yield robot


def in_thread(work: Coroutine[Any, Any, None]) -> None:
    """Do `work` in the loop of a thread: in the thread of the tests the browser's loop runs."""
    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, work).result()
