"""Commands of single axes: registers (SP, AC, OE), motion (PA, BG, ST, SH), motors and amplifiers.

The unit has sinusoidal amplifiers and no Hall sensors; commands that need Hall sensors are refused with 110. Finding
the phase (BX, BZ) takes no time and moves nothing: the bench's motors have no phases.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin.context import Answer, CallerContext, Handler, distance_set
from dmc41x3.twin.expressions import QUERY, Rejection, axes_and_planes, by_axis, mask, split
from dmc41x3.twin.motion.axis import VIRTUAL, Axis, Latch, MotionKind
from dmc41x3.twin.motion.monitors import step_error
from dmc41x3.twin.registers import AXIS, JOG, POSITION, STEPPER_FASTEST, TM, Register, WriteCondition

_OF_VIRTUAL = re.compile(r"\s*([MN])\s*=\s*(.+)")
_STEPPER = frozenset({"MT", "YA", "YB", "YC"})
_SPEEDS = frozenset({"SP", "JG", "HV"})


def addressed(context: CallerContext, text: str) -> list[tuple[Axis, str]]:
    """Return axes and their arguments, in any form; a virtual axis must be the only one, as in `SPN=2000`."""
    virtual = _OF_VIRTUAL.fullmatch(text)
    if virtual is not None:
        return [(context.core.virtual[virtual[1]], virtual[2].strip())]
    return [(context.unit.axes[place], argument) for place, argument in by_axis(text, context.unit.letters)]


def named(context: CallerContext, text: str) -> tuple[str, list[Axis]]:
    """Return a mask without M and N, and the virtual axes that it names."""
    return "".join(name for name in text if name not in VIRTUAL), [
        context.core.virtual[name] for name in VIRTUAL if name in text
    ]


def kept(context: CallerContext, axis: Axis, name: str, register: Register, value: float) -> float:
    """Return a value rounded as in a register of an axis, at the present sample period; raises `Rejection`."""
    if name in _SPEEDS and axis.stepper and abs(value) > STEPPER_FASTEST:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return register.sampled(context.core.period).rounded(value)


def allowed(axis: Axis, when: WriteCondition) -> None:
    """Raise `Rejection` if a register cannot be changed in the present state of the axis."""
    if when is WriteCondition.ALWAYS:
        return
    if when is WriteCondition.COMMUTATED and not axis.commutated:
        raise Rejection(ErrorCode.NOT_BRUSHLESS)
    if when is WriteCondition.BRAKING:
        if axis.motion is not None and axis.motion.positions and not axis.motion.stopping:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        return
    if axis.moving:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    if when is WriteCondition.OFF and axis.on:
        raise Rejection(ErrorCode.MOTOR_MUST_BE_OFF)


def _register(name: str, register: Register, context: CallerContext, text: str) -> Answer:
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    for axis, argument in addressed(context, text):
        if name not in axis.registers:
            raise Rejection(ErrorCode.INVALID_AXIS)
        if argument == QUERY:
            asked.append(axis.registers[name])
            continue
        allowed(axis, register.when)
        value = kept(context, axis, name, register, context.number(argument))
        changes.append((axis, abs(value) if name == "SP" else value))
    for axis, value in changes:
        counter = context.core.position(axis)
        axis.registers[name] = value
        if name in _STEPPER and axis.stepper:
            axis.encoder_offset += counter - context.core.position(axis)
        context.core.settings_changed(axis, name)
    if not asked:
        return None
    unit = context.unit
    return unit.fixed_text(asked, register.places) if register.places else unit.position_text(asked)


def _polarity(context: CallerContext, text: str) -> Answer:
    """CN: polarity of limits, home and latch; selective abort; whether the abort input ends the program."""
    cn, asked = list(context.core.cn), list[float]()
    arguments = split(text)
    if len(arguments) > len(cn):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for place, argument in enumerate(arguments):
        if argument == QUERY:
            asked.append(cn[place])
        elif argument:
            cn[place] = context.integer(argument, -1 if place < 3 else 0, 1)
            if place < 3 and cn[place] == 0:
                raise Rejection(ErrorCode.OUT_OF_RANGE)
    context.core.cn = cn
    context.core.look()
    return context.unit.position_text(asked) if asked else None


REGISTER_TABLE: dict[str, Handler] = {name: partial(_register, name, register) for name, register in AXIS.items()}
REGISTER_TABLE["CN"] = _polarity


_LATCHES = {"S": Latch.AUXILIARY, "T": Latch.INDEX}

_Reader = Callable[[CallerContext, Axis], float]
_Check = Callable[[CallerContext, Axis], None]
_Writer = Callable[[CallerContext, Axis, int], None]


def _per_axis(check: _Check, write: _Writer, read: _Reader, context: CallerContext, text: str) -> Answer:
    """Set or return a whole number of each named axis; nothing is set if one of them is refused."""
    asked: list[float] = []
    changes: list[tuple[Axis, int]] = []
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            asked.append(read(context, axis))
            continue
        check(context, axis)
        changes.append((axis, int(POSITION.rounded(context.number(argument)))))
    for axis, value in changes:
        write(context, axis, value)
    return context.unit.position_text(asked) if asked else None


def _resting(_: CallerContext, axis: Axis) -> None:
    allowed(axis, WriteCondition.RESTING)


def _at_rest_or_tracking(_: CallerContext, axis: Axis) -> None:
    if not axis.tracking or axis.plane:
        allowed(axis, WriteCondition.RESTING)
    elif not axis.on:
        raise Rejection(ErrorCode.BEGIN_MOTOR_OFF)


def _any_time(_: CallerContext, _axis: Axis) -> None:
    return None


def _absolute(context: CallerContext, axis: Axis, value: int) -> None:
    if axis.tracking:
        context.core.track(axis, value)
    else:
        axis.kind, axis.destination = MotionKind.ABSOLUTE, value


def _relative(_: CallerContext, axis: Axis, value: int) -> None:
    axis.kind, axis.distance = MotionKind.RELATIVE, value


def _auxiliary(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.define_auxiliary(axis, value)


def _auxiliary_now(context: CallerContext, axis: Axis) -> float:
    return context.core.position(axis) if axis.stepper else axis.auxiliary


def _track(_: CallerContext, axis: Axis, value: int) -> None:
    if value not in (0, 1):
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    axis.tracking = value == 1


def _shift(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.shift(axis, value)


def _define(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.define(axis, value)


def _jog_check(_: CallerContext, axis: Axis) -> None:
    if axis.motion is not None and axis.motion.kind is not MotionKind.JOG:
        raise Rejection(ErrorCode.JOG_ONLY_IN_JOG_MODE)
    if axis.plane:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)


def _jog(context: CallerContext, text: str) -> Answer:
    """JG: set the jog mode and its signed speed; a running jog changes its speed at once, also its direction.

    Without a speed all axes enter the mode and keep their speeds, as a program in use expects (Harvard, DPSS laser).
    """
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    if not text.strip():
        _jog_mode(context)
        return None
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            asked.append(abs(axis.jog_speed))
            continue
        _jog_check(context, axis)
        changes.append((axis, kept(context, axis, "JG", JOG, context.number(argument))))
    for axis, speed in changes:
        axis.kind, axis.jog_speed = MotionKind.JOG, speed
        axis.registers["SP"] = abs(speed)
        context.core.jog_at(axis, speed)
    return context.unit.position_text(asked) if asked else None


def _jog_mode(context: CallerContext) -> None:
    for axis in context.unit.axes:
        _jog_check(context, axis)
    for axis in context.unit.axes:
        axis.kind = MotionKind.JOG


def _begin(context: CallerContext, text: str) -> Answer:
    text, virtual = named(context, text)
    places, planes = axes_and_planes(text, context.unit.letters)
    if not places and not planes and not virtual:
        places = mask("", context.unit.letters)
    if places or virtual:
        context.core.begin([*context.axes(places), *virtual])
    for letter in planes:
        context.core.begin_plane(context.core.planes[letter])
    return None


def _stop(context: CallerContext, text: str) -> Answer:
    """ST: stop axes and planes; without arguments all of them, virtual axes too, and, from a host, the program."""
    text, virtual = named(context, text)
    places, planes = axes_and_planes(text, context.unit.letters)
    if not places and not planes and not virtual:
        places, planes, virtual = mask("", context.unit.letters), ["S", "T"], list(context.core.virtual.values())
        if context.thread is None:
            context.unit.threads.halt_all()
    for letter in planes:
        context.core.stop_plane(context.core.planes[letter])
    for axis in [*context.axes(places), *virtual]:
        context.core.stop(axis)
    return None


def _abort(context: CallerContext, text: str) -> Answer:
    """AB 0 also ends the program; AB 1 ends motion only."""
    motion_only = bool(text.strip()) and context.integer(text, 0, 1) == 1
    context.core.abort(StopCode.ABORTED)
    if not motion_only:
        context.unit.threads.halt_all()
    return None


def _servo(on: bool, context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    for axis in axes:
        allowed(axis, WriteCondition.RESTING)
        if on and axis.commutated and not axis.initialised:
            raise Rejection(ErrorCode.NOT_INITIALISED)
    for axis in axes:
        context.core.servo(axis, on)
    return None


def _seek(kind: MotionKind, context: CallerContext, text: str) -> Answer:
    """FE, FI, HM: choose a homing for the next BG."""
    axes = context.axes(mask(text, context.unit.letters))
    for axis in axes:
        allowed(axis, WriteCondition.RESTING)
    for axis in axes:
        axis.kind = kind
    return None


def _arm(context: CallerContext, text: str) -> Answer:
    """AL: arm latches; an S before a letter means the auxiliary encoder, a T the index."""
    latch = Latch.INPUT
    armed: list[tuple[int, Latch]] = []
    for name in text.replace(" ", ""):
        if name in _LATCHES:
            latch = _LATCHES[name]
            continue
        armed += [(place, latch) for place in mask(name, context.unit.letters)]
        latch = Latch.INPUT
    if latch is not Latch.INPUT:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for place, by in armed or [(place, latch) for place in mask("", context.unit.letters)]:
        context.unit.latches.arm(context.unit.axes[place], by)
    return None


MOTION_TABLE: dict[str, Handler] = {
    "PA": partial(_per_axis, _at_rest_or_tracking, _absolute, lambda _, axis: axis.last_stop),
    "PR": partial(_per_axis, _resting, _relative, lambda context, axis: distance_set(context.unit, axis)),
    "IP": partial(_per_axis, _any_time, _shift, lambda context, axis: axis.reference(context.core.now)),
    "DP": partial(_per_axis, _resting, _define, lambda context, axis: context.core.position(axis)),
    "DE": partial(_per_axis, _any_time, _auxiliary, _auxiliary_now),
    "PT": partial(_per_axis, _resting, _track, lambda _, axis: axis.tracking),
    "JG": _jog,
    "BG": _begin,
    "ST": _stop,
    "AB": _abort,
    "SH": partial(_servo, True),
    "MO": partial(_servo, False),
    "FE": partial(_seek, MotionKind.FIND_EDGE),
    "FI": partial(_seek, MotionKind.FIND_INDEX),
    "HM": partial(_seek, MotionKind.HOME),
    "AL": _arm,
}


MOST_VOLTS = 4.998
"""The largest command of BX and BZ [V]."""

LONGEST_TIME = 32767
"""The longest time of BX and BZ [ms]."""

_TIMES = re.compile("[<>]")


def _sample_period(context: CallerContext, text: str) -> Answer:
    """TM: the sample period [µs]; the minimum depends on the number of axes. Speeds remain the same in counts/s."""
    core = context.core
    if text.strip() == QUERY:
        return context.unit.position_text([core.period])
    if any(axis.moving for axis in context.unit.axes):
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    least = TM.minimum * ((len(context.unit.axes) + 1) // 2)
    core.set_period(int(TM._replace(minimum=least).rounded(context.number(text))))
    for axis in (*context.unit.axes, *core.virtual.values()):
        for name, register in AXIS.items():
            if register.power and name in axis.registers:
                sampled = register.sampled(core.period)
                axis.registers[name] = sampled.rounded(max(sampled.minimum, axis.registers[name]))
    return None


def _axes(context: CallerContext, text: str) -> list[Axis]:
    return context.axes(mask(text, context.unit.letters))


def _asked(context: CallerContext, text: str) -> list[Axis]:
    """Return the axes of a mask, or of question marks by place."""
    if QUERY not in text:
        return _axes(context, text)
    axes = [axis for axis, _ in addressed(context, text)]
    if any(axis.virtual for axis in axes):
        raise Rejection(ErrorCode.INVALID_AXIS)
    return axes


def _brushless(context: CallerContext, text: str) -> Answer:
    """BA: the axes with sinusoidal commutation; `N` for none."""
    axes = [] if text.strip() == "N" else _axes(context, text)
    for axis in context.unit.axes:
        allowed(axis, WriteCondition.RESTING)
    for axis in context.unit.axes:
        axis.initialised = axis.initialised and axis in axes
        axis.commutated = axis in axes
    return None


def _find_phase(context: CallerContext, text: str) -> Answer:
    """BX, BZ: find the phase with the given volts; after negative volts the motor is off.

    Times after `<` and `>` [ms], also without volts, are accepted; finding the phase takes no time here.
    """
    plain, *times = _TIMES.split(text)
    for time in times:
        context.integer(time, 0, LONGEST_TIME)
    if times and not plain.strip():
        return None
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    for axis, argument in addressed(context, plain):
        if argument == QUERY:
            asked.append(axis.initialised)
            continue
        allowed(axis, WriteCondition.RESTING)
        allowed(axis, WriteCondition.COMMUTATED)
        volts = context.number(argument)
        if not -MOST_VOLTS <= volts <= MOST_VOLTS:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        changes.append((axis, volts))
    for axis, volts in changes:
        axis.initialised = True
        context.core.servo(axis, volts >= 0.0)
    return context.unit.position_text(asked) if asked else None


def _hall(context: CallerContext, text: str) -> Answer:
    """BI: the phase from Hall sensors, which the unit does not have; only 0, which needs none, is accepted."""
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            return context.unit.position_text([0])
        allowed(axis, WriteCondition.COMMUTATED)
        if context.number(argument):
            raise Rejection(ErrorCode.NO_HALLS)
    return None


def _refine(context: CallerContext, text: str) -> Answer:
    for axis in _axes(context, text):
        allowed(axis, WriteCondition.COMMUTATED)
    raise Rejection(ErrorCode.NO_HALLS)


def _hall_state(context: CallerContext, text: str) -> Answer:
    """QH: the state of the Hall inputs, 0 without sensors."""
    return context.unit.position_text([0.0 for _ in _asked(context, text)])


def _correct(context: CallerContext, text: str) -> Answer:
    """YR: move a stepper by a number of microsteps, as IP does, to correct lost ones."""
    changes: list[tuple[Axis, int]] = []
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
        if axis.virtual or not axis.stepper:
            raise Rejection(ErrorCode.OPERAND_ERROR)
        allowed(axis, WriteCondition.RESTING)
        changes.append((axis, int(POSITION.rounded(context.number(argument)))))
    for axis, distance in changes:
        context.core.shift(axis, distance)
    return None


def _step_error(context: CallerContext, text: str) -> Answer:
    """QS: return by how many microsteps the encoder lags."""
    return context.unit.position_text([step_error(context.core, axis) for axis in _asked(context, text)])


def _compare(context: CallerContext, text: str) -> Answer:
    """OC: wait for an axis to pass a position; the twin does not output the pulses."""
    name, equals, values = text.partition("=")
    if not equals:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    axes = _axes(context, name)
    position = int(POSITION.rounded(context.number(split(values)[0])))
    for axis in axes:
        context.unit.latches.compare(axis, position)
    return None


def _clear_amplifier(context: CallerContext, text: str) -> Answer:
    """AZ: 1 clears latched amplifier errors; a persistent fault appears again. 0 and 2 choose the report."""
    context.integer(text, 0, 2)
    return None


HARDWARE_TABLE: dict[str, Handler] = {
    "TM": _sample_period,
    "BA": _brushless,
    "BX": _find_phase,
    "BZ": _find_phase,
    "BI": _hall,
    "BC": _refine,
    "QH": _hall_state,
    "YR": _correct,
    "QS": _step_error,
    "OC": _compare,
    "AZ": _clear_amplifier,
}
