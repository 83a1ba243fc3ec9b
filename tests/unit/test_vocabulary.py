"""Every word that events and reports may contain has a text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import get_args

import pytest

from dmc41x3.i18n import LANGUAGES, PHRASE, translate
from maya_un import vocabulary
from maya_un.controller.execution import GUARDED_MOVE
from maya_un.controller.protocol import HOMING_PHASES
from maya_un.errors.requests import JobStateWord
from maya_un.events import DECLARED, LeaseChanged, PhaseBegun, RecordingSaved, StepAdvanced
from maya_un.recorder.recorder import REASONS
from maya_un.schema.jobs import TaskState
from maya_un.vocabulary import PHASES, RECORDING_REASONS, STATES, WORD, worded

TABLES = {name: table for name, table in vars(vocabulary).items() if name.isupper() and isinstance(table, dict)}


@pytest.mark.parametrize(
    ("table", "words"),
    [(STATES, TaskState), (get_args(JobStateWord), TaskState), (RECORDING_REASONS, REASONS)],
    ids=["states", "states in errors", "reasons"],
)
def test_a_closed_vocabulary_has_every_word(table: Iterable[str], words: Iterable[str]) -> None:
    assert sorted(table) == sorted(words)


def test_every_phase_of_a_homing_and_every_motion_has_a_text() -> None:
    assert {*HOMING_PHASES, "move", "follow", "jog", GUARDED_MOVE} <= set(PHASES)


def test_the_end_of_a_right_is_translated_as_a_phrase() -> None:
    told = LeaseChanged("its token was revoked", "", "", implicit=False).sentence("es")
    assert told == f"control: {translate('its token was revoked', 'es', PHRASE)}"


@pytest.mark.parametrize("name", TABLES)
def test_every_text_is_translated_and_differs_from_its_neighbours(name: str) -> None:
    for language in LANGUAGES:
        texts = [translate(text, language, WORD) for text in TABLES[name].values()]
        assert len(set(texts)) == len(texts)
    assert all(translate(text, "es", WORD) != text for text in TABLES[name].values())


def test_a_sentence_has_the_texts_of_its_words() -> None:
    assert PhaseBegun("datum_a").sentence() == "find the switch of axis a"
    assert StepAdvanced(1, 2, "pick cube", "running").sentence("es") == "   2 pick cube: en marcha"
    assert RecordingSaved("estop").sentence("es") == "grabación (parada de emergencia)"


def test_a_word_of_a_newer_program_stays_as_it_is() -> None:
    assert worded(PHASES, "pirouette", "es") == "pirouette"
    assert PhaseBegun("pirouette").sentence("es") == "pirouette"


def test_words_are_named_after_fields_of_their_event() -> None:
    assert all(set(event.words) <= set(event.__dataclass_fields__) for event in DECLARED.values())
