"""Which mistake explains what was read and seen."""

from __future__ import annotations

from itertools import permutations, product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un import errors
from maya_un.commission import judgement
from maya_un.commission.judgement import SIDES, SWITCHES, Press, Seen, Switch, Trial
from maya_un.errors import MachineError


def press(input_: Switch | None, *, idle: bool = False) -> Press:
    """Return the readings of a press that changes one input; `idle` is the reading of all released switches."""
    before = dict.fromkeys(SWITCHES, idle)
    return Press(before, {one: reading != (one == input_) for one, reading in before.items()})


def presses(
    places: tuple[int, int, int] = (0, 1, 2), exchanged: int | None = None, *, idle: bool = False
) -> dict[Switch, Press]:
    """Return presses of all switches, with axes at other places, and one axis with exchanged switches."""
    found: dict[Switch, Press] = {}
    for axis, side in SWITCHES:
        at = SIDES[side == "reverse"] if axis == exchanged else side
        found[axis, side] = press((places[axis], at), idle=idle)
    return found


@pytest.mark.parametrize(
    ("before", "pressed", "error"),
    [
        (False, True, None),
        (False, False, errors.StopNotConnected),
        (True, False, errors.StopInverted),
        (True, True, errors.StopStuck),
    ],
)
def test_stop_is_judged_by_both_readings(before: bool, pressed: bool, error: type[MachineError] | None) -> None:
    assert type(judgement.stop(before, pressed)) is (error or type(None))


@pytest.mark.parametrize("places", list(permutations(range(3))))
@pytest.mark.parametrize("idle", [False, True])
def test_letters_and_level_are_found_together(places: tuple[int, int, int], idle: bool) -> None:
    verdict = judgement.switches(presses(places, idle=idle), "ABC", -1)
    assert verdict.letters == (None if places == (0, 1, 2) else "".join("ABC"[place] for place in places))
    assert verdict.level == (1 if idle else None)
    kinds = [type(error) for error in verdict.errors]
    wanted = [errors.AxesExchanged] * (places != (0, 1, 2)) + [errors.SwitchLevelsInverted] * idle
    assert kinds == wanted
    assert not verdict.axes


@pytest.mark.parametrize("axis", range(3))
def test_exchanged_switches_are_a_mistake_of_their_axis(axis: int) -> None:
    verdict = judgement.switches(presses(exchanged=axis), "ABC", -1)
    assert [type(error) for error in verdict.errors] == [errors.SwitchesExchanged]
    assert verdict.axes == {axis}


@pytest.mark.parametrize("switch", SWITCHES)
def test_a_switch_that_changes_nothing_is_not_connected(switch: Switch) -> None:
    found = presses() | {switch: press(None)}
    (error,) = judgement.switches(found, "ABC", -1).errors
    assert isinstance(error, errors.SwitchNotConnected)
    assert (error.details["axis"], error.details["side"]) == ("abc"[switch[0]], switch[1])


def test_a_switch_at_another_axis_names_the_input() -> None:
    found = presses()
    found[1, "forward"] = press((2, "reverse"))
    (error,) = judgement.switches(found, "ABC", -1).errors
    assert isinstance(error, errors.SwitchAtOtherInput)
    assert error.details["inputs"] == "c reverse"


def test_a_switch_that_its_axis_presses_is_judged_by_its_reading() -> None:
    active = {one: one == (1, "reverse") for one in SWITCHES}
    found = presses()
    found[1, "reverse"] = Press(active, active, already=True)
    assert judgement.switches(found, "ABC", -1).errors == ()
    inverted = {one: one in {(1, "reverse"), (1, "forward")} for one in SWITCHES}
    found[1, "reverse"], found[1, "forward"] = Press(inverted, inverted, already=True), press((1, "forward"), idle=True)
    assert [type(error) for error in judgement.switches(found, "ABC", -1).errors] == [errors.SwitchInverted]
    found = presses()
    idle = dict.fromkeys(SWITCHES, False)
    found[1, "reverse"] = Press(idle, idle, already=True)
    assert [type(error) for error in judgement.switches(found, "ABC", -1).errors] == [errors.PressedSwitchInactive]


@given(st.integers(0, 2), st.sampled_from((-1, 1)), st.floats(0.1, 2.0), st.booleans(), st.booleans())
def test_direction_follows_from_both_witnesses(axis: int, sign: int, share: float, encoder: bool, motor: bool) -> None:
    """A reversed motor moves the other way; an encoder counts that, or the opposite if it is reversed too."""
    moved = -sign if motor else sign
    own = share * (-moved if encoder else moved)
    counted = (own if axis == 0 else 0.0, own if axis == 1 else 0.0, own if axis == 2 else 0.0)
    error = judgement.direction(Trial(axis, sign, counted, tripped=encoder != motor), Seen(axis, moved))
    wanted = {
        (False, False): type(None),
        (True, False): errors.EncoderReversed,
        (False, True): errors.MotorReversed,
        (True, True): errors.AxisBackwards,
    }
    assert type(error) is wanted[encoder, motor]


@pytest.mark.parametrize(("axis", "other"), [pair for pair in product(range(3), range(3)) if pair[0] != pair[1]])
def test_exchanged_parts_are_told_apart(axis: int, other: int) -> None:
    def counted(*axes: int) -> tuple[float, float, float]:
        a, b, c = (1.0 if one in axes else 0.0 for one in range(3))
        return a, b, c

    seen_own, seen_other = Seen(axis, 1), Seen(other, 1)
    cases = [
        (counted(other), seen_own, errors.EncodersExchanged),
        (counted(), seen_own, errors.EncoderDead),
        (counted(other), seen_other, errors.MotorsExchanged),
        (counted(axis), seen_other, errors.AxesExchanged),
        (counted(axis), None, errors.EncoderWithoutMotion),
    ]
    for counts, seen, kind in cases:
        assert type(judgement.direction(Trial(axis, 1, counts, tripped=True), seen)) is kind
    assert judgement.nothing_moved(Trial(axis, 1, counted(), tripped=True), None)


def test_exchanged_axes_name_the_letters() -> None:
    error = judgement.direction(Trial(0, 1, (1.0, 0.0, 0.0), tripped=False), Seen(2, 1), "CAB")
    assert isinstance(error, errors.AxesExchanged)
    assert error.details["letters"] == "BAC"


@given(st.floats(1e-4, 1.0), st.floats(0.05, 20.0))
def test_scale_is_wrong_outside_its_tolerance(way: float, factor: float) -> None:
    found = judgement.scale_factor(way * factor, way, 0.05)
    if 1.0 / 1.049 < factor < 1.049:
        assert found is None
    elif not 1.0 / 1.051 < factor < 1.051:
        assert found == pytest.approx(factor)
