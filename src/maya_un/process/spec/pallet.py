"""Pallets: grids of places spanned by their corners, and the names of their cells.

With corners p11, p1C, pR1 and pRC, cell (row, column) of an R x C grid lies at

    p = (1 - v) ((1 - u) p11 + u p1C) + v ((1 - u) pR1 + u pRC),   u = (column - 1) / (C - 1),  v = (row - 1) / (R - 1)

which meets every corner and spaces the cells of each row evenly, and those of each column too. Without the fourth
corner, it is p1C + pR1 - p11, and the grid is a parallelogram.

`tray[1,2]` is row 1, column 2; `tray[next]` the next cell; `tray[each]` that of a loop. Loops choose more than one
cell: `tray` all of them, `tray[2,*]` a row, `tray[*,1]` a column.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import acos, degrees, dist, pi, radians, sqrt
from typing import NamedTuple, Self

from dmc41x3.i18n import phrase
from maya_un.values import FARTHEST, Point

MOST_CELLS = 1_000
"""Cells of the largest pallet."""

FLAT = 0.002
"""A corner farther than this from the plane of all four [m] causes a remark; chosen: a grasp's tolerance is unknown."""

SQUARE = radians(1.0)
"""An angle of the grid farther than this from a right angle [rad] causes a remark: 9 mm on a side of half a metre."""

_COINCIDE = 1e-4
"""Neighbours nearer than this [m] are indistinguishable: one count of the boom moves as far at full reach."""

_FLAT_CORNER = 2e-6
"""Twice the square of the smallest angle between two sides [rad²]."""

Vector = tuple[float, float, float]


class Cell(NamedTuple):
    """Row and column of a place on a pallet, both from 1."""

    row: int
    column: int


@dataclass(frozen=True, slots=True)
class RectangleError:
    """Deviation of four corners from a rectangle.

    `flatness` is the distance of each corner from their mean plane [m], `squareness` the largest deviation of an angle
    from a right angle [rad].
    """

    flatness: float
    squareness: float

    @property
    def remarks(self) -> tuple[str, ...]:
        """Deviations beyond tolerance, in words; the grid is used as taught."""
        flat = phrase("its corners are {distance:.1f} mm off a plane", distance=self.flatness * 1e3)
        square = phrase("its corners are {angle:.1f} degrees off a right angle", angle=degrees(self.squareness))
        return (flat,) * (self.flatness > FLAT) + (square,) * (self.squareness > SQUARE)


@dataclass(frozen=True, slots=True)
class Pallet:
    """A grid of `rows` x `columns` places.

    `corners` are cells (1, 1), (1, columns), (rows, 1) and (rows, columns), in reading order [m].
    """

    corners: tuple[Point, Point, Point, Point]
    rows: int
    columns: int

    @classmethod
    def spanned(cls, corners: Sequence[Point], rows: int, columns: int) -> Self:
        """Return the grid of the given corners, in reading order.

        A grid of several rows and columns needs three or four corners, a single row or column its two ends (more are
        accepted), a single cell one. Raises `ValueError` for counts out of range, too few or too many corners, and
        corners that span no grid.
        """
        check_counts(rows, columns, len(corners))
        pallet = cls(_four(corners, rows, columns), rows, columns)
        pallet._check_corners()
        return pallet

    def __len__(self) -> int:
        return self.rows * self.columns

    @property
    def extent(self) -> str:
        """The ranges of rows and columns, in words."""
        return phrase("it has rows 1 to {rows} and columns 1 to {columns}", rows=self.rows, columns=self.columns)

    def cells(self) -> Iterator[Cell]:
        """Yield every cell, row by row."""
        return (Cell(row, column) for row in range(1, self.rows + 1) for column in range(1, self.columns + 1))

    def place(self, cell: Cell) -> Point:
        """Return the place of a cell [m]; raises `ValueError` with the ranges for a cell that does not exist."""
        if not (1 <= cell.row <= self.rows and 1 <= cell.column <= self.columns):
            raise ValueError(self.extent)
        v, u = _share(cell.row, self.rows), _share(cell.column, self.columns)
        first, right, low, last = self.corners
        p, q, r, s = (1.0 - v) * (1.0 - u), (1.0 - v) * u, v * (1.0 - u), v * u
        corners = zip(first, right, low, last, strict=True)
        return Point(*(p * one + q * two + r * three + s * four for one, two, three, four in corners))

    @property
    def shape(self) -> RectangleError:
        """The deviation of the corners from a rectangle; 0 for a single row or column."""
        if self.rows == 1 or self.columns == 1:
            return RectangleError(0.0, 0.0)
        first, right, low, last = self.corners
        twist = _difference(_difference(last, low), _difference(right, first))
        return RectangleError(
            abs(_dot(twist, _unit(self._normal()))) / 4.0, max(abs(pi / 2 - turn) for turn in self._turns())
        )

    def _sides(self) -> tuple[tuple[Vector, Vector], ...]:
        """Return at every corner the side along its row and the side along its column, both in counting direction."""
        first, right, low, last = self.corners
        top, bottom = _difference(right, first), _difference(last, low)
        left, far = _difference(low, first), _difference(last, right)
        return (top, left), (top, far), (bottom, left), (bottom, far)

    def _turns(self) -> Iterator[float]:
        return (acos(max(-1.0, min(1.0, _dot(_unit(row), _unit(column))))) for row, column in self._sides())

    def _normal(self) -> Vector:
        """Return a normal of the mean plane of the corners: the cross product of the diagonals, not normalised."""
        first, right, low, last = self.corners
        return _cross(_difference(last, first), _difference(low, right))

    def _check_corners(self) -> None:
        first, right, low, last = self.corners
        if not all(abs(value) <= FARTHEST for corner in self.corners for value in corner):
            raise ValueError(phrase("a corner lies more than {most:g} m away", most=FARTHEST))
        along_rows = ((self.columns, first, right), (self.columns, low, last))
        along_columns = ((self.rows, first, low), (self.rows, right, last))
        for count, one, other in (*along_rows, *along_columns):
            if count > 1 and dist(one, other) < _COINCIDE * (count - 1):
                raise ValueError(phrase("two of its cells would stand in the same place"))
        if self.rows > 1 and self.columns > 1:
            self._check_order()

    def _check_order(self) -> None:
        """Raise `ValueError` for corners in another order or on one line: no corner may turn the other way."""
        normal = self._normal()
        for row, column in self._sides():
            if _dot(_cross(row, column), normal) <= _FLAT_CORNER * _dot(row, row) * _dot(column, column):
                raise ValueError(
                    phrase(
                        "its corners span no grid; they are the first and the last cell of the first row, "
                        "then the first and the last cell of the last row"
                    )
                )


def check_counts(rows: int, columns: int, corners: int) -> None:
    """Raise `ValueError` for an impossible grid, or one that cannot have `corners` corners."""
    if rows < 1 or columns < 1 or rows * columns > MOST_CELLS:
        raise ValueError(
            phrase(
                "a pallet has 1 to {most} cells, not {rows} x {columns}", most=MOST_CELLS, rows=rows, columns=columns
            )
        )
    least = 1 + (rows > 1) + (columns > 1)
    if not least <= corners <= 4:
        raise ValueError(
            phrase(
                "{rows} x {columns} cells have {least} to 4 corners, not {corners}",
                rows=rows,
                columns=columns,
                least=least,
                corners=corners,
            )
        )


def _four(corners: Sequence[Point], rows: int, columns: int) -> tuple[Point, Point, Point, Point]:
    """Return all four corners of a grid of which some are given; a side of a single cell has length 0."""
    first, *others = corners
    if len(others) == 3 and rows > 1 and columns > 1:
        right, low, last = others
        return first, right, low, last
    right = others[0] if columns > 1 else first
    low = others[:2][-1] if rows > 1 else first
    return first, right, low, Point(*(a + b - c for a, b, c in zip(right, low, first, strict=True)))


def _share(number: int, count: int) -> float:
    return (number - 1) / (count - 1) if count > 1 else 0.0


def _difference(to: Vector, of: Vector) -> Vector:
    return to[0] - of[0], to[1] - of[1], to[2] - of[2]


def _dot(one: Vector, other: Vector) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )


def _unit(vector: Vector) -> Vector:
    length = sqrt(_dot(vector, vector))
    return vector[0] / length, vector[1] / length, vector[2] / length


NEXT = "next"
"""The next cell in reading order: for a pick the first that the job has not picked from, and likewise for a place."""

EACH = "each"
"""The current cell of the loop."""

_REFERENCE = re.compile(r"(.+?) *\[ *(?:(next|each)|([0-9]{1,4}|\*) *, *([0-9]{1,4}|\*)) *\]")


class CellReference(NamedTuple):
    """A name with brackets after it; `which` is `next`, `each`, or row and column, None for all of them (`*`)."""

    pallet: str
    which: str | tuple[int | None, int | None]

    @property
    def cell(self) -> Cell | None:
        """The cell that the reference names by numbers, None if it names several or none."""
        if isinstance(self.which, str) or self.which[0] is None or self.which[1] is None:
            return None
        return Cell(self.which[0], self.which[1])


MOST_REFERENCE = 200
"""Length of the longest reference: a name of 64 letters and brackets, with some blanks."""


def read_reference(text: str) -> CellReference | None:
    """Return the reference in a text, None without valid brackets."""
    if len(text) > MOST_REFERENCE:  # blanks in a long text would take the square of its length
        return None
    found = _REFERENCE.fullmatch(text)
    if found is None:
        return None
    pallet, word, row, column = found.groups()
    return CellReference(pallet, word or (_number(row), _number(column)))


def _number(text: str) -> int | None:
    return None if text == "*" else int(text)


def chosen_cells(reference: CellReference, pallet: Pallet) -> tuple[Cell, ...]:
    """Return the cells that a reference by numbers chooses, row by row; empty if none matches."""
    assert not isinstance(reference.which, str)
    row, column = reference.which
    return tuple(cell for cell in pallet.cells() if row in {None, cell.row} and column in {None, cell.column})


def cell_text(pallet: str, cell: Cell) -> str:
    """Return the name of a cell."""
    return f"{pallet}[{cell.row},{cell.column}]"
