"""Questions to the person at the machine, and the person who answers them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, Protocol

from dmc41x3.i18n import Phrase, phrase

GO, SKIP, QUIT = "go", "skip", "quit"
"""Answers to the question whether a step may begin."""

YES, NO = "yes", "no"

NOTHING = "nothing"
"""Nothing moved."""

ALREADY = "already"
"""The axis itself presses the switch."""


class QuestionKind(StrEnum):
    """The kinds of questions."""

    READY = "ready"
    PRESS_SWITCH = "press_switch"
    RELEASE_SWITCH = "release_switch"
    PRESS_STOP = "press_stop"
    RELEASE_STOP = "release_stop"
    SEEN = "seen"
    LENGTH = "length"
    GRIPPER = "gripper"
    LAMP = "lamp"
    SUPPORT = "support"
    FREE = "free"
    CONFIRM = "confirm"


class PossibleAnswer(NamedTuple):
    """An answer that is possible, and its meaning in words."""

    value: str
    words: Phrase


@dataclass(frozen=True, slots=True)
class Question:
    """A question with a stable `key`, like "direction.b.seen"; its `text` says first what will move, and how far.

    `axis` (0 to 2) and `side` name the part that it is about. Without `choices`, the answer is a number. `most` is how
    far each axis (0 to 2) can move at most from now to the next question [rad, m, m], also if the wiring is wrong; an
    axis that it lacks does not move.
    """

    key: str
    ask: QuestionKind
    text: Phrase
    choices: tuple[PossibleAnswer, ...] = ()
    axis: int | None = None
    side: str = ""
    most: Mapping[int, float] = field(default_factory=dict[int, float])


class Person(Protocol):
    """The person at the machine."""

    async def ask(self, question: Question) -> str:
        """Return the answer: the value of a choice, or a number as text."""
        ...

    def tell(self, text: Phrase) -> None:
        """Show a sentence."""
        ...


DONE = (PossibleAnswer(GO, phrase("Enter: done")),)
"""The choice after an instruction."""
