"""Cells by name: `tray[1,2]` is row 1, column 2; `tray[next]` the next one; `tray[each]` that of a loop.

Loops choose more than one: `tray` all of them, `tray[2,*]` a row, `tray[*,1]` a column.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from maya_un.process.pallet import Cell, Pallet

NEXT = "next"
"""The next cell in reading order: for a pick the first that the job has not picked from, for a place alike."""

EACH = "each"
"""The cell that the loop has come to."""

_REFERENCE = re.compile(r"(.+?) *\[ *(?:(next|each)|([0-9]{1,4}|\*) *, *([0-9]{1,4}|\*)) *\]")


class CellReference(NamedTuple):
    """A name with brackets behind it; `which` is `next`, `each`, or row and column, None for all of them (`*`)."""

    pallet: str
    which: str | tuple[int | None, int | None]

    @property
    def cell(self) -> Cell | None:
        """The one cell that it names by its numbers, None where it names another number of them."""
        if isinstance(self.which, str) or self.which[0] is None or self.which[1] is None:
            return None
        return Cell(self.which[0], self.which[1])


def read_reference(text: str) -> CellReference | None:
    """Return what a text names by brackets, None where it has none that are understood."""
    found = _REFERENCE.fullmatch(text)
    if found is None:
        return None
    pallet, word, row, column = found.groups()
    return CellReference(pallet, word or (_number(row), _number(column)))


def _number(text: str) -> int | None:
    return None if text == "*" else int(text)


def chosen(reference: CellReference, pallet: Pallet) -> tuple[Cell, ...]:
    """Return the cells that a reference by numbers chooses, row by row; empty where there are none of that number."""
    assert not isinstance(reference.which, str)
    row, column = reference.which
    return tuple(cell for cell in pallet.cells() if row in {None, cell.row} and column in {None, cell.column})


def cell_text(pallet: str, cell: Cell) -> str:
    """Return the name of a cell."""
    return f"{pallet}[{cell.row},{cell.column}]"
