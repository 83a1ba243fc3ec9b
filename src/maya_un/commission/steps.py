"""The declared steps of a commissioning: nothing moves before the emergency stop and the limit switches work."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from math import degrees, inf
from typing import Any

from dmc41x3.i18n import PHRASE, Phrase, marked, phrase
from maya_un.axes import AXES
from maya_un.commission import judgement
from maya_un.commission.guarded import GuardedMachine, Motion
from maya_un.commission.judgement import SIDES, SWITCHES, Press, Seen, Side, Switch
from maya_un.commission.procedure import Commissioning, CommissioningStep, LeftToPerson, SkippedByPerson
from maya_un.commission.questions import (
    ALREADY,
    CLOSED,
    DONE,
    NO,
    NOTHING,
    OPEN,
    YES,
    PossibleAnswer,
    Question,
    QuestionKind,
)
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.controller.registers import HOMING
from maya_un.errors import (
    AmplifierFault,
    AmplifierNotEnabled,
    AxisUnstable,
    BrakeClosed,
    CommandRejected,
    EncoderScaleWrong,
    GripperAtOtherOutput,
    GripperInverted,
    GripperSilent,
    MotionNotCompleted,
    SwitchBlocks,
    TorqueTooLow,
)

PARTS: tuple[Phrase, Phrase, Phrase] = (phrase("the boom (a)"), phrase("line b"), phrase("line c"))

_TOWARD: tuple[tuple[Phrase, Phrase], ...] = (
    (phrase("anticlockwise, seen from above"), phrase("clockwise, seen from above")),
    (phrase("shorter"), phrase("longer")),
    (phrase("shorter"), phrase("longer")),
)

_ENDS: tuple[dict[Side, Phrase], ...] = (
    {"reverse": phrase("anticlockwise end"), "forward": phrase("clockwise end")},
    {"reverse": phrase("short end"), "forward": phrase("long end")},
    {"reverse": phrase("short end"), "forward": phrase("long end")},
)

BOUND = 12.0
"""Longest motion of an axis before its wiring is known [lengths of a trial]; the controller then stops it."""

FURTHER = 10.0
"""Length of a slow move, and of a trial that repeats one that was too short to see [lengths of a trial]."""

COARSE, FINE = 0.6, 0.05
"""Tolerances of a measured way: after a trial, which is short, and after a slow move."""


async def _connection(s: Commissioning) -> None:
    await s.ready(
        "connection.ready",
        phrase(
            "Nothing moves. This program connects to {address}, becomes the owner of the controller, switches its "
            "motors off, and writes the registers of the configuration.",
            address=s.address,
        ),
    )
    machine = await s.machine()
    driver = machine.driver
    s.read(firmware=machine.firmware, axes=round(await driver.value("_BV")), serial=round(await driver.value("_BN")))
    try:
        hardware = [line.strip() for line in (await driver.send("ID")).splitlines()]
        s.read(hardware="; ".join(line for line in hardware if line))
    except CommandRejected:
        s.read(hardware="unknown")
    status = (await driver.record()).amplifier_status
    if status:
        raise AmplifierFault(status=f"{status:#010x}")


async def _stop(s: Commissioning) -> None:
    await s.ready(
        "stop.ready",
        phrase("Nothing moves. You press and release the emergency stop, and this program reads the abort input."),
    )
    machine = await s.machine()
    before = await machine.abort_active()
    await s.ask(Question("stop.press", QuestionKind.PRESS_STOP, phrase("Press the emergency stop."), DONE))
    pressed = await machine.abort_active()
    await s.ask(Question("stop.release", QuestionKind.RELEASE_STOP, phrase("Release the emergency stop."), DONE))
    s.read(released="active" if before else "inactive", pressed="active" if pressed else "inactive")
    error = judgement.stop(before, pressed)
    if error is not None:
        s.found(error)
    elif await machine.abort_active():
        s.found(judgement.StopStuck())
    else:
        await machine.guard()  # the abort input ends programs


async def _limits(s: Commissioning) -> None:
    fitted = [switch for switch in SWITCHES if _is_fitted(s.config, *switch)]
    if not fitted:
        s.read(switches="none")
        return
    await s.ready(
        "limits.ready",
        phrase(
            "Nothing moves: all motors are off. You press the limit switches by hand, one after another: {count}.",
            count=len(fitted),
        ),
    )
    machine = await s.machine()
    presses: dict[Switch, Press] = {}
    for axis, side in fitted:
        presses[axis, side] = await _pressed(s, machine, axis, side)
    letters = "".join(s.config.axes[axis].letter for axis in range(3))
    verdict = judgement.switches(presses, letters, s.config.wiring.limit_active_level)
    changes: dict[str, Any] = {}
    if verdict.letters is not None:
        changes = {f"axes.{name}.letter": letter for name, letter in zip(AXES, verdict.letters, strict=True)}
    if verdict.level is not None:
        changes["wiring.limit_active_level"] = verdict.level
    correctable = (judgement.AxesExchanged, judgement.SwitchLevelsInverted)
    for error in verdict.errors:
        if isinstance(error, correctable):
            await s.correct(error, changes)
        else:
            s.found(error)


def _is_fitted(config: Config, axis: int, side: Side) -> bool:
    ends = config.axes[axis]
    return ends.switch_at_minimum if side == SIDES[0] else ends.switch_at_maximum


async def _pressed(s: Commissioning, machine: GuardedMachine, axis: int, side: Side) -> Press:
    before = await machine.switches()
    key = f"limits.{AXES[axis]}.{side}"
    press = phrase(
        "Press the limit switch at the {end} of {part} by hand, and hold it.", end=_ENDS[axis][side], part=PARTS[axis]
    )
    already = PossibleAnswer(ALREADY, phrase("a: the axis itself presses it now"))
    answer = await s.ask(Question(f"{key}.press", QuestionKind.PRESS_SWITCH, press, (*DONE, already), axis, side))
    pressed = await machine.switches()
    if answer != ALREADY:
        await s.ask(Question(f"{key}.release", QuestionKind.RELEASE_SWITCH, phrase("Let it go."), DONE, axis, side))
    return Press(before, pressed, answer == ALREADY)


_JAWS = (PossibleAnswer(OPEN, phrase("o: open")), PossibleAnswer(CLOSED, phrase("c: closed")))


async def _gripper(s: Commissioning) -> None:
    machine = await s.machine()
    grip = s.config.gripper
    await s.ready(
        "gripper.ready",
        phrase(
            "The gripper opens and closes: output {output} is switched on and off. No axis moves. Take your hands and "
            "all parts out of the gripper.",
            output=grip.output,
        ),
    )
    closed_by = await _closed_by(s, machine, grip.output)
    if closed_by is None:
        await _search_gripper(s, machine)
    elif closed_by != grip.closed_by:
        await s.correct(GripperInverted(closed_by=closed_by), {"gripper.closed_by": closed_by})
    s.read(output=s.config.gripper.output, closed_by=s.config.gripper.closed_by)


async def _search_gripper(s: Commissioning, machine: GuardedMachine) -> None:
    configured = s.config.gripper.output
    others = [bit for bit in range(1, 9) if bit != configured and bit not in s.config.controller.outputs]
    text = phrase(
        "Output {configured} did not move the gripper. Outputs {others} are switched on and off, one after another. "
        "Check what else is connected to them. No axis moves.",
        configured=configured,
        others=", ".join(map(str, others)),
    )
    await s.ready("gripper.search.ready", text)
    for bit in others:
        closed_by = await _closed_by(s, machine, bit)
        if closed_by is not None:
            changes = {"gripper.output": bit, "gripper.closed_by": closed_by}
            await s.correct(GripperAtOtherOutput(configured=configured, found=bit), changes)
            return
    s.found(GripperSilent())


async def _closed_by(s: Commissioning, machine: GuardedMachine, bit: int) -> str | None:
    """Return the bit command that closes the gripper, None if the output does not move it."""
    seen: dict[str, str] = {}
    for command, high in (("set", True), ("clear", False)):
        await machine.output(bit, high=high)
        text = phrase("Output {bit}: is the gripper open or closed now?", bit=bit)
        seen[command] = await s.ask(Question(f"gripper.{bit}.{command}", QuestionKind.GRIPPER, text, _JAWS))
    if seen["set"] == seen["clear"]:
        return None
    return "set" if seen["set"] == CLOSED else "clear"


async def _direction(axis: int, s: Commissioning) -> None:
    machine = await s.machine()
    await machine.guard()  # the abort input, or a pause of this computer, may have ended its watch
    way, levels = machine.distance(axis), machine.levels(axis)
    look = await machine.look()
    way = -way if look.forward[axis] else way
    motion, seen = await _first_motion(axis, s, machine, way, "")
    if motion.after.met(axis, SIDES[way > 0.0]):  # it stood close to this switch
        way = -way
        motion, seen = await _first_motion(axis, s, machine, way, ".other")
    trial = machine.trial(motion)
    s.read(counted=length_text(axis, motion.moved(axis) / machine.units.per_unit[axis]))
    if judgement.nothing_moved(trial, seen):
        await _explain_rest(axis, s, levels[-1])
        return
    if not motion.begun:
        s.found(AxisUnstable(axis=AXES[axis]))
        return
    letters = "".join(s.config.axes[one].letter for one in range(3))
    error = judgement.direction(trial, seen, letters)
    if isinstance(error, judgement.EncoderWithoutMotion) and not motion.tripped:
        motion, seen = await _try(axis, s, machine, FURTHER * way, levels[-1], ".further")
        error = judgement.direction(machine.trial(motion), seen, letters)
    if error is None and seen is not None and not motion.tripped:
        error = await _measured(axis, s, machine, motion, COARSE)
    if error is not None:
        s.found(error)
        await machine.off(axis)
        return
    _require_arrived(axis, s, machine, motion)
    await _back(axis, s, machine, motion)


async def _first_motion(
    axis: int, s: Commissioning, machine: GuardedMachine, way: float, suffix: str
) -> tuple[Motion, Seen | None]:
    """Try with more and more torque, until something moves."""
    level, levels = 0, machine.levels(axis)
    while True:
        motion, seen = await _try(axis, s, machine, way, levels[level], f"{suffix}.{level}" if level else suffix)
        trial = machine.trial(motion)
        blocked = motion.tripped and judgement.direction(trial, seen) is None
        if level + 1 == len(levels) or not (blocked or judgement.nothing_moved(trial, seen)):
            break
        level += 1
    s.read(volts=f"{levels[level]:.2f}")
    allowed = HOMING * s.config.homing.torque_per_load
    moved = abs(trial.counted[axis]) > judgement.COUNTS
    if level and levels[level] > allowed and _tells_torque(axis, way) and moved:
        s.found(TorqueTooLow(axis=AXES[axis], allowed=f"{allowed:.2f}"))
    return motion, seen


def _tells_torque(axis: int, way: float) -> bool:
    """Return whether a motion needs friction only: a line becomes longer. The torque for a shorter one is unknown."""
    return axis > 0 and way > 0.0


async def _try(
    axis: int, s: Commissioning, machine: GuardedMachine, way: float, volts: float, suffix: str
) -> tuple[Motion, Seen | None]:
    """Announce a motion, make it, and return it with what the person saw."""
    key = f"direction.{AXES[axis]}"
    bounds = {one: BOUND * machine.distance(one) for one in range(3)}
    text = phrase(
        "Motion of {part} by {way} ({words}), with at most {volts:.1f} V. If its wiring is wrong, an axis may run "
        "away, until the controller switches its motor off: by {a} (boom), {b} (line b) or {c} (line c). Keep one hand "
        "at the emergency stop, and nobody near the machine.",
        part=PARTS[axis],
        way=length_text(axis, abs(way)),
        words=_TOWARD[axis][way > 0.0],
        volts=volts,
        a=length_text(0, bounds[0]),
        b=length_text(1, bounds[1]),
        c=length_text(2, bounds[2]),
    )
    await s.ready(f"{key}{suffix}.ready", text, bounds)
    motion = await machine.move(axis, way, volts)
    choices = [
        PossibleAnswer(f"{name}{sign}", phrase("{part} moved ({words})", part=part, words=words))
        for name, part, ways in zip(AXES, PARTS, _TOWARD, strict=True)
        for sign, words in zip("-+", ways, strict=True)
    ]
    choices.append(PossibleAnswer(NOTHING, phrase("nothing moved")))
    answer = await s.ask(
        Question(
            f"{key}{suffix}.seen",
            QuestionKind.SEEN,
            phrase("What moved, and in which direction?"),
            tuple(choices),
            axis,
        )
    )
    seen = None if answer == NOTHING else Seen(AXES.index(answer[0]), 1 if answer[1] == "+" else -1)
    return motion, seen


async def _explain_rest(axis: int, s: Commissioning, volts: float) -> None:
    lamp = (PossibleAnswer(YES, phrase("y: yes")), PossibleAnswer(NO, phrase("n: no")))
    text = phrase("Is the amplifier of {part} enabled (its lamp, or a voltage at the motor)?", part=PARTS[axis])
    machine = await s.machine()
    answer = await s.ask(Question(f"direction.{AXES[axis]}.lamp", QuestionKind.LAMP, text, lamp, axis))
    await machine.off(axis)
    if answer == YES:
        s.found(BrakeClosed(axis=AXES[axis], volts=f"{volts:.1f}"))
    else:
        s.found(AmplifierNotEnabled(axis=AXES[axis]))


async def _measured(
    axis: int, s: Commissioning, machine: GuardedMachine, motion: Motion, tolerance: float
) -> EncoderScaleWrong | None:
    """Ask how far an axis moved, and compare it with the encoder."""
    config = s.config
    step = "direction" if tolerance == COARSE else "travel"
    text = phrase("How far did {part} move [mm]? After your answer it moves back: keep clear.", part=PARTS[axis])
    if axis == 0:
        text = phrase(
            "How far did the boom move [mm], {distance:.0f} mm from its axis (below anchor c)? After your answer it "
            "moves back: keep clear.",
            distance=config.geometry.length * 1e3,
        )
    counted = abs(motion.moved(axis)) / machine.units.per_unit[axis]
    back = {axis: (1.0 + COARSE) * counted}
    question = Question(f"{step}.{AXES[axis]}.length", QuestionKind.LENGTH, text, axis=axis, most=back)
    answer = float(await s.ask(question))
    measured = abs(answer) / 1e3 / (config.geometry.length if axis == 0 else 1.0)
    s.read(counted=length_text(axis, counted), measured=length_text(axis, measured))
    factor = judgement.scale_factor(counted, measured, tolerance)
    if factor is None:
        return None
    key, scale, unit = _scale(axis, config)
    return EncoderScaleWrong(
        axis=AXES[axis],
        measured=length_text(axis, measured),
        counted=length_text(axis, counted),
        factor=f"{factor:.2g}",
        key=key,
        scale=f"{float(f'{scale * factor:.3g}'):.0f}",
        unit=unit,
    )


def _scale(axis: int, config: Config) -> tuple[str, float, str]:
    """Return the key of the scale of an axis, its value, and its unit."""
    if axis == 0:
        return "scale.pulses_per_degree", config.scale.pulses_per_degree, "counts/°"
    key = phrase("{key} (it holds for lines b and c, so both need the same resolution)", key="scale.pulses_per_metre")
    return key, config.scale.pulses_per_metre, "counts/m"


async def _back(axis: int, s: Commissioning, machine: GuardedMachine, motion: Motion) -> None:
    """Move an axis back, and switch its motor off; it may end at a switch, if it stood there."""
    scale, levels = machine.units.per_unit[axis], machine.levels(axis)
    way = -motion.moved(axis) / scale
    enough = levels[1] if _tells_torque(axis, way) else levels[-1]
    try:
        back = await machine.move(axis, way, enough)
        if back.tripped and enough < levels[-1]:
            back = await machine.move(axis, way - back.moved(axis) / scale, levels[-1])
            if not back.tripped:
                s.found(TorqueTooLow(axis=AXES[axis], allowed=f"{enough:.2f}"))
    except SwitchBlocks:
        await machine.off(axis)
        return
    await machine.off(axis)
    if not back.after.met(axis, SIDES[way > 0.0]):
        _require_arrived(axis, s, machine, back)


def _require_arrived(axis: int, s: Commissioning, machine: GuardedMachine, motion: Motion) -> None:
    missing = motion.counts - motion.moved(axis)
    if s.has_found or (not motion.tripped and abs(missing) <= machine.error_limit(axis)):
        return  # a mistake that was found, as too little torque, explains what is missing
    scale = machine.units.per_unit[axis]
    reason = phrase("its motor was switched off") if motion.tripped else phrase("it stopped")
    s.found(
        MotionNotCompleted(
            axis=AXES[axis],
            measured=length_text(axis, abs(motion.moved(axis)) / scale),
            wanted=length_text(axis, abs(motion.counts) / scale),
            reason=reason,
        )
    )


async def _travel(axis: int, s: Commissioning) -> None:
    machine = await s.machine()
    await machine.guard()
    look = await machine.look()
    way = FURTHER * machine.distance(axis) * (-1.0 if look.forward[axis] else 1.0)
    motion = await _slow(axis, s, machine, way, "")
    if motion is None:  # a switch stopped it: it works, and there is room on the other side
        motion = await _slow(axis, s, machine, -way, ".other")
    if motion is None:
        raise SkippedByPerson
    _require_arrived(axis, s, machine, motion)
    error = await _measured(axis, s, machine, motion, FINE)
    if error is not None:
        s.found(error)
    await _back(axis, s, machine, motion)


async def _slow(axis: int, s: Commissioning, machine: GuardedMachine, way: float, suffix: str) -> Motion | None:
    """Make a slow move; None if a limit switch stopped it, and the axis is back then."""
    text = phrase(
        "Slow motion of {part} by {way} ({words}), and back. Nothing else moves. Make sure that {way} are free, also "
        "below the gripper.",
        part=PARTS[axis],
        way=length_text(axis, abs(way)),
        words=_TOWARD[axis][way > 0.0],
    )
    await s.ready(f"travel.{AXES[axis]}{suffix}.ready", text, {axis: (1.0 + COARSE) * abs(way)})
    side = SIDES[way > 0.0]
    try:
        motion = await machine.move(axis, way, machine.levels(axis)[-1])
    except SwitchBlocks:
        return None
    if not motion.after.met(axis, side):
        return motion
    s.read(**{f"{side} switch": "stopped the axis"})
    await _back(axis, s, machine, motion)
    return None


async def _home(s: Commissioning) -> None:
    if s.config.person_needed:
        s.person.tell(
            phrase(
                "The robot cannot find its position alone, because {reason}. Home it with `maya datum` later, while "
                "`maya up` runs.",
                reason=s.config.person_needed,
            )
        )
        raise LeftToPerson
    bounds = dict.fromkeys(range(3), inf)
    await s.ready(
        "home.ready",
        phrase(
            "All axes move, over their whole strokes: the gripper rises first, then every axis finds its limit "
            "switches, slowly. It takes about five minutes. Keep one hand at the emergency stop."
        ),
        bounds,
    )
    if not s.config.safety.self_locking:
        machine = await s.machine()
        await machine.hold()
        text = phrase("The motors hold the lines now. Take the support of the gripper away.")
        await s.ask(Question("home.free", QuestionKind.FREE, text, DONE))
    await s.disconnect()
    controller = GalilController(s.dial, s.address, s.waiting(s.config))
    try:
        await controller.open()
        await controller.home()
        ends = {"b": controller.workspace.line_b[1], "c": controller.workspace.line_c[1]}
    finally:
        await controller.close()
    for name, end in ends.items():
        s.read(**{f"long end of {name}": f"{end * 1e3:.1f} mm"})
        configured = s.config.axes["abc".index(name)].maximum
        if abs(end - configured) > STROKE_DIFFERS:
            s.propose({f"axes.{name}.maximum": round(end, 4)})


STROKE_DIFFERS = 0.002
"""A measured long end that differs by more than this from the configured one is proposed instead [m]."""


async def _calibration(s: Commissioning) -> None:
    text = phrase(
        "Nothing moves. The machine is homed and can work. To make it exact, start `maya up --address real`, "
        "home, measure points with `maya calibrate collect points.csv`, then fit them with `maya calibrate "
        "points.csv --apply`."
    )
    if s.config.person_needed:
        text = phrase(
            "Nothing moves. The machine is not homed yet: start `maya up --address real`, give the datum with `maya "
            "datum`, then measure points with `maya calibrate collect points.csv`, then fit them with `maya calibrate "
            "points.csv --apply`."
        )
    await s.ready("calibration.ready", text)


def length_text(axis: int, way: float) -> Phrase:
    """Return a way [rad or m] as text, in degrees for the boom and millimetres for a line."""
    return phrase("{value:.2f} °", value=degrees(way)) if axis == 0 else phrase("{value:.1f} mm", value=way * 1e3)


_Run = Callable[[int, Commissioning], Coroutine[Any, Any, None]]


def _for_axes(key: str, title: str, does: str, run: _Run, needs: tuple[str, ...]) -> tuple[CommissioningStep, ...]:
    return tuple(
        CommissioningStep(
            f"{key}.{name}",
            title.format(part=PARTS[axis]),
            does,
            partial(run, axis),
            tuple(need if "." not in need else f"{need.partition('.')[0]}.{name}" for need in needs),
        )
        for axis, name in enumerate(AXES)
    )


_WIRED = ("connection", "stop", "limits")

STEPS: tuple[CommissioningStep, ...] = (
    CommissioningStep(
        "connection", phrase("Controller"), phrase("identifies controller, firmware and amplifiers"), _connection
    ),
    CommissioningStep(
        "stop",
        phrase("Emergency stop"),
        phrase("you press the emergency stop; the abort input must change"),
        _stop,
        ("connection",),
        again=True,
    ),
    CommissioningStep(
        "limits",
        phrase("Limit switches"),
        phrase("you press each switch by hand; finds the level, exchanged and missing switches, and exchanged axes"),
        _limits,
        ("connection",),
    ),
    CommissioningStep(
        "gripper",
        phrase("Gripper"),
        phrase("you look whether it opens and closes; finds its output and the level that closes it"),
        _gripper,
        ("connection",),
    ),
    *_for_axes(
        "direction",
        marked("Direction of {part}", PHRASE),
        phrase("moves the axis a little; compares command, encoder and what you see"),
        _direction,
        _WIRED,
    ),
    *_for_axes(
        "travel",
        marked("Slow move of {part}", PHRASE),
        phrase("moves the axis by ten times the distance of the direction test, and back; you measure the distance"),
        _travel,
        (*_WIRED, "direction.x"),
    ),
    CommissioningStep(
        "home",
        phrase("First homing"),
        phrase("finds all switches and measures the strokes"),
        _home,
        (*_WIRED, "gripper", *(f"{key}.{name}" for key in ("direction", "travel") for name in AXES)),
    ),
    CommissioningStep(
        "calibration",
        phrase("Calibration"),
        phrase("says how to measure points, with `maya calibrate`"),
        _calibration,
        ("home",),
    ),
)
"""All steps, in order."""
