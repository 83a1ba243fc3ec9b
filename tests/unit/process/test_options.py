from __future__ import annotations

import pytest

from maya_un.errors import InvalidRequest, InvalidValue
from maya_un.process.journal.protocol import JobOptions
from maya_un.process.queue.editing import DEFAULT_OPTIONS, checked_options, read_options
from maya_un.schema.choices import OnFailure


def test_missing_option_keeps_its_value() -> None:
    old = JobOptions(priority=3, notes="night", retries=1)
    assert read_options({"priority": 5, "depends_on": [4, 2, 4]}, old) == JobOptions(
        priority=5, notes="night", retries=1, depends_on=(4, 2)
    )
    assert read_options({}) == DEFAULT_OPTIONS
    assert read_options({"on_failure": "pause", "stepwise": True, "held": True}) == JobOptions(
        on_failure=OnFailure.PAUSE, stepwise=True, held=True
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("priority", 101),
        ("priority", -101),
        ("priority", True),
        ("priority", "high"),
        ("held", 1),
        ("depends_on", "12"),
        ("depends_on", [0]),
        ("depends_on", [1.5]),
        ("depends_on", list(range(1, 102))),
        ("notes", 7),
        ("notes", "n" * 1001),
        ("notes", "night\0"),
        ("on_failure", "cry"),
        ("retries", 11),
        ("retries", -1),
        ("stepwise", None),
    ],
)
def test_value_out_of_range_is_refused_by_name(key: str, value: object) -> None:
    with pytest.raises(InvalidValue, match=key):
        read_options({key: value})


def test_another_key_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="colour"):
        read_options({"colour": "red"})


def test_old_notes_longer_than_new_ones_may_be_are_kept() -> None:
    old = JobOptions(notes="n" * 2000)
    assert read_options({"priority": 5}, old) == JobOptions(priority=5, notes=old.notes)


def test_a_refused_item_of_a_list_is_named() -> None:
    with pytest.raises(InvalidValue) as refused:
        read_options({"depends_on": [3, 1.5]})
    assert refused.value.details == {"key": "depends_on.1", "value": "1.5", "reason": "it must be a whole number"}


def test_options_made_by_hand_are_checked_too() -> None:
    assert checked_options(DEFAULT_OPTIONS) == DEFAULT_OPTIONS
    with pytest.raises(InvalidValue, match="priority"):
        checked_options(JobOptions(priority=1000))
