"""Steps are carried out once: whatever comes twice, at once, or before and after the end of the program."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random
from typing import Any

import pytest

from maya_ros.graph.protocol import GoalResult, GoalStatus, Message
from maya_ros.graph.servers.steps import QUIET, Steps
from maya_un.errors import (
    Busy,
    FileNotOurs,
    InvalidRequest,
    KeyReused,
    NodeGone,
    NotAllowed,
    StepExpired,
    StepNotBegun,
    StepOfOtherRobot,
    StorageDamaged,
    StorageFailed,
    StorageInUse,
    StorageTooNew,
)
from maya_un.process.journal.file import JournalLock
from maya_un.service.access.operations import Operation
from maya_un.steps.store import StepStore
from maya_un.steps.text import INTERRUPTED, StepEnd, StepProgress
from tests.campaign import Campaign
from tests.virtual_time import elapse

DONE = GoalResult(GoalStatus.SUCCEEDED, {"success": True, "code": "", "message": ""})


class Robot:
    """Carries out tasks, each in a second; `answers` gives the ends of those that fail."""

    def __init__(self, *answers: GoalResult | Exception) -> None:
        self.begun: list[Message] = []
        self.stopped = 0
        self._answers = list(answers)

    async def do(self, goal: Message) -> GoalResult:
        """Take a second."""
        answer = self._answers.pop(0) if self._answers else DONE
        if isinstance(answer, NodeGone) or (isinstance(answer, GoalResult) and answer.outcome is GoalStatus.REJECTED):
            return _given(answer)
        self.begun.append(goal["task"])
        try:
            await elapse(1.0)
        except asyncio.CancelledError:
            self.stopped += 1
            raise
        return _given(answer)


def _given(answer: GoalResult | Exception) -> GoalResult:
    if isinstance(answer, Exception):
        raise answer
    return answer


def now() -> str:
    return f"{asyncio.get_running_loop().time():.1f}"


def dated() -> str:
    return (datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=asyncio.get_running_loop().time())).isoformat()


@asynccontextmanager
async def steps_in(
    folder: Path, robot: Robot, progress: list[tuple[str, str, str]] | None = None, date: Callable[[], str] = now
) -> AsyncIterator[Steps]:
    def report(new: StepProgress) -> None:
        if progress is not None:
            progress.append((new.id, new.state.value, new.date))

    store = await StepStore.open(folder / "steps.db")
    steps = Steps(store, robot.do, date, name="MAYA", report=report)
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
    assert result == StepEnd("1", None, None, "0.0", "1.0")


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


async def test_repeated_command_of_a_step_without_a_result_repeats_its_latest_report(tmp_path: Path) -> None:
    robot, progress = Robot(), list[tuple[str, str, str]]()
    async with steps_in(tmp_path, robot, progress) as steps:
        answers = [asyncio.create_task(steps.answer(command(id_))) for id_ in "12"]
        await elapse(0.5)
        progress.clear()
        answers += [asyncio.create_task(steps.answer(command(id_))) for id_ in "12"]
        await elapse(0.2)
        assert progress == [("1", "executing", "0.0"), ("2", "accepted", "0.0")]
        await asyncio.gather(*answers)
        progress.clear()
        await steps.answer(command("1"))
        assert progress == []
    assert len(robot.begun) == 2


async def test_an_id_with_other_content_is_refused(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        refused = await steps.answer(command("1", "gripper", open=True))
        assert (refused.id, refused.code) == ("1", str(KeyReused.code))
        assert refused.content == {"command": "gripper", "args": {"open": True}}
        wrong = await steps.answer(command("1", "dance"))
        assert (wrong.id, wrong.code) == ("1", str(KeyReused.code))
        assert wrong.content == {"command": "dance", "args": {}}
        await steps.told(refused)
        assert await steps.take_up() == [first], "who was told of the refusal was not told of the result"
    assert len(robot.begun) == 1


async def test_steps_run_in_the_order_in_which_they_came(tmp_path: Path) -> None:
    robot = Robot()
    progress: list[tuple[str, str, str]] = []
    async with steps_in(tmp_path, robot, progress) as steps:
        results = await asyncio.gather(*(steps.answer(command(id_)) for id_ in "312"))
    assert [(result.id, result.finished) for result in results] == [("3", "1.0"), ("1", "2.0"), ("2", "3.0")]
    assert [(id_, date) for id_, state, date in progress if state == "executing"] == [
        ("3", "0.0"),
        ("1", "1.0"),
        ("2", "2.0"),
    ]
    assert [id_ for id_, state, _ in progress if state == "accepted"] == ["3", "1", "2"]


async def test_a_failed_step_ends_the_steps_behind_it(tmp_path: Path) -> None:
    robot = Robot(GoalResult(GoalStatus.ABORTED, {"success": False, "code": "2102", "message": "too far"}))
    async with steps_in(tmp_path, robot) as steps:
        first, second = await asyncio.gather(steps.answer(command("1")), steps.answer(command("2")))
        assert (first.code, second.code) == ("2102", str(StepNotBegun.code))
        assert (await steps.answer(command("2"))).code == str(StepNotBegun.code)
        assert (await steps.answer(command("3"))).code is None
    assert len(robot.begun) == 2


async def test_a_halt_ends_the_step_under_way_and_those_behind_it(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        waiting = [asyncio.ensure_future(steps.answer(command(id_))) for id_ in "123"]
        await elapse(0.5)
        steps.halt()
        results = [await result for result in waiting]
        assert [result.code for result in results] == ["2202", str(StepNotBegun.code), str(StepNotBegun.code)]
        for id_ in ("late 1", "late 2"):  # delayed in a broker
            await elapse(0.9 * QUIET)
            assert (await steps.answer(command(id_))).code == str(StepNotBegun.code)
        await elapse(1.1 * QUIET)
        assert (await steps.answer(command("late 2"))).code == str(StepNotBegun.code)
        assert (await steps.answer(command("4"))).code is None
    assert (len(robot.begun), robot.stopped) == (2, 1)


async def test_a_step_of_another_robot_is_refused(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        steps_for = [json.dumps({"id": name, "command": "home", "robot": name}) for name in ("MAYA2", "MAYA")]
        other, own = [await steps.answer(text) for text in steps_for]
    assert (other.code, own.code) == (str(StepOfOtherRobot.code), None)
    assert len(robot.begun) == 1


async def test_step_past_its_deadline_does_not_begin(tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot, date=dated) as steps:
        late, soon, ahead = (
            json.dumps({"id": id_, "command": "home", "deadline": deadline})
            for id_, deadline in (
                ("late", "2026-01-01T01:00:00+02:00"),
                ("soon", "2026-01-01T00:00:00.5Z"),
                ("ahead", "2026-01-01T00:00:05Z"),
            )
        )
        results = await asyncio.gather(*map(steps.answer, (late, ahead, soon)))
    assert [result.code for result in results] == [str(StepExpired.code), None, str(StepExpired.code)]
    assert len(robot.begun) == 1


@pytest.mark.parametrize("deadline", ["soon", "2026-01-01T00:00:00", 5, "9999-12-31T23:59:59-23:59"])
async def test_a_deadline_without_a_time_zone_is_refused(deadline: object, tmp_path: Path) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot, date=dated) as steps:
        result = await steps.answer(json.dumps({"id": "1", "command": "home", "deadline": deadline}))
    assert result.code == str(InvalidRequest.code)
    assert "time zone" in str(result.error)
    assert not robot.begun


async def test_failure_keeps_its_sentence(tmp_path: Path) -> None:
    far = GoalResult(GoalStatus.ABORTED, {"success": False, "code": "2102", "message": "it is too far away"})
    robot = Robot(far)
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        assert (first.error, first.code) == ("it is too far away", "2102")
        assert await steps.answer(command("1")) == first
    assert len(robot.begun) == 1


@pytest.mark.parametrize(
    "answer",
    [
        GoalResult(GoalStatus.REJECTED, {"success": False, "code": str(Busy.code), "message": "busy"}),
        NodeGone(node="primitive_server"),
    ],
)
async def test_a_refusal_of_the_robot_is_final(answer: GoalResult | Exception, tmp_path: Path) -> None:
    robot = Robot(answer)
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        assert first.code in {str(Busy.code), str(NodeGone.code)}
        assert await steps.answer(command("1")) == first
    assert not robot.begun


async def test_a_server_that_vanishes_meanwhile_ends_the_step_for_good(tmp_path: Path) -> None:
    robot = Robot(GoalResult(GoalStatus.LOST, {}))
    async with steps_in(tmp_path, robot) as steps:
        first = await steps.answer(command("1"))
        assert first.code == str(NodeGone.code)
        assert await steps.answer(command("1")) == first


async def test_step_without_an_id_gets_one_and_reports_it(tmp_path: Path) -> None:
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


async def test_running_step_is_interrupted_and_never_repeated(tmp_path: Path) -> None:
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


async def test_a_step_that_waited_at_the_crash_is_interrupted_and_says_that_it_did_not_begin(tmp_path: Path) -> None:
    robot = Robot()
    await _killed_at(0.5, tmp_path, robot, [command("1"), command("2")])
    async with steps_in(tmp_path, robot) as steps:
        first, second = await steps.take_up()
        assert (first.code, second.code) == (INTERRUPTED, INTERRUPTED)
        assert "under way" in str(first.error)
        assert "before this step began" in str(second.error)
    assert len(robot.begun) == 1


async def test_a_file_of_version_1_still_opens(tmp_path: Path) -> None:
    import sqlite3

    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        done = await steps.answer(command("1"))
    with sqlite3.connect(tmp_path / "steps.db") as connection:
        connection.execute("UPDATE steps SET told = 1")
        connection.execute("INSERT INTO steps (id, digest, started, warnings) VALUES ('2', 'x', '0.0', '[]')")
        connection.execute("ALTER TABLE steps DROP COLUMN begun")
        connection.execute("PRAGMA user_version = 1")
    connection.close()
    async with steps_in(tmp_path, robot) as steps:
        (left,) = await steps.take_up()
        assert (left.id, left.code) == ("2", INTERRUPTED)
        assert "under way" in str(left.error)
        assert await steps.answer(command("1")) == done


async def test_step_runs_at_most_once(campaign: Campaign, tmp_path: Path) -> None:
    """Ids come again and again, at once and later, through kills at any instant: none is carried out twice."""
    for case in range(campaign.size(ci=20, long=400)):
        rng = campaign.rng(case)
        folder = tmp_path / str(case)
        robot = Robot(*_answers(rng))
        results: dict[str, set[str]] = {}
        for _ in range(4):
            requests = [command(str(rng.randrange(4)), "gripper", open=rng.random() < 0.2) for _ in range(8)]
            for result in await _killed_at(rng.uniform(0.0, 6.0), folder, robot, requests, rng):
                if result.code not in {str(Busy.code), str(KeyReused.code)} and result.id is not None:
                    results.setdefault(result.id, set()).add(result.text)
        assert len(robot.begun) <= 4
        assert all(len(texts) <= 1 for texts in results.values()), results


def _answers(rng: Random) -> list[GoalResult]:
    failed = GoalResult(GoalStatus.ABORTED, {"success": False, "code": "2201", "message": "stopped"})
    busy = GoalResult(GoalStatus.REJECTED, {"success": False, "code": str(Busy.code), "message": "busy"})
    return rng.choices([DONE, failed, busy, GoalResult(GoalStatus.LOST, {})], k=40)


async def _killed_at(
    instant: float, folder: Path, robot: Robot, requests: list[str], rng: Random | None = None
) -> list[StepEnd]:
    """Send commands to a program that is killed after a while; return its results."""
    store = await StepStore.open(folder / "steps.db")
    steps = Steps(store, robot.do, now)
    results = await steps.take_up()

    async def ask(text: str) -> None:
        await elapse(rng.uniform(0.0, 5.0) if rng is not None else 0.0)
        results.append(await steps.answer(text))

    asking = [asyncio.create_task(ask(text)) for text in requests]
    await elapse(instant)
    kept, store._connection = store._connection, _Dead()  # type: ignore[assignment]
    for task in [*asking, *([] if steps._doing is None else [steps._doing])]:
        task.cancel()
    await asyncio.gather(*asking, return_exceptions=True)
    while steps._waiting:
        if steps._doing is not None:
            steps._doing.cancel()
        await asyncio.wait(steps._waiting.values(), timeout=0.01)
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
    lock = JournalLock(tmp_path / "steps.db")
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
    JournalLock(tmp_path / "steps.db").release()


async def test_damaged_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "steps.db").write_bytes(b"no database" * 100)
    with pytest.raises(StorageDamaged):
        await StepStore.open(tmp_path / "steps.db")


@pytest.mark.parametrize("later", ["cleared", "again"])
async def test_a_refusal_is_final_also_when_its_reason_has_gone(later: str, tmp_path: Path) -> None:
    robot, refuse = Robot(), [True]

    def permit(_: Operation) -> None:
        if refuse:
            raise NotAllowed(who="MAYA", role="observer", operation="this", needed="operator")

    store = await StepStore.open(tmp_path / "steps.db")
    steps = Steps(store, robot.do, now, permit=permit)
    refused = await steps.answer(command("1"))
    assert refused.code == str(NotAllowed.code)
    refuse.clear()
    assert await steps.answer(command("1")) == refused
    done = await steps.answer(command("2"))
    if later == "again":
        refuse.append(True)
    assert await steps.answer(command("2")) == done
    assert len(robot.begun) == 1
    await steps.close()
    await store.close()


async def _full(*_: object, **__: object) -> None:
    raise StorageFailed(reason="the disk is full")


@pytest.mark.parametrize("method", ["accept", "refuse", "find"])
async def test_a_refusal_that_cannot_be_stored_is_final_too(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = Robot()
    other = json.dumps(json.loads(command("1")) | {"robot": "MAYA2"})
    async with steps_in(tmp_path, robot) as steps:
        with monkeypatch.context() as full:
            full.setattr(StepStore, method, _full)
            first = await steps.answer(other if method == "refuse" else command("1"))
        assert first.code == str(StorageFailed.code)
        assert await steps.answer(command("1")) == first
        assert (await steps.answer(command("1", "can_teleop"))).code == str(KeyReused.code)
        assert (await steps.answer(command("1", "dance"))).code == str(KeyReused.code)
        assert robot.begun == []
        assert (await steps.answer(command("2"))).error is None
        monkeypatch.setattr(StepStore, "accept", _full)
        for number in range(1000):
            await steps.answer(command(f"more {number}"))
        monkeypatch.undo()
        assert (await steps.answer(command("1"))).error is None, "it is forgotten after 1000 others"


async def test_steps_under_way_are_known_although_their_journal_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = Robot()
    async with steps_in(tmp_path, robot) as steps:
        running = [asyncio.create_task(steps.answer(command(id_))) for id_ in "12"]
        await elapse(0.5)
        with monkeypatch.context() as full:
            full.setattr(StepStore, "find", _full)
            for id_ in "12":
                assert (await steps.answer(command(id_, "can_teleop"))).code == str(KeyReused.code)
                assert (await steps.answer(command(id_, "dance"))).code == str(KeyReused.code)
            again = await asyncio.gather(*(steps.answer(command(id_)) for id_ in "12"))
        assert again == await asyncio.gather(*running)
        assert [result.error for result in again] == [None, None]
    assert len(robot.begun) == 2


async def test_a_journal_keeps_its_name_and_no_other_has_it(tmp_path: Path) -> None:
    names = []
    for place in (tmp_path / "one.db", tmp_path / "one.db", tmp_path / "two.db"):
        store = await StepStore.open(place)
        names.append(store.journal)
        await store.close()
    assert names[0] == names[1] != names[2]
    assert all(names)
