"""Recordings as tables (CSV): one of the states, one of the wire, for spreadsheets and for numpy."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from math import inf
from typing import NamedTuple, TextIO, TypeAlias

from dmc41x3.wire.transcript import WirePiece
from maya_un.axes import AXES
from maya_un.recorder.recording import Header, Recording, date
from maya_un.schema.robot import Signals
from maya_un.values import State

Value: TypeAlias = float | int | str | None
"""A value in the table of states: booleans are 1 and 0, None is unknown."""


class TableColumn(NamedTuple):
    """A column of the table of states: its name, and its unit, "" for none."""

    name: str
    unit: str = ""

    @property
    def head(self) -> str:
        """The head of the column in a table."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def key(self) -> str:
        """The name of the column in JSON, which no other column has."""
        return "_".join([*self.name.split(), *(["counts"] if self.unit == "counts" else [])])


class StateRow(NamedTuple):
    """A state, and the signals in the newest data record before it; None without such a record."""

    state: State
    signals: Signals | None


def at_rate(rows: Iterable[StateRow], rate: float | None) -> Iterator[StateRow]:
    """Yield the rows that are at least 1 / `rate` [s] apart on average; all if it is None."""
    period = 0.0 if rate is None else 1.0 / rate
    due = -inf
    for row in rows:
        time = row.state.time
        if time >= due:
            due = period + (time if due == -inf else max(due, time - period))
            yield row


def _three(name: str, *units: str) -> tuple[TableColumn, ...]:
    """Return a column for each axis, with the units of a, b and c."""
    return tuple(TableColumn(f"{name} {axis}".strip(), unit) for axis, unit in zip(AXES, units, strict=True))


_SWITCHES = ("motor on", "forward limit", "reverse limit", "stop code")

MACHINE_COLUMNS = (
    TableColumn("time", "s"),
    *(TableColumn("mode"), TableColumn("homed")),
    *_three("", "rad", "m", "m"),
    *(TableColumn(axis, "m") for axis in "xyz"),
    *_three("", "counts", "counts", "counts"),
    *_three("velocity", "rad/s", "m/s", "m/s"),
    TableColumn("moving"),
    *(column for name in _SWITCHES for column in _three(name, "", "", "")),
    *(TableColumn("gripper closed"), TableColumn("phase"), TableColumn("fault"), TableColumn("override")),
)
"""The columns of a state."""

SIGNAL_COLUMNS = (
    *_three("following error", "rad", "m", "m"),
    *_three("torque", "V", "V", "V"),
    *_three("tension", "", "loads", "loads")[1:],
)
"""The columns of the signals that belong to a state. Torques are motor commands, tensions multiples of the load."""

STATE_COLUMNS = (*MACHINE_COLUMNS, *SIGNAL_COLUMNS)
"""The columns of the table of states."""

_WIRE = ("utc", "time [s]", "link", "from", "event", "bytes", "hexadecimal", "text")


def write_states(header: Header, rows: Iterable[StateRow], file: TextIO) -> None:
    """Write one row for every state; cells of unknown values are empty."""
    csv.writer(file).writerows(state_table(header, rows))


def state_table(header: Header, rows: Iterable[StateRow]) -> Iterator[list[Value]]:
    """Yield the head of the table of states, then its rows, each with its date."""
    yield ["utc", *(column.head for column in STATE_COLUMNS)]
    for row in rows:
        yield [date(header.utc_at(row.state.time)), *values(row)]


def values(row: StateRow) -> Iterator[Value]:
    """Yield the values of a row in the order of `STATE_COLUMNS`."""
    state, signals = row
    yield from (state.time, state.mode.value, int(state.homed))
    yield from state.joints or _UNKNOWN
    yield from state.point or _UNKNOWN
    yield from state.counts
    yield from state.velocity
    yield int(state.moving)
    for three in (state.motors_on, state.forward_limit, state.reverse_limit):
        yield from map(int, three)
    yield from state.stop_code
    yield int(state.gripper_closed)
    yield None if state.progress is None else state.progress.phase
    yield None if state.fault is None else state.fault.code
    yield state.override
    yield from _UNKNOWN if signals is None else signals.following_error
    yield from _UNKNOWN if signals is None else signals.torque
    yield from _UNKNOWN[1:] if signals is None or signals.tension is None else signals.tension


_UNKNOWN = (None, None, None)


def write_wire(recording: Recording, file: TextIO) -> None:
    """Write one row for every piece of the wire; `text` shows unprintable characters as escapes."""
    writer = csv.writer(file)
    writer.writerow(_WIRE)
    for piece in recording.wire:
        writer.writerow(_piece(recording, piece))


def _piece(recording: Recording, piece: WirePiece) -> tuple[object, ...]:
    text = piece.data.decode("latin-1").encode("unicode_escape").decode("ascii")
    stamp = date(recording.header.utc_at(piece.time))
    return stamp, piece.time, piece.link, piece.side, piece.event, len(piece.data), piece.data.hex(), text
