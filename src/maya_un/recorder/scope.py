"""The newest states as columns, for plots; works on plain values, in any thread."""

from __future__ import annotations

from collections.abc import Sequence

from maya_un.errors import UnknownName
from maya_un.recorder.tables import MACHINE_COLUMNS, StateRow, Value, at_rate, values
from maya_un.schema.recordings import RecordedColumn
from maya_un.values import State

TIME = MACHINE_COLUMNS[0].key
"""The column that every answer contains."""


def require_columns(names: Sequence[str]) -> None:
    """Raise `UnknownName` for a column that states do not have."""
    known = [column.key for column in MACHINE_COLUMNS]
    for name in names:
        if name not in known:
            raise UnknownName(name=name, known=", ".join(known))


def sampled(states: Sequence[State], rate: float, names: Sequence[str] = ()) -> dict[str, RecordedColumn]:
    """Return the columns `names` of states, oldest first, and their times; without `names`, all columns.

    At most `rate` states a second remain.
    """
    chosen = [index for index, column in enumerate(MACHINE_COLUMNS) if not names or column.key in {TIME, *names}]
    rows = [_chosen(row, chosen) for row in at_rate((StateRow(state, None) for state in states), rate)]
    found = zip(*rows, strict=True) if rows else [()] * len(chosen)
    columns = (MACHINE_COLUMNS[index] for index in chosen)
    return {column.key: RecordedColumn(column.unit, one) for column, one in zip(columns, found, strict=True)}


def _chosen(row: StateRow, chosen: Sequence[int]) -> tuple[Value, ...]:
    every = tuple(values(row))
    return tuple(every[index] for index in chosen)
