"""Statements: the steps of a job that are no motion. One class declares one statement.

    - wait: 2 s                                       a pause in the job; a plain number is in s
    - set: {output: vacuum, to: on}                   switch a digital output
    - wait_for: {input: part, is: on, within: 10 s}   wait for a digital input; without `within`, for ever
    - ask: "Is the tray full?"                        ask the operator; `{question: …, choices: […]}` names the answers

The job's model, its JSON schema and its text follow from the declaration. An output or an input has a number, or a name
of the configuration (`controller.output_names`, `controller.input_names`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from reprlib import repr
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    SerializerFunctionWrapHandler,
    WithJsonSchema,
    model_serializer,
    model_validator,
)

from dmc41x3.i18n import phrase
from maya_un.config import ControllerConfig
from maya_un.errors import InvalidJob, InvalidValue
from maya_un.quantities import duration_in, share_in
from maya_un.robot.primitives.primitive import PartEffect

LONGEST = 86_400.0
"""Longest wait of one step [s]: a day."""

SLOWEST = 0.01
"""Least share of the speed for a step."""

MOST_CHOICES = 6
"""Most answers to a question: so many buttons stand side by side."""

CONTINUE, CANCEL = "continue", "cancel"
"""The answers to a question without `choices`. The answer `cancel` ends the job."""


def _seconds(value: object) -> float:
    try:
        seconds = duration_in(value, "it")
    except InvalidValue as error:
        raise ValueError(phrase("{reason}, not {value}", reason=error.details["reason"], value=repr(value))) from error
    if not 0.0 < seconds <= LONGEST:
        raise ValueError(phrase("it must be more than 0 s and at most {most:g} s", most=LONGEST))
    return seconds


def _share(value: object) -> float:
    try:
        share = share_in(value, "it")
    except InvalidValue as error:
        raise ValueError(phrase("{reason}, not {value}", reason=error.details["reason"], value=repr(value))) from error
    if not SLOWEST <= share <= 1.0:
        raise ValueError(phrase("it must lie between {least:.0%} and 100%", least=SLOWEST))
    return share


def _level(value: object) -> Literal["on", "off"]:
    """Return on or off; YAML reads both words as booleans."""
    if value is True or value == "on":
        return "on"
    if value is False or value == "off":
        return "off"
    raise ValueError(phrase("it must be on or off, not {value}", value=repr(value)))


def _channel(value: object) -> int | str:
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise ValueError(phrase("it must be a name of the configuration or a number, not {value}", value=repr(value)))  # noqa: TRY004 - pydantic's way
    if isinstance(value, int) and not 1 <= value <= 8:
        raise ValueError(phrase("it must lie between 1 and 8"))
    return value


def _line(text: str) -> str:
    if not text.strip() or not text.isprintable():
        raise ValueError(phrase("it must be a text on one line"))
    return text


def _choice(value: object) -> object:
    """Return a choice; YAML reads yes and no as booleans."""
    return {True: "yes", False: "no"}.get(value, value) if isinstance(value, bool) else value


_POSITIVE = {"type": "number", "exclusiveMinimum": 0, "maximum": LONGEST}
_WITH_UNIT = {"type": "string", "examples": ["2 s", "1.5 min"]}

Seconds = Annotated[float, PlainValidator(_seconds), WithJsonSchema({"anyOf": [_POSITIVE, _WITH_UNIT]})]
"""A duration [s], or a text with a unit."""

Share = Annotated[
    float,
    PlainValidator(_share),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": SLOWEST, "maximum": 1}, {"type": "string", "examples": ["50 %"]}]}
    ),
]
"""A share of the speed: 0.5, or the text "50 %"."""

Level = Annotated[Literal["on", "off"], BeforeValidator(_level), WithJsonSchema({"enum": ["on", "off", True, False]})]
"""The level of an output or an input: on is high."""

Channel = Annotated[
    int | str,
    PlainValidator(_channel),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1, "maximum": 8}, {"type": "string"}]}),
]
"""A digital output or input: its number, or its name in the configuration."""

Text = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_line)]
"""A question."""

Answer = Annotated[str, BeforeValidator(_choice), Field(min_length=1, max_length=30), AfterValidator(_line)]
"""An answer to a question."""


class JobStatement(BaseModel, ABC):
    """A step that is no motion. `command` is its key in a job, `summary` its help.

    `short` is the field that may stand for the whole statement, "" if none may. Time under a pause does not count.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=False)
    command: ClassVar[str]
    summary: ClassVar[str]
    short: ClassVar[str] = ""
    part: ClassVar[PartEffect] = PartEffect.NONE

    @property
    def duration(self) -> float:
        """The predicted duration [s]; a wait for a person or for an input counts as 0."""
        return 0.0

    @property
    def remark(self) -> str:
        """The part of the duration that no prediction contains, in words, "" without one."""
        return ""

    @property
    @abstractmethod
    def words(self) -> str:
        """The statement as a label."""

    @classmethod
    def harmless(cls) -> bool:
        """Return True: doing a statement twice has the same effect as doing it once."""
        return True

    def checked(self, config: ControllerConfig, key: str) -> None:
        """Raise `InvalidJob` at `key` if the configuration lacks an output or input."""

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Return its keys in a job."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())

    @model_validator(mode="before")
    @classmethod
    def _from_short(cls, data: object) -> object:
        return data if isinstance(data, Mapping) or not cls.short else {cls.short: data}

    @model_serializer(mode="wrap")
    def _to_plain(self, serialize: SerializerFunctionWrapHandler) -> Any:
        """Return the statement as it may be written, by its shortest form."""
        if self.model_fields_set == {self.short}:
            return getattr(self, self.short)
        whole = serialize(self)
        given = self.model_fields_set & whole.keys()
        fields = type(self).model_fields.items()
        return {field.alias or name: whole[name] for name, field in fields if name in given}


class Wait(JobStatement):
    """Do nothing for a time."""

    command = "wait"
    summary = "Wait for a time; `2 s`, `1.5 min`, or a number in s."
    short = "seconds"
    seconds: Seconds

    @property
    def duration(self) -> float:
        """The time [s]."""
        return self.seconds

    @property
    def words(self) -> str:
        """The time as text."""
        return f"wait {self.seconds:g} s"


class SetOutput(JobStatement):
    """Switch a digital output that `controller.outputs` of the configuration lists."""

    command = "set"
    summary = "Switch a digital output `to` on or off."
    output: Channel
    to: Level

    @property
    def words(self) -> str:
        """The output and its level."""
        return f"set {self.output} {self.to}"

    def checked(self, config: ControllerConfig, key: str) -> None:
        """Raise `InvalidJob` if jobs may not switch the output."""
        if self.number(config, key) not in config.outputs:
            raise InvalidJob(
                key=f"{key}.output",
                reason=phrase("`controller.outputs` of the configuration lacks output {output}", output=self.output),
            )

    def number(self, config: ControllerConfig, key: str) -> int:
        """Return the number of the output; raises `InvalidJob`."""
        return _number(self.output, config.output_names, f"{key}.output", "controller.output_names")


class WaitFor(JobStatement):
    """Wait until a digital input is on or off."""

    command = "wait_for"
    summary = "Wait until a digital input `is` on or off; `within` a time, else the job fails."
    input: Channel
    level: Level = Field(alias="is")
    within: Seconds | None = None

    @property
    def remark(self) -> str:
        """The remark that no prediction contains the wait."""
        return phrase("the wait for input {input} counts as no time", input=self.input)

    @property
    def words(self) -> str:
        """The input and its level."""
        return f"wait_for {self.input} {self.level}"

    def checked(self, config: ControllerConfig, key: str) -> None:
        """Raise `InvalidJob` for an unknown name."""
        self.number(config, key)

    def number(self, config: ControllerConfig, key: str) -> int:
        """Return the number of the input; raises `InvalidJob`."""
        return _number(self.input, config.input_names, f"{key}.input", "controller.input_names")


class AskOperator(JobStatement):
    """Ask the operator, and wait for an answer; the answer `cancel` ends the job."""

    command = "ask"
    summary = "Ask the operator a question, and wait for one of its `choices`."
    short = "question"
    question: Text
    choices: Annotated[tuple[Answer, ...], Field(min_length=1, max_length=MOST_CHOICES)] = (CONTINUE, CANCEL)

    @property
    def remark(self) -> str:
        """The remark that no prediction contains the wait."""
        return phrase("the wait for an answer counts as no time")

    @property
    def words(self) -> str:
        """The question."""
        return f"ask {self.question}"

    @model_validator(mode="after")
    def _different(self) -> AskOperator:
        if len(set(self.choices)) < len(self.choices):
            raise ValueError(phrase("an answer is named twice"))
        return self


THEN, ELSE = "then", "else"
"""The branches of an `if`."""


ONE_KIND = phrase("it must be an object like {{input: 3, is: on}} or {{answer: yes}}")
"""Why a condition is refused."""


class Condition(JobStatement):
    """The condition of an `if`: the level of a digital input, or the answer to the last question before it."""

    command = "if"
    summary = "Do the steps of `then` if an input `is` on or off, or if the `answer` was given; else those of `else`."
    input: Channel | None = None
    level: Level | None = Field(default=None, alias="is")
    answer: Answer | None = None

    @property
    def remark(self) -> str:
        """The branch of the prediction."""
        if self.input is None:
            return phrase("the prediction takes the branch of the first answer")
        return phrase("the prediction takes the branch of the present input")

    @property
    def words(self) -> str:
        """The condition."""
        return f"if answer {self.answer}" if self.input is None else f"if input {self.input} {self.level}"

    def checked(self, config: ControllerConfig, key: str) -> None:
        """Raise `InvalidJob` for an unknown name."""
        if self.input is not None:
            self.number(config, key)

    def number(self, config: ControllerConfig, key: str) -> int:
        """Return the number of the input; raises `InvalidJob`."""
        assert self.input is not None
        return _number(self.input, config.input_names, f"{key}.input", "controller.input_names")

    @model_validator(mode="after")
    def _one_kind(self) -> Condition:
        given = (self.input is not None, self.level is not None, self.answer is not None)
        if given not in {(True, True, False), (False, False, True)}:
            raise ValueError(ONE_KIND)
        return self


STATEMENTS: dict[str, type[JobStatement]] = {one.command: one for one in (Wait, SetOutput, WaitFor, AskOperator)}
"""The statements by their keys."""


def _number(channel: int | str, names: Sequence[str], key: str, setting: str) -> int:
    if isinstance(channel, int):
        return channel
    if not channel or channel not in names:
        known = ", ".join(name for name in names if name) or phrase("no names")
        raise InvalidJob(
            key=key,
            reason=phrase(
                "`{setting}` of the configuration has no {name!r}; it has {known}",
                setting=setting,
                name=channel,
                known=known,
            ),
        )
    return names.index(channel) + 1
