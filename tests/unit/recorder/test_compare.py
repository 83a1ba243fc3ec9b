"""Comparison of two runs: differences are named, normal variations are not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches, DataRecord, encode
from dmc41x3.wire.framing import RecordReply, Reply
from maya_un.recorder.compare import Comparison, FinalPosition, MotionTiming, ReplayDifference, Tolerances, compare
from maya_un.recorder.exchanges import RecordedExchange, RecordedTalk, Unpaired

PERIOD = 0.05
TOLERANCES = Tolerances(counts=2.0, seconds=0.02)
REST = DataRecord(axes=(AxisRecord(),) * 3)


def run(
    records: list[DataRecord], *others: RecordedExchange, messages: tuple[tuple[float, str], ...] = ()
) -> RecordedTalk:
    """Return a run with a record every 50 ms, and other exchanges between."""
    asked = [
        RecordedExchange(number * PERIOD, 1, "QR", RecordReply(encode(record)), number * PERIOD)
        for number, record in enumerate(records)
    ]
    return RecordedTalk(sorted([*asked, *others], key=lambda one: one.time), [], list(messages))


def drive(begin: int, end: int, count: int, speed: int = 45_000) -> list[DataRecord]:
    """Return records of axis B at a steady speed [counts/s] from one record to another, at rest before and after."""
    found: list[DataRecord] = []
    for number in range(count):
        place = round(min(max(number - begin, 0), end - begin) * PERIOD * speed)
        status = AxisStatus.MOVING if begin <= number < end else 0
        velocity = 64 * speed if status else 0
        axis = AxisRecord(status=status, position=place, reference=place, velocity_raw=velocity)
        found.append(replace(REST, axes=(AxisRecord(), axis, AxisRecord())))
    return found


def words(comparison: Comparison) -> list[tuple[str, str]]:
    return [(one.what, one.how) for one in comparison.differences]


def test_a_run_is_the_same_as_itself() -> None:
    same = run(drive(5, 25, 40), RecordedExchange(1.01, 1, "BGS", Reply(True), 1.01), messages=((1.0, "MAYA limit"),))
    found = compare(same, same, TOLERANCES)
    assert found.differences == ()
    assert (found.commands, found.compared) == (41, 41)
    assert found.motions == (MotionTiming(0.25, 1.0, 1.0),)
    assert found.ends == (FinalPosition("A", 0, 0), FinalPosition("B", 45_000, 45_000), FinalPosition("C", 0, 0))


def test_another_answer_is_named_with_its_command() -> None:
    one = run([REST], RecordedExchange(1.0, 2, "MG _ERB", Reply(True, " 8000.0000"), 1.0))
    other = run([REST], RecordedExchange(1.0, 2, "MG _ERB", Reply(True, " 4000.0000"), 1.0))
    assert compare(one, other, TOLERANCES).differences == (
        ReplayDifference(1.0, 2, "MG _ERB", "' 8000.0000' became ' 4000.0000'"),
    )
    refused = run([REST], RecordedExchange(1.0, 2, "MG _ERB", Reply(False), 1.0))
    assert words(compare(one, refused, TOLERANCES)) == [("MG _ERB", "' 8000.0000' became '?'")]
    silent = run([REST])
    assert words(compare(one, silent, TOLERANCES)) == [("MG _ERB", "' 8000.0000' became no answer")]


def test_an_answer_that_never_came_is_named_unless_the_connection_ended_with_it() -> None:
    lost = RecordedExchange(1.0, 1, "BGS", None, None)
    answered = lost._replace(reply=Reply(True), answered=1.0)
    after = RecordedExchange(1.5, 1, "TP", Reply(True, "1"), 1.5)
    found = compare(run([REST], lost, after), run([REST], answered, after), TOLERANCES)
    assert words(found) == [("BGS", "no answer was recorded, the replay has ':'")]
    assert found.compared == 2
    assert compare(run([REST], lost), run([REST], answered), TOLERANCES).differences == ()


def test_bytes_that_answer_nothing_are_named() -> None:
    one = run([REST])
    one.unpaired.append(Unpaired(0.5, 1, b":"))
    (found,) = compare(one, run([REST]), TOLERANCES).differences
    assert (found.time, found.what) == (0.5, "bytes of the controller")
    assert "answers nothing" in found.how


def test_a_lag_within_the_tolerance_is_no_difference_and_beyond_it_is() -> None:
    there = drive(5, 25, 40)
    late = [_moved(record, -round(45_000 * 0.015)) if 6 <= n < 25 else record for n, record in enumerate(there)]
    assert compare(run(there), run(late), TOLERANCES).differences == ()
    later = [_moved(record, -round(45_000 * 0.2)) if 10 <= n < 25 else record for n, record in enumerate(there)]
    (found,) = compare(run(there), run(later), TOLERANCES).differences
    assert (found.what, found.times, found.time) == ("data record", 15, 0.5)
    assert found.how.startswith("B position")


def _moved(record: DataRecord, counts: int) -> DataRecord:
    a, b, c = record.axes
    return replace(record, axes=(a, replace(b, position=b.position + counts, reference=b.reference + counts), c))


def test_a_motion_seen_to_begin_and_end_a_record_later_is_the_same() -> None:
    """The twin was 15 ms late, and the records at the ends of the motion were asked for just in between."""
    there = drive(5, 25, 40)
    late = [_moved(record, -675) if 6 <= n < 25 else record for n, record in enumerate(there)]
    late[5] = there[4]
    late[25] = _moved(there[24], 45_000 - 675 - there[24].axes[1].position)
    assert compare(run(there), run(late), TOLERANCES).differences == ()


def test_a_motion_that_begins_four_records_later_is_another() -> None:
    assert compare(run(drive(5, 25, 40)), run(drive(9, 29, 40)), TOLERANCES).differences != ()


def test_a_single_record_that_is_like_none_around_it_is_named() -> None:
    there = drive(5, 25, 40)
    wrong = [*there[:30], _moved(there[30], 900), *there[31:]]
    (found,) = compare(run(wrong), run(there), TOLERANCES).differences
    assert (found.what, found.times) == ("data record", 1)
    assert found.time == 30 * PERIOD
    assert found.how == "B position 45900 became 45000, B reference 45900 became 45000"


def test_a_slower_motion_is_named_with_both_durations() -> None:
    slow = drive(5, 33, 40, speed=45_000 * 20 // 28)
    found = compare(run(drive(5, 25, 40)), run(slow), TOLERANCES)
    (timed,) = found.motions
    assert (timed.began, timed.recorded) == (0.25, 1.0)
    assert timed.replayed == pytest.approx(1.4)
    assert ("motion", "it took 1.000 s, in the replay 1.400 s") in words(found)


def test_a_motion_that_does_not_happen_is_named() -> None:
    found = compare(run(drive(5, 25, 40)), run([REST] * 40), TOLERANCES)
    assert ("motion", "it took 1.000 s, in the replay no end") in words(found)
    assert ("end of axis B", "at 45000 counts, in the replay at 0, -45000") in words(found)


def test_messages_and_switches_are_compared_with_their_times() -> None:
    at_limit = replace(REST, axes=(AxisRecord(switches=AxisSwitches.REVERSE_INACTIVE), *REST.axes[1:]))
    one = run([REST] * 3 + [at_limit] * 10, messages=((0.16, "MAYA limit"), (0.4, "hello")))
    other = run([REST] * 13, messages=((0.163, "MAYA limit"), (0.6, "hello"), (0.61, "again")))
    found = words(compare(one, other, TOLERANCES))
    assert ("message hello", "in the replay 0.200 s later") in found
    assert ("message again", "it happens in the replay only") in found
    assert ("met the forward limit of A", "it does not happen in the replay") in found
    assert not any(what == "message MAYA limit" for what, _ in found)


def test_runs_without_records_have_no_ends() -> None:
    found = compare(RecordedTalk([], [], []), RecordedTalk([], [], []), TOLERANCES)
    assert found == Comparison(0, 0, (), (), ())
