from __future__ import annotations

from dmc41x3.cli.terminal import session
from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches, DataRecord

RECORD = DataRecord(
    (
        AxisRecord(
            AxisStatus.MOVING,
            position=-2147483648,
            velocity_raw=-64 * 25000,
            error=-16384,
            torque_raw=-32767,
            stop_code=0,
        ),
        AxisRecord(AxisStatus.MOTOR_OFF, AxisSwitches.FORWARD_INACTIVE, stop_code=1),
        AxisRecord(0, AxisSwitches.HOME_INPUT | AxisSwitches.REVERSE_INACTIVE, stop_code=8),
    ),
    threads=0b101,
)


def test_every_fact_of_an_axis_is_shown() -> None:
    head, a, b, c = session.plain(session.axes(RECORD, 100)).splitlines()
    assert head.split() == ["position", "velocity", "error", "torque", "motor", "motion", "lim", "stop", "code"]
    assert a.split() == ["A", "-2147483648", "-25000", "-16384", "-10.00V", "on", "moving", "···", "0", "running"]
    assert b.split()[5:] == ["off", "at", "rest", "·R·", "1", "arrived", "where", "commanded"]
    assert c.split()[5:8] == ["on", "at", "rest"]
    assert "F·H   8 following error, motor switched off" in c


def test_columns_are_below_their_names() -> None:
    head, a, *_ = session.plain(session.axes(RECORD, 100)).splitlines()
    for name, value in [("position", "-2147483648"), ("velocity", "-25000"), ("torque", "-10.00V")]:
        assert head.index(name) + len(name) == a.index(value) + len(value)


def test_it_fits_eighty_columns() -> None:
    lines = session.plain(session.axes(RECORD, 80)).splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[3].endswith("…")


def test_abnormal_values_stand_out() -> None:
    styles = {text.strip(): style for line in session.axes(RECORD, 100) for style, text in line}
    assert styles["moving"] == "class:moving"
    assert styles["off"] == "class:off"
    assert styles["F"] == styles["R"] == "class:active"


def test_watched_values_share_lines_as_far_as_they_fit() -> None:
    values = {"_TPA": "1.0000", "_TPB*1000000": "2.0000", "nothing": "?57"}
    assert session.plain(session.watched(values, 40)).splitlines() == [
        "_TPA 1.0000   _TPB*1000000 2.0000",
        "nothing ?57",
    ]
    assert ("class:refused", "?57") in session.watched(values, 40)[1]
    assert session.watched({}, 40) == []


def test_threads_that_run() -> None:
    assert session.threads(RECORD) == "0 2"
    assert session.threads(DataRecord(RECORD.axes)) == ""


def test_lines_are_joined_by_line_ends() -> None:
    assert "".join(text for _, text in session.joined([[("", "a"), ("", "b")], [("", "c")]])) == "ab\nc"
    assert session.joined([]) == []
