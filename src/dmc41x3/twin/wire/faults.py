"""Faults on demand: the table of faults of a virtual controller, and disturbances of its bytes.

The command line, the helpers for tests and the documentation show `TABLE`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite
from random import Random
from typing import NamedTuple, Protocol, TypeAlias

from dmc41x3.errors import InvalidValue, UnknownName
from dmc41x3.i18n import marked, phrase
from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import Handle


class Disturbance:
    """The disturbances of the connections; by default there are none. Probabilities are per reply.

    `latency` and `jitter` [s] delay the data of the controller, `drop` loses it, `duplicate` sends it twice, `garbage`
    puts `noise` random bytes before it. `balk` is the probability that a command is refused without being executed.
    Handles in `silent` neither receive nor send. While `refusing` is true, connections are refused.
    """

    def __init__(self, seed: int = 0) -> None:
        self.random = Random(seed)
        self.latency = 0.0
        self.jitter = 0.0
        self.drop = 0.0
        self.duplicate = 0.0
        self.garbage = 0.0
        self.noise = 8
        self.balk = 0.0
        self.refusing = False
        self.silent: set[Handle] = set()

    @property
    def clear(self) -> bool:
        """Whether the data of the controller arrive unchanged and at once."""
        return not (self.latency or self.jitter or self.drop or self.duplicate or self.garbage or self.silent)

    def delay(self) -> float:
        """Return the delay of the next reply [s]."""
        return self.latency + (self.random.uniform(0.0, self.jitter) if self.jitter else 0.0)

    def outgoing(self, data: bytes) -> list[bytes]:
        """Return the pieces that arrive for a reply: none, the reply, the reply twice, random bytes before it."""
        if self.drop and self.random.random() < self.drop:
            return []
        pieces = [data]
        if self.duplicate and self.random.random() < self.duplicate:
            pieces.append(data)
        if self.garbage and self.random.random() < self.garbage:
            pieces.insert(0, self.random.randbytes(self.noise))
        return pieces

    def balks(self) -> bool:
        """Return whether the next command is refused."""
        return self.balk > 0.0 and self.random.random() < self.balk


Value: TypeAlias = float | int | bool | str
Values: TypeAlias = Mapping[str, Value]

_LONGEST = 3600.0
_OVERCURRENT = 1 << 24
_WORDS = {"true": True, "on": True, "1": True, "false": False, "off": False, "0": False}


class Timer(Protocol):
    """A scheduled action that can be cancelled."""

    def cancel(self) -> None:
        """Cancel the action."""
        ...


class FaultTarget(Protocol):
    """The target of a fault: a virtual controller with its connections."""

    def time(self) -> float:
        """Return the time of its loop [s]."""
        ...

    def later(self, seconds: float, act: Callable[[], None]) -> Timer:
        """Call `act` after `seconds` [s]."""
        ...

    @property
    def wire(self) -> Disturbance:
        """The disturbances of its connections."""
        ...

    @property
    def machine(self) -> VirtualDmc:
        """Its machine, advanced to the present time."""
        ...

    def look(self) -> None:
        """Send the output that the fault causes."""
        ...

    def cut(self, letters: str) -> None:
        """Cut connections."""
        ...

    def silence(self, letters: str) -> None:
        """Make connections silent."""
        ...

    def unsilence(self, letters: str) -> None:
        """Make silent connections work again."""
        ...

    def reset(self) -> None:
        """Reset the controller."""
        ...

    def power(self, on: bool) -> None:
        """Switch the controller's supply."""
        ...


class Parameter(NamedTuple):
    """One parameter of a fault: its default has its type, `unit` is empty for a plain number or word.

    A number lies between `minimum` and `maximum`; a word is one of `choices`, if there are any. Faults that differ in a
    parameter that `selects` can be active together; otherwise a new fault replaces the old one.
    """

    name: str
    default: Value
    unit: str
    words: str
    minimum: float = 0.0
    maximum: float = 1.0
    choices: tuple[str, ...] = ()
    selects: bool = False

    def read(self, value: Value) -> Value:
        """Return a value of this parameter, given as it is or as text; raises `InvalidValue`."""
        if isinstance(self.default, str):
            return self._word(str(value))
        if isinstance(self.default, bool):
            found = _WORDS.get(str(value).lower())
            if found is None:
                raise InvalidValue(key=self.name, value=value, reason="it must be true or false")
            return found
        return self._number(value)

    def _word(self, text: str) -> str:
        if self.choices and text not in self.choices:
            reason = phrase("it must be one of {choices}", choices=", ".join(self.choices))
            raise InvalidValue(key=self.name, value=text, reason=reason)
        if self.name == "handles" and (not text or not set(text) <= set(LETTERS)):
            raise InvalidValue(key=self.name, value=text, reason="it must be letters of handles, A to H")
        return text

    def _number(self, value: Value) -> float | int:
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):  # it may come from any JSON
            number = float("nan")
        whole = isinstance(self.default, int)
        if not isfinite(number) or not self.minimum <= number <= self.maximum or (whole and number % 1):
            limits = f"{self.maximum:g} {self.unit}".rstrip()
            reason = (
                phrase("it must be a whole number from {least:g} to {most}", least=self.minimum, most=limits)
                if whole
                else phrase("it must be a number from {least:g} to {most}", least=self.minimum, most=limits)
            )
            raise InvalidValue(key=self.name, value=value, reason=reason)
        return int(number) if whole else number


class Fault(NamedTuple):
    """One kind of fault. Without `end` it ends immediately.

    `duration` names the parameter that is the default duration [s].
    """

    name: str
    words: str
    parameters: tuple[Parameter, ...]
    begin: Callable[[FaultTarget, Values], None]
    end: Callable[[FaultTarget, Values], None] | None = None
    duration: str = ""

    def read(self, given: Values) -> dict[str, Value]:
        """Return all parameters, the `given` ones and defaults; raises `UnknownName` and `InvalidValue`."""
        known = {parameter.name for parameter in self.parameters}
        for name in given:
            if name not in known:
                raise UnknownName(name=name, known=", ".join(sorted(known)) or "no parameters")
        return {p.name: p.read(given.get(p.name, p.default)) for p in self.parameters}


def find(name: str) -> Fault:
    """Return a kind of fault by its name; raises `UnknownName`."""
    for fault in TABLE:
        if fault.name == name:
            return fault
    raise UnknownName(name=name, known=", ".join(fault.name for fault in TABLE))


def _axis(victim: FaultTarget, values: Values) -> int:
    """Return the axis that a fault names; raises `InvalidValue` if the controller has no such axis."""
    letters = victim.machine.unit.letters
    letter = str(values["axis"])
    if letter not in letters:
        reason = phrase("this controller has the axes {letters}", letters=letters)
        raise InvalidValue(key="axis", value=letter, reason=reason)
    return letters.index(letter)


def _set_wire(names: Mapping[str, str], victim: FaultTarget, values: Values) -> None:
    """Set attributes of the wire to the values of their parameters."""
    for attribute, parameter in names.items():
        setattr(victim.wire, attribute, values[parameter])


def _mend_wire(names: Mapping[str, str], victim: FaultTarget, _: Values) -> None:
    for attribute in names:
        setattr(victim.wire, attribute, getattr(_GOOD, attribute))


_GOOD = Disturbance()


def _refuse(refusing: bool, victim: FaultTarget, _: Values) -> None:
    victim.wire.refusing = refusing


def _cut(victim: FaultTarget, values: Values) -> None:
    victim.cut(str(values["handles"]))


def _silence(victim: FaultTarget, values: Values) -> None:
    victim.silence(str(values["handles"]))


def _unsilence(victim: FaultTarget, values: Values) -> None:
    victim.unsilence(str(values["handles"]))


def _reset(victim: FaultTarget, _: Values) -> None:
    victim.reset()


def _power(on: bool, victim: FaultTarget, _: Values) -> None:
    victim.power(on)


def _stick(victim: FaultTarget, values: Values) -> None:
    axis, machine = _axis(victim, values), victim.machine
    level = bool(values["active"]) == (machine.unit.core.cn[0] == 1)
    _force(machine, axis, str(values["side"]), level)


def _unstick(victim: FaultTarget, values: Values) -> None:
    _force(victim.machine, _axis(victim, values), str(values["side"]), None)


def _force(machine: VirtualDmc, axis: int, side: str, level: bool | None) -> None:
    plant = machine.unit.core.plant
    if side == "forward":
        plant.force_inputs(axis, forward=level)
    else:
        plant.force_inputs(axis, reverse=level)
    machine.look()


def _encoder(failed: bool, victim: FaultTarget, values: Values) -> None:
    machine = victim.machine
    machine.unit.core.plant.fail_encoder(_axis(victim, values), failed)
    machine.look()


def _abort(active: bool, victim: FaultTarget, _: Values) -> None:
    victim.machine.abort_input(active)


def _amplifier(victim: FaultTarget, values: Values) -> None:
    victim.machine.amplifier_fault(int(values["status"]))


def _amplifier_well(victim: FaultTarget, _: Values) -> None:
    victim.machine.amplifier_fault(0)


def _on_wire(name: str, words: str, parameters: tuple[Parameter, ...], attributes: Mapping[str, str]) -> Fault:
    return Fault(name, words, parameters, partial(_set_wire, attributes), partial(_mend_wire, attributes))


def _chance(words: str) -> Parameter:
    return Parameter("probability", 0.1, "", words)


_HANDLES = Parameter("handles", LETTERS, "", marked("letters of the handles concerned"), selects=True)
_AXIS = Parameter("axis", "A", "", marked("letter of the axis"), choices=tuple(LETTERS), selects=True)

TABLE: tuple[Fault, ...] = (
    _on_wire(
        "latency",
        marked("Data from the controller arrives late."),
        (
            Parameter("seconds", 0.05, "s", marked("delay"), maximum=60.0),
            Parameter("jitter", 0.0, "s", marked("largest additional random delay; the order stays"), maximum=60.0),
        ),
        {"latency": "seconds", "jitter": "jitter"},
    ),
    _on_wire(
        "drop",
        marked("A reply, message or record is lost."),
        (_chance(marked("probability for each reply, message or record")),),
        {"drop": "probability"},
    ),
    _on_wire(
        "duplicate",
        marked("A reply, message or record arrives twice."),
        (_chance(marked("probability for each reply, message or record")),),
        {"duplicate": "probability"},
    ),
    _on_wire(
        "garbage",
        marked("Random bytes arrive before a reply, message or record."),
        (
            _chance(marked("probability for each reply, message or record")),
            Parameter("bytes", 8, "", marked("number of bytes"), 1.0, 450.0),
        ),
        {"garbage": "probability", "noise": "bytes"},
    ),
    _on_wire(
        "refuse_commands",
        marked("The controller answers a command with ? (code 1) and does not execute it."),
        (_chance(marked("probability for each command")),),
        {"balk": "probability"},
    ),
    Fault(
        "half_open",
        marked(
            "Connections fall silent: neither side receives data or learns that the connection ended. If the "
            "controller sends on such a TCP handle, it closes the handle after the retries of IA (error 123)."
        ),
        (_HANDLES,),
        _silence,
        _unsilence,
    ),
    Fault("cut", marked("Connections end abruptly; both sides learn of it at once."), (_HANDLES,), _cut),
    Fault(
        "refuse_connections",
        marked("The controller refuses new connections; existing ones continue."),
        (),
        partial(_refuse, True),
        partial(_refuse, False),
    ),
    Fault(
        "reset",
        marked("The controller resets, as after a dip of its supply: unburned data is lost, and all connections end."),
        (),
        _reset,
    ),
    Fault(
        "power_cycle",
        marked(
            "The power supply of the controller goes off and on again: motors and outputs go off, unburned data is "
            "lost, all connections are dead, and no client can connect until the power is back."
        ),
        (Parameter("outage", 0.0, "s", marked("time without power"), maximum=_LONGEST),),
        partial(_power, False),
        partial(_power, True),
        duration="outage",
    ),
    Fault(
        "stuck_limit",
        marked("A limit switch has the same state at every position of the axis."),
        (
            _AXIS,
            Parameter("side", "forward", "", marked("the limit switch"), choices=("forward", "reverse"), selects=True),
            Parameter("active", True, "", marked("state of the switch: always active, or never")),
        ),
        _stick,
        _unstick,
    ),
    Fault(
        "encoder_loss",
        marked("The encoder of an axis stops counting."),
        (_AXIS,),
        partial(_encoder, True),
        partial(_encoder, False),
    ),
    Fault(
        "abort_input",
        marked("The abort input is active: the emergency stop is pressed."),
        (),
        partial(_abort, True),
        partial(_abort, False),
    ),
    Fault(
        "amplifier_fault",
        marked("The amplifiers report a fault."),
        (
            Parameter(
                "status",
                _OVERCURRENT,
                "",
                marked("bits as in the data record, 16777216 for overcurrent"),
                1.0,
                4294967295.0,
            ),
        ),
        _amplifier,
        _amplifier_well,
    ),
)
"""Every kind of fault."""
