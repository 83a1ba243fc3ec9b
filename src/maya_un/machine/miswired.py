"""A machine with mistakes in its wiring, as a plant of the controller.

The mechanics follow references; they know no servo. An axis whose loop of motor and encoder has a mistake does not
follow: with a reversed encoder it runs away. So this plant closes the loop of such an axis by itself, in steps of 2 ms:

    e = r − x        error by the encoder input, which may count another axis, backwards, wrongly or not at all
    u = K e          motor command, within the torque limit
    v = G (u − n)    speed of the motor: n is what friction and load need; no more than that moves nothing

with K the stiffness of the axis and G = 1/(K τ) for its delay τ, so that without a mistake it would follow as the
mechanics do. The speed becomes the reference of the mechanics, which still know hard stops, lines and load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import copysign

from dmc41x3.twin.plant import CONTACT_STEP, TORQUE_LIMIT, Plant
from dmc41x3.twin.timeline import Timeline, TimelinePiece
from maya_un.machine.log import Place
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.machine.wiring import AXES, SIDES, WIRED


@dataclass(slots=True)
class _Servo:
    """The loop of an axis with a mistake: its motor and encoder are those of axes `motor` and `encoder` (0 to 2).

    `units` are encoder counts per motor count, 0 for a dead encoder; `sign` is -1 for a motor that runs backwards, 0
    for one without power. `delay` is that of the axis without the mistake [s], `limit` its torque limit [V].
    """

    own: int
    encoder: int
    motor: int
    units: float
    sign: float
    delay: float
    timeline: Timeline = field(default_factory=Timeline)
    powered: bool = False
    limit: float = TORQUE_LIMIT

    def moving(self, t: float) -> bool:
        """Return whether the reference moves at time `t` [s]."""
        return self.timeline.jogs or self.timeline.end > t


def built(
    truth: TrueConstants, start: StartPose, parts: Mapping[str, Place] | None = None, *, trace: bool = False
) -> tuple[MayaMechanics, Plant]:
    """Return the mechanics of a machine, and the plant that a controller drives, which contains the wiring mistakes."""
    body = MayaMechanics(truth, start, parts, trace=trace)
    return body, body if truth.wiring == WIRED else MiswiredPlant(body)


class MiswiredPlant:
    """The `body` of a machine with the mistakes of its wiring; axes that have none follow as before.

    The body has no delay of its own where a servo of this plant drives it.
    """

    def __init__(self, body: MayaMechanics) -> None:
        self._body = body
        truth = body.truth
        self._wiring = truth.wiring
        self._own = tuple(truth.letters.index(letter) for letter in "ABC")
        self._axis_of = tuple("ABC".index(letter) for letter in truth.letters)
        self._servos = {axis: self._servo(own) for axis, own in enumerate(self._own) if self._wiring.servo_faulty(own)}
        self._timelines = tuple(
            self._servos[axis].timeline if axis in self._servos else body.timelines[axis] for axis in range(3)
        )

    def _servo(self, own: int) -> _Servo:
        wiring, name = self._wiring, AXES[own]
        reverse = -1.0 if name in wiring.encoder_reversed else 1.0
        units = 0.0 if name in wiring.encoder_dead else reverse * wiring.encoder_factor[own]
        powerless = name in wiring.amplifier_off or name in wiring.brake_closed
        sign = 0.0 if powerless else -1.0 if name in wiring.motor_reversed else 1.0
        moved = wiring.motor_of(own)
        return _Servo(own, wiring.encoder_of(own), moved, units, sign, self._body.truth.lag[moved])

    @property
    def timelines(self) -> Sequence[Timeline]:
        """The reference of every axis, in counts of its encoder input."""
        return self._timelines

    def advance(self, t: float) -> None:
        """Advance to time `t` [s]; in steps while a servo with a mistake moves."""
        while self._body.now < t:
            now = self._body.now
            speeds = {axis: self._speed(servo, now) for axis, servo in self._servos.items()}
            for axis, servo in self._servos.items():
                self._plan(servo, now, speeds[axis])
            busy = any(self._busy(servo, now) for servo in self._servos.values())
            self._body.advance(min(t, now + CONTACT_STEP) if busy else t)

    def _plan(self, servo: _Servo, now: float, speed: float) -> None:
        """Set the speed of a motor [counts/s] from now on."""
        axis = self._axis_of[servo.motor]
        timeline = self._body.timelines[axis]
        if speed or timeline.jogs:
            timeline.plan(now, (TimelinePiece(now, self._body.position(axis), speed, 0.0),))

    def _busy(self, servo: _Servo, now: float) -> bool:
        return servo.powered and (servo.moving(now) or self._speed(servo, now) != 0.0)

    def _command(self, servo: _Servo, now: float) -> float:
        """Return the motor command [V]."""
        if not servo.powered:
            return 0.0
        stiffness = self._body.truth.stall_stiffness[servo.own] / (abs(servo.units) or 1.0)
        error = servo.timeline.at(now)[0] - self._counted(servo)
        return max(-servo.limit, min(servo.limit, stiffness * error))

    def _speed(self, servo: _Servo, now: float) -> float:
        """Return the speed of the motor [counts/s]. The servo's integral part carries the load, within the limit."""
        truth, moved = self._body.truth, servo.motor
        push = servo.sign * self._command(servo, now)
        load = truth.torque_per_load * self._body.tension()[moved - 1] if moved and push < 0.0 else 0.0
        if abs(push) <= truth.friction[moved] or servo.limit <= load + truth.friction[moved]:
            return 0.0
        gain = 1.0 / (truth.stall_stiffness[moved] * servo.delay)
        return copysign(gain * (abs(push) - truth.friction[moved]), push)

    def _counted(self, servo: _Servo) -> float:
        """Return the count of the encoder input of a servo."""
        return servo.units * self._body.position(self._axis_of[servo.encoder])

    def next_event(self, until: float) -> float | None:
        """Return the earliest time in (now, until] at which the machine must be evaluated, None without one.

        While a servo pushes, that is every 2 ms.
        """
        now = self._body.now
        if until <= now:
            return None
        if any(self._busy(servo, now) for servo in self._servos.values()):
            return min(until, now + CONTACT_STEP)
        return self._body.next_event(until)

    def position(self, axis: int) -> float:
        """Return the count of the encoder input of an axis."""
        servo = self._servos.get(axis)
        return self._body.position(axis) if servo is None else self._counted(servo)

    def velocity(self, axis: int) -> float:
        """Return the speed that the encoder input of an axis reads [counts/s]."""
        servo = self._servos.get(axis)
        return (
            self._body.velocity(axis)
            if servo is None
            else servo.units * self._body.velocity(self._axis_of[servo.encoder])
        )

    def torque(self, axis: int) -> float:
        """Return the motor command [V]."""
        servo = self._servos.get(axis)
        if servo is None:
            return self._body.torque(axis)
        return self._command(servo, self._body.now)

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the electrical levels of forward limit, reverse limit and home input; an open input is high."""
        own = self._own[axis]
        forward, reverse, home = self._body.inputs(axis)
        if AXES[own] in self._wiring.switches_exchanged:
            forward, reverse = reverse, forward
        reverse, forward = (
            self._level(own, side, level) for side, level in zip(SIDES, (reverse, forward), strict=True)
        )
        return forward, reverse, home

    def _level(self, own: int, side: str, level: bool) -> bool:
        name = f"{AXES[own]} {side}"
        if name in self._wiring.switch_open:
            return True
        return level != (name in self._wiring.switch_inverted)

    def power(self, axis: int, on: bool) -> None:
        """Switch an amplifier; without its enable signal, or with its brake closed, no motor gets power."""
        servo = self._servos.get(axis)
        if servo is None:
            self._body.power(axis, on)
            return
        servo.powered = on
        self._plan(servo, self._body.now, 0.0)
        self._body.power(self._axis_of[servo.motor], on and servo.sign != 0.0)

    def limit_torque(self, axis: int, volts: float) -> None:
        """Limit a motor to `volts` [V]."""
        servo = self._servos.get(axis)
        if servo is None:
            self._body.limit_torque(axis, volts)
        else:
            servo.limit = volts

    def output(self, bit: int, on: bool) -> None:
        """Set a digital output."""
        self._body.output(bit, on)

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Stop an encoder of the machine, or let it continue."""
        self._body.fail_encoder(axis, on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at a level, or release them (None)."""
        self._body.force_inputs(axis, **levels)
