from __future__ import annotations

from itertools import product

import pytest

from maya_un.schema.jobs import TRANSITIONS, TaskState, advance


def test_every_state_is_in_the_table_and_can_be_reached() -> None:
    assert set(TRANSITIONS) == set(TaskState)
    assert frozenset().union(*TRANSITIONS.values()) == set(TaskState)


def test_the_table_is_obeyed() -> None:
    for old, new in product(TaskState, TaskState):
        if new in TRANSITIONS[old]:
            assert advance(old, new) is new
        else:
            with pytest.raises(ValueError, match="cannot follow"):
                advance(old, new)


def test_ended_state_is_final() -> None:
    assert {state for state in TaskState if state.ended} == {
        TaskState.DONE,
        TaskState.FAILED,
        TaskState.CANCELLED,
        TaskState.SKIPPED,
    }
