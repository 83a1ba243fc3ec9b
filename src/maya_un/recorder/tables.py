"""Recordings as tables (CSV): one of the states, one of the wire, for spreadsheets and for numpy."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from typing import NamedTuple, TextIO, TypeAlias

from dmc41x3.wire.transcript import WirePiece
from maya_un.recorder.recording import Recording, date
from maya_un.values import AXES, State

_SWITCHES = ("motor on", "forward limit", "reverse limit", "stop code")
Cell: TypeAlias = float | int | str | None
"""A value in the table of states: booleans are 1 and 0, None is unknown."""


class StateColumn(NamedTuple):
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


STATE_COLUMNS = (
    *(StateColumn("time", "s"), StateColumn("mode"), StateColumn("homed")),
    *(StateColumn("a", "rad"), StateColumn("b", "m"), StateColumn("c", "m")),
    *(StateColumn(name, "m") for name in "xyz"),
    *(StateColumn(axis, "counts") for axis in AXES),
    *(StateColumn("velocity a", "rad/s"), StateColumn("velocity b", "m/s"), StateColumn("velocity c", "m/s")),
    StateColumn("moving"),
    *(StateColumn(f"{what} {axis}") for what in _SWITCHES for axis in AXES),
    *(StateColumn("gripper closed"), StateColumn("phase"), StateColumn("fault"), StateColumn("override")),
)
"""The columns of the table of states, in the order of `cells`."""

_WIRE = ("utc", "time [s]", "link", "from", "event", "bytes", "hexadecimal", "text")


def write_states(recording: Recording, file: TextIO) -> None:
    """Write one row for every state; cells of unknown values are empty, booleans are 1 and 0."""
    writer = csv.writer(file)
    writer.writerow(["utc", *(column.head for column in STATE_COLUMNS)])
    for state in recording.states:
        writer.writerow([date(recording.header.utc_at(state.time)), *cells(state)])


def write_wire(recording: Recording, file: TextIO) -> None:
    """Write one row for every piece of the wire; `text` shows unprintable characters as escapes."""
    writer = csv.writer(file)
    writer.writerow(_WIRE)
    for piece in recording.wire:
        writer.writerow(_piece(recording, piece))


def cells(state: State) -> Iterator[Cell]:
    """Yield the values of a state in the order of `STATE_COLUMNS`."""
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


_UNKNOWN = (None, None, None)


def _piece(recording: Recording, piece: WirePiece) -> tuple[object, ...]:
    text = piece.data.decode("latin-1").encode("unicode_escape").decode("ascii")
    stamp = date(recording.header.utc_at(piece.time))
    return stamp, piece.time, piece.link, piece.side, piece.event, len(piece.data), piece.data.hex(), text
