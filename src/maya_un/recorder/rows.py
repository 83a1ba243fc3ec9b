"""States of a recording with the signals of the controller that belong to them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dmc41x3.i18n import phrase
from dmc41x3.language.record import DataRecord, decode
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.controller.state_builder import StateBuilder, indices
from maya_un.errors import FileUnreadable, InvalidConfig, UnexpectedReply
from maya_un.kinematics.mechanism import Mechanism
from maya_un.recorder.mcap_file import EXCHANGES, STATE, read_header, read_some
from maya_un.recorder.recording import TimeSpan
from maya_un.recorder.tables import StateRow
from maya_un.values import State

_LONGEST_GAP = 5.0
"""A record that is older than this says nothing about a state [s]."""


_ROUNDING = 1e-6
"""The time of an answer in the file is rounded by less than this [s]."""


def state_rows(path: Path, span: TimeSpan | None = None) -> Iterator[StateRow]:
    """Yield the states of a recording, of a `span` or all of them; raises `FileUnreadable`."""
    records = _records_of(path)
    wide = None if span is None else span._replace(begin=span.begin - _LONGEST_GAP)
    waiting: deque[State] = deque()  # of one instant: an exchange of that instant may follow in the file
    for topic, content in read_some(path, wide, STATE, EXCHANGES):
        now: float = content["t"] if topic == EXCHANGES.name else content.time
        while waiting and waiting[0].time < now:
            yield records.row(waiting.popleft())
        if topic == EXCHANGES.name:
            records.add(content)
        elif span is None or content.time >= span.begin:
            waiting.append(content)
    yield from map(records.row, waiting)


def _records_of(path: Path) -> _Records:
    try:
        return _Records(parse(read_header(path).origin.config))
    except InvalidConfig as error:
        raise FileUnreadable(
            path=path, reason=phrase("its configuration is invalid: {reason}", reason=error.details["reason"])
        ) from error


class _Records:
    """The data records of a recording, in order."""

    def __init__(self, config: Config) -> None:
        self._builder = StateBuilder(config, Units.of(config), Mechanism.of(config), indices(config))
        self._coming: deque[tuple[float, str]] = deque()
        self._newest: tuple[float, DataRecord | None] = (0.0, None)

    def add(self, exchange: dict[str, Any]) -> None:
        """Add an exchange, if its answer is a data record."""
        if exchange["command"] == "QR" and exchange["took"] is not None:
            self._coming.append((exchange["t"] + exchange["took"], exchange["reply"]))

    def row(self, state: State) -> StateRow:
        """Return the row of a state, which is newer than those before."""
        newest = ""
        while self._coming and self._coming[0][0] <= state.time + _ROUNDING:
            time, newest = self._coming.popleft()
            self._newest = time, None
        if newest:
            self._newest = self._newest[0], _decoded(newest)
        time, record = self._newest
        if record is None or state.time - time > _LONGEST_GAP:
            return StateRow(state, None)
        return StateRow(state, self._builder.signals(record, state))


def _decoded(reply: str) -> DataRecord | None:
    try:
        return decode(reply.encode("latin-1"))
    except (UnexpectedReply, UnicodeEncodeError):
        return None
