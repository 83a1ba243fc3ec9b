"""Steps are carried out once: whatever comes twice, at once, or before and after the end of the program."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from random import Random
from typing import Any

import pytest

from maya_un.errors import Busy, FileNotOurs, KeyReused, NodeGone, StorageDamaged, StorageInUse, StorageTooNew
from maya_un.graph.protocol import Ended, Message, Outcome
from maya_un.graph.step import INTERRUPTED, Result
from maya_un.graph.step_store import StepStore
from maya_un.graph.steps import Steps
from maya_un.process.journal.file import Lock
from tests.campaign import Campaign
from tests.virtual_time import elapse

DONE = Ended(Outcome.SUCCEEDED, {"success": True, "code": "", "message": ""})


class Robot:
    """Carries out tasks, each in a second; `answers` says how those end that do not succeed."""

    def __init__(self, *answers: Ended | Exception) -> None:
        self.begun: list[Message] = []
        self.stopped = 0
        self._answers = list(answers)

    async def do(self, goal: Message) -> Ended:
        """Take a second."""
        answer = self._answers.pop(0) if self._answers else DONE
        if isinstance(answer, NodeGone) or (isinstance(answer, Ended) and answer.outcome is Outcome.REJECTED):
            return _given(answer)
        self.begun.append(goal["task"])
        try:
            await elapse(1.0)
        except asyncio.CancelledError:
            self.stopped += 1
            raise
        return _given(answer)


def _given(answer: Ended | Exception) -> Ended:
    if isinstance(answer, Exception):
        raise answer
    return answer


def now() -> str:
    return f"{asyncio.get_running_loop().time():.1f}"


@asynccontextmanager
async def steps_in(folder: Path, robot: Robot) -> AsyncIterator[Steps]:
    store = await StepStore.open(folder / "steps.db")
    steps = Steps(store, robot.do, now)
    try:
        yield steps
    finally:
        await steps.close()
        await store.close()


def command(id_: str | None, name: str = "home", **args: Any) -> str:
    return json.dumps({"command": name, "args": args} | ({} if id_ is None else {"id": id_}))


async def test_a_step_is_carried_out_and_answered_with_its_dates(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        result = await steps.answer(command("1", "pick", x=0.5, y=1.1, z=0.4))
    assert robot.begun == [{"command": "pick", "target": {"x": 0.5, "y": 1.1, "z": 0.4}, "open": False}]
    assert result == Result("1", None, None, "0.0", "1.0")


async def test_the_same_once_more_has_the_same_result_and_moves_nothing(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        await elapse(5.0)
        assert await steps.answer(command("1")) == first
    async with steps_in(tmp_path, robot) as steps:
        assert await steps.answer(command("1")) == first
    assert len(robot.begun) == 1


async def test_the_same_while_it_is_under_way_waits_for_its_result(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        one, two = await asyncio.gather(steps.answer(command("1")), steps.answer(command("1")))
    assert one == two
    assert len(robot.begun) == 1


async def test_an_id_with_other_content_is_refused(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        refused = await steps.answer(command("1", "gripper", open=True))
        assert (refused.id, refused.code) == ("1", str(KeyReused.code))
        await steps.told(refused)
        assert await steps.take_up() == [first], "who was told of the refusal was not told of the result"
    assert len(robot.begun) == 1


async def test_another_step_meanwhile_is_refused_and_may_come_again(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        first = asyncio.ensure_future(steps.answer(command("1")))
        await elapse(0.5)
        refused = await steps.answer(command("2"))
        assert (refused.code, refused.started) == (str(Busy.code), "0.5")
        assert (await first).code is None
        assert (await steps.answer(command("2"))).code is None
    assert len(robot.begun) == 2


async def test_what_failed_is_kept_as_it_was_said(tmp_path: Path) -> None:
    far = Ended(Outcome.ABORTED, {"success": False, "code": "2102", "message": "it is too far away"})
    robot = Robot(far)
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        assert (first.error, first.code) == ("it is too far away", "2102")
        assert await steps.answer(command("1")) == first
    assert len(robot.begun) == 1


@pytest.mark.parametrize(
    "answer",
    [
        Ended(Outcome.REJECTED, {"success": False, "code": str(Busy.code), "message": "busy"}),
        NodeGone(node="primitive_server"),
    ],
)
async def test_what_never_began_may_come_again(answer: Ended | Exception, tmp_path: Path) -> None:
    robot = Robot(answer)
    async with steps_in(tmp_path, robot) as steps:
        assert (await steps.answer(command("1"))).code in {str(Busy.code), str(NodeGone.code)}
        assert (await steps.answer(command("1"))).code is None
    assert len(robot.begun) == 1


async def test_a_server_that_vanishes_meanwhile_ends_the_step_for_good(tmp_path: Path) -> None:
    robot = Robot(Ended(Outcome.LOST, {}))
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        assert first.code == str(NodeGone.code)
        assert await steps.answer(command("1")) == first


async def test_without_an_id_one_is_made_and_said(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        one, two = await steps.answer(command(None)), await steps.answer(command(None))
    assert one.id != two.id
    assert len(robot.begun) == 2
    assert "without an id" in one.warnings[0]


async def test_nonsense_has_a_result_and_moves_nothing(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        results = [await steps.answer(text) for text in ("", "{}", '{"id": 3, "command": "home"}', command("1", "fly"))]
        assert await steps.take_up() == []
    assert [result.id for result in results[:3]] == [None, results[1].id, None]
    assert all(result.error for result in results)
    assert not robot.begun


async def test_the_end_of_the_program_stops_the_step_and_keeps_that(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        under_way = asyncio.ensure_future(steps.answer(command("1")))
        await elapse(0.5)
    assert robot.stopped == 1
    assert (await under_way).code == "2202"
    async with steps_in(tmp_path, robot) as steps:
        assert (await steps.answer(command("1"))).code == "2202"
    assert len(robot.begun) == 1


async def test_what_was_under_way_is_interrupted_and_never_repeated(tmp_path: Path) -> None:
    robot = Robot()
    await _killed_at(0.5, tmp_path, robot, [command("1")])
    async with steps_in(tmp_path, robot) as steps:
        (result,) = await steps.take_up()
        assert (result.id, result.code, result.started) == ("1", INTERRUPTED, "0.0")
        assert await steps.answer(command("1")) == result
        assert await steps.take_up() == [result], "until somebody is told"
        await steps.told(result)
        assert await steps.take_up() == []
    assert len(robot.begun) == 1


async def test_at_most_once_whatever_happens(campaign: Campaign, tmp_path: Path) -> None:
    """Ids come again and again, at once and later, through kills at any instant: none is carried out twice."""
    for case in range(campaign.size(ci=20, long=400)):
        rng = campaign.rng(case)
        folder = tmp_path / str(case)
        robot = Robot(*_answers(rng))
        results: dict[str, set[str]] = {}
        for _ in range(4):
            wishes = [command(str(rng.randrange(4)), "gripper", open=rng.random() < 0.2) for _ in range(8)]
            for result in await _killed_at(rng.uniform(0.0, 6.0), folder, robot, wishes, rng):
                if result.code not in {str(Busy.code), str(KeyReused.code)} and result.id is not None:
                    results.setdefault(result.id, set()).add(result.text)
        assert len(robot.begun) <= 4
        assert all(len(texts) <= 1 for texts in results.values()), results


def _answers(rng: Random) -> list[Ended]:
    failed = Ended(Outcome.ABORTED, {"success": False, "code": "2201", "message": "stopped"})
    busy = Ended(Outcome.REJECTED, {"success": False, "code": str(Busy.code), "message": "busy"})
    return rng.choices([DONE, failed, busy, Ended(Outcome.LOST, {})], k=40)


async def _killed_at(
    instant: float, folder: Path, robot: Robot, wishes: list[str], rng: Random | None = None
) -> list[Result]:
    """Send wishes to a program that is killed after a while; return the results that it gave."""
    store = await StepStore.open(folder / "steps.db")
    steps = Steps(store, robot.do, now)
    results = await steps.take_up()

    async def ask(text: str) -> None:
        await elapse(rng.uniform(0.0, 5.0) if rng is not None else 0.0)
        results.append(await steps.answer(text))

    asking = [asyncio.create_task(ask(text)) for text in wishes]
    await elapse(instant)
    kept, store._connection = store._connection, _Dead()  # type: ignore[assignment]
    for task in [*asking, *([] if steps._doing is None else [steps._doing])]:
        task.cancel()
    await asyncio.gather(*asking, return_exceptions=True)
    if steps._under_way is not None:
        await asyncio.wait({steps._under_way.result})
    store._connection = kept
    await store.close()
    return results


class _Dead:
    """The connection of a program that is not there any more: nothing is written."""

    def execute(self, *_: object) -> _Dead:
        return self

    def fetchall(self) -> list[object]:
        return []


async def test_one_program_at_a_time_holds_the_file(tmp_path: Path) -> None:
    async with steps_in(tmp_path, Robot()):
        with pytest.raises(StorageInUse):
            await StepStore.open(tmp_path / "steps.db")
    lock = Lock(tmp_path / "steps.db")
    lock.release()


@pytest.mark.parametrize(
    ("pragma", "error"),
    [("PRAGMA application_id = 7", FileNotOurs), ("PRAGMA user_version = 9", StorageTooNew)],
)
async def test_a_file_that_is_not_for_us_is_left_alone(pragma: str, error: type[Exception], tmp_path: Path) -> None:
    async with steps_in(tmp_path, Robot()) as steps:
        await steps.answer(command("1"))
    import sqlite3

    with sqlite3.connect(tmp_path / "steps.db") as connection:
        connection.execute(pragma)
    connection.close()
    with pytest.raises(error):
        await StepStore.open(tmp_path / "steps.db")
    Lock(tmp_path / "steps.db").release()


async def test_a_damaged_file_is_said_to_be_one(tmp_path: Path) -> None:
    (tmp_path / "steps.db").write_bytes(b"no database" * 100)
    with pytest.raises(StorageDamaged):
        await StepStore.open(tmp_path / "steps.db")
