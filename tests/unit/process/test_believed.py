"""The places of the parts as jobs tell them, on a fake controller."""

from __future__ import annotations

import pytest

from maya_un.errors import EndNotReached
from maya_un.events import StepAdvanced
from maya_un.values import Point
from tests.queues import PICK_AND_PLACE, Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HERE, THERE = Point(0.50, 1.10, 0.40), Point(1.10, 0.50, 0.40)
ELSEWHERE = Point(0.7, 0.9, 0.4)


async def ended(layer: QueueBench, *steps: object, **more: object) -> str:
    """Run a job to its end; return its state."""
    report = await layer.process.result(await layer.process.submit(job(*steps, **more)))  # type: ignore[arg-type]
    return report.state.value


async def test_before_the_first_job_there_are_no_parts() -> None:
    async with Machine().running() as layer:
        assert layer.process.parts.places == {}
        assert layer.process.parts.held is None
        await ended(layer, {"approach": [0.5, 1.1]})
        assert layer.process.parts.places == {"cube": HERE}


async def test_part_is_taken_when_the_gripper_closes_and_put_down_when_it_opens() -> None:
    async with Machine().running() as layer:
        parts = layer.process.parts
        seen: list[tuple[str | None, Point | None]] = []
        layer.controller.events.heard_by(lambda _: seen.append((parts.held, parts.places.get("cube"))))
        assert await ended(layer, *PICK_AND_PLACE) == "done"
        assert list(dict.fromkeys(seen)) == [(None, None), (None, HERE), ("cube", None), (None, THERE)]
        assert seen[-1] == (None, THERE)


async def test_later_jobs_move_the_parts_of_an_earlier_one() -> None:
    async with Machine().running() as layer:
        await ended(layer, *PICK_AND_PLACE)
        for command in ({"command": "pick", "target": list(THERE)}, {"command": "place", "target": list(ELSEWHERE)}):
            await layer.process.result(await layer.process.command(command))
        assert layer.process.parts.places == {"cube": ELSEWHERE}


async def test_job_that_names_parts_says_where_they_are() -> None:
    async with Machine().running() as layer:
        await ended(layer, *PICK_AND_PLACE)
        await ended(layer, {"approach": [0.5, 1.1]})
        assert layer.process.parts.places == {"cube": HERE}


async def test_part_is_lost_when_the_gripper_opens_without_a_place() -> None:
    async with Machine().running() as layer:
        await ended(layer, {"pick": "cube"})
        assert layer.process.parts.held == "cube"
        await layer.controller.gripper(True)  # by another client of the controller
        assert layer.process.parts.held is None
        assert layer.process.parts.places == {"cube": None}


async def test_place_is_unknown_after_a_pick_that_ended_early() -> None:
    async with Machine().running() as layer:
        layer.controller.fail_at[2] = EndNotReached(axis="a", distance="far")
        assert await ended(layer, *PICK_AND_PLACE) == "failed"
        assert layer.process.parts.held is None
        assert layer.process.parts.places == {"cube": None}


async def test_place_that_ended_early_leaves_the_part_in_the_gripper() -> None:
    async with Machine().running() as layer:
        number = await layer.process.submit(job(*PICK_AND_PLACE))
        async for event in layer.controller.events.follow():
            if isinstance(event, StepAdvanced) and (event.index, event.state) == (2, "running"):
                break
        await elapse(0.1)
        await layer.process.cancel(number)
        assert layer.process.parts.held == "cube"
        assert layer.process.parts.places == {"cube": None}


@pytest.mark.parametrize(("step", "place", "held"), [(1, None, None), (2, None, "cube"), (3, THERE, None)])
async def test_parts_of_an_interrupted_job_are_known_after_a_restart(
    step: int, place: Point | None, held: str | None
) -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job(*PICK_AND_PLACE, {"approach": [0.5, 1.1]}), submit_request())
    await layer.until(1, step)
    await elapse(0.1)
    await machine.kill(layer)
    async with machine.running() as again:
        assert again.process.parts.held == held
        assert again.process.parts.places == {"cube": place}
