"""Recordings as tables (CSV): one of the states, one of the wire, for spreadsheets and for numpy."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from typing import TextIO

from dmc41x3.wire.transcript import WirePiece
from maya_un.recorder.recording import Recording, date
from maya_un.values import AXES, State

_SWITCHES = ("motor on", "forward limit", "reverse limit", "stop code")
_STATE = (
    *("utc", "time [s]", "mode", "homed", "a [rad]", "b [m]", "c [m]", "x [m]", "y [m]", "z [m]"),
    *(f"{axis} [counts]" for axis in AXES),
    *("velocity a [rad/s]", "velocity b [m/s]", "velocity c [m/s]", "moving"),
    *(f"{what} {axis}" for what in _SWITCHES for axis in AXES),
    *("gripper closed", "phase", "fault", "override"),
)
_WIRE = ("utc", "time [s]", "link", "from", "event", "bytes", "hexadecimal", "text")


def write_states(recording: Recording, file: TextIO) -> None:
    """Write one row for every state; cells of unknown values are empty, booleans are 1 and 0."""
    writer = csv.writer(file)
    writer.writerow(_STATE)
    for state in recording.states:
        writer.writerow(_state(recording, state))


def write_wire(recording: Recording, file: TextIO) -> None:
    """Write one row for every piece of the wire; `text` shows unprintable characters as escapes."""
    writer = csv.writer(file)
    writer.writerow(_WIRE)
    for piece in recording.wire:
        writer.writerow(_piece(recording, piece))


def _state(recording: Recording, state: State) -> Iterator[object]:
    yield date(recording.header.utc_at(state.time))
    yield from (state.time, state.mode.value, int(state.homed))
    yield from state.joints or ("", "", "")
    yield from state.point or ("", "", "")
    yield from state.counts
    yield from state.velocity
    yield int(state.moving)
    for three in (state.motors_on, state.forward_limit, state.reverse_limit):
        yield from map(int, three)
    yield from state.stop_code
    yield int(state.gripper_closed)
    yield "" if state.progress is None else state.progress.phase
    yield "" if state.fault is None else state.fault.code
    yield state.override


def _piece(recording: Recording, piece: WirePiece) -> tuple[object, ...]:
    text = piece.data.decode("latin-1").encode("unicode_escape").decode("ascii")
    stamp = date(recording.header.utc_at(piece.time))
    return stamp, piece.time, piece.link, piece.side, piece.event, len(piece.data), piece.data.hex(), text
