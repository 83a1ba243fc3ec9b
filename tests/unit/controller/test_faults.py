from __future__ import annotations

from itertools import permutations

import pytest

from dmc41x3.language.codes import STOP_TEXTS
from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller import state_builder
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    EndNotReached,
    FollowingError,
    LimitReached,
    MayaError,
    MotorOff,
    Stopped,
    UnexpectedStop,
)
from maya_un.events import EmergencyStopped, Event, FaultEntered, LimitHit, MotionStopped
from tests.unit.controller.bench import record_of

ORDER = (0, 1, 2)
WELL = AxisRecord(stop_code=101)
OFF = AxisRecord(stop_code=101, status=AxisStatus.MOTOR_OFF)


def ended(*codes: int, amplifier_status: int = 0) -> DataRecord:
    return record_of(*(AxisRecord(stop_code=code) for code in codes), amplifier_status=amplifier_status)


NAMED: dict[int, type[MayaError] | None] = {
    **dict.fromkeys(STOP_TEXTS, UnexpectedStop),
    **dict.fromkeys((0, 1, 100, 101), None),
    2: LimitReached,
    3: LimitReached,
    4: Stopped,
    6: AbortInput,
    8: FollowingError,
    15: AmplifierFault,
    250: UnexpectedStop,
}


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_every_stop_code_has_its_error(axis: int) -> None:
    for code, error in NAMED.items():
        codes = [101, 101, 101]
        codes[axis] = code
        found = state_builder.cause(ended(*codes), ORDER, (0, 1, 2))
        assert (None if found is None else type(found)) == error, code
        if error is not None:
            assert found is not None
            assert found.details.get("axis", "abc"[axis]) == "abc"[axis]


def test_unexpected_code_is_reported_with_its_meaning() -> None:
    found = state_builder.cause(ended(101, 12, 101), ORDER, (0, 1, 2))
    assert found is not None
    assert found.details == {"axis": "b", "stop_code": 12, "reason": STOP_TEXTS[12]}


BY_GRAVITY = [(6, AbortInput), (15, AmplifierFault), (8, FollowingError), (2, LimitReached), (3, LimitReached)]


@pytest.mark.parametrize("places", list(permutations(range(3))))
@pytest.mark.parametrize("first", range(len(BY_GRAVITY)))
def test_the_gravest_cause_wins_wherever_it_stands(first: int, places: tuple[int, ...]) -> None:
    code, error = BY_GRAVITY[first]
    lesser = [*(code for code, _ in BY_GRAVITY[first + 1 :]), 4, 101]
    codes = [code, *lesser[:2]]
    record = ended(*(codes[place] for place in places))
    assert type(state_builder.grave(record, ORDER)) is error
    assert type(state_builder.cause(record, ORDER, (0, 1, 2))) is error


@pytest.mark.parametrize("code", [7, 11, 12, 16, 99])
def test_stopped_partner_axes_do_not_hide_the_cause(code: int) -> None:
    for codes in ((4, 4, code), (4, code, 4), (code, 4, 4)):
        assert type(state_builder.cause(ended(*codes), ORDER, (0, 1, 2))) is UnexpectedStop


def test_a_motor_that_is_off_is_not_hidden_by_partners_that_were_stopped() -> None:
    found = state_builder.cause(record_of(AxisRecord(stop_code=4), OFF, WELL), ORDER, (0, 1, 2))
    assert type(found) is MotorOff
    assert found.details == {"axis": "b"}


def test_limits_name_axis_and_side() -> None:
    for code, side in ((2, "forward"), (3, "reverse")):
        found = state_builder.grave(ended(4, 4, code), ORDER)
        assert found is not None
        assert found.details == {"axis": "c", "side": side}


def test_amplifier_fault_is_found_without_a_stop_code() -> None:
    found = state_builder.grave(ended(101, 101, 101, amplifier_status=1 << 24), ORDER)
    assert type(found) is AmplifierFault
    assert found.details == {"status": "0x01000000"}


def test_axes_outside_the_motion_are_ignored() -> None:
    record = ended(8, 101, 101)
    assert state_builder.grave(record, ORDER, (1, 2)) is None
    assert state_builder.cause(record, ORDER, (1, 2)) is None
    assert state_builder.cause(record_of(OFF, WELL, WELL), ORDER, (1, 2)) is None


def test_axes_are_named_as_maya_does_wherever_they_are_wired() -> None:
    config = parse({"axes": {"a": {"letter": "B"}, "b": {"letter": "C"}, "c": {"letter": "A"}}})
    assert state_builder.indices(Config()) == (0, 1, 2)
    order = state_builder.indices(config)
    assert order == (1, 2, 0)
    found = state_builder.grave(ended(2, 101, 101), order)
    assert found is not None
    assert found.details["axis"] == "c"


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (LimitReached(axis="b", side="forward"), LimitHit),
        (AbortInput(), EmergencyStopped),
        (Stopped(), MotionStopped),
        (FollowingError(axis="a"), FaultEntered),
        (AmplifierFault(status="0x1"), FaultEntered),
        (EndNotReached(axis="a", distance="3 counts"), FaultEntered),
    ],
)
def test_how_an_error_is_announced(error: MayaError, kind: type[Event]) -> None:
    assert state_builder.kind(error) is kind
