"""Questions to the person at the machine, and the person who answers them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from itertools import product
from typing import NamedTuple, Protocol

from dmc41x3.i18n import Phrase, phrase
from maya_un.axes import AXES

GO, SKIP, QUIT = "go", "skip", "quit"
"""Answers to the question whether a step may begin."""

YES, NO = "yes", "no"

NOTHING = "nothing"
"""Nothing moved."""

ALREADY = "already"
"""The axis itself presses the switch."""

OPEN, CLOSED = "open", "closed"
"""The jaws of the gripper."""


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


_READY = (GO, SKIP, QUIT)
_SEEN = (*(f"{axis}{sign}" for axis in AXES for sign in "-+"), NOTHING)
_JAWS = (OPEN, CLOSED)
_YES_NO = (YES, NO)

KEY_PARTS: Mapping[str, tuple[str, ...]] = {
    "AXIS": AXES,
    "SIDE": ("reverse", "forward"),
    "OUTPUT": tuple(str(bit) for bit in range(1, 9)),
    "TRY": ("1", "2", "other", "other.1", "other.2", "further"),
}
"""The words in capitals in the keys of `QUESTIONS`, and what stands there: of TRY the number of an attempt with more
torque, the other direction, and a longer way."""

QUESTIONS: Mapping[str, tuple[str, ...]] = {
    "connection.ready": _READY,
    "connection.support": (GO,),
    "stop.ready": _READY,
    "stop.press": (GO,),
    "stop.release": (GO,),
    "limits.ready": _READY,
    "limits.AXIS.SIDE.press": (GO, ALREADY),
    "limits.AXIS.SIDE.release": (GO,),
    "gripper.ready": _READY,
    "gripper.search.ready": _READY,
    "gripper.OUTPUT.set": _JAWS,
    "gripper.OUTPUT.clear": _JAWS,
    "direction.AXIS.ready": _READY,
    "direction.AXIS.TRY.ready": _READY,
    "direction.AXIS.seen": _SEEN,
    "direction.AXIS.TRY.seen": _SEEN,
    "direction.AXIS.lamp": _YES_NO,
    "direction.AXIS.length": (),
    "travel.AXIS.ready": _READY,
    "travel.AXIS.other.ready": _READY,
    "travel.AXIS.length": (),
    "home.ready": _READY,
    "home.free": (GO,),
    "calibration.ready": _READY,
    "configuration.write": _YES_NO,
}
"""The keys of all questions, with their answers; without answers, a number is asked for."""


@cache
def _declared() -> Mapping[str, tuple[str, ...]]:
    """Return the answers of every question by its key, with the words in capitals filled in."""
    found: dict[str, tuple[str, ...]] = {}
    for key, answers in QUESTIONS.items():
        ways = [KEY_PARTS.get(part, (part,)) for part in key.split(".")]
        found |= dict.fromkeys([".".join(way) for way in product(*ways)], answers)
    return found


def is_key(key: str) -> bool:
    """Return whether a question has this key."""
    return key in _declared()


class PossibleAnswer(NamedTuple):
    """An answer that is possible, and its meaning in words."""

    value: str
    words: Phrase


@dataclass(frozen=True, slots=True)
class Question:
    """A question with a stable `key` of `QUESTIONS`, like "direction.b.seen".

    Its `text` says first what will move, and how far.

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

    def __post_init__(self) -> None:
        """Require that the question and its answers are declared; raises `ValueError`."""
        if not is_key(self.key):
            raise ValueError(f"QUESTIONS lacks {self.key}")
        for choice in self.choices:
            if choice.value not in _declared()[self.key]:
                raise ValueError(f"QUESTIONS lacks the answer {choice.value} to {self.key}")


class Person(Protocol):
    """The person at the machine."""

    async def ask(self, question: Question) -> str:
        """Return the answer: the value of a choice, or a number as text."""
        ...

    def begin(self, title: Phrase) -> None:
        """Show that a step begins."""
        ...

    def tell(self, text: Phrase) -> None:
        """Show a sentence."""
        ...


DONE = (PossibleAnswer(GO, phrase("Enter: done")),)
"""The choice after an instruction."""
