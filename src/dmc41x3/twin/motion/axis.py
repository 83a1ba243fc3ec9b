"""One axis of the controller: registers, counters, encoder, and present motion.

The encoder position is the reference less the following error. The reference is known at any time. The error is
sampled when the machine looks, and interpolated linearly between these times.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from math import inf

from dmc41x3.language.codes import StopCode
from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.plant import Plant
from dmc41x3.twin.timeline import AxisProfile, Timeline


class ProgramTrigger(Enum):
    """Cause of an automatic subroutine of a program."""

    LIMIT = "hard or soft limit in the direction of motion"
    POSITION_ERROR = "following error beyond ER"
    AMPLIFIER = "amplifier fault"


VIRTUAL = "NM"
"""The virtual axes: profiles without a motor, for gearing and cams to follow."""

NAMES = LETTERS + "ST" + VIRTUAL
"""Axes and planes in the order of their numbers in axis variables."""

FORWARD_OFF = 2147483647
REVERSE_OFF = -2147483648
"""Values of FL and BL that disable the soft limits."""


class MotionKind(Enum):
    """Kind of an independent motion."""

    ABSOLUTE = "PA"
    RELATIVE = "PR"
    JOG = "JG"
    FIND_EDGE = "FE"
    FIND_INDEX = "FI"
    HOME = "HM"


class Latch(Enum):
    """Trigger of the position latch (AL)."""

    INPUT = "a general input"
    AUXILIARY = "a general input, for the auxiliary encoder"
    INDEX = "the index of the main encoder"


@dataclass(slots=True)
class IndependentMotion:
    """An independent motion under way.

    `target` is the end of a positioning move [motor counts], `speed` the signed velocity of a jog [counts/s], `result`
    the stop code at the end. `stopping` is true once a stop or a limit decelerates the motion. `stage` counts the
    stages of a homing from 1; `level` is the home input at the beginning of the stage.
    """

    kind: MotionKind
    profile: AxisProfile
    target: int = 0
    speed: float = 0.0
    result: StopCode = StopCode.COMMANDED
    stopping: bool = False
    stage: int = 1
    level: bool = False

    @property
    def positions(self) -> bool:
        """Whether the motion is a positioning move (PA, PR)."""
        return self.kind in (MotionKind.ABSOLUTE, MotionKind.RELATIVE)


@dataclass(slots=True)
class Axis:
    """State of one axis. Counts are those of the controller, which adds `offset` to motor counts.

    `plane` is the letter of the coordinate system that moves it, empty for none. `kind` and `distance`, `destination`
    or `jog_speed` describe the motion of the next BG; `last_stop` is the value of `_PA`. For the present plan, `peak`
    is the largest speed [counts/s], `soft_limit` the time when it passes FL or BL, `turns` the times when it starts or
    reverses. `latch` is the trigger that AL armed. `encoder_offset` is added to the encoder counts of a stepper.
    `erring` is true while the following error exceeds ER; `released` is the time when a brake's delay ends and the
    amplifier is switched off [s]. `commutated` means that BA made the motor brushless, `initialised` that its phases
    are known. `bound` is `cam` or `gear` if the axis follows another.
    `error_gain` [s] is the measured following error per unit of speed, None before the first motion.
    """

    index: int
    timeline: Timeline
    registers: dict[str, float]
    on: bool = False
    offset: int = 0
    motion: IndependentMotion | None = None
    plane: str = ""
    stop_code: StopCode = StopCode.COMMANDED
    kind: MotionKind = MotionKind.RELATIVE
    distance: int = 0
    destination: int = 0
    jog_speed: float = 25000.0
    last_stop: int = 0
    auxiliary: int = 0
    latch: Latch = Latch.INPUT
    latch_armed: bool = False
    latched: int = 0
    latch_tripped: bool = False
    tracking: bool = False
    encoder_offset: int = 0
    erring: bool = False
    released: float = inf
    commutated: bool = False
    initialised: bool = False
    bound: str = ""
    error_gain: float | None = None
    peak: float = 0.0
    soft_limit: float | None = None
    turns: list[float] = field(default_factory=list[float])

    @property
    def letter(self) -> str:
        """Letter of the axis."""
        return NAMES[self.index]

    @property
    def virtual(self) -> bool:
        """Whether the axis has no motor."""
        return self.index >= len(LETTERS)

    @property
    def stepper(self) -> bool:
        """Whether the motor is a stepper (MT 2, 2.5, 4 and their negatives)."""
        return abs(self.registers.get("MT", 1.0)) >= 2.0

    @property
    def moving(self) -> bool:
        """Whether a profile of the axis runs, alone or in a sequence (`_BG`)."""
        return self.motion is not None or self.plane != ""

    def reference(self, t: float) -> int:
        """Return the commanded position RP at time `t` [counts]."""
        return round(self.timeline.at(t)[0]) + self.offset

    def heading(self, t: float) -> int:
        """Return the direction in which the reference moves just after time `t`: 1, -1, or 0 at rest."""
        velocity = self.timeline.at(t + 1e-6)[1]
        return (velocity > 0.0) - (velocity < 0.0)

    def direction(self, t: float, home: bool) -> int:
        """Return the direction of the motion set up, at time `t`: 1, -1, or 0; `home` is the home input (`_HM`)."""
        match self.kind:
            case MotionKind.ABSOLUTE:
                way = float(self.destination - self.reference(t))
            case MotionKind.RELATIVE:
                way = float(self.distance)
            case MotionKind.FIND_EDGE | MotionKind.HOME:
                way = -1.0 if home else 1.0
            case MotionKind.JOG | MotionKind.FIND_INDEX:
                way = self.jog_speed
        return (way > 0) - (way < 0)


WINDOW = 0.25
"""Time over which TV averages [s]."""

SPACING = WINDOW / 64.0
"""Errors sampled closer together than this [s] are not all stored."""


class Encoder:
    """The main encoder of one axis.

    For a servo motor its counts are the motor counts. For a stepper, the plant counts microsteps, and YC encoder counts
    correspond to YA * YB microsteps.
    """

    def __init__(self, axis: Axis, plant: Plant) -> None:
        self._axis = axis
        self._plant = plant
        self._errors: deque[tuple[float, float]] = deque([(0.0, 0.0)])

    @property
    def position(self) -> int:
        """TP [counts]."""
        axis = self._axis
        if axis.stepper:
            return round(self._plant.position(axis.index) * self.counts_per_step) + axis.encoder_offset
        return round(self._plant.position(axis.index)) + axis.offset

    @property
    def counts_per_step(self) -> float:
        """Encoder counts in a microstep."""
        registers = self._axis.registers
        return registers["YC"] / (registers["YA"] * registers["YB"])

    def note(self, t: float) -> None:
        """Store the following error at the present time `t` [s]."""
        self._note(t, self._axis.timeline.at(t)[0] - self._plant.position(self._axis.index))

    def velocity(self, t: float) -> float:
        """Return TV at the present time `t` [s]: the mean over the last quarter of a second [counts/s]."""
        return self.reading(t, self._axis.timeline.at(t)[0])[1]

    def reading(self, t: float, reference: float) -> tuple[int, float]:
        """Return TP [counts] and TV [counts/s] at the present time `t` [s], at which the reference is `reference`."""
        axis = self._axis
        here = self._plant.position(axis.index)
        self._note(t, reference - here)
        before = axis.timeline.at(t - WINDOW)[0] - self._error(t - WINDOW)
        if axis.stepper:
            scale = self.counts_per_step
            return round(here * scale) + axis.encoder_offset, (here - before) / WINDOW * scale
        return round(here) + axis.offset, (here - before) / WINDOW

    def _note(self, t: float, error: float) -> None:
        errors = self._errors
        if len(errors) > 1 and t - errors[-2][0] < SPACING:
            errors.pop()
        errors.append((t, error))
        while len(errors) > 2 and errors[1][0] <= t - WINDOW:
            errors.popleft()

    def _error(self, t: float) -> float:
        before = self._errors[0]
        for after in self._errors:
            if after[0] > t:
                span = after[0] - before[0]
                share = min(1.0, max(0.0, (t - before[0]) / span)) if span else 1.0
                return before[1] + share * (after[1] - before[1])
            before = after
        return before[1]
