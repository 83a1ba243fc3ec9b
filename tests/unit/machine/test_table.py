"""Parts, and the gripper that takes and leaves them."""

from __future__ import annotations

import pytest

from maya_un.machine.log import PartDrop, PartTable

CUP = (0.5, 1.2, 0.4)


def table(**others: tuple[float, float, float]) -> PartTable:
    return PartTable({"cup": CUP, **others}, closed=False)


def test_closing_near_a_part_takes_it_to_the_middle_of_the_gripper() -> None:
    jaws = table()
    assert jaws.close((0.505, 1.195, 0.408)) == "cup"
    assert jaws.carried == "cup"
    assert jaws.places((0.7, 1.0, 0.608))["cup"] == pytest.approx((0.7, 1.0, 0.6))


@pytest.mark.parametrize("place", [(0.516, 1.2, 0.4), (0.5, 1.2, 0.416), (0.51, 1.21, 0.41)])
def test_closing_too_far_away_takes_nothing(place: tuple[float, float, float]) -> None:
    jaws = table()
    assert jaws.close(place) is None
    assert jaws.closed
    assert jaws.places(place)["cup"] == CUP


def test_the_nearest_of_two_is_taken() -> None:
    assert table(nut=(0.51, 1.2, 0.4)).close((0.508, 1.2, 0.4)) == "nut"


def test_closed_gripper_takes_nothing_more() -> None:
    jaws = table()
    jaws.close((0.0, 1.0, 1.0))
    assert jaws.close(CUP) is None


def test_opening_places_a_part_at_the_gripper() -> None:
    jaws = table()
    jaws.close((0.5, 1.2, 0.41))
    assert jaws.open((1.0, 0.5, 0.414), time=3.0) is None
    assert jaws.places((0.0, 0.0, 2.0))["cup"] == (1.0, 0.5, 0.4)
    assert not jaws.closed


def test_opening_high_up_drops_it() -> None:
    jaws = table()
    jaws.close(CUP)
    assert jaws.open((1.0, 0.5, 0.9), time=3.0) == PartDrop(3.0, "cup", 0.5, (1.0, 0.5, 0.4))


def test_opening_an_empty_gripper_drops_nothing() -> None:
    assert table().open(CUP, time=0.0) is None


def test_names_are_given_once() -> None:
    with pytest.raises(ValueError, match="cup"):
        table().add("cup", (0.0, 0.0, 0.0))
