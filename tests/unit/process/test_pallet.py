from __future__ import annotations

from itertools import pairwise
from math import dist, radians

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from maya_un.process.spec.pallet import FLAT, MOST_REFERENCE, Cell, Pallet, read_reference
from maya_un.values import Point

FIRST, RIGHT, LOW, LAST = Point(0.3, 1.0, 0.4), Point(0.6, 1.0, 0.4), Point(0.3, 1.2, 0.4), Point(0.6, 1.2, 0.4)

coordinate = st.floats(-2.0, 2.0)
points = st.builds(Point, coordinate, coordinate, st.floats(0.1, 2.0))
counts = st.integers(2, 9)


def spanned(corners: list[Point], rows: int, columns: int) -> Pallet:
    """Return the pallet of drawn corners; those that span none are not what is asked about."""
    try:
        return Pallet.spanned(corners, rows, columns)
    except ValueError:
        assume(False)
        raise


def test_a_grid_of_three_corners_worked_by_hand() -> None:
    pallet = Pallet.spanned([FIRST, RIGHT, LOW], 3, 4)
    assert pallet.place(Cell(1, 2)) == pytest.approx((0.4, 1.0, 0.4))
    assert pallet.place(Cell(2, 1)) == pytest.approx((0.3, 1.1, 0.4))
    assert pallet.place(Cell(3, 4)) == pytest.approx(LAST)
    assert len(pallet) == 12
    assert [tuple(cell) for cell in pallet.cells()][:5] == [(1, 1), (1, 2), (1, 3), (1, 4), (2, 1)]


def test_a_text_longer_than_any_name_is_no_reference() -> None:
    assert read_reference(f"{'a' * 64} [ 1 , 2 ]") == ("a" * 64, (1, 2))
    assert read_reference(f"{'a' * MOST_REFERENCE}[1,2]") is None


def test_the_fourth_corner_bends_the_grid() -> None:
    pallet = Pallet.spanned([FIRST, RIGHT, LOW, LAST._replace(z=0.44)], 3, 3)
    assert pallet.place(Cell(2, 2)).z == pytest.approx(0.41)
    assert pallet.place(Cell(2, 3)).z == pytest.approx(0.42)
    assert pallet.place(Cell(1, 2)).z == 0.4


@pytest.mark.parametrize("corners", [[FIRST, RIGHT], [FIRST, RIGHT, LOW], [FIRST, RIGHT, LOW, LAST]])
def test_one_row_lies_between_its_ends(corners: list[Point]) -> None:
    pallet = Pallet.spanned(corners, 1, 4)
    assert [pallet.place(cell).x for cell in pallet.cells()] == pytest.approx([0.3, 0.4, 0.5, 0.6])
    assert {pallet.place(cell).y for cell in pallet.cells()} == {1.0}


@pytest.mark.parametrize("corners", [[FIRST, LOW], [FIRST, RIGHT, LOW], [FIRST, RIGHT, LOW, LAST]])
def test_one_column_lies_between_its_ends(corners: list[Point]) -> None:
    pallet = Pallet.spanned(corners, 3, 1)
    assert [pallet.place(cell).y for cell in pallet.cells()] == pytest.approx([1.0, 1.1, 1.2])
    assert {pallet.place(cell).x for cell in pallet.cells()} == {0.3}


def test_a_single_cell_is_its_corner() -> None:
    assert Pallet.spanned([FIRST], 1, 1).place(Cell(1, 1)) == FIRST


@given(points, points, points, points, counts, counts)
def test_four_corners_are_met_exactly(
    first: Point, right: Point, low: Point, last: Point, rows: int, columns: int
) -> None:
    pallet = spanned([first, right, low, last], rows, columns)
    cells = [Cell(1, 1), Cell(1, columns), Cell(rows, 1), Cell(rows, columns)]
    assert [pallet.place(cell) for cell in cells] == [first, right, low, last]


@given(points, points, points, counts, counts)
def test_three_corners_make_an_affine_grid(first: Point, right: Point, low: Point, rows: int, columns: int) -> None:
    pallet = spanned([first, right, low], rows, columns)
    for cell in pallet.cells():
        u, v = (cell.column - 1) / (columns - 1), (cell.row - 1) / (rows - 1)
        affine = [a + u * (b - a) + v * (c - a) for a, b, c in zip(first, right, low, strict=True)]
        assert pallet.place(cell) == pytest.approx(affine, abs=1e-12)
    assert pallet.shape.flatness == pytest.approx(0.0, abs=1e-9)


@given(points, points, points, points, counts, counts)
def test_the_cells_of_a_row_and_of_a_column_are_spaced_evenly(
    first: Point, right: Point, low: Point, last: Point, rows: int, columns: int
) -> None:
    pallet = spanned([first, right, low, last], rows, columns)
    lines = [[Cell(row, column) for column in range(1, columns + 1)] for row in range(1, rows + 1)]
    lines += [[Cell(row, column) for row in range(1, rows + 1)] for column in range(1, columns + 1)]
    for line in lines:
        gaps = [dist(pallet.place(one), pallet.place(other)) for one, other in pairwise(line)]
        assert gaps == pytest.approx([gaps[0]] * len(gaps), abs=1e-12)


@pytest.mark.parametrize("cell", [Cell(0, 1), Cell(4, 1), Cell(1, 0), Cell(1, 5)])
def test_cell_out_of_range_is_refused_with_the_range(cell: Cell) -> None:
    with pytest.raises(ValueError, match="rows 1 to 3 and columns 1 to 4"):
        Pallet.spanned([FIRST, RIGHT, LOW], 3, 4).place(cell)


@pytest.mark.parametrize(
    ("corners", "rows", "columns", "reason"),
    [
        ([FIRST, RIGHT], 2, 2, "2 x 2 cells have 3 to 4 corners, not 2"),
        ([FIRST], 1, 5, "2 to 4 corners"),
        ([FIRST, RIGHT, LOW, LAST, LAST], 2, 2, "not 5"),
        ([FIRST, RIGHT, LOW], 0, 3, "1 to 1000 cells, not 0 x 3"),
        ([FIRST, RIGHT, LOW], 40, 40, "1 to 1000 cells"),
        ([FIRST, FIRST, LOW], 2, 2, "the same place"),
        ([FIRST, RIGHT._replace(x=1e300), LOW], 2, 2, "more than 10000 m away"),
        ([FIRST, RIGHT, LOW._replace(z=-10001.0)], 2, 2, "more than 10000 m away"),
        ([FIRST, FIRST._replace(x=0.3001)], 1, 3, "the same place"),
        ([FIRST, RIGHT, LAST, LOW], 2, 2, "span no grid; they are the first and the last cell of the first row"),
        ([FIRST, RIGHT, Point(0.9, 1.0, 0.4)], 2, 2, "span no grid"),
        ([FIRST, RIGHT, LOW, Point(0.4, 1.05, 0.4)], 2, 2, "span no grid"),
    ],
)
def test_invalid_grid_is_refused(corners: list[Point], rows: int, columns: int, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Pallet.spanned(corners, rows, columns)


def test_a_mirrored_grid_is_one_too() -> None:
    assert Pallet.spanned([RIGHT, FIRST, LAST], 2, 2).place(Cell(2, 2)) == pytest.approx(LOW)


def test_a_rectangle_has_nothing_to_remark() -> None:
    shape = Pallet.spanned([FIRST, RIGHT, LOW, LAST], 3, 4).shape
    assert (shape.flatness, shape.squareness) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert shape.remarks == ()


def test_a_corner_off_the_plane_is_remarked() -> None:
    shape = Pallet.spanned([FIRST, RIGHT, LOW, LAST._replace(z=0.412)], 3, 4).shape
    assert shape.flatness == pytest.approx(0.003, rel=0.01)
    assert shape.remarks[0] == "its corners are 3.0 mm off a plane"
    nearly = Pallet.spanned([FIRST, RIGHT, LOW, LAST._replace(z=0.4 + 3.9 * FLAT)], 3, 4)
    assert not any("plane" in remark for remark in nearly.shape.remarks)


def test_a_slanted_grid_is_remarked() -> None:
    shape = Pallet.spanned([FIRST, RIGHT, Point(0.4, 1.1, 0.4)], 3, 4).shape
    assert shape.squareness == pytest.approx(radians(45.0))
    assert shape.remarks == ("its corners are 45.0 degrees off a right angle",)


def test_a_single_row_has_no_shape() -> None:
    assert Pallet.spanned([FIRST, RIGHT, Point(0.4, 1.1, 0.4)], 1, 4).shape.remarks == ()
