"""Tables for spreadsheets: one row for every state, one for every piece of the wire."""

from __future__ import annotations

import csv
import io

from maya_un.recorder.tables import STATE_COLUMNS, StateRow, values, write_states, write_wire
from tests.unit.recorder.recordings import RECORDING, header


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text, newline="")))


def test_a_state_is_a_row_with_units_in_the_head() -> None:
    file = io.StringIO(newline="")
    write_states(RECORDING.header, [StateRow(state, None) for state in RECORDING.states], file)
    before, homed, faulted = rows(file.getvalue())
    assert homed["utc"] == "2026-11-21T19:25:15.439Z"
    assert (homed["time [s]"], homed["mode"], homed["homed"]) == ("95.1", "moving", "1")
    assert [float(homed[name]) for name in ("a [rad]", "b [m]", "c [m]")] == [0.3, 1.5, 1.3]
    assert float(homed["y [m]"]) == 1.0 / 3.0
    assert [homed[f"{axis} [counts]"] for axis in "abc"] == ["6378", "1500000", "1300000"]
    assert homed["velocity b [m/s]"] == "-0.045"
    assert [homed[f"motor on {axis}"] for axis in "abc"] == ["1", "1", "0"]
    assert [homed[f"forward limit {axis}"] for axis in "abc"] == ["0", "1", "0"]
    assert [homed[f"reverse limit {axis}"] for axis in "abc"] == ["0", "0", "1"]
    assert [homed[f"stop code {axis}"] for axis in "abc"] == ["1", "2", "100"]
    assert (homed["gripper closed"], homed["phase"], homed["fault"], homed["override"]) == ("1", "down", "", "0.5")
    assert [before[name] for name in ("a [rad]", "x [m]", "homed")] == ["", "", "0"]
    assert faulted["fault"] == "2301"
    assert [homed[f"torque {axis} [V]"] for axis in "abc"] == ["", "", ""]


def test_columns_have_different_names_and_one_value_each() -> None:
    assert len({column.key for column in STATE_COLUMNS}) == len(STATE_COLUMNS) == len({c.head for c in STATE_COLUMNS})
    assert len(list(values(StateRow(RECORDING.states[0], None)))) == len(STATE_COLUMNS)


def test_a_piece_of_the_wire_is_a_row_with_its_bytes_twice() -> None:
    file = io.StringIO(newline="")
    write_wire(RECORDING, file)
    found = rows(file.getvalue())
    assert len(found) == len(RECORDING.wire)
    assert (found[0]["event"], found[0]["bytes"], found[0]["link"]) == ("open", "0", "1")
    assert found[2]["text"] == r" 5.0000\r\n:"
    assert found[2]["from"] == "controller"
    assert [bytes.fromhex(row["hexadecimal"]) for row in found] == [piece.data for piece in RECORDING.wire]


def test_an_empty_recording_is_a_head_alone() -> None:
    file = io.StringIO(newline="")
    write_states(header(), [], file)
    assert rows(file.getvalue()) == []
    assert file.getvalue().startswith("utc,time [s],mode")
