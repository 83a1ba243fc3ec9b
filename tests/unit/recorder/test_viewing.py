"""Recordings for readers elsewhere: columns, events and CSV of a real recording of the twin."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest

from maya_un.errors import FileUnreadable, TooLarge
from maya_un.recorder import mcap_file, viewing
from maya_un.recorder.recording import Recording, TimeSpan
from maya_un.recorder.tables import STATE_COLUMNS
from maya_un.schema.robot import Signals
from maya_un.values import Joints
from tests.recorded import HERE, recorded
from tests.unit.recorder.recordings import RECORDING, header, state
from tests.virtual_time import elapse

EVER = TimeSpan(-1e9, 1e9)
ALL = None


def told(pieces: viewing.Pieces) -> bytes:
    return b"".join(piece for piece in pieces if piece)


def columns(path: Path, span: TimeSpan = EVER, rate: float | None = ALL) -> dict[str, list[Any]]:
    found = json.loads(told(viewing.states(path, span, rate)))
    return {name: column["values"] for name, column in found["columns"].items()}


def saved(folder: Path, recording: Recording) -> Path:
    path = folder / "made.mcap"
    with path.open("wb") as file:
        mcap_file.write(recording, file)
    return path


async def moved(folder: Path) -> tuple[Path, list[Signals]]:
    """Record a motion of the twin; return the file, and the signals that the controller layer published."""
    published: list[Signals] = []
    async with recorded(folder) as robot:
        await elapse(1.0)
        await robot.controller.move(Joints(HERE.a + 0.05, HERE.b, HERE.c + 0.02))
        signals = robot.controller.signals()
        assert signals is not None
        published.append(signals)
        kept = await robot.recorder.save()
        assert kept is not None
    return folder / kept.name, published


async def test_states_have_the_signals_that_were_published(tmp_path: Path) -> None:
    path, (last,) = await moved(tmp_path)
    taken = mcap_file.read(path)
    found = columns(path)
    assert found["time"] == [one.time for one in taken.states]
    assert [*zip(*(found[axis] for axis in "abc"), strict=True)][-1] == taken.states[-1].joints
    assert [found[f"following_error_{axis}"][-1] for axis in "abc"] == list(last.following_error)
    assert [found[f"torque_{axis}"][-1] for axis in "abc"] == list(last.torque)
    assert [found["tension_b"][-1], found["tension_c"][-1]] == list(last.tension or ())
    moving = [error for error, at in zip(found["following_error_a"], found["moving"], strict=True) if at]
    assert max(map(abs, moving)) > 0.0


async def test_span_and_rate_choose_the_states(tmp_path: Path) -> None:
    path, _ = await moved(tmp_path)
    times = columns(path)["time"]
    begin, end = times[len(times) // 3], times[2 * len(times) // 3]
    some = columns(path, TimeSpan(begin, end))
    assert some["time"] == [time for time in times if begin <= time < end]
    assert None not in some["torque_b"]
    few = columns(path, rate=2.0)["time"]
    assert len(few) == pytest.approx(2.0 * (times[-1] - times[0]), abs=2.0)
    assert set(few) < set(times)
    assert columns(path, TimeSpan(end, begin)) == {column.key: [] for column in STATE_COLUMNS}


def test_answer_describes_the_recording(tmp_path: Path) -> None:
    found = json.loads(told(viewing.states(saved(tmp_path, RECORDING), EVER, ALL)))
    assert {key: value for key, value in found.items() if key != "columns"} == {
        "begin": 90.0,
        "end": 100.0,
        "date": "2026-11-21T19:25:20.339Z",
        "speed": 1.0,
        "every": 1,
    }
    units = {name: column["unit"] for name, column in found["columns"].items()}
    assert [units[name] for name in ("time", "a", "x", "a_counts", "velocity_a", "mode", "tension_b", "torque_c")] == [
        *("s", "rad", "m", "counts", "rad/s", "", "loads", "V")
    ]
    homed = {name: column["values"][1] for name, column in found["columns"].items()}
    assert (homed["mode"], homed["homed"], homed["phase"], homed["fault"]) == ("moving", 1, "down", None)
    assert (homed["motor_on_c"], homed["stop_code_c"], homed["following_error_a"]) == (0, 100, None)
    assert found["columns"]["fault"]["values"] == [None, None, 2301]
    assert found["columns"]["a"]["values"][0] is None


def test_too_many_states_are_thinned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewing, "MOST_ROWS", 100)
    path = saved(tmp_path, Recording(header(), tuple(state(0.05 * number) for number in range(901))))
    found = json.loads(told(viewing.states(path, EVER, ALL)))
    assert found["every"] == 16
    assert found["columns"]["time"]["values"] == [0.05 * number for number in range(0, 901, 16)]


def test_events_of_a_span_are_messages(tmp_path: Path) -> None:
    path = saved(tmp_path, RECORDING)
    begun, limit = mcap_file.read(path).events
    found = json.loads(told(viewing.events(path, EVER)))
    assert [one["kind"] for one in found] == ["phase", "limit"]
    assert (found[1]["seq"], found[1]["code"], found[1]["detail"]) == (7, 2301, dict(limit.detail))
    assert json.loads(told(viewing.events(path, TimeSpan(begun.time, limit.time)))) == found[:1]


def test_table_is_that_of_the_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path, RECORDING)
    text = told(viewing.table(path, EVER, ALL)).decode()
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [row["time [s]"] for row in rows] == ["90.0", "95.1", "99.9"]
    assert rows[1]["utc"] == "2026-11-21T19:25:15.439Z"
    assert len(told(viewing.table(path, TimeSpan(95.0, 96.0), ALL)).splitlines()) == 2
    monkeypatch.setattr(viewing, "MOST_TABLE", 1000)
    many = saved(tmp_path, Recording(header(), tuple(state(0.05 * number) for number in range(400))))
    with pytest.raises(TooLarge):
        told(viewing.table(many, EVER, ALL))


@pytest.mark.parametrize("damage", [b"", b"no recording", None])
def test_damaged_file_is_refused(damage: bytes | None, tmp_path: Path) -> None:
    path = saved(tmp_path, RECORDING)
    whole = path.read_bytes()
    middle = len(whole) // 8
    path.write_bytes(whole[:middle] + bytes(40) + whole[middle + 40 :] if damage is None else damage)
    for pieces in (viewing.states(path, EVER, ALL), viewing.events(path, EVER), viewing.table(path, EVER, ALL)):
        with pytest.raises(FileUnreadable):
            told(pieces)
