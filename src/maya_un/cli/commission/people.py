"""People who answer the questions of a commissioning: a person at the terminal, or a file of answers."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

from dmc41x3.i18n import Phrase, marked, phrase, translate, translate_phrase
from maya_un.cli import output
from maya_un.cli.questions import LineReader
from maya_un.cli.settings import OutputSettings
from maya_un.commission.questions import QUESTIONS, QUIT, Person, PossibleAnswer, Question, QuestionKind, is_key
from maya_un.config.files import text_of
from maya_un.errors import FileUnreadable, InvalidValue, UnknownName


def answers_of(file: str) -> Mapping[str, str]:
    """Return the answers of a TOML file by the keys of the questions; raises `FileUnreadable` and `UnknownName`."""
    try:
        found = tomllib.loads(text_of(Path(file)))
    except ValueError as error:
        raise FileUnreadable(path=file, reason=phrase("it is not TOML: {error}", error=error)) from error
    answers = dict(_flat(found))
    for key in answers:
        if not is_key(key):
            raise UnknownName(name=key, known=", ".join(QUESTIONS))
    return answers


def _flat(table: Mapping[str, object], before: str = "") -> list[tuple[str, str]]:
    pairs: list[tuple[str, str]] = []
    for key, value in table.items():
        name = f"{before}.{key}" if before else key
        pairs += _flat(value, name) if isinstance(value, Mapping) else [(name, str(value))]
    return pairs


def valid(question: Question, answer: str) -> bool:
    """Return whether an answer is one of the choices or, if the question has none, a number from 0 to below 1e6."""
    if question.choices:
        return any(choice.value == answer for choice in question.choices)
    try:
        return 0.0 <= float(answer) < 1e6
    except ValueError:
        return False


class TerminalPerson:
    """A person at the terminal."""

    def __init__(self, settings: OutputSettings) -> None:
        self._settings = settings
        self._lines = LineReader()

    async def ask(self, question: Question) -> str:
        """Print a question, and read lines until one is an answer; the end of the input quits.

        A line that was typed at a terminal before the question showed is no answer.
        """
        language = self._settings.language
        keys = _keys(question.choices)
        self._say(translate_phrase(question.text, language))
        shown = [translate_phrase(choice.words, language) for choice in question.choices]
        numbered = [text if ": " in text else f"{key}: {text}" for key, text in zip(keys, shown, strict=True)]
        while True:
            self._lines.discard_typed()
            if numbered:
                self._say(f"  [{' | '.join(numbered)}]")
            line = await self._lines.line()
            if line is None:
                return QUIT
            word = line.strip().lower()
            answer = keys.get(word, word)
            if valid(question, answer):
                return answer
            if word in {"q", "quit"}:
                return QUIT
            self._say(translate(marked("This is not an answer. Enter it again."), language))

    def begin(self, title: Phrase) -> None:
        """Print the title of a step."""
        self._say(f"--- {translate_phrase(title, self._settings.language)}")

    def tell(self, text: Phrase) -> None:
        """Print a sentence."""
        self._say(translate_phrase(text, self._settings.language))

    def _say(self, text: str) -> None:
        if self._settings.json:
            print(text, file=sys.stderr, flush=True)
        else:
            output.say(text)


def _keys(choices: tuple[PossibleAnswer, ...]) -> dict[str, str]:
    """Return the answers by what a person types: the letter before the colon, "" for Enter, else a number."""
    found: dict[str, str] = {}
    for number, choice in enumerate(choices, 1):
        key, colon, _ = choice.words.partition(":")
        typed = str(number) if not colon else "" if key == "Enter" else key
        found[typed] = choice.value
    return found


class ScriptedPerson:
    """Answers from a file first, and from another person else; prints everything.

    With `ready`, somebody at the terminal says whether a step may begin.
    """

    def __init__(
        self, answers: Mapping[str, str], other: Person, shown: TerminalPerson, *, ready: bool = False
    ) -> None:
        self._answers = answers
        self._other = other
        self._shown = shown
        self._ready = ready

    async def ask(self, question: Question) -> str:
        """Return the answer; raises `InvalidValue`."""
        own = await self._other.ask(question)
        if self._ready and question.ask in {QuestionKind.READY, QuestionKind.CONFIRM}:
            return await self._shown.ask(question)
        answer = self._answers.get(question.key, own)
        if not valid(question, answer):
            known = ", ".join(choice.value for choice in question.choices) or "a number"
            raise InvalidValue(
                key=question.key, value=answer, reason=phrase("it must be one of {choices}", choices=known)
            )
        self._shown.tell(question.text)
        self._shown.tell(f"  > {answer}")
        return answer

    def begin(self, title: Phrase) -> None:
        """Print the title of a step."""
        self._shown.begin(title)

    def tell(self, text: Phrase) -> None:
        """Print a sentence."""
        self._shown.tell(text)
