"""The link to the controller, and the registers that safety depends on, torque limits included.

Torque limits of the line motors: almost no torque at rest; in motion the torque of the path, and a reserve.

A self-locking drum holds its load without its motor. So a line outside this program's motions gets too little torque to
lift any load: if another program begins to move it, the line stays. The controller enforces the bound (Galil DMC-41x3,
command TL), so it holds also while this program is late or dead.

To shorten a line that carries T loads, a motor needs `homing.torque_per_load` times T, and friction.

The registers that safety depends on are declared once, written at connect, and read periodically.

The configuration gives the value of some. Others, such as gains and types of motors and encoders, belong to the
machine: they must keep the value that they had when this program connected. The last motion sets those of the
coordinate system. All are read before every motion, a few periodically in motion, and all in turn at rest.

The link to the controller is opened, watched, and opened again after a loss. By itself it never sends motion.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import floor
from typing import NamedTuple

import numpy as np

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.numbers import parse_number
from dmc41x3.wire.transport import Transport
from maya_un.config import Config
from maya_un.errors import (
    CommandRejected,
    MachineError,
    MayaError,
    NotConnected,
    ParameterMismatch,
    RegisterChanged,
    UnexpectedReply,
    WrongController,
)
from maya_un.kinematics.mechanism import Floats

HOLD = 0.25
"""Torque of a line at rest [loads]: it overcomes friction at most, and holds the motor against shaking."""

HOMING = 4.0
"""Torque of a line that homing moves [loads]: it needs 2.6 on the tightest ellipse, and friction up to half a load."""

SPARE, FRICTION = 1.25, 1.0
"""In motion, a line gets this multiple of the greatest tension of its path, and these loads for friction."""

_LINES = (1, 2)
_STEP = 20.0 / 65536.0
_MOST = 9.9982

Volts = Mapping[str, float]
"""Torque limits by the letters of the controller's axes [V]."""


class Torque:
    """Torque limits of the lines of one machine."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._letters = {axis: config.axes[axis].letter for axis in _LINES}
        self._width = config.geometry.width

    @property
    def most(self) -> Volts:
        """The limits for the greatest tension of any path."""
        return self._each(_LINES, self._needed(self._config.safety.tension_limit))

    @property
    def rest(self) -> Volts:
        """The limits at rest; a drum that is not self-locking needs its motor to hold the load."""
        return self._each(_LINES, HOLD) if self._config.safety.self_locking else self.most

    def homing(self, axes: Collection[int]) -> Volts:
        """Return the limits for a step of homing that moves `axes` (0 to 2)."""
        if not self._config.safety.self_locking:
            return self.most
        return {**self.rest, **self._each(axes, HOMING)}

    def travel(self, axes: Collection[int], knots: Floats) -> Volts:
        """Return the limits for a motion of `axes` (0 to 2) through `knots` (n, 3) [rad, m, m]."""
        if not self._config.safety.self_locking:
            return self.most
        return {**self.rest, **self._each(axes, self._needed(self.peak(knots)))}

    def peak(self, knots: Floats) -> float:
        """Return the greatest tension of a line at any of `knots` [multiples of the load].

        T_b = (W - u)/W · b/h and T_c = u/W · c/h, with u and h the place of the load from anchor b.
        """
        b, c, width = knots[:, 1], knots[:, 2], self._width
        u = np.clip((width * width + b * b - c * c) / (2.0 * width), 0.0, width)
        h = np.sqrt(np.maximum(b * b - u * u, 1e-9))
        return float((np.maximum((width - u) * b, u * c) / (width * h)).max(initial=0.0))

    @staticmethod
    def _needed(tension: float) -> float:
        return SPARE * tension + FRICTION

    def _each(self, axes: Collection[int], loads: float) -> dict[str, float]:
        volts = min(_MOST, loads * self._config.homing.torque_per_load)
        kept = floor(volts / _STEP) * _STEP
        return {self._letters[axis]: kept for axis in axes if axis in self._letters}


def commands(limits: Volts) -> list[str]:
    """Return the commands that set torque limits."""
    return [f"TL{letter}={volts + 1e-5:.5f}" for letter, volts in limits.items()]  # rounded up: the controller cuts


NOT_NOTED = -1
"""Value of a variable `noted` that notes nothing."""


def noted(letter: str) -> str:
    """Return the variable of the controller with the torque limit of an axis before a commissioning [V]."""
    return f"mayatl{letter.lower()}"


async def restore_torque(driver: Driver) -> None:
    """Put the torque limits back that a commissioning noted in the controller and could not put back itself."""
    for letter in "ABC":
        try:
            volts = await driver.value(noted(letter))
        except CommandRejected:
            return  # a commissioning notes them in this order: nothing is noted
        if 0.0 <= volts <= _MOST + _SAME:
            await driver.batch([*commands({letter: volts}), f"{noted(letter)}={NOT_NOTED}"])


_SAMPLE = 1000
"""TM [us, nominal]: speeds and the guard's time refer to this value."""

_PRINTED = 10.4
_FORMAT = f"VF {_PRINTED}"
"""Format of printed numbers: a narrower format, set by another program, would truncate the answers."""

_SAME = 5e-4
"""Values that differ by less are equal: the controller prints four decimals and rounds to its own steps."""

_ODD = frozenset({"TM", "CN"})

_PLANE = {"VS": 2.0, "VA": 1024.0, "VD": 1024.0, "VR": 0.0}
"""Registers of the coordinate system that every motion sets, and the steps to which the controller rounds."""


class Group(NamedTuple):
    """Registers that are read in one line: of every axis, of the coordinate system S, of the whole controller."""

    axes: str = ""
    plane: str = ""
    whole: str = ""


GROUPS = (
    Group(axes="LD OE ER", plane="VR VS VA VD", whole="CN0"),
    Group(axes="TL TK GR OF", whole="TM CN3"),
    Group(axes="SP AC DC SD"),
    Group(axes="FL BL"),
    Group(axes="MT CE DV AF"),
    Group(axes="KP KI KD"),
    Group(axes="IT PT FV BR"),
    Group(axes="FA IL PL GM"),
    Group(axes="NB NF NZ"),
    Group(axes="OA OT OV BW"),
)
"""Every register that safety depends on (Galil DMC-41x3); in motion, the first group is read often."""

MEANING = frozenset({"MT", "CE", "DV", "AF", "GR"})
"""Registers that define the meaning of counts: a change makes the homing invalid."""


def wanted(config: Config) -> dict[str, float]:
    """Return register operands (`_TM`, `_SPA`, `_ERB`, `_CN0`, …) and their values in the configuration.

    Software limits (FL, BL) are off: the whole-path check is narrower, and before homing they mean nothing.
    Accelerations are what the controller makes of them: multiples of 1024 counts/s², speeds even (Galil AC, SP).
    """
    values: dict[str, float] = {"_TM": _SAMPLE, "_CN0": config.wiring.limit_active_level}
    for axis in (config.axes.a, config.axes.b, config.axes.c):
        values |= {
            f"_SP{axis.letter}": axis.speed_counts // 2 * 2,
            f"_AC{axis.letter}": axis.acceleration_counts // 1024 * 1024,
            f"_DC{axis.letter}": axis.stop_deceleration_counts // 1024 * 1024,
            f"_SD{axis.letter}": axis.limit_deceleration_counts // 1024 * 1024,
            f"_ER{axis.letter}": axis.error_limit_counts,
            f"_OE{axis.letter}": config.safety.oe,
            f"_LD{axis.letter}": (not axis.switch_at_maximum) + 2 * (not axis.switch_at_minimum),
            f"_FL{axis.letter}": 2_147_483_647,
            f"_BL{axis.letter}": -2_147_483_648,
            f"_TK{axis.letter}": 0,
            f"_GR{axis.letter}": 0,
        }
    return values | {f"_TL{letter}": volts for letter, volts in Torque(config).rest.items()}


def operands() -> list[list[str]]:
    """Return the operands of every group, in order."""
    return [
        [
            *(f"_{name}S" for name in group.plane.split()),
            *(f"_{name}{letter}" for name in group.axes.split() for letter in "ABC"),
            *(f"_{name}" for name in group.whole.split()),
        ]
        for group in GROUPS
    ]


async def identify(driver: Driver, address: str) -> str:
    """Return the firmware line of the device; raises `WrongController` unless it is a three-axis DMC-41x3."""
    firmware = await driver.send("\x12\x16")
    if not firmware.isprintable():  # a terminal would execute its control characters
        raise WrongController(address=address, found=repr(firmware))
    family = firmware.startswith("DMC41") and len(firmware) > 6 and firmware[6] == "3"
    if not family or not firmware[5].isdigit() or int(firmware[5]) < 3:
        raise WrongController(address=address, found=firmware or phrase("silent"))
    return firmware


@dataclass(frozen=True, slots=True)
class PendingRead:
    """A pending read of registers, and the expected values."""

    answers: asyncio.Future[list[str]]
    lines: Sequence[RegisterRead]
    expected: Mapping[str, float]


class RegisterRead(NamedTuple):
    """One read: its number, with which the answer begins, and the operands whose values follow."""

    number: int
    operands: tuple[str, ...]

    @property
    def command(self) -> str:
        """The command of this read."""
        return f"MG{self.number},{','.join(self.operands)}"

    def read(self, answer: str) -> dict[str, float]:
        """Return the values of an answer by operand; raises `UnexpectedReply` for the answer to another command."""
        try:
            number, *values = (parse_number(word) for word in answer.split())
        except ValueError as error:
            raise UnexpectedReply(command=self.command, reply=answer) from error
        if number != self.number or len(values) != len(self.operands):
            raise UnexpectedReply(command=self.command, reply=answer)
        return dict(zip(self.operands, values, strict=True))


class Registers:
    """The registers of one controller, and their expected values."""

    def __init__(self, config: Config) -> None:
        self._wanted = wanted(config)
        self._lines = tuple(RegisterRead(number, tuple(names)) for number, names in enumerate(operands(), start=1))
        self._kept: dict[str, float] = {}
        self._expected: dict[str, float] = {}
        assert all(len(line.command) <= LINE_LIMIT for line in self._lines)

    @property
    def known(self) -> bool:
        """Whether the registers have been written and read since this program connected."""
        return bool(self._expected)

    @property
    def written(self) -> bool:
        """Whether the registers have ever been written, also before a link was lost."""
        return bool(self._kept)

    def sent(self, commands: Iterable[str]) -> None:
        """Store the values that sent commands give to the coordinate system and TL, as expected values."""
        if not self._expected:
            return
        for command in commands:
            name, value = command[:2], command[3:]
            if name in _PLANE:
                self._expected[f"_{name}S"] = (
                    float(value) // _PLANE[name] * _PLANE[name] if name != "VR" else float(value)
                )
            elif name == "TL":
                self._expected[f"_TL{command[2]}"] = float(command[4:])

    def torque(self, limits: Volts) -> list[str]:
        """Return the commands that set torque limits, without unchanged ones."""
        known = self._expected
        return commands(
            {letter: volts for letter, volts in limits.items() if abs(known.get(f"_TL{letter}", -1.0) - volts) > _SAME}
        )

    async def configure(self, driver: Driver) -> None:
        """Write every register of the configuration, read all, and accept those of the machine.

        Machine registers that were stored before are written back. Raises `ParameterMismatch` if the controller has
        another value. Until this returns, and after an error or a cancel, the earlier expected values are kept.

        DC holds the stop's deceleration, because axis-wise motion is used only to stop.
        """
        written = self._wanted | self._kept
        found = await self._read(driver) if self._kept else {}
        restored = {name: value for name, value in self._kept.items() if found.get(name) != value}
        changes = self._wanted | restored
        await driver.batch([_FORMAT, *(_command(operand, value) for operand, value in changes.items())])
        found = await self._read(driver)
        for operand, value in written.items():
            if abs(found.get(operand, value) - value) > _SAME:
                raise ParameterMismatch(register=operand[1:], found=f"{found[operand]:g}", wanted=f"{value:g}")
        plane = {name: value for name, value in found.items() if name.endswith("S") and len(name) == 4}
        self._kept = {name: value for name, value in found.items() if name not in self._wanted and name not in plane}
        self._expected = found | self._wanted

    async def adopt(self, driver: Driver) -> None:
        """Do what `configure` does, and the first time accept the machine's values from before a commissioning."""
        if not self.written:
            await restore_torque(driver)
        await self.configure(driver)

    def forget(self) -> None:
        """Expect no values until the registers are configured again."""
        self._expected = {}

    def ask(self, driver: Driver, numbers: Iterable[int] | None = None) -> PendingRead:
        """Send the read of groups of registers (by their indices in `GROUPS`; None: all), before returning."""
        return self._ask(driver, self._lines if numbers is None else [self._lines[number] for number in numbers])

    async def require(self, driver: Driver, asked: PendingRead) -> None:
        """Raise `RegisterChanged` if a register differs; raises as `Driver.batch`, and `UnexpectedReply`.

        An unreadable answer proves nothing, nor does an answer after another program changed the print format (VF). The
        registers of `asked` are then read again.
        """
        try:
            changed = await _difference(asked)
            doubtful = changed is not None and await driver.value("_VF") != _PRINTED
        except UnexpectedReply:
            changed, doubtful = None, True
        if doubtful:
            await driver.send(_FORMAT)
            changed = await _difference(self._ask(driver, asked.lines))
        if changed is not None:
            raise await self._cause(driver, changed)

    async def _cause(self, driver: Driver, changed: RegisterChanged) -> RegisterChanged:
        """Return the change of TM if TM changed, else `changed`.

        The speeds and accelerations that are read scale with TM.
        """
        expected, found = self._expected.get("_TM"), await driver.value("_TM")
        if expected is None or abs(found - expected) <= _SAME:
            return changed
        return RegisterChanged(register="TM", found=f"{found:g}", wanted=f"{expected:g}")

    def _ask(self, driver: Driver, lines: Sequence[RegisterRead]) -> PendingRead:
        expected = {name: self._expected[name] for line in lines for name in line.operands if name in self._expected}
        return PendingRead(driver.begin_batch([line.command for line in lines]), lines, expected)

    async def _read(self, driver: Driver) -> dict[str, float]:
        """Return the values of all registers; drops registers that this controller lacks from their line."""
        found: dict[str, float] = {}
        lines: list[RegisterRead] = []
        for line in self._lines:
            try:
                found |= line.read(await driver.send(line.command))
                lines.append(line)
            except CommandRejected:
                values = await _one_by_one(driver, line.operands)
                found |= values
                lines.append(RegisterRead(line.number, tuple(values)))
        self._lines = tuple(lines)
        return found


async def _difference(asked: PendingRead) -> RegisterChanged | None:
    """Return the error for the first register that is not as expected, None without one."""
    answers = await asked.answers
    for line, answer in zip(asked.lines, answers, strict=True):
        for name, value in line.read(answer).items():
            expected = asked.expected.get(name, value)
            if abs(value - expected) > _SAME:
                return RegisterChanged(register=name[1:], found=f"{value:g}", wanted=f"{expected:g}")
    return None


async def _one_by_one(driver: Driver, names: Sequence[str]) -> dict[str, float]:
    values: dict[str, float] = {}
    for name in names:
        try:
            values[name] = await driver.value(name)
        except CommandRejected:
            continue
    return values


def _command(operand: str, value: float) -> str:
    if operand.startswith("_TL"):
        return commands({operand[3:]: value})[0]
    number = f"{value:.4f}".rstrip("0").rstrip(".")
    if operand[1:3] in _ODD:
        return f"CN {',' * int(operand[3:])}{number}" if operand.startswith("_CN") else f"TM {number}"
    return f"{operand[1:]}={number}"


Dial = Callable[[], Awaitable[Transport]]
"""Opens a transport to the controller; raises `ConnectFailed`."""

RETRY = (0.5, 1.0, 2.0, 5.0)
"""Waits between attempts to reach a lost controller [s]; the last one repeats."""


class DriverLink:
    """One driver at a time; `firmware` is the firmware line that the device last returned.

    Calls `on_lost` once with the reason of a loss, and `on_back` when the controller answers again.
    """

    def __init__(
        self,
        dial: Dial,
        address: str,
        timeout: float,
        on_lost: Callable[[MachineError], None],
        on_back: Callable[[Driver], Awaitable[None]],
    ) -> None:
        self._dial = dial
        self.address = address
        self.firmware = ""
        self._timeout = timeout
        self._on_lost = on_lost
        self._on_back = on_back
        self._driver: Driver | None = None
        self._keeper: asyncio.Task[None] | None = None
        self._tap: Callable[[str, bytes], None] | None = None

    def tap(self, listener: Callable[[str, bytes], None]) -> None:
        """Pass every byte on the wire to `listener` ("tx" or "rx"), of this connection and of later ones."""
        self._tap = listener
        if self._driver is not None:
            self._driver.tap = listener

    @property
    def up(self) -> bool:
        """Whether a driver exists whose link has not been lost."""
        return self._driver is not None and not self._driver.lost.done()

    @property
    def driver(self) -> Driver:
        """The driver; raises `NotConnected` without one."""
        if self._driver is None or self._driver.lost.done():
            raise NotConnected
        return self._driver

    async def open(self) -> Driver:
        """Connect, check that the device is a DMC-41x3, keep the link from now on, and return the driver.

        Raises `ConnectFailed`, `LinkTimeout`, `WrongController`.
        """
        self._driver = await self._connect()
        self._keeper = asyncio.get_running_loop().create_task(self._keep(), name="keep link")
        return self._driver

    async def close(self) -> None:
        """Close the link and release the handle."""
        if self._keeper is not None:
            self._keeper.cancel()
            await asyncio.gather(self._keeper, return_exceptions=True)
            self._keeper = None
        if self._driver is not None:
            await self._driver.close()
            self._driver = None

    async def _connect(self) -> Driver:
        transport = await self._dial()
        driver = await Driver.open(transport, timeout=self._timeout)
        driver.tap = self._tap
        try:
            self.firmware = await identify(driver, self.address)
        except BaseException:
            await driver.close()
            raise
        return driver

    async def _keep(self) -> None:
        while True:
            assert self._driver is not None
            reason = await asyncio.shield(self._driver.lost)
            await self._driver.close()
            self._on_lost(reason)
            self._driver = await self._again()
            await self._on_back(self._driver)

    async def _again(self) -> Driver:
        attempt = 0
        while True:
            await asyncio.sleep(RETRY[min(attempt, len(RETRY) - 1)])
            attempt += 1
            try:
                return await self._connect()
            except MayaError:
                continue
