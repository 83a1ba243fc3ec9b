"""Errors are complete in Spanish: their sentences, and the phrases that stand in them."""

from __future__ import annotations

import pickle
import re
from collections.abc import Iterator
from string import Formatter

import pytest
from babel.messages.pofile import read_po
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.i18n import PHRASE, translate_phrase
from maya_un import errors
from maya_un.errors import MayaError
from tests.conventions.source import ROOT

SAME = {"delta (Δ)", "gripper_height (Φ)", "variables", "terminal", "n: no", "{value:.1f} mm", "error {code}: {text}"}
"""Phrases that read the same in both languages."""

ENGLISH = re.compile(r"\b(the|is|are|it|its|must|of|and|not|with|from|which|there|has|have|this|that|be|an|to)\b")
QUOTED = re.compile(r"`[^`]*`|\{[^{}]*\}|\{\{.*\}\}|--[\w-]+|\b[\w.]+_[\w.]+\b|\bALT [^ ]*")
"""Parts of a text that are the same in every language: code, details, options and keys."""


def catalogue() -> dict[str, str]:
    found: dict[str, str] = {}
    for package in ("dmc41x3", "maya_un"):
        file = ROOT / "src" / package / "locale" / "es" / "LC_MESSAGES" / f"{package}.po"
        with file.open("rb") as opened:
            found |= {str(one.id): str(one.string) for one in read_po(opened) if one.id and one.context == PHRASE}
    return found


PHRASES = catalogue()


def values(template: str) -> dict[str, object]:
    """Return a value for each placeholder: a number if it is formatted, else a text that is no phrase."""
    fields = [(name, form) for _, name, form, _ in Formatter().parse(template) if name is not None]
    numbers = {"d": 25, "f": 2.5, "g": 2.5, "%": 0.25}
    return {name: numbers.get((form or "-")[-1], f"<{name}>") for name, form in fields}


def filled(template: str, like: str = "") -> str:
    return template.format(**values(like or template))


def phrase_details(kind: type[MayaError]) -> list[str]:
    """Return the details that are translated if they hold a phrase."""
    given = {name: f"<{name}>" for name, required in kind.declared.items() if required}
    phrase = "it must be a text"
    return [name for name in given if phrase not in kind.rebuilt({**given, name: phrase}).text("es")]


DETAILS = {kind: phrase_details(kind) for kind in errors.by_code().values()}


def test_reasons_and_remedies_are_phrases() -> None:
    named = {(kind, name) for kind in DETAILS for name in kind.declared if name in {"reason", "remedy"}}
    assert named
    assert [one for one in named if one[1] not in DETAILS[one[0]]] == []


def test_a_phrase_is_found_by_its_text() -> None:
    for template, spanish in PHRASES.items():
        assert translate_phrase(filled(template), "es") == filled(spanish, template)
        assert translate_phrase(filled(template), "en") == filled(template)


def test_phrases_in_every_error_are_spanish() -> None:
    for kind, details in DETAILS.items():
        given = {name: f"<{name}>" for name, required in kind.declared.items() if required}
        some = list(PHRASES.items())[kind.code % 10 :: 10]
        for name in details:
            sentence = kind.rebuilt({**given, name: "<here>"}).text("es")
            for english, spanish in some:
                error = kind.rebuilt({**given, name: filled(english)})
                assert error.text("es") == sentence.replace("<here>", filled(spanish, english)), (kind, name)


def test_a_phrase_in_another_one_is_spanish() -> None:
    for template, text in PHRASES.items():
        english, spanish = filled(template), filled(text, template)
        assert translate_phrase(f"grid: {english}", "es") == f"grid: {spanish}"
        assert translate_phrase(f"it is no recording: {english}", "es") == f"no es una grabación: {spanish}"
        error = errors.GuardBlocked(reason=f"the two together are too much ({english})")
        assert error.text("es") == errors.GuardBlocked.template("es").format(
            reason=f"los dos juntos son demasiado ({spanish})"
        )


@pytest.mark.parametrize("template", ["it must be a text", "it has more than {most} bytes"])
def test_a_phrase_is_spanish_after_the_error_crossed_processes(template: str) -> None:
    error = errors.InvalidRequest(key="body", reason=filled(template))
    wanted = f"La petición tiene un error en body: {filled(PHRASES[template], template)}."
    assert pickle.loads(pickle.dumps(error)).text("es") == wanted
    assert errors.from_notice(error.code, error.details).text("es") == wanted
    assert errors.from_sentence(error.code, str(error)).text("es") == wanted
    assert errors.translated(error.code, str(error), "es") == wanted


def every_error() -> Iterator[MayaError]:
    """Yield an error of each kind, with its name in place of each detail."""
    for kind in errors.by_code().values():
        yield kind.rebuilt({name: f"<{name}>" for name, required in kind.declared.items() if required})


def test_a_sentence_is_found_by_its_text_and_a_spanish_one_stays() -> None:
    for error in every_error():
        assert translate_phrase(error.text("en"), "es") == error.text("es")
        assert translate_phrase(error.text("es"), "es") == error.text("es")


def test_the_sentence_of_an_error_in_another_one_is_spanish() -> None:
    for error in every_error():
        outer = errors.Faulted(fault=str(error))
        assert outer.text("es") == errors.Faulted.template("es").format(fault=error.text("es"))
        cut = errors.InvalidProcess(key="pick", reason=str(error).rstrip("."))
        assert cut.text("es") == errors.InvalidProcess.template("es").format(
            key="pick", reason=error.text("es").rstrip(".")
        )


def test_spanish_texts_hold_no_english() -> None:
    assert {text for text in PHRASES if PHRASES[text] == text} == SAME
    english = [text for text in PHRASES.values() if ENGLISH.search(QUOTED.sub(" ", text))]
    assert english == []


@given(st.text() | st.lists(st.sampled_from(sorted(PHRASES)), min_size=1).map(": ".join))
def test_any_text_is_translated_or_stays(text: str) -> None:
    assert translate_phrase(text, "en") == text
    assert isinstance(translate_phrase(text, "es"), str)
