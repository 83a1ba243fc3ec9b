"""Checks of a controller over a separate handle: only queries; nothing is changed and nothing moves."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator

from dmc41x3.address import parse
from dmc41x3.driver import Driver
from dmc41x3.language.hardware import SAMPLES
from dmc41x3.language.numbers import parse_number
from dmc41x3.wire.transport import connect
from maya_un.axes import AXES
from maya_un.config import Config
from maya_un.controller import state_builder
from maya_un.controller.ownership import living_owner
from maya_un.controller.registers import Torque, identify
from maya_un.errors import CommandRejected, ConnectFailed, MayaError
from maya_un.http.doctor.finding import Finding, fail, ok, warn
from maya_un.http.doctor.robot import limits

PATIENCE = 2.0
"""Longest wait for the connection and for each answer [s]."""

SPAN = 0.25
"""Duration for which the controller's clock is observed [s]."""

_ROUNDING = 0.01
"""Amount by which the controller's reported torque limit may exceed the set one [V]."""

FEW = 2
"""With at most this many free handles, a disconnected program may not be able to reconnect."""

THREADS = 8

_HANDLE = re.compile(r"IH([A-H])\s+(.*)")


async def findings(address: str, config: Config, language: str) -> list[Finding]:
    """Yield the results of all checks of the controller at an address."""
    loop = asyncio.get_running_loop()
    try:
        began = loop.time()
        driver = await Driver.open(await connect(parse(address), PATIENCE), timeout=PATIENCE)
    except MayaError as error:
        return [fail("controller", "controller_silent", error=error.text(language))]
    try:
        return [finding async for finding in _asked(driver, address, config, language, began)]
    finally:
        await driver.close()


async def _asked(driver: Driver, address: str, config: Config, language: str, began: float) -> AsyncIterator[Finding]:
    try:
        firmware = await identify(driver, address)
        took = asyncio.get_running_loop().time() - began
        yield ok("controller", "controller_answers", address=address, milliseconds=took * 1e3)
        yield ok("firmware", "firmware", firmware=firmware)
    except ConnectFailed as error:
        yield fail("controller", "controller_silent", error=error.text(language))
        return
    except MayaError as error:
        yield fail("controller", "controller_wrong", error=error.text(language))
        return
    for look in (_owner, _handles, _record, _level, _program, _memory, _clock):
        try:
            async for finding in look(driver, config, language):
                yield finding
        except CommandRejected as error:
            yield warn("controller", "controller_refuses", command=error.details["command"], reason=str(error))
        except MayaError as error:
            yield fail("controller", "controller_wrong", error=error.text(language))
            return


async def _owner(driver: Driver, config: Config, _: str) -> AsyncIterator[Finding]:
    """Check its owner (decision 37), and without one the torque limits, which a killed program may have left low."""
    holder = await living_owner(driver)
    if holder:
        yield ok("owner", "owned", holder=holder)
        return
    yield ok("owner", "owned_by_nobody")
    rest = Torque(config).rest if config.safety.self_locking else {}
    found = {letter: await driver.value(f"_TL{letter}") for letter in rest}
    low = {letter: volts for letter, volts in found.items() if volts <= rest[letter] + _ROUNDING}
    if low:
        told = ", ".join(f"TL{letter}={volts:.2f}" for letter, volts in low.items())
        yield warn("torque", "torque_low", found=told)


async def _handles(driver: Driver, _: Config, __: str) -> AsyncIterator[Finding]:
    """Check the owners of its Ethernet handles (Galil DMC-41x3, commands TH and WH)."""
    lines = [found for line in (await driver.send("TH")).splitlines() if (found := _HANDLE.search(line))]
    own = (await driver.send("WH")).strip()
    taken = [(f"IH{line[1]}", line[2].strip()) for line in lines if "AVAILABLE" not in line[2]]
    others = "; ".join(f"{handle} {_peer(what)}" for handle, what in taken if handle != own) or "–"
    free = len(lines) - len(taken)
    key = "handles_short" if free < FEW else "handles_free"
    found = warn if free < FEW else ok
    yield found("handles", key, free=free, all=len(lines), own=own, others=others)


def _peer(what: str) -> str:
    """Return the peer of a handle, as TH lists it, in the usual notation."""
    found = re.search(r"(TCP|UDP).*TO IP ADDRESS (\d+),(\d+),(\d+),(\d+) PORT (\d+)", what)
    return what if found is None else f"{found[1]} {found[2]}.{found[3]}.{found[4]}.{found[5]}:{found[6]}"


async def _record(driver: Driver, config: Config, language: str) -> AsyncIterator[Finding]:
    record, order = await driver.record(), state_builder.indices(config)
    if max(order) >= len(record.axes):
        return
    axes = [record.axes[place] for place in order]
    yield limits(*state_builder.limits(record, config, order))
    off = [name for name, axis in zip(AXES, axes, strict=True) if axis.motor_off]
    yield warn("motors", "motors_off", axes=", ".join(off)) if off else ok("motors", "motors_on")
    error = state_builder.grave(record, order)
    if error is not None:
        yield warn("motors", "controller_fault", error=error.text(language))


async def _level(driver: Driver, config: Config, _: str) -> AsyncIterator[Finding]:
    """Compare the active level of the switches (Galil DMC-41x3, command CN) with the configuration."""
    wanted, found = config.wiring.limit_active_level, await driver.value("_CN0")
    if found == wanted:
        yield ok("limits", "level_same", found=f"{found:.0f}")
    else:
        yield warn("limits", "level_differs", found=f"{found:.0f}", wanted=wanted)


async def _program(driver: Driver, _: Config, __: str) -> AsyncIterator[Finding]:
    """Check which threads run (Galil DMC-41x3, operand _XQ: the line, -1 for none)."""
    lines = await driver.batch([f"MG _XQ{thread}" for thread in range(THREADS)])
    running = [str(thread) for thread, line in enumerate(lines) if parse_number(line) >= 0.0]
    if running:
        yield warn("program", "program_runs", threads=", ".join(running))
    else:
        yield ok("program", "program_none")


async def _memory(driver: Driver, _: Config, __: str) -> AsyncIterator[Finding]:
    """Check whether the burned memory was intact at power-up (Galil DMC-41x3, operand _RS)."""
    found = await driver.value("_RS")
    yield warn("memory", "memory_damaged", found=found) if found else ok("memory", "memory_sound")


async def _clock(driver: Driver, _: Config, __: str) -> AsyncIterator[Finding]:
    """Measure the rate of its clock (Galil DMC-41x3, operands TIME and _TM)."""
    loop = asyncio.get_running_loop()
    period = await driver.value("_TM")
    first, began = await driver.value("TIME"), loop.time()
    await asyncio.sleep(SPAN)
    counts = (await driver.value("TIME") - first) / (loop.time() - began)
    right = abs(counts / SAMPLES - 1.0) <= 0.2 and period == 1000.0
    found, key = (ok, "controller_clock") if right else (warn, "controller_clock_off")
    yield found("controller clock", key, counts=counts, period=period)
