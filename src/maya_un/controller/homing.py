"""Homing from any start: a sequence that can neither tear the machine nor touch the table.

It needs a switch of axis a at either end, switches at the short ends of both lines, and torque. Long ends without
switches are not measured. Other machines are homed by a person (`maya_un.controller.datum`).

Known facts: lengthening a line never breaks b + c >= W; shortening a line always raises the gripper; moving both lines
by equal and opposite amounts keeps the gripper on an ellipse about the two anchors. A high tension is largest near the
middle of the ellipse: at most 1.11 times the tension where a short switch ends the ellipse. Unknown are lengths,
friction, following, the long ends. So the sequence relies on switches, following error and motor torque
(docs/explanation/homing.md derives every bound):

1. raise: shorten both lines in steps, each a fraction of the length that, by the torque, remains before the lines are
   straight;
2. datum of a, with the gripper high;
3. along the ellipse until c is at its short end: datum of c;
4. along the ellipse back, c to a suitable length, then b alone to its short end: datum of b;
5. measure the long ends of c and b, with the other line at a length that keeps both taut;
6. go to the homed pose and write the mark.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, sqrt
from typing import NamedTuple

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.config.model import MOST_SLACK
from maya_un.controller.datum import shown
from maya_un.controller.seek import FORWARD, RELEASE_WITHIN, REVERSE, AxesReading, Seeker, Stall
from maya_un.errors import HomingStalled, MayaError, StrokeDiffers, SwitchNotFound
from maya_un.schema.robot import Jogged
from maya_un.values import Joints

A, B, C = 0, 1, 2

ENOUGH = 2.0
"""Load on a line at which the raise ends [loads]. Low down no line carries more than 0.98, with friction 1.5."""

LEAST = 0.35
"""Least load [loads]: the tighter of two lines carries at least 0.5; less means a wrong torque constant."""

PROBE = 0.0002
"""First step of the raise, as a share of W: it takes two lines from the tightest legal start (5 loads) to 5.26."""

PROBE_TIME = 0.8
"""Duration of the first step [s]: long enough to read its torque at any latency."""

RELAX = 0.015
"""After the raise both lines lengthen by this [m], so that the ellipse starts well below the limit."""

BACK = (0.07, 0.025, 0.025)
"""Way off a long end's switch, and half of the way in which a datum must trip again (rad, m, m)."""

CLEAR = (0.01, 0.002, 0.002)
"""Further way before the slow approach (rad, m, m): long enough for a steady speed at the switch."""

MARGIN_COUNTS = (2, 5, 5)
"""Offset of the datum to the safe side [counts], so that the end of the stroke lies short of the switch."""


class HomingResult(NamedTuple):
    """The result of a homing: the long ends of the two lines [m]."""

    b_end: float
    c_end: float


INSIDE = 0.025
"""Least distance of a line from the ends of its stroke at the places of homing, as a share of W."""

OFF_END = 0.075
"""A line leaves its long end by this share of W before the other one shortens alone."""

OFF_SWITCHED_END, OFF_GIVEN_END = 0.035, 0.1
"""Angle between the homed pose and the end of the boom's stroke [rad], with a datum by a switch and by a person."""

PAST = (0.05, 0.02, 0.02)
"""Longest braking distance behind a switch (rad, m, m); the switch must release within `RELEASE_WITHIN`."""

LOW = 1.2
"""At the homed pose b + c is at least this times W: no line carries more than 0.91 loads there."""

SLACK = 0.25
"""A line may be slack by this [m] while the lines move along the ellipse."""


def homed_pose(config: Config) -> Joints:
    """Return the pose after homing (rad, m, m): off every switch, high, well inside the workspace."""
    width = config.geometry.width
    share_b, share_c = (0.75, 0.65) if config.deepest > 0.5 * width else (0.65, 0.55)
    b, c = _inside(config, B, share_b * width), _inside(config, C, share_c * width)
    c = _inside(config, C, max(c, LOW * width - b))
    b = _inside(config, B, max(b, LOW * width - c))
    boom = config.axes.a
    off = OFF_GIVEN_END if config.person_needed else OFF_SWITCHED_END
    return Joints(boom.maximum - off if boom.switches == "maximum" else boom.minimum + off, b, c)


def _inside(config: Config, axis: int, length: float) -> float:
    """Return the length of a line, inside of its stroke, that is nearest to `length` [m]."""
    ends = config.axes[axis]
    inside = min(INSIDE * config.geometry.width, 0.25 * (ends.maximum - ends.minimum))
    return min(max(length, ends.minimum + inside), ends.maximum - inside)


class HomingRun:
    """One run of the sequence; calls `phase` with the name of each step as it begins."""

    def __init__(
        self, seeker: Seeker, driver: Driver, config: Config, units: Units, phase: Callable[[str], None]
    ) -> None:
        self._seek = seeker
        self._driver = driver
        self._config = config
        self._units = units
        self._phase = phase
        self._speed = min(config.homing.speed, self._braked(B), self._braked(C))
        self._sag = 1.0 / config.homing.torque_per_load

    async def run(self) -> HomingResult:
        """Run the whole sequence.

        Raises `WiringContradictsCn`, `HomingStalled`, `SwitchNotFound`, `StrokeDiffers`, and the errors that end a
        motion.
        """
        look = await self._seek.survey()
        if look.reverse[B] and look.reverse[C] and self._shortest(B) + self._shortest(C) < self._width:
            liar = await self._liar()
            raise self._seek.contradiction(liar, REVERSE, phrase("lines b and c cannot both be at their short ends"))
        try:
            return await self._sequence()
        except Stall as stall:
            raise await self._explain(stall) from stall

    async def _liar(self) -> int:
        """Return the line whose short-end switch reads falsely, when both read active.

        Lengthens c: if its switch releases, b's is wrong. If it stays active or c stalls, c's is wrong.
        """
        try:
            look = await self._seek.go(
                {C: RELEASE_WITHIN[C]}, 4.0 * self._approach(C), poll=0.1, until=lambda look: not look.reverse[C]
            )
        except Stall:
            return C
        return C if look.reverse[C] else B

    async def _sequence(self) -> HomingResult:
        self._phase("raise")
        await self._raise()
        self._phase("datum_a")
        await self._datum(A, self._angle_stroke(), REVERSE if self._config.axes.a.switch_at_minimum else FORWARD)
        self._phase("datum_c")
        await self._to_short_c()
        await self._datum(C, 0.1)
        self._phase("datum_b")
        await self._to_short_b()
        await self._datum(B, 0.1)
        b_end, c_end = self._config.axes.b.maximum, self._config.axes.c.maximum
        if self._config.axes.c.switch_at_maximum:
            self._phase("stroke_c")
            c_end = await self._long_end(C, B, other_length=self._beside_long_end(C, 0.65))
        if self._config.axes.b.switch_at_maximum:
            self._phase("stroke_b")
            b_end = await self._long_end(B, C, other_length=self._beside_long_end(B, 0.60))
        self._phase("pose")
        await self._to_pose()
        return HomingResult(b_end=b_end, c_end=c_end)

    @property
    def _width(self) -> float:
        return self._config.geometry.width

    def _shortest(self, axis: int) -> float:
        """Return the length of a line at its short end [m]."""
        return self._config.axes[axis].minimum

    def _longest(self, axis: int) -> float:
        """Return the greatest length at which the long switch of a line may trip [m]."""
        return self._config.longest(self._config.axes[axis])

    def _least_long(self, axis: int) -> float:
        """Return a length that a line surely has at its long end [m]: as configured, less if no switch shows it."""
        ends, tolerance = self._config.axes[axis], self._config.homing.stroke_tolerance
        return ends.maximum if ends.switch_at_maximum else ends.maximum * (1.0 - tolerance)

    def _beside_long_end(self, axis: int, share: float) -> float:
        """Return a length of the other line with which `axis` may go to its long end [m], `share` of W if that will do.

        A line of length l is taut as long as l <= sqrt(W² + m²), where m is the length of the other one. The gripper
        hangs at most m below the anchors then. If that is too low, m is shorter, and `axis` gets slack at its end.
        """
        longest = self._longest(axis)
        wanted = max(share * self._width, self._taut_with(longest) + 0.005)
        least = self._taut_with(longest - MOST_SLACK)
        return _inside(self._config, B + C - axis, max(least, min(wanted, self._config.deepest)))

    def _taut_with(self, length: float) -> float:
        """Return the least length of one line at which the other line is taut if it is `length` long [m]."""
        return sqrt(max(0.0, length * length - self._width * self._width))

    def _beside_short_b(self) -> float:
        """Return a length of c with which b stays taut to its short end, and b + c well above W [m]."""
        width, shortest = self._width, self._shortest(B)
        taut = hypot(width, shortest) - 0.02 * width
        return _inside(self._config, C, min(max(0.95 * width, (1.0 + OFF_END) * width - shortest), taut))

    def _angle_stroke(self) -> float:
        axis = self._config.axes.a
        return (axis.maximum - axis.minimum) * 1.1

    def _stroke(self, axis: int) -> float:
        ends = self._config.axes[axis]
        return (ends.maximum - ends.minimum) * (1.0 + self._config.homing.stroke_tolerance) + 0.1

    async def _raise(self) -> None:
        """Shorten both lines until the torque shows that they are nearly straight, or a line is at its short end.

        If a line could become too slack later, or the gripper too low, the other line then shortens alone until both
        are nearly straight.
        """
        load, look = await self._probe()
        if 0.0 < load < LEAST and not (look.reverse[B] or look.reverse[C]):
            reason = phrase("the torque read is too small for a hanging load, see homing.torque_per_load")
            raise HomingStalled(axis=AXES[B], reason=reason)
        while load < ENOUGH and not self._raised(look):
            step = self._safe_step(load, look)
            load, look = await self._shorten(step, self._speed, poll=0.05)
            if load == 0.0:
                load, look = await self._probe()
        if load < ENOUGH:
            return
        for axis in (B, C):
            if look.forward[axis]:
                raise self._seek.contradiction(axis, FORWARD, phrase("a line at its long end cannot be that tight"))
        await self._seek.go({B: RELAX, C: RELAX}, self._speed)

    def _raised(self, look: AxesReading) -> bool:
        """Return whether the lines are short enough although no torque shows that they are nearly straight."""
        slack = self._longest(B) - hypot(self._width, self._shortest(C))
        longest = max(self._shortest(B) + self._longest(C), self._shortest(C) + self._longest(B))
        deepest = 0.5 * self._taut_with(longest)  # of the gripper, in the middle of the ellipse
        ends = [look.reverse[axis] for axis in (B, C)]
        return all(ends) if slack > SLACK or deepest > self._config.deepest else any(ends)

    def _safe_step(self, load: float, look: AxesReading) -> float:
        """Return how far lines may be shortened [m] when the tighter moving line carries `load` (in loads).

        Of a line at its short end no torque is read. While the other one carries less than 0.55 loads, b + c - W is at
        least 0.52 times the length of the short line.
        """
        short = [self._shortest(axis) for axis in (B, C) if look.reverse[axis]]
        return min([_safe_step(load, self._width), *(0.1 * length for length in short)])

    async def _probe(self) -> tuple[float, AxesReading]:
        """Return the load on the tighter line [loads] and the reading after a tiny step.

        If no load was read, step back and retry.
        """
        look = await self._seek.look()
        step = round(PROBE * self._width, 6)
        speed = step / PROBE_TIME
        for attempt in range(6):
            load, look = await self._shorten(step, speed / 2**attempt, poll=0.02)
            if load > 0.0 or look.reverse[B] or look.reverse[C]:
                return load, look
            back = {axis: step for axis in (B, C) if not look.forward[axis]}  # a line at its long end is not tight
            await self._seek.go(back, speed)
        raise HomingStalled(axis=AXES[B], reason="its torque could not be read on the way: the link is too slow")

    async def _shorten(self, step: float, speed: float, poll: float) -> tuple[float, AxesReading]:
        """Shorten the lines that are not at their short ends; return the largest load [loads] and the last reading."""
        before = await self._seek.look()
        deltas = {axis: -step for axis in (B, C) if not before.reverse[axis]}
        seen = 0.0

        def watch(look: AxesReading) -> bool:
            nonlocal seen
            for axis in deltas:
                if look.running[axis]:
                    seen = max(seen, abs(look.torque[axis]) * self._sag)
            return seen > ENOUGH

        look = await self._seek.go(deltas, speed, poll=poll, until=watch)
        return seen, look

    async def _to_short_c(self) -> None:
        """Move along the ellipse until c is at its short end; if b meets its long end first, c continues alone."""
        look = await self._seek.look()
        if look.reverse[C]:
            return
        if not look.forward[B]:
            stroke = self._stroke(C)
            if look.reverse[B]:  # b's length is known then; at both ends at once, b would be slack by 0.25 m
                stroke = min(stroke, self._least_long(B) - self._shortest(B) - 0.05 * self._width)
            elif not self._config.axes.b.switch_at_maximum:  # the raise has ended with b + c at most 1.1 times W
                stroke = max(0.0, min(stroke, 1.1 * self._width - self._shortest(B) - self._shortest(C)))
            look = await self._seek.go({C: -stroke, B: stroke}, self._speed)
        if not look.met(C, REVERSE):
            await self._seek.go({B: -OFF_END * self._width}, self._speed)
            await self._reach(C, REVERSE, -self._stroke(C))

    async def _to_short_b(self) -> None:
        """Move back along the ellipse to a length of c that keeps b taut to its short end, then move b alone."""
        look = await self._seek.look()
        away = self._beside_short_b() - self._length(C, look)
        if not look.reverse[B]:
            look = await self._seek.go({C: away, B: -away}, self._speed)
        if not look.met(B, REVERSE):
            await self._reach(B, REVERSE, -self._stroke(B))

    async def _reach(self, axis: int, side: str, distance: float) -> AxesReading:
        """Move at most `distance` (rad or m) to a switch, and return the reading there; raises `SwitchNotFound`."""
        look = await self._seek.look()
        if not look.at(axis, side):
            look = await self._seek.go({axis: distance}, self._speed if axis != A else self._slew())
        if not look.met(axis, side):
            raise SwitchNotFound(axis=AXES[axis], side=side, distance=shown(AXES[axis], abs(distance)))
        return look

    async def _datum(self, axis: int, distance: float, side: str = REVERSE) -> None:
        """Define the counts of `axis` at its switch at `side`: back off, approach slowly, define the position.

        The axis rests past the switch by its stopping distance, v²/2a, and by its following error while moving.
        """
        away = 1.0 if side == REVERSE else -1.0
        await self._reach(axis, side, -away * distance)
        speed = self._approach(axis)
        released = await self._seek.go(
            {axis: away * RELEASE_WITHIN[axis]}, 4.0 * speed, poll=0.1, until=lambda look: not look.at(axis, side)
        )
        if released.at(axis, side):
            raise self._seek.contradiction(axis, side, phrase("it stays active though the axis has left it"))
        await self._seek.go({axis: away * CLEAR[axis]}, 4.0 * speed)
        lag = 0

        def note(look: AxesReading) -> bool:
            nonlocal lag
            if look.running[axis] and not look.at(axis, side):
                lag = abs(look.error[axis])
            return False

        look = await self._seek.go({axis: -away * 2.0 * BACK[axis]}, speed, poll=0.1, until=note)
        if not look.met(axis, side):
            raise SwitchNotFound(axis=AXES[axis], side=side, distance=shown(AXES[axis], 2.0 * BACK[axis]))
        past = lag + self._stopping(axis, speed)
        config = self._config.axes[axis]
        end = (config.minimum if side == REVERSE else config.maximum) * self._units.per_unit[axis]
        await self._seek.define(axis, round(end - away * past) - round(away) * MARGIN_COUNTS[axis])

    def _approach(self, axis: int) -> float:
        """Return the slow speed: as configured for the lines (m/s), a twentieth of its slew for the boom (rad/s)."""
        if axis == A:
            return self._config.axes.a.speed_counts / 20 / self._units.per_unit[A]
        return self._config.homing.slow_speed

    def _slew(self) -> float:
        """Return the speed of the boom [rad/s]: its slew, or less if it would come to rest too far behind a switch."""
        return min(self._config.axes.a.speed_counts / self._units.per_unit[A], self._braked(A))

    def _braked(self, axis: int) -> float:
        """Return the speed from which an axis brakes within `PAST` behind a switch (rad/s or m/s)."""
        deceleration = self._config.axes[axis].limit_deceleration_counts // 1024 * 1024 / self._units.per_unit[axis]
        return sqrt(2.0 * PAST[axis] * deceleration)

    def _stopping(self, axis: int, speed: float) -> float:
        """Return the way from a switch to rest [counts] when it ends a move at `speed`: v²/2a, a of the plane."""
        v = int(speed * self._units.per_unit[axis]) // 2 * 2
        return v * v / (2.0 * (self._config.axes[axis].limit_deceleration_counts // 1024 * 1024))

    def _length(self, axis: int, look: AxesReading) -> float:
        return look.counts[axis] / self._units.per_unit[axis]

    async def _long_end(self, axis: int, other: int, other_length: float) -> float:
        """Return where the long switch of a line trips [m], with the other line at `other_length` [m].

        Raises `StrokeDiffers` if this is not the configured stroke.
        """
        await self._make_room(axis, other, other_length)
        look = await self._reach(axis, FORWARD, self._stroke(axis))
        measured = self._length(axis, look) - self._stopping(axis, self._speed) / self._units.per_unit[axis]
        wanted = self._config.axes[axis].maximum
        if abs(measured / wanted - 1.0) > self._config.homing.stroke_tolerance + 0.002:
            raise StrokeDiffers(axis=AXES[axis], measured=shown(AXES[axis], measured), wanted=shown(AXES[axis], wanted))
        await self._seek.go({axis: -BACK[axis]}, self._speed)
        return measured

    async def _make_room(self, axis: int, other: int, other_length: float) -> None:
        """Bring the `other` line to a length [m], with `axis` as long as both lines need to be taut and not tight.

        The other line shortens first, alone, because that raises the gripper.
        """
        look = await self._seek.look()
        least = max(self._taut_with(other_length) + 0.02 * self._width, LOW * self._width - other_length)
        longer = max(0.0, least - self._length(axis, look))
        first = max(other_length, LOW * self._width - self._length(axis, look)) if longer else other_length
        look = await self._seek.go({other: first - self._length(other, look)}, self._speed)
        if longer:
            await self._seek.go({other: other_length - self._length(other, look), axis: longer}, self._speed)

    async def _to_pose(self) -> None:
        look = await self._seek.look()
        pose = homed_pose(self._config)
        lines = self._config.axes.b, self._config.axes.c
        if self._config.deepest < 0.65 * self._width or not all(line.switch_at_maximum for line in lines):
            for axis in (B, C):  # a line that becomes shorter first, alone, because that raises the gripper
                least = LOW * self._width - self._length(B + C - axis, look)
                shorter = max(pose[axis], least) - self._length(axis, look)
                look = await self._seek.go({axis: min(0.0, shorter)}, self._speed)
        await self._seek.go({axis: pose[axis] - self._length(axis, look) for axis in (B, C)}, self._speed)
        await self._seek.go({A: pose.a - self._length(A, look)}, self._slew())

    async def _explain(self, stall: Stall) -> MayaError:
        """Return the error of a stall; if no active switch explains it, back off both ways to test the switches.

        A switch that turns active while its axis leaves it raises `WiringContradictsCn` on the way.
        """
        error = self._seek.stalled(stall, phrase("it pushes against something and no switch is active"))
        if isinstance(error, HomingStalled):
            way = BACK[stall.axis] * 2.0
            for side, direction in ((FORWARD, way), (REVERSE, -way)):
                look = await self._seek.look()
                if look.at(stall.axis, side):
                    continue
                try:
                    await self._seek.go({stall.axis: direction}, self._approach(stall.axis) * 4)
                except Stall:
                    continue
        return error


async def guarded_move(seeker: Seeker, config: Config, units: Units, axis: int, distance: float) -> Jogged:
    """Move one axis slowly by `distance` (rad or m), until it meets its switch at most; towards an active one, not.

    A line that becomes shorter ends when it carries `ENOUGH` loads. Raises as `Seeker.go` does, and `HomingStalled`.
    """
    tight = False
    ahead = FORWARD if distance > 0.0 else REVERSE

    def until(look: AxesReading) -> bool:
        nonlocal tight
        loads = abs(look.torque[axis]) / config.homing.torque_per_load
        tight = tight or (
            axis != A and distance < 0.0 and config.homing.torque_readings and look.running[axis] and loads > ENOUGH
        )
        return tight

    before = await seeker.survey()
    if before.at(axis, ahead):
        return Jogged(AXES[axis], 0.0, "switch", phrase("its limit switch at this end is active"))
    slow = config.axes.a.speed_counts / 20 / units.per_unit[A] if axis == A else 2.0 * config.homing.slow_speed
    try:
        after = await seeker.go({axis: distance}, slow, poll=0.05, until=until)
    except Stall as stall:
        raise seeker.stalled(stall, phrase("it pushes against something and no switch is active")) from stall
    gone = (after.reference[axis] - before.reference[axis]) / units.per_unit[axis]
    if tight:
        return Jogged(AXES[axis], gone, "tension", phrase("the line carries twice the load"))
    if after.met(axis, ahead):
        return Jogged(AXES[axis], gone, "switch", phrase("its limit switch at this end is active"))
    return Jogged(AXES[axis], gone)


def _safe_step(load: float, width: float) -> float:
    """Return how far both lines may be shortened [m] when the tighter line carries `load` (in loads).

    In the middle of the ellipse T = A / (2 sqrt(A² - 1)) with A = (b + c) / W, so the load gives the remaining b + c -
    W; an eighth of it for each line leaves three quarters. Friction only makes the load look larger, hence the step
    smaller. `width` is W [m].
    """
    if load < 0.55:
        return 0.1 * width
    ratio = sqrt(4.0 * load * load / (4.0 * load * load - 1.0))
    return min(0.1, 0.125 * (ratio - 1.0)) * width
