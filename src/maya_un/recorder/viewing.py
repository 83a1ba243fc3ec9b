"""Recordings for readers elsewhere: states as columns or CSV, and events. A worker reads and serializes them.

Every function yields pieces of its answer as bytes, and None where other work may run.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Generator
from pathlib import Path

from maya_un.errors import TooLarge
from maya_un.recorder.mcap_file import EVENTS, read_header, read_some
from maya_un.recorder.recording import TimeSpan
from maya_un.recorder.rows import state_rows
from maya_un.recorder.tables import STATE_COLUMNS, Value, at_rate, state_table, values
from maya_un.schema.encoding import in_pieces, to_json
from maya_un.schema.recordings import RecordedColumn, RecordedStates
from maya_un.schema.robot import EventMessage

MOST_ROWS = 20_000
"""Maximum number of states or events in one answer."""

MOST_TABLE = 64_000_000
"""Size of the largest table (CSV) [bytes]."""

Pieces = Generator[bytes | None, None, None]

_PAUSE = 200


def states(path: Path, span: TimeSpan, rate: float | None) -> Pieces:
    """Return the `RecordedStates` of a `span` as JSON, with at most `rate` states a second; raises `FileUnreadable`.

    Of more than `MOST_ROWS` states every second one is left out, as often as necessary.
    """
    header = read_header(path)
    kept: list[tuple[Value, ...]] = []
    every = 1
    for number, row in enumerate(at_rate(state_rows(path, span), rate)):
        if number % every == 0:
            kept.append(tuple(values(row)))
        if len(kept) > MOST_ROWS:
            kept, every = kept[::2], 2 * every
        if number % _PAUSE == 0:
            yield None
    each = zip(*kept, strict=True) if kept else [()] * len(STATE_COLUMNS)
    columns = {
        column.key: RecordedColumn(column.unit, found) for column, found in zip(STATE_COLUMNS, each, strict=True)
    }
    yield None
    yield from in_pieces(
        to_json(RecordedStates(header.whole, header.saved, header.date, header.origin.speed, every, columns))
    )


def events(path: Path, span: TimeSpan) -> Pieces:
    """Return the events of a `span` as JSON, at most the first `MOST_ROWS`; raises `FileUnreadable`."""
    found: list[EventMessage] = []
    for number, (_, event) in enumerate(read_some(path, span, EVENTS)):
        if number == MOST_ROWS:
            break
        found.append(EventMessage.of(event))
        if number % _PAUSE == 0:
            yield None
    yield from in_pieces(to_json(found))


def table(path: Path, span: TimeSpan, rate: float | None) -> Pieces:
    """Return the states of a `span` as CSV, with at most `rate` a second; raises `FileUnreadable`, `TooLarge`."""
    rows = at_rate(state_rows(path, span), rate)
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    size = 0
    for number, cells in enumerate(state_table(read_header(path), rows)):
        writer.writerow(cells)
        if number % _PAUSE == 0:
            piece = file.getvalue().encode()
            file.seek(0)
            file.truncate()
            size += len(piece)
            if size > MOST_TABLE:
                raise TooLarge(most=f"{MOST_TABLE} bytes")
            yield piece
    yield file.getvalue().encode()
