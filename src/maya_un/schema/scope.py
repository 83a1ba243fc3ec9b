"""The newest states in memory as columns, for plots. Units are m, rad, s."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SampledColumn:
    """A value of every state: its `unit` ("" for none) and its `values`; booleans are 1 and 0, unknown values None."""

    unit: str
    values: tuple[float | int | str | None, ...]


@dataclass(frozen=True, slots=True)
class ScopeView:
    """The newest states as `columns` by name, oldest first; `time` is that of the loop [s].

    They were recorded from `begin` to `end` [s, loop time]; the loop's clock runs at `speed` times real time. `begin`
    is later than requested if the memory does not reach back as far.
    """

    begin: float
    end: float
    speed: float
    columns: dict[str, SampledColumn]
