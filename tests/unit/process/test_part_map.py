from __future__ import annotations

from math import dist

from hypothesis import given
from hypothesis import strategies as st

from maya_un.process.spec.tasks import SAME_PLACE, PartMap
from maya_un.values import Point

CUBE, TRAY = Point(0.5, 1.1, 0.4), Point(1.1, 0.5, 0.4)

hair = st.floats(-0.5 * SAME_PLACE, 0.5 * SAME_PLACE)
grid = st.integers(0, 30).map(lambda number: number * 5e-5)
places = st.builds(Point, grid, grid, grid)


def test_part_is_at_its_last_place() -> None:
    standing = PartMap({"cube": CUBE})
    assert (standing.at(CUBE), standing.at(TRAY)) == ("cube", None)
    standing.put("cube", TRAY)
    assert (standing.at(CUBE), standing.at(TRAY)) == (None, "cube")
    standing.put("cube", None)
    assert standing.at(TRAY) is None
    assert standing.parts == {"cube": None}
    standing.put("cube", CUBE)
    assert standing.at(CUBE) == "cube"


def test_of_parts_in_one_place_it_is_the_first_that_was_named() -> None:
    standing = PartMap({"lower": CUBE, "upper": None})
    standing.put("upper", CUBE)
    assert standing.at(CUBE) == "lower"
    standing.put("lower", TRAY)
    assert standing.at(CUBE) == "upper"


@given(st.lists(places, min_size=1, max_size=20), places, hair, hair, hair)
def test_part_map_agrees_with_a_linear_search(parts: list[Point], place: Point, x: float, y: float, z: float) -> None:
    named: dict[str, Point | None] = {f"part{number}": part for number, part in enumerate(parts)}
    wanted = Point(place.x + x, place.y + y, place.z + z)
    found = [name for name, part in named.items() if part is not None and dist(part, wanted) < SAME_PLACE]
    assert PartMap(named).at(wanted) == (found[0] if found else None)


def test_the_greatest_numbers_are_places_too() -> None:
    far = Point(-2.9e16, -1.7976931348623157e308, 8e-220)
    standing = PartMap({"cube": far})
    assert (standing.at(far), standing.at(CUBE)) == ("cube", None)
    standing.put("cube", TRAY)
    assert (standing.at(far), standing.at(TRAY)) == (None, "cube")
