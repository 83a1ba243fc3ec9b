"""Robots for tests of the controller: homed at once, rewired, or a script of answers only."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager

from dmc41x3.driver import Driver
from dmc41x3.language.record import AxisRecord, DataRecord
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.timeline import Timeline
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import Transport
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.registers import operands, wanted
from maya_un.events import Event
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.testing import Rig, rig
from maya_un.values import Joints
from tests.homing_mark import take_over
from tests.virtual_time import elapse

HERE = Joints(0.3, 1.5, 1.3)
"""Position of `homed` robots, to a count."""

FAR = Joints(1.2, 1.0, 1.8)
"""A place some 35 s away from there."""

FIRMWARE = "DMC4133 Rev 1.3k"

BEAT = "mayabeat="
"""Prefix of the frequent messages from the host to the watchdog."""

OWN = ("maya", "MG_XQ7", "MG(_ZAB=")
"""Prefixes of messages from the host to the watchdog and about itself; these move nothing."""


@asynccontextmanager
async def homed(
    config: Config | None = None, *, truth: TrueConstants | None = None, live: bool = False
) -> AsyncIterator[Rig]:
    """Give a robot that stands at `HERE` and takes over the mark of a homing, which costs nothing."""
    async with rig(config, truth=truth, start=StartPose(*HERE), live=live) as bench:
        await take_over(bench.controller, bench.virtual, HERE)
        yield bench


@asynccontextmanager
async def far_away(latency: float, rate: float) -> AsyncIterator[Rig]:
    """Give a homed robot whose answers take `latency` [s]; its record is read at `rate` [Hz]."""
    config = parse({"controller": {"stream_rate": rate}})
    async with _plugged(MayaMechanics(start=StartPose(*HERE)), config, latency=latency, live=True) as bench:
        await take_over(bench.controller, bench.virtual, HERE)
        yield bench


@asynccontextmanager
async def rewired(config: Config, order: tuple[int, int, int]) -> AsyncIterator[Rig]:
    """Give a robot whose motors hang on other axes of its controller: `order[i]` is Maya's axis on the i-th."""
    async with _plugged(MayaMechanics(), config, order) as bench:
        yield bench


@asynccontextmanager
async def _plugged(
    mechanics: MayaMechanics,
    config: Config,
    order: tuple[int, int, int] = (0, 1, 2),
    *,
    latency: float = 0.0,
    live: bool = False,
) -> AsyncIterator[Rig]:
    virtual = VirtualController(VirtualDmc(_Rewired(mechanics, order)))
    sent = bytearray()

    async def dial() -> Transport:
        return _Late(virtual.loopback(), latency) if latency else virtual.loopback()

    controller = GalilController(dial, "twin", config, live=live)
    controller.tap(lambda way, data: sent.extend(data) if way == "tx" else None)
    try:
        await controller.open()
        yield Rig(controller, virtual, mechanics, sent)
    finally:
        await controller.close()
        await virtual.close()


async def foreign(bench: Rig, *commands: str) -> list[str]:
    """Send commands through a handle of somebody else's and return what they printed."""
    driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
    replies = await driver.batch(list(commands))
    await driver.close()
    return replies


def when_sent(bench: Rig, command: str, act: Callable[[], object]) -> None:
    """Call `act` once, as the next `command` arrives at the controller and before it is executed."""

    def look(_: str, way: str, data: bytes) -> None:
        if way == "rx" and command.encode() in data:
            bench.virtual.tap = None
            act()

    bench.virtual.tap = look


def kinds(bench: Rig, since: int = 0) -> list[type[Event]]:
    """Return the kinds of the events from number `since` on."""
    return [type(event) for event in bench.controller.events.since(since)]


def commands_in(sent: bytes) -> list[str]:
    """Return the commands of bytes on the wire."""
    return [command for command in sent.decode("ascii").replace(";", "\r").split("\r") if command]


def now() -> float:
    """Return the loop's time [s]."""
    return asyncio.get_running_loop().time()


def references(bench: Rig) -> tuple[float, float, float]:
    """Return where the twin's references are now (rad, m, m), its lag apart."""
    lines, scale = bench.mechanics.timelines, bench.controller.units.per_unit
    t = bench.virtual.machine.now
    a, b, c = (line.at(t)[0] / unit for line, unit in zip(lines, scale, strict=True))
    return a, b, c


def still_moving(bench: Rig) -> float:
    """Return how long the twin's axes will still move, alone or in their sequence [s]."""
    machine = bench.virtual.machine
    plane = machine.unit.core.planes["S"]
    ends = [axis.motion.profile.end for axis in machine.unit.axes if axis.motion is not None]
    ends += [plane.end] if plane.running else []
    return max(ends, default=machine.now) - machine.now


def record_of(*axes: AxisRecord, amplifier_status: int = 0, outputs: int = 0) -> DataRecord:
    """Return a data record of these axes A, B, C."""
    return DataRecord(axes=axes, amplifier_status=amplifier_status, outputs=(outputs, *(0,) * 9))


def box(config: Config, firmware: str = FIRMWARE, **kept: str) -> Callable[[str], bytes]:
    """Return the answers of a controller that stores its settings, but `kept` registers (`ERB="16384.0000"`)."""
    values = {name[1:]: "0.0000" for group in operands() for name in group}
    values |= {operand[1:]: f"{value:.4f}" for operand, value in wanted(config).items()} | kept

    def answer(command: str) -> bytes:
        if command == "\x12\x16":
            return f"{firmware}\r\n:".encode()
        if command.startswith("MG"):
            number, *names = command.removeprefix("MG").split(",")
            return f" {number}.0000 {' '.join(values[name[1:]] for name in names)}\r\n:".encode()
        return b":"

    return answer


class _Rewired:
    """Maya's mechanics with its motors on other axes of the controller."""

    def __init__(self, mechanics: MayaMechanics, order: tuple[int, int, int]) -> None:
        self._mechanics = mechanics
        self._order = order

    @property
    def timelines(self) -> Sequence[Timeline]:
        return tuple(self._mechanics.timelines[axis] for axis in self._order)

    def advance(self, t: float) -> None:
        self._mechanics.advance(t)

    def next_event(self, until: float) -> float | None:
        return self._mechanics.next_event(until)

    def position(self, axis: int) -> float:
        return self._mechanics.position(self._order[axis])

    def velocity(self, axis: int) -> float:
        return self._mechanics.velocity(self._order[axis])

    def torque(self, axis: int) -> float:
        return self._mechanics.torque(self._order[axis])

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        return self._mechanics.inputs(self._order[axis])

    def power(self, axis: int, on: bool) -> None:
        self._mechanics.power(self._order[axis], on)

    def limit_torque(self, axis: int, volts: float) -> None:
        self._mechanics.limit_torque(self._order[axis], volts)

    def output(self, bit: int, on: bool) -> None:
        self._mechanics.output(bit, on)

    def fail_encoder(self, axis: int, on: bool) -> None:
        self._mechanics.fail_encoder(self._order[axis], on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        self._mechanics.force_inputs(self._order[axis], **levels)


class _Late:
    """A transport whose answers take a while."""

    def __init__(self, transport: Transport, latency: float) -> None:
        self._transport = transport
        self._latency = latency

    @property
    def peer(self) -> str:
        return self._transport.peer

    async def read(self) -> bytes:
        data = await self._transport.read()
        await elapse(self._latency)
        return data

    def write(self, data: bytes) -> None:
        self._transport.write(data)

    async def close(self) -> None:
        await self._transport.close()
