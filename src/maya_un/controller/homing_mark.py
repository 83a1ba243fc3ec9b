"""The mark that a homing leaves in the controller, and where this program leaves the axes at rest.

A reset erases the mark. A variable alone is not enough: if somebody burned it (command BV), a reset restores it. So the
mark is a pair: the variable `mayahome` and the axis user variable ZA (part of the data record, zero after a reset) must
hold the same number, and the lines' counts must lie within their strokes. After a reset the counts start at zero,
outside the strokes.

Counts depend on where the configuration of their homing placed the switches (`axes.*.minimum`), so the controller
stores that too, as `mayamina`, `mayaminb`, `mayaminc` [counts]. If a calibration has changed them since, the mark is no
longer valid. If a person gave the datum, `controller.datum` adds what the person said.

Every motion writes its rest position into `mayaata`, `mayaatb`, `mayaatc` [counts], valid while `mayamove` is 0. A
program that adopts the mark later compares it with the positions, and so detects foreign changes.
"""

from __future__ import annotations

from collections.abc import Sequence

from dmc41x3.driver import Driver
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.controller.datum import GivenDatum, written
from maya_un.errors import CommandRejected
from maya_un.values import Joints

_SLACK = 0.035
"""A measured long end may lie 3 % beyond the configured one, plus the way past its switch."""


def plausible(config: Config, here: Joints) -> bool:
    """Return whether the lines' counts are possible for a homed controller; after a reset the counts start at zero."""
    return all(
        axis.minimum - _SLACK <= length <= axis.maximum * (1 + _SLACK) + _SLACK
        for axis, length in ((config.axes.b, here.b), (config.axes.c, here.c))
    )


def datum(config: Config, units: Units, axis: int) -> str:
    """Return the command that stores the counts at which the datum of an axis (0, 1, 2) was defined."""
    return f"{_noted(axis)}={_datum_counts(config, units, axis)}"


def _noted(axis: int) -> str:
    return f"mayamin{AXES[axis]}"


def _datum_counts(config: Config, units: Units, axis: int) -> int:
    return round(config.axes[axis].minimum * units.per_unit[axis])


async def _datum_holds(driver: Driver, config: Config, units: Units, axis: int) -> bool:
    """Return whether the counts of an axis were defined as in `config`.

    Without a stored value, the manual's machine counts.
    """
    try:
        noted = await driver.value(_noted(axis))
    except CommandRejected:
        manual = Config()
        noted = _datum_counts(manual, Units.of(manual), axis)
    return noted == _datum_counts(config, units, axis)


async def leave(driver: Driver, ends: tuple[float, float], units: Units, given: GivenDatum | None = None) -> None:
    """Write the mark; `ends` are the long ends of lines b and c [m], `given` is the datum if a person gave it."""
    number = int(await driver.value("TIME")) & 0x3FFFFFFF | 1
    scale = units.per_unit
    await driver.batch(
        [
            f"ZAA={number}",
            f"mayaendb={round(ends[0] * scale[1])}",
            f"mayaendc={round(ends[1] * scale[2])}",
            *written(given, units),
            f"mayahome={number}",
        ]
    )


async def erase(driver: Driver) -> None:
    """Erase the mark: it is absent until a homing ends."""
    await driver.batch(["mayahome=0", "ZAA=0"])


async def remembered(driver: Driver) -> bool:
    """Return whether the controller still has the variable of the mark; a reset removes it."""
    try:
        await driver.value("mayahome")
    except CommandRejected:
        return False
    return True


MOVING = "mayamove=1"
"""Command before a motion: the rest position is unknown from now on."""


def resting(counts: Sequence[int]) -> list[str]:
    """Return the commands that write the rest positions of the references of a, b, c."""
    places = [f"mayaat{name}={count}" for name, count in zip(AXES, counts, strict=True)]
    return [*places, "mayamove=0"]


async def noted(driver: Driver) -> tuple[float, float, float] | None:
    """Return the written rest positions of the references of a, b, c [counts], None if unknown."""
    try:
        if await driver.value("mayamove") != 0.0:
            return None
        a, b, c = [await driver.value(f"mayaat{name}") for name in AXES]
    except CommandRejected:
        return None
    return a, b, c


async def read(driver: Driver, config: Config, units: Units, here: Joints) -> tuple[float, float] | None:
    """Return the measured long ends of b and c [m] of a valid mark, None without one."""
    try:
        number = await driver.value("mayahome")
        ends = (await driver.value("mayaendb"), await driver.value("mayaendc"))
    except CommandRejected:
        return None
    if number == 0 or number != await driver.value("_ZAA"):
        return None
    if not plausible(config, here):
        return None
    if not all([await _datum_holds(driver, config, units, axis) for axis in range(3)]):
        return None
    return ends[0] / units.per_unit[1], ends[1] / units.per_unit[2]
