"""Move one axis of an unknown machine by a little, within bounds that the controller itself enforces.

Nothing is known about the wiring, so the bounds do not depend on it: the torque is limited (TL, TK), the motor goes off
when the error exceeds an eighth of the configured limit (ER, OE), every move is sent whole and is short, the other
motors are off, limit switches and abort input stop the axis, and the guard in the controller stops it when this program
falls silent. A move is twice as long as the error limit, so that an axis whose encoder does not count is always
switched off.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from math import floor
from typing import NamedTuple

from dmc41x3.driver import Driver
from maya_un.axes import AXES
from maya_un.cancellation import run_to_end
from maya_un.commission.judgement import SIDES, SWITCHES, Readings, Trial
from maya_un.config import Config, Units
from maya_un.controller import state_builder
from maya_un.controller.registers import NOT_NOTED, Dial, Registers, Torque, identify, noted
from maya_un.controller.seek import SETTLE, AxesReading, look_at
from maya_un.controller.watchdog import Watchdog, WatchdogStatus
from maya_un.errors import CommandRejected, MachineError, MayaError, SwitchBlocks

SHARE = 8
"""The error limit of a trial is this part of the configured one."""

LENGTH = 2
"""Length of a trial [error limits]."""

HASTE = 5.0
"""The speed of a trial [error limits/s]."""

POLL = 0.02
"""Time between two readings in a motion [s]."""

LATE = 3.0
"""A trial that takes longer than expected by this is stopped [s]."""

HELD = 0.2
"""A motor that was switched on is watched for this time before it moves [s]."""

LEVELS = (0.1, 0.3, 1.0)
"""Torque limits of the boom, one after another [shares of the machine's own]."""

LINES = (2.0, 4.0)
"""Torque limits of a line [loads], before the one for the greatest tension."""

_MOST = 9.9982
_LEAST = 20
_STEP = 20.0 / 65536.0
_AT_LIMIT = 22


class Motion(NamedTuple):
    """The readings before and after a motion of `axis` by `counts`, and whether the controller switched it off.

    `begun` is false if it was switched off before its motion: as soon as its motor was on.
    """

    axis: int
    counts: int
    before: AxesReading
    after: AxesReading
    tripped: bool
    begun: bool = True

    def moved(self, axis: int) -> int:
        """Return by how much the encoder of an axis counted [counts]."""
        return self.after.counts[axis] - self.before.counts[axis]


class GuardedMachine:
    """A claimed controller, whose axes move one at a time and by a little."""

    def __init__(self, driver: Driver, config: Config, watchdog: Watchdog, firmware: str) -> None:
        self.driver = driver
        self.firmware = firmware
        self.supported = config.safety.self_locking
        """Whether the load stays without motors: the drums lock, or a person has supported the gripper."""
        self._watchdog = watchdog
        self._loop = asyncio.get_running_loop()
        self._torque: dict[str, float] = {}
        self._use(config)

    def _use(self, config: Config) -> None:
        self.config = config
        self.units = Units.of(config)
        self._order = state_builder.indices(config)

    async def configure(self, config: Config) -> None:
        """Write the registers of a configuration, with all motors off; raises `ParameterMismatch`."""
        self._use(config)
        await self.rest()
        await Registers(config).configure(self.driver)

    async def keep_torque(self) -> None:
        """Note the torque limits of the machine, in the controller too, to restore them after a lost link."""
        for letter in "ABC":
            try:
                volts = await self.driver.value(noted(letter))
            except CommandRejected:
                volts = NOT_NOTED
            if volts < 0.0:
                volts = await self.driver.value(f"_TL{letter}")
                await self.driver.send(f"{noted(letter)}={volts:.4f}")
            self._torque[letter] = volts

    async def restore_torque(self) -> None:
        """Write the noted torque limits back; raises as `Driver.batch`."""
        for letter, volts in self._torque.items():
            await self.driver.batch([f"TL{letter}={volts + 1e-5:.5f}", f"{noted(letter)}={NOT_NOTED}"])
        self._torque = {}

    async def look(self) -> AxesReading:
        """Return the present readings of a, b, c."""
        return look_at(await self.driver.record(), self.config)

    async def switches(self) -> Readings:
        """Return which limit inputs read active."""
        look = await self.look()
        return {(axis, side): look.at(axis, side) for axis, side in SWITCHES}

    async def abort_active(self) -> bool:
        """Return whether the abort input is active."""
        return await self.driver.value("_AB") == 0.0

    async def guard(self) -> None:
        """Start the guard in the controller; raises `GuardBlocked`."""
        await self._watchdog.install(self.driver)

    async def output(self, bit: int, *, high: bool) -> None:
        """Switch an output; raises the errors of ownership."""
        await self._watchdog.output(self.driver, bit, high=high)

    async def rest(self) -> None:
        """Stop every axis, and switch the motors off if the load stays without them."""
        letters = "".join(sorted(self._letter(axis) for axis in range(3)))
        with suppress(CommandRejected):
            await self.driver.urgent(f"ST{letters}")
        end = self._loop.time() + LATE
        while True:
            if not (await self.look()).moving:
                break
            if self._loop.time() > end:
                await self.driver.urgent("AB 1")  # it does not decelerate: stop at once
            await asyncio.sleep(POLL)
        if self.supported:
            await self.driver.send(f"MO{letters}")

    async def hold(self) -> None:
        """Switch all motors on at their places, and leave them on from now on: the support is taken away."""
        self.supported = False
        await self.configure(self.config)
        await self._watchdog.load(self.driver, [f"SH{self._letter(axis)}" for axis in range(3)])

    def error_limit(self, axis: int) -> int:
        """Return the error limit of a trial [counts]."""
        return max(_LEAST, self.config.axes[axis].error_limit_counts // SHARE)

    def distance(self, axis: int) -> float:
        """Return the length of a trial [rad or m]."""
        return LENGTH * self.error_limit(axis) / self.units.per_unit[axis]

    def levels(self, axis: int) -> tuple[float, ...]:
        """Return the torque limits of trials, one after another [V]."""
        config = self.config
        if axis == 0:
            most = self._torque.get(self._letter(axis), _MOST)
            return tuple(_cut(share * most) for share in LEVELS)
        most = Torque(config).most[self._letter(axis)]
        return (*(_cut(min(most, loads * config.homing.torque_per_load)) for loads in LINES), most)

    async def move(self, axis: int, way: float, volts: float) -> Motion:
        """Move an axis by `way` [rad or m] with at most `volts` [V]; its motor stays on unless it tripped.

        Raises `SwitchBlocks` for an active switch ahead, and the errors of the link. A cancellation stops the axis.
        """
        try:
            return await self._moved(axis, way, volts)
        except asyncio.CancelledError:
            await run_to_end(self._safe())
            raise
        except MayaError:
            await self._safe()
            raise

    async def _safe(self) -> None:
        with suppress(MachineError):  # the link is lost: the guard in the controller stops the axes
            await self.rest()

    async def _moved(self, axis: int, way: float, volts: float) -> Motion:
        letter, limits = self._letter(axis), self.config.axes[axis]
        counts = round(way * self.units.per_unit[axis])
        speed = max(2, int(min(limits.speed_counts, HASTE * self.error_limit(axis))) // 2 * 2)
        rate = limits.stop_deceleration_counts
        before = await self.look()
        await self._watchdog.load(
            self.driver,
            [
                f"TK{letter}=0",
                f"TL{letter}={volts + 1e-5:.5f}",
                f"ER{letter}={self.error_limit(axis)}",
                f"OE{letter}=1",
                f"SP{letter}={speed}",
                f"AC{letter}={rate}",
                f"DC{letter}={rate}",
                f"SD{letter}={limits.limit_deceleration_counts}",
                f"SH{letter}",
                f"PR{letter}={counts}",
            ],
        )
        await asyncio.sleep(HELD)
        begun = not self._off(await self.look(), axis)
        if begun:
            await self._begin(axis, letter, counts)
            await self._ended(axis, letter, abs(counts) / speed + speed / rate + LATE)
        after = await self.look()
        return Motion(axis, counts, before, after, self._off(after, axis), begun)

    async def _begin(self, axis: int, letter: str, counts: int) -> None:
        await self._watchdog.load(self.driver, [])
        try:
            await self.driver.send(f"BG{letter}")
        except CommandRejected as refused:
            if refused.details["tc"] != _AT_LIMIT:
                raise
            raise SwitchBlocks(axis=AXES[axis], side=SIDES[counts > 0]) from refused

    async def _ended(self, axis: int, letter: str, seconds: float) -> None:
        """Wait until a motion has ended; stop it after `seconds` [s]."""
        end = self._loop.time() + seconds
        while (await self.look()).running[axis]:
            if self._loop.time() >= end:
                await self.driver.urgent(f"ST{letter}")
                end = float("inf")
            await asyncio.sleep(POLL)
        await asyncio.sleep(2.0 * SETTLE)

    async def off(self, axis: int) -> None:
        """Switch a motor off, if the load stays."""
        if self.supported:
            await self.driver.send(f"MO{self._letter(axis)}")

    def trial(self, motion: Motion) -> Trial:
        """Return a motion for its judgement: counts as shares of the way of a trial of each axis."""
        a, b, c = (
            motion.moved(axis)
            / (abs(motion.counts) if axis == motion.axis else self.distance(axis) * self.units.per_unit[axis])
            for axis in range(3)
        )
        return Trial(motion.axis, 1 if motion.counts > 0 else -1, (a, b, c), motion.tripped)

    def _letter(self, axis: int) -> str:
        return self.config.axes[axis].letter

    def _off(self, look: AxesReading, axis: int) -> bool:
        return look.record.axes[self._order[axis]].motor_off


def _cut(volts: float) -> float:
    return floor(volts / _STEP) * _STEP


@asynccontextmanager
async def claimed(
    dial: Dial, address: str, config: Config, *, take_over: bool = False
) -> AsyncIterator[GuardedMachine]:
    """Connect, claim the controller, switch its motors off and write the registers, for the length of the block.

    With `take_over`, claims also a controller at rest whose owner is alive. At the end the axes are stopped and the
    controller is released. Raises `ConnectFailed`, `LinkTimeout`,
    `WrongController`, `ControllerOwned`, `ControllerMoves`, `ParameterMismatch`, `GuardBlocked`.
    """
    driver = await Driver.open(await dial(), timeout=config.controller.timeout)
    letters = "".join(sorted(config.axes[axis].letter for axis in range(3)))
    watchdog = Watchdog(config.safety.guard_time, letters, _nothing)
    machine: GuardedMachine | None = None
    try:
        firmware = await identify(driver, address)
        machine = GuardedMachine(driver, config, watchdog, firmware)
        one = machine

        async def moving() -> bool:
            return (await one.look()).moving

        await watchdog.claim(driver, address, moving, take_over=take_over)
        await machine.keep_torque()
        await machine.configure(config)
        await machine.guard()
        yield machine
    finally:
        await run_to_end(_released(driver, watchdog, machine))


def _nothing(_status: WatchdogStatus, _driver: Driver) -> None:
    """Ignore the status of the guard in a beat's answer: every motion asks for it by itself."""


async def _released(driver: Driver, watchdog: Watchdog, machine: GuardedMachine | None) -> None:
    up = machine is not None and not driver.lost.done()
    try:
        if up and machine is not None:
            with suppress(MayaError):
                if await watchdog.owner.holds(driver):
                    await machine.rest()
                    await machine.restore_torque()
        with suppress(MayaError):
            await watchdog.close(driver if up else None)
    finally:
        await driver.close()


Bounds = Mapping[int, float]
"""How far each axis (0 to 2) can move at most [rad, m, m]."""
