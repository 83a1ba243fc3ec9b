"""Recovery of an interrupted job: no assumption about a gripper that a person has to inspect."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import AnswerNeeded, InvalidValue
from maya_un.process.queue.recovery import RecoveryDecision, RecoverySituation, choices, decide
from maya_un.schema.choices import RecoveryChoice
from maya_un.schema.jobs import TRANSITIONS, TaskState

COMMANDS = ("home", "pick", "place", "approach", "line", "gripper", "move")

situations = st.builds(
    RecoverySituation,
    st.sampled_from(("", *COMMANDS)),
    st.lists(st.sampled_from(COMMANDS), max_size=4).map(tuple),
    st.sampled_from((False, None)),
)
answers = st.sampled_from((True, False, None))

DONE, QUEUED, SKIPPED, CANCELLED = TaskState.DONE, TaskState.QUEUED, TaskState.SKIPPED, TaskState.CANCELLED


@pytest.mark.parametrize(
    ("command", "choice", "holding", "step"),
    [
        ("pick", "resume", True, DONE),
        ("pick", "resume", False, QUEUED),
        ("place", "resume", True, QUEUED),
        ("place", "resume", False, DONE),
        ("pick", "redo", False, QUEUED),
        ("place", "redo", True, QUEUED),
        ("pick", "skip", True, SKIPPED),
        ("place", "abort", None, CANCELLED),
        ("home", "resume", True, QUEUED),
        ("line", "resume", False, QUEUED),
        ("gripper", "resume", None, QUEUED),
        ("", "resume", True, None),
        ("", "abort", None, None),
    ],
)
def test_choice_does_its_action(command: str, choice: str, holding: bool | None, step: TaskState | None) -> None:
    found = decide(RecoverySituation(command, (), None), choice, holding)
    assert (found.step, found.goes_on) == (step, choice != "abort")


@pytest.mark.parametrize(
    ("command", "rest", "choice", "seen", "needed"),
    [
        ("pick", (), "resume", None, True),
        ("pick", (), "resume", False, False),  # an open gripper holds nothing, so the pick is done again
        ("place", (), "resume", False, True),  # an open gripper does not tell where the part went
        ("place", (), "redo", False, False),
        ("place", (), "skip", None, False),
        ("move", ("place",), "resume", None, True),
        ("move", ("gripper", "place"), "resume", None, False),
        ("move", ("line", "home"), "redo", None, False),
        ("", ("place",), "resume", None, True),
        ("pick", ("place",), "skip", None, True),
        ("pick", ("place",), "abort", None, False),
    ],
)
def test_question_is_asked_only_for_relevant_facts(
    command: str, rest: tuple[str, ...], choice: str, seen: bool | None, needed: bool
) -> None:
    situation = RecoverySituation(command, rest, seen)
    offered = {one.name: one.needs_answer for one in choices(situation)}
    assert offered[choice] is needed
    if needed:
        with pytest.raises(AnswerNeeded, match="Does the gripper hold a part"):
            decide(situation, choice, None)
    else:
        decide(situation, choice, None)


@given(situations, st.sampled_from(("resume", "redo", "skip", "abort")), answers)
def test_every_decision_follows_the_table_and_the_known_facts(
    situation: RecoverySituation, choice: str, holding: bool | None
) -> None:
    offered = {one.name: one for one in choices(situation)}
    try:
        found = decide(situation, choice, holding)
    except AnswerNeeded:
        assert holding is None
        assert offered[choice].needs_answer
        return
    except InvalidValue as refused:
        contradicts = bool(holding) and situation.holding is False
        assert choice not in offered or (contradicts and refused.details["key"] == "holding")
        return
    assert choice in offered
    assert (found.step is None) is (situation.command == "")
    assert found.step is None or found.step in TRANSITIONS[TaskState.INTERRUPTED]
    assert found.goes_on is (choice != "abort")
    assert found.holding == (situation.holding if holding is None else holding)
    if found.step is DONE:
        assert situation.command in {"pick", "place"}
        assert found.holding is (situation.command == "pick")
        assert holding is not None


@given(situations)
def test_without_an_answer_nothing_counts_as_done(situation: RecoverySituation) -> None:
    for choice in choices(situation):
        if not choice.needs_answer:
            assert decide(situation, choice.name, None).step is not DONE


@given(situations)
def test_every_choice_has_a_description(situation: RecoverySituation) -> None:
    offered = choices(situation)
    assert [one.name for one in offered if one.name in {"resume", "abort"}] == ["resume", "abort"]
    assert all(one.meaning for one in offered)


def test_invalid_choice_is_refused_with_the_valid_ones() -> None:
    with pytest.raises(InvalidValue, match="resume, abort") as refused:
        decide(RecoverySituation("", (), None), RecoveryChoice.REDO, None)
    assert refused.value.details["value"] == "'redo'"


def test_contradiction_of_the_machine_is_reported() -> None:
    with pytest.raises(InvalidValue, match="the gripper is open"):
        decide(RecoverySituation("place", (), False), "redo", True)
    assert decide(RecoverySituation("place", (), None), "redo", True) == RecoveryDecision(
        QUEUED, goes_on=True, holding=True
    )
