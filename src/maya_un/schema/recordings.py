"""Recordings as messages: their states as columns. Units are m, rad, s."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordedColumn:
    """A value of every state: its `unit` ("" for none) and its `values`; booleans are 1 and 0, unknown values None."""

    unit: str
    values: tuple[float | int | str | None, ...]


@dataclass(frozen=True, slots=True)
class RecordedStates:
    """States of a recording as `columns` by name, oldest first.

    The recording begins and ends at the loop times `begin` and `end` [s]; it was saved at `end`, on the `date` (UTC).
    Its clock ran at `speed` times real time. The columns contain every `every`-th of the requested states, at most
    20 000.
    """

    begin: float
    end: float
    date: str
    speed: float
    every: int
    columns: dict[str, RecordedColumn]
