"""Bounded moves of homing: each travels a distance at most, or ends early at a switch, a torque, or a stall.

Counts have no meaning yet, so no position is known here, only how far each axis went since it was powered. Every move
is sent whole and bounded: a lost host leaves no axis running.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.record import DataRecord
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.controller import homing_mark, registers, state_builder
from maya_un.controller.monitor import PositionReckoner
from maya_un.controller.registers import Torque
from maya_un.errors import CommandRejected, ForeignMotion, HomingStalled, MayaError, Stopped, WiringContradictsCn
from maya_un.motion.polyline import Polyline

Pause = Callable[[float], Awaitable[None]]
"""Waits until a loop time [s]; raises at once when the link is lost or a user stops the robot."""

Load = Callable[[Driver, Sequence[str]], Awaitable[None]]
"""Sends the commands that prepare a motion; raises where motion is not allowed."""

FORWARD, REVERSE = "forward", "reverse"

SETTLE = 0.06
"""Wait after the end of a profile [s] until the encoders are where the reference is."""

RELEASE_WITHIN = (0.09, 0.045, 0.045)
"""An active switch must release within this way (rad, m, m): its zone ends at the hard stop."""


async def brake(driver: Driver) -> None:
    """Stop a sequence along its path, at once and past every queue; has no effect if no sequence runs."""
    with suppress(CommandRejected):  # a refused ST S means that there is no sequence
        await driver.urgent("ST S")


def strays(record: DataRecord, config: Config, order: state_builder.Order) -> str:
    """Return the letters of the axes that move outside a sequence, which ST S does not reach."""
    axes = ((config.axes[i].letter, record.axes[place]) for i, place in enumerate(order))
    return "".join(sorted(letter for letter, axis in axes if axis.moving and not axis.coordinated))


class Stall(Exception):
    """An axis pushes and does not follow; the caller interprets the cause."""

    def __init__(self, axis: int) -> None:
        self.axis = axis
        super().__init__(AXES[axis])


@dataclass(frozen=True, slots=True)
class AxesReading:
    """Part of the data record about Maya's axes a, b, c: switches, counts, errors [counts], torque [V]."""

    moving: bool
    counts: tuple[int, int, int]
    reference: tuple[int, int, int]
    error: tuple[int, int, int]
    torque: tuple[float, float, float]
    running: tuple[bool, bool, bool]
    forward: tuple[bool, bool, bool]
    reverse: tuple[bool, bool, bool]
    stop_code: tuple[int, int, int]
    record: DataRecord

    def at(self, axis: int, side: str) -> bool:
        """Return whether the switch at `side` of `axis` reads active."""
        return (self.forward if side == FORWARD else self.reverse)[axis]

    def met(self, axis: int, side: str) -> bool:
        """Return whether a move that has just ended met the switch at `side`.

        At rest on its edge it may read either.
        """
        return self.at(axis, side) or self.stop_code[axis] == (2 if side == FORWARD else 3)


def look_at(record: DataRecord, config: Config) -> AxesReading:
    """Return the part of a data record that concerns Maya's axes, in the order a, b, c."""
    order = state_builder.indices(config)
    a, b, c = (record.axes[place] for place in order)
    forward, reverse = state_builder.limits(record, config, order)
    return AxesReading(
        moving=a.moving or b.moving or c.moving,
        counts=(a.position, b.position, c.position),
        reference=(a.reference, b.reference, c.reference),
        error=(a.error, b.error, c.error),
        torque=(a.torque, b.torque, c.torque),
        running=(a.moving, b.moving, c.moving),
        forward=forward,
        reverse=reverse,
        stop_code=(a.stop_code, b.stop_code, c.stop_code),
        record=record,
    )


class Seeker:
    """Makes bounded coordinated moves and watches switches, torque and following error on the way.

    `load` sends the commands that prepare a motion, if motion is allowed.
    """

    def __init__(
        self, driver: Driver, config: Config, units: Units, pause: Pause, clock: Callable[[], float], load: Load
    ) -> None:
        self._driver = driver
        self._config = config
        self._units = units
        self._pause = pause
        self._clock = clock
        self._load = load
        self._order = state_builder.indices(config)
        self._claimed: dict[tuple[int, str], int] = {}
        self._torque = Torque(config)
        self._reckoning = PositionReckoner(config, self._order)
        self._known: tuple[int, int, int] | None = None

    async def look(self) -> AxesReading:
        """Read the record, and return its part about Maya's axes."""
        return look_at(await self._driver.record(), self._config)

    async def survey(self) -> AxesReading:
        """Read the switches before anything moves, store which read active, and return the reading.

        Raises `WiringContradictsCn` for an impossible reading: both ends of an axis at once.
        """
        look = await self.look()
        for axis in range(3):
            if look.forward[axis] and look.reverse[axis]:
                raise self.contradiction(axis, "forward and reverse", phrase("both ends read active at once"))
        self._claimed = {
            (axis, side): look.counts[axis] for axis in range(3) for side in (FORWARD, REVERSE) if look.at(axis, side)
        }
        return look

    def contradiction(self, axis: int, side: str, reason: str) -> WiringContradictsCn:
        """Return the error for a switch whose reading cannot be true."""
        return WiringContradictsCn(axis=AXES[axis], side=side, cn=self._config.wiring.limit_active_level, reason=reason)

    async def go(
        self,
        deltas: Mapping[int, float],
        speed: float,
        *,
        poll: float = 0.25,
        until: Callable[[AxesReading], bool] | None = None,
    ) -> AxesReading:
        """Move axes by `deltas` (rad or m) together, the fastest at `speed` (rad/s or m/s); return the last reading.

        Ends early at a limit switch (the controller stops all axes together) or when `until` returns True. Raises
        `Stall` when an axis does not follow. Raises `WiringContradictsCn` for a switch that is active at the end
        towards which its axis is to move (no step of homing moves towards an active switch), that turns active while
        its axis leaves it, or that does not release. Raises `ForeignMotion` or `PositionChanged` for a foreign change.
        """
        counts = {axis: round(delta * self._units.per_unit[axis]) for axis, delta in deltas.items()}
        counts = {axis: count for axis, count in counts.items() if count}
        before = await self.look()
        self._require_known(before)
        if not counts:
            return before
        for axis, count in counts.items():
            ahead = FORWARD if count > 0 else REVERSE
            if before.at(axis, ahead):
                raise self.contradiction(axis, ahead, phrase("it reads active where the axis cannot be at that end"))
        end = self._clock() + await self._begin(counts, speed)
        path = _path(before, counts)
        halted = False
        while True:
            await self._pause(min(self._clock() + poll, max(end, self._clock() + 0.005)))
            look = await self.look()
            await self._require_ours(look)
            await self._examine(before, look, counts)
            self._require_on_way(path, before, look, counts)
            if not look.moving:
                await self._ended(look, counts, halted=halted)
                self._known = look.reference
                await self._pause(self._clock() + SETTLE)
                await self._load(self._driver, registers.commands(self._torque.rest))
                look = await self.look()
                self._require_known(look)
                return look
            if until is not None and not halted and until(look):
                halted = True
                await brake(self._driver)

    async def settle(self) -> AxesReading:
        """Brake on the path, wait until the axes are at rest, and return the reading."""
        await brake(self._driver)
        look = await self.look()
        while look.moving:
            letters = strays(look.record, self._config, self._order)
            if letters:
                await self._driver.urgent(f"ST{letters}")
            await self._pause(self._clock() + 0.02)
            look = await self.look()
        return look

    async def define(self, axis: int, counts: int) -> None:
        """Define the position of an axis at rest as `counts` (DP), and store its datum in the controller."""
        command = f"DP{self._config.axes[axis].letter}={counts}"
        await self._driver.batch([command, homing_mark.datum(self._config, self._units, axis)])
        if self._known is not None:
            a, b, c = (counts if i == axis else known for i, known in enumerate(self._known))
            self._known = a, b, c

    def _require_known(self, look: AxesReading) -> None:
        """Raise `ForeignMotion` or `PositionChanged` if the axes changed since the last step."""
        if self._known is None:
            return
        for axis, (known, here) in enumerate(zip(self._known, look.reference, strict=True)):
            if look.running[axis]:
                raise ForeignMotion(axis=AXES[axis])
            if here != known:
                raise self._reckoning.changed(axis, here - known)

    async def _require_ours(self, look: AxesReading) -> None:
        """Raise `ForeignMotion` if an axis moves independently."""
        foreign = state_builder.foreign(look.record, self._order)
        if foreign is not None:
            await self.settle()
            raise foreign

    def _require_on_way(
        self, path: Polyline, before: AxesReading, look: AxesReading, counts: Mapping[int, int]
    ) -> None:
        """Raise `PositionChanged` if the reference leaves the path of the step; other axes must not change."""
        for axis in set(range(3)) - counts.keys():
            if look.reference[axis] != before.reference[axis]:
                raise self._reckoning.changed(axis, look.reference[axis] - before.reference[axis])
        astray = self._reckoning.astray(path, look.reference)
        if astray is not None:
            raise astray

    async def _begin(self, counts: Mapping[int, int], speed: float) -> float:
        """Send the move and begin it; return its longest duration [s]."""
        axes = self._config.axes
        letters = {axes[axis].letter: count for axis, count in counts.items()}
        length = hypot(*counts.values())
        shares = {axis: abs(count) / length for axis, count in counts.items()}
        vector = min(speed * self._units.per_unit[axis] / share for axis, share in shares.items() if share)
        slew = max(2, int(min(vector, *(axes[i].speed_counts / s for i, s in shares.items() if s))) // 2 * 2)
        brake = _step1024(min(axes[i].stop_deceleration_counts / s for i, s in shares.items() if s))
        names = "".join(sorted(letters))
        limits = registers.commands(self._torque.homing(counts))
        values = ",".join(str(letters.get(letter, "")) for letter in "ABC").rstrip(",")
        await self._load(
            self._driver,
            [
                *limits,
                "CA S",
                "CS S",
                "VR 1",
                f"LM {names}",
                f"VS {slew}",
                f"VA {brake}",
                f"VD {brake}",
                f"LI {values}",
                "LE",
            ],
        )
        await self._pause(self._clock())
        await self._driver.send("BGS")
        if length < slew * slew / brake:
            return 2.0 * sqrt(length / brake)
        return length / slew + slew / brake

    async def _examine(self, before: AxesReading, look: AxesReading, counts: Mapping[int, int]) -> None:
        """Raise `WiringContradictsCn` if a switch contradicts the motion, `Stall` if an axis does not follow.

        SH sets the reference of a stalled axis to its position, so that it can be moved away.
        """
        for axis, count in counts.items():
            leaving = REVERSE if count > 0 else FORWARD
            if look.at(axis, leaving) and not before.at(axis, leaving):
                await self.settle()
                raise self.contradiction(axis, leaving, phrase("it turned active while the axis was leaving it"))
            start = self._claimed.get((axis, leaving))
            if start is None:
                continue
            if not look.at(axis, leaving):
                del self._claimed[axis, leaving]
            elif abs(look.counts[axis] - start) > RELEASE_WITHIN[axis] * self._units.per_unit[axis]:
                await self.settle()
                raise self.contradiction(axis, leaving, phrase("it stays active though the axis has left it"))
        for axis in counts:
            if abs(look.error[axis]) * 2 > self._config.axes[axis].error_limit_counts:
                await self.settle()
                await self._driver.send(f"SH{self._config.axes[axis].letter}")
                self._known = None
                raise Stall(axis)

    async def _ended(self, look: AxesReading, counts: Mapping[int, int], *, halted: bool) -> None:
        """Raise the error that ended the motion, unless it reached its end, a limit switch or our own stop.

        A motion that the guard or another program stopped does not continue.
        """
        error = state_builder.cause(look.record, self._order, tuple(counts))
        if error is None or _limit(error) or (halted and isinstance(error, Stopped)):
            return
        if isinstance(error, Stopped):
            await self._load(self._driver, [])  # raises if the guard stopped it
        raise error

    def stalled(self, stall: Stall, reason: str) -> MayaError:
        """Return the error for a stalled axis: its wiring if a switch that read active never released."""
        for axis, side in self._claimed:
            if axis == stall.axis:
                return self.contradiction(
                    axis, side, phrase("it reads active, yet the axis stands against its other end")
                )
        return HomingStalled(axis=AXES[stall.axis], reason=reason)


def _path(before: AxesReading, counts: Mapping[int, int]) -> Polyline:
    """Return the path of a step: from a reading by `counts` of some axes (0 to 2) [counts]."""
    ends = [here + counts.get(axis, 0) for axis, here in enumerate(before.reference)]
    return Polyline(np.array([before.reference, ends], dtype=np.float64))


def _limit(error: MayaError) -> bool:
    return isinstance(error, state_builder.LimitReached)


def _step1024(value: float) -> int:
    return max(1024, int(value) // 1024 * 1024)
