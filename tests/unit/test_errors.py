"""Errors: a code that stays, details that stay readable by machines, words in two languages."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.i18n import LANGUAGES
from maya_un import errors
from maya_un.errors import InvalidConfig, MachineError, MayaError, NotHomed, RequestError, Unreachable
from maya_un.process.queue.recovery import QUESTION

PUBLISHED = {
    "link": [1001, 1002, 1003, 1004, 1005, 1006, 1007, 1010, 1020, 1021],
    "motion": [*range(2101, 2109), 2201, 2202, *range(2301, 2309), *range(2401, 2405)],
    "work-piece": [3001, 3002],
    "request": list(range(4001, 4009)),
    "house": [5001, 5002, 5003, 5004, 5999],
}
"""Codes that somebody outside may have written down: more may come, none of these may go or change its branch."""

MACHINE = {1001, 1002, 1003, 1004, 1005, 1006, 1007, *range(2301, 2309), *range(2401, 2405), 5999}

LEAVES = list(errors.by_code().values())

REFUSAL = {"key": "a", "value": 1, "reason": "it is too small"}


def details(leaf: type[MayaError]) -> dict[str, object]:
    return {name: f"<{name} of the case>" for name, required in leaf.declared.items() if required}


def test_published_codes_stay_and_keep_their_branch() -> None:
    for code in (code for family in PUBLISHED.values() for code in family):
        assert issubclass(errors.by_code()[code], MachineError if code in MACHINE else RequestError), code


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_detail_appears_in_the_sentence(language: str) -> None:
    for leaf in LEAVES:
        given_details = details(leaf)
        said = leaf(**given_details).text(language)
        assert [detail for detail in given_details.values() if str(detail) not in said] == [], leaf
        assert "{" not in said


def test_the_two_languages_differ() -> None:
    assert [leaf for leaf in LEAVES if len({leaf.template(language) for language in LANGUAGES}) < len(LANGUAGES)] == []


def test_an_error_says_its_sentence_and_keeps_its_details() -> None:
    error = Unreachable(target="(3, 0, 1) m", reason="too far", nearest="(2, 0, 1) m")
    assert str(error) == "(3, 0, 1) m cannot be reached: too far. The nearest reachable point is: (2, 0, 1) m."
    assert (error.code, list(error.details)) == (2101, ["target", "reason", "nearest"])


def test_error_is_in_spanish_on_request() -> None:
    assert NotHomed(command="maya home").text("es").endswith("Ejecute primero `maya home`.")


def test_a_language_we_lack_reads_as_english() -> None:
    assert NotHomed(command="maya home").text("fr") == str(NotHomed(command="maya home"))


def test_a_detail_that_a_peer_left_out_does_not_hide_the_error() -> None:
    error = errors.from_notice(InvalidConfig.code, {"key": "axes.a", "of": "a newer version"})
    assert (
        str(error)
        == "The configuration has an error at axes.a = <value>: <reason>. Correct it, then run `maya config check`."
    )
    assert error.details == {"key": "axes.a", "of": "a newer version"}


@pytest.mark.parametrize(
    ("details", "complaint"),
    [({"key": "a", "value": 1}, "lacks the detail reason"), ({**REFUSAL, "why": ""}, "has no detail why")],
)
@pytest.mark.parametrize("kind", [InvalidConfig])
def test_an_error_with_other_details_than_declared_cannot_be_made(
    kind: type[MayaError], details: dict[str, object], complaint: str
) -> None:
    with pytest.raises(TypeError, match=complaint):
        kind(**details)


def test_a_code_cannot_be_declared_twice() -> None:
    with pytest.raises(TypeError, match="Another has the code 2103 of NotHomed"):
        type("Another", (RequestError,), {}, code=NotHomed.code, en="Something else.")
    assert errors.by_code()[NotHomed.code] is NotHomed


def test_details_are_attributes_and_missing_ones_are_none() -> None:
    error = Unreachable(target="(3, 0, 1) m", reason="too far", nearest="none")
    assert (error.target, error.zone) == ("(3, 0, 1) m", None)
    assert "zone" not in error.details


def test_no_detail_hides_a_part_of_the_base_class() -> None:
    assert [(leaf, name) for leaf in LEAVES for name in leaf.declared if hasattr(MayaError, name)] == []


def test_errors_cross_into_another_process() -> None:
    for leaf in LEAVES:
        for one in (leaf(**details(leaf)), errors.from_sentence(leaf.code, "Only words.")):
            again = pickle.loads(pickle.dumps(one))
            assert (type(again), str(again)) == (leaf, str(one))
            assert (again.details, again.verbatim) == (one.details, one.verbatim)


def test_a_copy_has_other_details_and_no_traceback() -> None:
    error = InvalidConfig(key="a", value=1, reason="it is too small")
    try:
        raise error
    except InvalidConfig:
        copy = error.copy(key="--a")
    assert (copy.details, copy.__traceback__) == ({"key": "--a", "value": 1, "reason": "it is too small"}, None)


@given(st.text())
def test_a_detail_is_shown_and_never_read_as_a_format(detail: str) -> None:
    assert f"({detail})" in str(errors.LinkLost(address="{0} {address.__class__}", reason=detail))


def test_an_edge_rebuilds_the_same_error_from_code_and_details() -> None:
    for leaf in LEAVES:
        error = leaf(**details(leaf))
        again = errors.from_notice(error.code, error.details)
        assert (type(again), str(again), again.details) == (leaf, str(error), error.details)


def test_interface_shows_the_text_of_an_error_without_its_details() -> None:
    error = errors.from_sentence(2111, "Maya cannot pause now: nothing moves. To stop the robot, run `maya stop`.")
    again = errors.from_notice(error.code, error.details, str(error))
    assert (type(again), str(again)) == (errors.CannotPause, str(error))
    paused = errors.from_notice(errors.NotPaused.code, {}, "in English")
    assert (str(paused), paused.verbatim) == (str(errors.NotPaused()), False)


def test_a_code_that_is_not_in_the_tree_is_not_rebuilt() -> None:
    with pytest.raises(KeyError):
        errors.from_notice(1, {})


@pytest.mark.parametrize("branch", [MayaError, RequestError, MachineError])
def test_only_leaves_are_raised(branch: type[MayaError]) -> None:
    with pytest.raises(TypeError, match="branch of the tree"):
        branch(reason="no leaf")


def test_an_error_that_came_in_words_keeps_them_in_every_language() -> None:
    error = errors.from_sentence(2101, "La posición está fuera del alcance.")
    assert isinstance(error, errors.Unreachable)
    assert str(error) == error.text("en") == error.text("es") == "La posición está fuera del alcance."
    assert error.details == {}


def test_the_english_sentence_of_a_peer_is_translated() -> None:
    for leaf in LEAVES:
        error = leaf(**{name: f"<{name}>" for name in details(leaf)})
        words = errors.from_sentence(leaf.code, str(error))
        assert words.text("es") == error.text("es")
        assert words.text("en") == str(error)


@pytest.mark.parametrize(
    ("error", "spanish"),
    [
        (errors.NotFound(what="job", number=7), "No existe el trabajo 7."),
        (errors.NotFound(what="interrupted job", number="now"), "No existe ningún trabajo interrumpido ahora."),
        (
            errors.WrongState(number=7, state="running", action="moved"),
            "El trabajo 7 está en marcha. En este estado no es posible moverlo.",
        ),
        (errors.from_notice(4004, {"what": "cosa", "number": "job"}), "No existe cosa job."),
    ],
)
def test_details_that_are_words_of_ours_are_translated_and_no_others(error: MayaError, spanish: str) -> None:
    assert error.text("es") == spanish
    assert "trabajo" not in str(error)


def test_questions_to_a_person_are_in_spanish() -> None:
    error = errors.AnswerNeeded(question=QUESTION, options="")
    assert "¿La pinza sujeta una pieza?" in error.text("es")
    assert QUESTION in str(error)
