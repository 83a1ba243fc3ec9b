"""The state of a DMC-41x3 besides its motion: variables, outputs, formats, handles, peripherals.

Settings of devices that this unit does not have (a second serial port, Modbus) are stored and reported like all others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.numbers import format_raw, format_value, join_positions
from dmc41x3.twin import registers
from dmc41x3.twin.memory import ArrayRecorder, Arrays, Memory
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.gearing import Cam, Gearing
from dmc41x3.twin.motion.monitors import Failures, Latches
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.network import Handle, Handles, Network, OutputBuffer, RecordEmitter
from dmc41x3.twin.plant import Plant
from dmc41x3.twin.program import Program, Threads

ANALOG_INPUTS = 8
PLUS_MINUS_TEN = 2
"""AQ: an analog input reads -10 to 10 V."""

LOCKED_COMMANDS = frozenset({"DL", "ED", "LS", "TR", "UL"})
"""Commands that are refused while the program is locked."""


@dataclass(slots=True)
class Peripherals:
    """Settings: AQ, MW, ME, US, CI and CC, the masks and handle of EI, and the lock of the program."""

    analog_ranges: list[int] = field(default_factory=lambda: [PLUS_MINUS_TEN] * ANALOG_INPUTS)
    modbus_waits: int = 1
    modbus_writes: int = 0
    ports_swapped: int = 0
    communication_interrupt: int = 0
    event_settings: list[int] = field(default_factory=lambda: [0, 0, -1])
    password: str = ""
    locked: bool = False


class Activity(Protocol):
    """A part of the controller with its own schedule; the machine never advances past its next event.

    Times are seconds of the machine's clock.
    """

    @property
    def active(self) -> bool:
        """Whether it has anything to do, now or later; if not, the machine skips it. Only a command changes that."""
        ...

    @property
    def watching(self) -> bool:
        """Whether it must see events of axes at once, even before its own next event."""
        ...

    def next_event(self) -> float:
        """Return when it must be called next [s], infinity for never."""
        ...

    def look(self, now: float) -> None:
        """Do what is due at `now` [s]. Called after every event, its own or another's, and after every command.

        During this call the motion core's `happened` contains the events of axes; it is cleared afterwards.
        """
        ...

    def reset(self) -> None:
        """Reset to the state of power-up."""
        ...


MOST_VARIABLES = 510


class Format(NamedTuple):
    """Format of printed numbers: digits before and after the point, or hexadecimal."""

    before: int
    after: int
    hexadecimal: bool = False

    @property
    def code(self) -> float:
        """The number that sets this format, 10.4 for ten and four digits."""
        return (-1 if self.hexadecimal else 1) * (self.before + self.after / 10)


class ControllerIdentity(NamedTuple):
    """Identity of the controller: firmware line, serial number, its own address."""

    firmware: str
    serial: int
    address: tuple[int, int, int, int]
    hardware_address: str


class Unit:
    """One controller. `plane` is the coordinate system that CA selected; `motors_off` whether motors power up off.

    `inputs` are the levels of the general inputs, which idle high; `analog` the volts at the analog ones.
    """

    def __init__(
        self, plant: Plant, axes: int, identity: ControllerIdentity, motors_off: bool, memory: Memory | None = None
    ) -> None:
        self.identity = identity
        self.motors_off = motors_off
        lines = (Axis(i, plant.timelines[i], registers.defaults(registers.AXIS)) for i in range(axes))
        planes = {letter: Plane(letter, registers.defaults(registers.PLANE)) for letter in "ST"}
        self.core = MotionCore(plant, tuple(lines), planes)
        self.core.contour.starved = self._starved
        self.handles = Handles()
        self.outlet = OutputBuffer(self.handles)
        self.handles.on_close = self._closed
        self.memory = Memory() if memory is None else memory
        self.records = RecordEmitter(self.handles, self.outlet)
        self.arrays = Arrays()
        self.recorder = ArrayRecorder(self.arrays)
        self.program = Program()
        self.threads = Threads()
        self.inputs = [True] * (8 if axes <= 4 else 16)
        self.gearing = Gearing(self.core)
        self.cam = Cam(self.core)
        self.latches = Latches(self.core, self.inputs)
        coupled = (self.latches, self.gearing, self.cam, Failures(self.core, self.inputs))
        self.activities: tuple[Activity, ...] = (*coupled, self.recorder)
        self.on_note: Callable[[str], None] | None = None
        self._noted: set[str] = set()
        self.on_tcp_error: Callable[[int], None] | None = None
        self.started = 0.0
        self.outputs = [False] * (8 if axes <= 4 else 16)
        self.analog = [0.0] * 8
        self._forget()

    def _starved(self) -> None:
        """Set the error code for contour data that came too late."""
        self.error_code = int(ErrorCode.CONTOUR_STARVED)

    def _forget(self) -> None:
        """Restore the power-up settings."""
        self.variables: dict[str, int] = {}
        self.axis_variables: dict[str, int] = {}
        self.arrays.clear()
        self.program.load("")
        self.threads.reset()
        self.error_code = 0
        self.plane = "S"
        self.value_format = Format(10, 4)
        self.position_format = Format(10, 0)
        self.suppress_zeros = 1
        self.echo = 1
        self.outlet.reset()
        self.network = Network(self.identity.address)
        self.peripherals = Peripherals()
        self.handles.blocking = True

    @property
    def axes(self) -> Sequence[Axis]:
        """The axes."""
        return self.core.axes

    @property
    def letters(self) -> str:
        """Names of the existing axes."""
        return LETTERS[: len(self.core.axes)]

    @property
    def period(self) -> float:
        """Time from one sample to the next [s] (TM)."""
        return self.core.sample

    @property
    def time(self) -> int:
        """TIME: samples since power-up, as a signed 32-bit integer."""
        samples = int(self.core.samples + 1e-6)
        return (samples + (1 << 31)) % (1 << 32) - (1 << 31)

    def reset(self) -> None:
        """Restore the factory settings: counters from zero, motors off, variables lost."""
        self.core.reset()
        self.core.cn = [-1, -1, -1, 0, 0]
        for axis in self.axes:
            axis.registers.update(registers.defaults(registers.AXIS))
            self.core.limit_torque(axis)
            axis.jog_speed = registers.JOG.default
        for plane in self.core.planes.values():
            plane.registers.update(registers.defaults(registers.PLANE))
        for bit in range(1, len(self.outputs) + 1):
            self.set_output(bit, False)
        self.started = self.core.now
        self.core.restart_clock()
        self._forget()

    def tcp_error(self, handle_index: int) -> None:
        """Handle a TCP connection that was found lost when something was sent on its handle (error 123)."""
        self.handles.last_lost = handle_index
        self.error_code = int(ErrorCode.TCP_LOST)
        if self.on_tcp_error is not None:
            self.on_tcp_error(handle_index)

    def note(self, text: str) -> None:
        """Report a fact about the twin itself to `on_note`, once, for example that a command has no effect."""
        if self.on_note is not None and text not in self._noted:
            self._noted.add(text)
            self.on_note(text)

    def set_input(self, bit: int, high: bool) -> None:
        """Set the level of general input `bit`, from 1; latches and selective aborts react at the next look."""
        self.inputs[bit - 1] = high

    def _closed(self, handle: Handle) -> None:
        self.outlet.closed(handle.letter)

    def set_output(self, bit: int, on: bool) -> None:
        """Set digital output `bit`, from 1; an output that controls a brake (BW) follows only its motor."""
        if bit <= len(self.axes) and self.axes[bit - 1].registers["BW"]:
            return
        if self.outputs[bit - 1] != on:
            self.outputs[bit - 1] = on
            self.core.plant.output(bit, on)

    def raw_text(self, raw: int) -> str:
        """Return a raw fixed-point number in the format of VF."""
        form = self.value_format
        return format_raw(raw, form.before, form.after, not self.suppress_zeros, form.hexadecimal)

    def value_text(self, value: float) -> str:
        """Return a number in the format of VF."""
        return self._text(value, self.value_format)

    def position_text(self, values: Sequence[float]) -> str:
        """Return numbers in the format of PF, separated by commas."""
        return join_positions([self._text(value, self.position_format) for value in values])

    def fixed_text(self, values: Sequence[float], places: int) -> str:
        """Return numbers with a fixed number of decimals, independent of PF."""
        zeros = not self.suppress_zeros
        before = 1 if places == 4 else 3
        return join_positions([format_value(value, before, places, zeros) for value in values])

    def _text(self, value: float, form: Format) -> str:
        return format_value(value, form.before, form.after, not self.suppress_zeros, form.hexadecimal)
