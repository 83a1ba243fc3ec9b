"""A worker computes jobs like the loop, and a stop does not wait for it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.errors import InvalidJob, InvalidRequest, MayaError, Stopped, TooLarge, Unreachable
from maya_un.process.spec.job import MOST_NAMES, Job
from maya_un.process.spec.json_object import MOST_VALUES, decode_object
from maya_un.robot.primitives.approach import Approach
from maya_un.schema.encoding import to_json
from maya_un.schema.jobs import TaskState
from maya_un.values import Point
from maya_un.workers import WorkerSet
from tests.homing_mark import stand_homed
from tests.virtual_time import turn

JOB = {
    "parts": {"cube": [0.5, 1.1]},
    "places": {"tray": [1.1, 0.5]},
    "steps": ["home", {"pick": "cube"}, {"place": "tray"}, {"line": [0.9, 0.7, 0.6]}],
    "repeat": 3,
}


@contextmanager
def staff() -> Iterator[WorkerSet]:
    """Keep workers for the usual machine."""
    with staffed(Config()) as kept:
        yield kept


async def worked(robot: Stack) -> tuple[bytes, bytes, bytes]:
    """Return what a robot tells of a job before, in detail, and after it was done."""
    preview = await robot.service.previews.preview(JOB, from_homed=True)
    detail = await robot.service.previews.inspect(JOB, from_homed=True, samples=20)
    accepted = await robot.service.submit(JOB)
    report = await robot.service.wait(accepted.id)
    assert report.state is TaskState.DONE
    return preview, detail, to_json([(step.predicted, step.end_counts) for step in report.steps])


async def test_worker_returns_the_same_as_the_loop() -> None:
    async with stack(Config(), live=False) as robot:
        here = await worked(robot)
    with staff() as kept:
        async with stack(Config(), live=False, staff=kept) as robot:
            assert await worked(robot) == here


@pytest.mark.parametrize(
    "job",
    [
        {"steps": [{"pick": "nobody"}]},
        {"steps": [], "more": 1},
        {"parts": {f"p{n}": [0.5, 1.1] for n in range(MOST_NAMES + 1)}, "steps": ["home"]},
        b"[" * 50_000,
        b'{"steps": ["home"], "steps": []}',
    ],
)
async def test_a_worker_refuses_in_the_words_of_the_loop(job: object) -> None:
    async with stack(Config(), live=False) as robot:
        with pytest.raises(MayaError) as here:
            await robot.service.previews.preview(job)
        with staff() as kept:
            async with stack(Config(), live=False, staff=kept) as other:
                with pytest.raises(type(here.value)) as there:
                    await other.service.previews.preview(job)
    assert (str(there.value), there.value.details) == (str(here.value), here.value.details)


async def test_stop_while_a_step_is_planned_prevents_it() -> None:
    with staff() as kept:
        async with stack(Config(), live=False, staff=kept) as robot:
            await stand_homed(robot)
            before = robot.controller.state.counts
            running = asyncio.ensure_future(robot.robot.run(Approach(Point(0.5, 1.1, 0.4))))
            await turn()
            await robot.service.stop()
            with pytest.raises(Stopped):
                await running
            assert robot.controller.state.counts == before


async def test_an_inspection_of_too_many_samples_is_refused() -> None:
    job = {"steps": ["home", *({"approach": [0.5 + 0.01 * n, 1.0, 0.5]} for n in range(25))]}
    with staff() as kept:
        async with stack(Config(), live=False, staff=kept) as robot:
            with pytest.raises(TooLarge):
                await robot.service.previews.inspect(job, from_homed=True, samples=10_000)


async def test_a_target_out_of_reach_is_refused_by_a_worker_with_the_nearest() -> None:
    with staff() as kept:
        async with stack(Config(), live=False, staff=kept) as robot:
            await stand_homed(robot)
            with pytest.raises(Unreachable, match="nearest reachable point"):
                await robot.robot.run(Approach(Point(5.0, 5.0, 0.4)))


def test_a_job_with_too_many_names_is_refused_by_its_key() -> None:
    with pytest.raises(InvalidJob, match="places: it has more than 1000 entries"):
        Job.parse({"places": {f"p{n}": [0.5, 1.1] for n in range(MOST_NAMES + 1)}, "steps": ["home"]})


def test_json_with_too_many_values_is_refused_before_it_is_read() -> None:
    with pytest.raises(InvalidRequest, match="more than"):
        decode_object(b'{"a":[' + b"1," * MOST_VALUES + b"]")


@pytest.mark.parametrize(
    "body", [b'{"name": "\xed\xa0\x80"}', b'{"name": "\\ud800"}', '{"name": "\\ud800"}'.encode("utf-16")]
)
def test_json_with_a_lone_surrogate_is_refused_in_every_encoding(body: bytes) -> None:
    with pytest.raises(InvalidRequest, match="it is not JSON"):
        decode_object(body)
