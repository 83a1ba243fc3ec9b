"""States as columns: those of a recording, and the newest ones in memory. Units are m, rad, s."""

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


@dataclass(frozen=True, slots=True)
class ScopeView:
    """The newest states as `columns` by name, oldest first; `time` is that of the loop [s].

    They were recorded from `begin` to `end` [s, loop time]; the loop's clock runs at `speed` times real time. `begin`
    is later than requested if the memory does not reach back as far.
    """

    begin: float
    end: float
    speed: float
    columns: dict[str, RecordedColumn]
