from __future__ import annotations

import json
import re
from dataclasses import fields

import pytest
from maya_ui.resources import resource
from maya_ui.robot import Command
from maya_ui.words import WORDS, happened, phrase, sentence, word

from maya_un.errors import Busy, InvalidRequest, InvalidValue, Unreachable, by_code
from maya_un.events import DECLARED, ControllerEvent, Event
from maya_un.schema.jobs import PauseReason
from maya_un.values import Mode


def names(text: str) -> set[str]:
    return set(re.findall(r"\{(\w+)", text))


def test_words_have_both_languages_with_the_same_fields() -> None:
    for key, (english, spanish) in WORDS.items():
        assert english, key
        assert spanish, key
        assert names(english) == names(spanish), key


def test_every_mode_and_every_command_has_words() -> None:
    assert {f"mode_{mode.value}" for mode in Mode} <= WORDS.keys()
    assert {f"command_{command.value}" for command in Command} <= WORDS.keys()


def test_every_reason_of_a_paused_queue_has_words() -> None:
    start = "queue_reason_"
    assert {key.removeprefix(start) for key in WORDS if key.startswith(start)} == set(PauseReason)


@pytest.mark.parametrize("event", [event for event in DECLARED.values() if issubclass(event, ControllerEvent)])
def test_every_event_on_the_graph_has_a_sentence_in_both_languages(event: type[Event]) -> None:
    detail = {one.name: 0.5 if one.type == "float" else "x" for one in fields(event)}
    said = [happened(event.word, detail, language) for language in ("en", "es")]
    assert [text for text, _ in said] == [event.template(language).format(**detail) for language in ("en", "es")]


def test_an_event_shows_only_the_details_that_its_sentence_leaves_out() -> None:
    assert happened("speed", {"ratio": 0.5, "by": "ana"}, "es") == ("velocidad 50%", {"by": "ana"})
    assert happened("speed", {"by": "ana"}) == ("speed", {"by": "ana"})
    assert happened("gone_fishing", {"till": 5}, "es") == ("gone fishing", {"till": 5})
    assert happened("refused", {}, "es") == ("rechazado", {})


def test_stop_queue_mentions_that_waiting_jobs_are_cancelled() -> None:
    assert "cancel all jobs in the robot's queue, running and waiting" in word("stop_queue_hint", "en")
    assert "cancelar todos los trabajos de la cola del robot, en curso y en espera" in word("stop_queue_hint", "es")


def test_value_of_another_version_is_shown_readably() -> None:
    assert phrase("event_gone_fishing", "es") == "gone fishing"
    assert word("busy", "fr") == word("busy", "en")


def test_error_sentence_is_translated_with_its_details() -> None:
    error = Busy(doing="pick")
    assert sentence("2104", str(error), "es") == error.text("es")
    assert sentence("2104", str(error), "en") == str(error)
    invalid = InvalidValue(key="point", value="2", reason="it must be a number between -10000 and 10000")
    assert sentence("4001", str(invalid), "es") == invalid.text("es")
    far = Unreachable(target="(3, 3, 0.4)", reason="it is too far", nearest="(1, 1, 0.4)")
    assert sentence("2101", str(far), "es") == far.text("es")


@pytest.mark.parametrize("filler", ["b", "x: y.", "(0.1, 0.2)", "", "a\nb"])
def test_every_sentence_has_a_spanish_translation(filler: str) -> None:
    for code, leaf in by_code().items():
        english, spanish = (re.sub(r"\{\w+[^}]*\}", lambda _: filler, leaf.template(lang)) for lang in ("en", "es"))
        said = sentence(str(code), english, "es")
        assert said != english
        if filler == "b":
            assert said == spanish


def test_unknown_sentence_is_shown_unchanged() -> None:
    assert sentence("2104", "Something else.", "es") == "Something else."
    assert sentence("", "plain words", "es") == "plain words"
    assert sentence("9999", "plain words", "es") == "plain words"


def test_phrases_in_errors_are_those_of_the_service() -> None:
    phrases = json.loads(resource("phrases.json").read_text(encoding="utf-8"))
    assert phrases
    for english in phrases:
        error = InvalidRequest(key="a", reason=re.sub(r"\{\w+\}", "7", english))
        assert sentence("4005", str(error), "es") == error.text("es")


def test_unknown_reason_stays_in_the_sentence() -> None:
    assert sentence("4005", "The request has an error at a: new.", "es") == "La petición tiene un error en a: new."
