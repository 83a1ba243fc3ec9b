"""Events: facts in order, numbered from 1, never dropped and never merged.

State is different (`values.State`, the latest value). A late reader requests missed events by number. Memory holds the
newest events. A reader that is too slow gets an error, and delays no other. A journal may hold older ones.

An event is declared once, as a class below, and emitted as an instance: `events.emit(SpeedChanged(0.5))`. Its word in
JSON and on /maya_event, its sentence, its level in the log and the generated files follow from the declaration.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from string import Formatter
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar, cast

from dmc41x3.i18n import translate
from maya_un.errors import EventsForgotten, translated
from maya_un.vocabulary import (
    LEASE_CHANGES,
    LEVELS,
    PHASES,
    RECORDING_REASONS,
    STATES,
    STORAGE_STATES,
    Vocabulary,
    worded,
)

KEPT = 20_000
"""Number of the newest events in memory; up to an eighth more may be present."""

DECLARED: dict[str, type[Event]] = {}
"""Every declared event by its word, in the order of the declarations."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """One fact. `seq` counts from 1 without gaps; `time` is the event loop's [s]; `code` is 0 or an error's.

    A subclass with a `word` declares an event; one with fields is a frozen dataclass. The fields are the details of the
    event. Details that are None are left out of JSON. `en` is a sentence over the fields; for a field in `words` it
    shows the text of the word. A field `message` is the sentence of an error. `more` holds undeclared details that
    another program sent.
    """

    word: ClassVar[str] = ""
    en: ClassVar[str] = ""
    narrated: ClassVar[bool] = False
    level: ClassVar[int] = logging.INFO
    words: ClassVar[Mapping[str, Vocabulary]] = {}

    seq: int = 0
    time: float = 0.0
    code: int = 0
    more: Mapping[str, object] = field(default_factory=dict[str, object])

    def __init_subclass__(
        cls,
        *,
        word: str = "",
        en: str = "",
        narrated: bool = False,
        level: int = logging.INFO,
        words: Mapping[str, Vocabulary] | None = None,
    ) -> None:
        """Declare an event: its word, its sentence, whether the command line narrates it, and its level in the log.

        `words` are the vocabularies of its fields.
        """
        if word:
            cls.word, cls.en, cls.narrated, cls.level, cls.words = word, en, narrated, level, words or {}
            DECLARED[word] = cls

    @property
    def kind(self) -> str:
        """The word of this event."""
        return self.word

    @property
    def detail(self) -> Mapping[str, object]:
        """The details in the form of JSON."""
        own = {name: value for name, value in vars(self).items() if name not in _ENVELOPE and value is not None}
        return MappingProxyType({**own, **self.more})

    @classmethod
    def template(cls, language: str = "en") -> str:
        """Return the sentence in `language` ("en" or "es") with placeholders for the details."""
        return translate(cls.en, language)

    def sentence(self, language: str = "en") -> str:
        """Return what happened as a sentence, without code and message."""
        if not self.en:
            return str(self)
        try:
            return self.template(language).format_map({**self.detail, **self._worded(language)})
        except (LookupError, ValueError, TypeError, AttributeError):  # a newer program has other details
            return str(self)

    def narration(self, language: str = "en") -> str | None:
        """Return the line for the command line: sentence, code, message; None for an event that is not narrated."""
        if not self.narrated:
            return None
        text = f"{self.sentence(language)} ({self.code})" if self.code else self.sentence(language)
        return f"{text} {self._message(language)}".rstrip()

    def report(self, language: str = "en") -> str:
        """Return the event without its code: the sentence, the details that it leaves out, the message."""
        said = self.sentence(language)
        if said == str(self):
            return said
        shown = {name for _, name, _, _ in Formatter().parse(self.en)} | {"message"}
        rest = " ".join(f"{key}={value}" for key, value in self.detail.items() if key not in shown)
        return "  ".join(part for part in (said.strip(), rest, self._message(language)) if part)

    def _worded(self, language: str) -> dict[str, str]:
        """Return the texts of the details that are words."""
        return {
            name: worded(vocabulary, word, language)
            for name, vocabulary in self.words.items()
            if isinstance(word := self.detail.get(name), str)
        }

    def _message(self, language: str) -> str:
        return translated(self.code, str(self.detail.get("message", "")), language)

    def __str__(self) -> str:
        words = " ".join(f"{key}={value}" for key, value in self.detail.items())
        return f"{self.kind} {words}".rstrip()


_ENVELOPE = {one.name for one in fields(Event)}


@dataclass(frozen=True)
class UnknownEvent(Event):
    """An event that is not declared here, for example of a newer program; `more` has all of its details."""

    name: str

    @property
    def kind(self) -> str:
        """The word of the received event."""
        return self.name

    @property
    def detail(self) -> Mapping[str, object]:
        """The details."""
        return MappingProxyType(dict(self.more))


def event_of(kind: str, detail: Mapping[str, object], code: int = 0, *, seq: int = 0, time: float = 0.0) -> Event:
    """Return the event of JSON data; an undeclared one, or one without a required field, is an `UnknownEvent`."""
    declared = DECLARED.get(kind)
    if declared is not None:
        names = {one.name for one in fields(declared)} - _ENVELOPE
        own = {name: value for name, value in detail.items() if name in names}
        more = {name: value for name, value in detail.items() if name not in names}
        try:
            return cast("Any", declared)(**own, seq=seq, time=time, code=code, more=more)
        except TypeError:
            pass  # a field is missing
    return UnknownEvent(kind, seq=seq, time=time, code=code, more=detail)


class ControllerEvent(Event):
    """Something that happens to the machine; it is published on /maya_event."""


@dataclass(frozen=True)
class Trouble(ControllerEvent):
    """Something that ends motion. `message` is the sentence of the error; None if only the mode is known."""

    message: str | None = None


@dataclass(frozen=True)
class Connected(ControllerEvent, word="connected", en="connected to {address}"):
    """The controller answers at `address`. `firmware` is its version; None over a graph, which does not transmit it."""

    address: str
    firmware: str | None = None


class Disconnected(Trouble, word="disconnected", en="disconnected", narrated=True, level=logging.WARNING):
    """The link to the controller is lost, or the node of the controller is gone."""


class HomingNeeded(ControllerEvent, word="not_homed", en="not homed"):
    """The position is unknown: it was never measured, or it was lost."""


class HomingBegun(ControllerEvent, word="homing", en="homing"):
    """A homing begins."""


class HomingDone(ControllerEvent, word="homed", en="homed", narrated=True):
    """The position is known: a homing has ended, or an earlier one was adopted."""


@dataclass(frozen=True)
class DatumGiven(ControllerEvent, word="datum_given", en="{by} gave the datum {joints}", narrated=True):
    """A person has stated the joints a [rad], b and c [m] of the robot. `by` is the person."""

    by: str
    joints: str


@dataclass(frozen=True)
class DatumConfirmed(ControllerEvent, word="datum_confirmed", en="{by} confirmed the datum", narrated=True):
    """A second point agrees with the datum that a person gave. `by` is the person who stated the second point."""

    by: str


@dataclass(frozen=True)
class MotionBegun(ControllerEvent, word="moving", en="moving", level=logging.DEBUG):
    """A motion begins. `to` is its end as text: a [rad], b and c [m]; None if only the mode is known."""

    to: str | None = None


class MotionEnded(ControllerEvent, word="idle", en="at rest", level=logging.DEBUG):
    """A motion has reached its end."""


@dataclass(frozen=True)
class MotionStopped(ControllerEvent, word="stopped", en="stopped", narrated=True):
    """The robot was stopped. `message` is the reason if the stop was not requested here."""

    message: str | None = None


class MotionPaused(ControllerEvent, word="paused", en="paused", narrated=True):
    """All motion brakes on its path and is held."""


class MotionResumed(ControllerEvent, word="resumed", en="resumed", narrated=True):
    """Motion continues after a pause."""


@dataclass(frozen=True)
class SpeedChanged(ControllerEvent, word="speed", en="speed {ratio:.0%}", narrated=True):
    """The speed of all motion was changed. `ratio` is its factor, from 0.01 to 1."""

    ratio: float


@dataclass(frozen=True)
class ZonesChanged(ControllerEvent, word="zones", en="zones: {names}"):
    """The zones that the robot avoids were changed. `names` has all of them, separated by commas."""

    names: str


@dataclass(frozen=True)
class PlacesChanged(Event, word="places", en="taught places changed: {name}"):
    """The pose or pallet `name` was taught or removed, or got this name."""

    name: str


class GripperOpened(ControllerEvent, word="gripper_open", en="gripper open", narrated=True):
    """The gripper has opened."""


class GripperClosed(ControllerEvent, word="gripper_closed", en="gripper closed", narrated=True):
    """The gripper has closed."""


@dataclass(frozen=True)
class OutputSet(ControllerEvent, word="output_on", en="output {number} on", narrated=True):
    """A digital output of the controller was switched on. `number` is 1 to 8."""

    number: int


@dataclass(frozen=True)
class OutputCleared(ControllerEvent, word="output_off", en="output {number} off", narrated=True):
    """A digital output of the controller was switched off. `number` is 1 to 8."""

    number: int


class LimitHit(Trouble, word="limit", en="limit switch hit", narrated=True, level=logging.WARNING):
    """An axis met a limit switch. A user must recover."""


class FaultEntered(Trouble, word="fault", en="fault", narrated=True, level=logging.ERROR):
    """Motion ended with another fault. A user must recover."""


class EmergencyStopped(Trouble, word="estop", en="emergency stop", narrated=True, level=logging.ERROR):
    """The abort input stopped the robot, as the emergency stop does. A user must recover."""


class FaultCleared(ControllerEvent, word="recovered", en="recovered", narrated=True):
    """A user has cleared the fault."""


@dataclass(frozen=True)
class PhaseBegun(Event, word="phase", en="{name}", narrated=True, level=logging.DEBUG, words={"name": PHASES}):
    """The phase `name` of a homing or of a primitive begins. `primitive` is None for a homing."""

    name: str
    primitive: str | None = None


@dataclass(frozen=True)
class JobAdvanced(Event, word="job", en="job {job}, {name}: {state}", words={"state": STATES}):
    """A job enters a state. `job` is its number, `name` its name, `owner` the user who owns it."""

    job: int
    name: str
    state: str
    owner: str


@dataclass(frozen=True)
class StepAdvanced(Event, word="step", en="{index:>4} {step}: {state}", narrated=True, words={"state": STATES}):
    """A step of job number `job` enters a state. `index` counts from 1; `step` is its label, such as `pick cube`.

    `attempt` is the number of the attempt that follows a failed one, from 2; None for the first.
    """

    job: int
    index: int
    step: str
    state: str
    attempt: int | None = None

    def narration(self, language: str = "en") -> str | None:
        """Return the line of the command line; None for a step that is only queued."""
        return None if self.state == "queued" else super().narration(language)


@dataclass(frozen=True)
class InputAwaited(
    Event, word="input_wait", en="waiting until input {input} is {state}", narrated=True, words={"state": LEVELS}
):
    """Step `index` of job number `job` waits until the digital `input` (1 to 8) is in `state`, on or off."""

    job: int
    index: int
    input: int
    state: str


@dataclass(frozen=True)
class QuestionAsked(Event, word="question", en="question: {question} ({choices})", narrated=True):
    """Step `index` of job number `job` asks the operator a `question`. `choices` are the answers, separated by /."""

    job: int
    index: int
    question: str
    choices: str


@dataclass(frozen=True)
class QuestionAnswered(Event, word="answer", en="answer: {answer}", narrated=True):
    """The question of step `index` of job number `job` has this `answer`."""

    job: int
    index: int
    answer: str


@dataclass(frozen=True)
class QueueChanged(Event, word="queue", en="queue {state}", words={"state": STATES}):
    """The queue starts jobs again (`state` running) or starts none (paused), for `reason`, by the user `by`."""

    state: str
    reason: str
    by: str


@dataclass(frozen=True)
class LeaseChanged(Event, word="lease", en="lease {change}", words={"change": LEASE_CHANGES}):
    """The control lease changed: `change` names how (taken, released, expired …).

    `holder` has it now, "" without a holder. `source` is the origin of the holder's requests. `implicit`: a command
    took the lease without a request for it. `before` held it until now. For an offer or a request, `by` made it; `to`
    gets the offer.
    """

    change: str
    holder: str
    source: str
    implicit: bool
    before: str | None = None
    to: str | None = None
    by: str | None = None


@dataclass(frozen=True)
class StorageChanged(
    Event, word="storage", en="storage of the queue: {state}", level=logging.ERROR, words={"state": STORAGE_STATES}
):
    """The journal cannot be written (`state` failing, with the `reason`), or can be written again (working)."""

    state: str
    reason: str | None = None


@dataclass(frozen=True)
class RecordingSaved(Event, word="recording", en="recording ({reason})", words={"reason": RECORDING_REASONS}):
    """A recording was saved because of `reason`: its `name` and size (`bytes`).

    If it failed, `message` is the reason.
    """

    reason: str
    message: str | None = None
    name: str | None = None
    bytes: int | None = None


Listener = Callable[[Event], None]
"""Called with every event, before any other task continues."""

E = TypeVar("E", bound=Event)


class EventLog:
    """Numbers events, stores the newest `kept` in order, passes every one of them to every reader.

    `clock` returns the time of an event [s], normally the event loop's `time`. `run` is the number of this start of the
    program, which distinguishes its events from those of another run.
    """

    def __init__(self, clock: Callable[[], float], kept: int = KEPT) -> None:
        self._clock = clock
        self._kept = kept
        self._events: list[Event] = []
        self._forgotten = 0
        self._waiting: set[asyncio.Future[None]] = set()
        self._listeners: list[Listener] = []
        self.run = 1

    def __len__(self) -> int:
        return self._forgotten + len(self._events)

    @property
    def last(self) -> Event | None:
        """The newest event, None before the first."""
        return self._events[-1] if self._events else None

    @property
    def oldest(self) -> int:
        """Number of the oldest event in memory; before the first event, the number that it will have."""
        return self._forgotten + 1

    def emit(self, event: E) -> E:
        """Add a fact and pass it to every listener and reader; returns it with its number and time."""
        event = replace(event, seq=len(self) + 1, time=self._clock())
        self._events.append(event)
        if len(self._events) > self._kept + self._kept // 8:
            self._forget()
        for waiting in self._waiting:
            if not waiting.done():
                waiting.set_result(None)
        for listener in tuple(self._listeners):
            listener(event)
        return event

    def since(self, seq: int) -> list[Event]:
        """Return all events numbered above `seq`; raises `EventsForgotten` if the first of them was dropped."""
        if max(0, seq) < self._forgotten:
            raise EventsForgotten(since=seq, oldest=self.oldest)
        return self._events[max(0, seq) - self._forgotten :]

    def heard_by(self, listener: Listener) -> None:
        """Call `listener` with every event from now on, before any other task continues."""
        self._listeners.append(listener)

    @contextmanager
    def listening(self, listener: Listener) -> Iterator[None]:
        """Call `listener` with every event while the block runs, before any other task continues."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    async def follow(self, seq: int = 0) -> AsyncGenerator[Event]:
        """Yield every event numbered above `seq`, stored ones first, then new ones as they come.

        Raises `EventsForgotten` for a reader that is too late or too slow.
        """
        while True:
            news = self.since(seq)
            for event in news:
                yield event
            seq = news[-1].seq if news else seq
            if len(self) <= seq:
                await self._next()

    async def _next(self) -> None:
        waiting: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.add(waiting)
        try:
            await waiting
        finally:
            self._waiting.discard(waiting)

    def _forget(self) -> None:
        """Drop the oldest, many at a time, so that the cost of an event is independent of their number."""
        dropped = len(self._events) - self._kept
        del self._events[:dropped]
        self._forgotten += dropped
