"""The controller's registers as the configuration wants them: written at connect, then read back."""

from __future__ import annotations

from maya_un.config import Config
from maya_un.errors import ParameterMismatch, UnexpectedReply, WrongController
from maya_un.galil.driver import Driver
from maya_un.galil.numbers import parse_number

_SAMPLE = 1000
"""TM [us, nominal]: speeds, and the guard's time, are meant at this one."""

_FORMAT = "VF 10.4"
"""How numbers are printed: a narrower format, left by somebody else, would cut what is read back."""


def wanted(config: Config) -> dict[str, int]:
    """Return register operands (`_TM`, `_SPA`, `_ERB`, `_CN0`, …) and the values the configuration asks for.

    Software limits (FL, BL) are off: the whole-path check is narrower, and before homing they mean nothing.
    Accelerations are what the controller makes of them: multiples of 1024 counts/s², speeds even (Galil AC, SP).
    """
    values: dict[str, int] = {"_TM": _SAMPLE, "_CN0": config.wiring.limit_active_level}
    for axis in (config.axes.a, config.axes.b, config.axes.c):
        values |= {
            f"_SP{axis.letter}": axis.speed_counts // 2 * 2,
            f"_AC{axis.letter}": axis.acceleration_counts // 1024 * 1024,
            f"_DC{axis.letter}": axis.stop_deceleration_counts // 1024 * 1024,
            f"_SD{axis.letter}": axis.limit_deceleration_counts // 1024 * 1024,
            f"_ER{axis.letter}": axis.error_limit_counts,
            f"_OE{axis.letter}": config.safety.oe,
            f"_LD{axis.letter}": 0,
            f"_FL{axis.letter}": 2_147_483_647,
            f"_BL{axis.letter}": -2_147_483_648,
        }
    return values


async def identify(driver: Driver, address: str) -> str:
    """Return the firmware line of the device; raises `WrongController` unless it is a three-axis DMC-41x3."""
    firmware = await driver.send("\x12\x16")
    family = firmware.startswith("DMC41") and len(firmware) > 6 and firmware[6] == "3"
    if not family or not firmware[5].isdigit() or int(firmware[5]) < 3:
        raise WrongController(address=address, found=firmware or "silent")
    return firmware


async def configure(driver: Driver, config: Config) -> None:
    """Write every register and read it back; raises `ParameterMismatch` where the controller kept another value.

    DC holds the stop's deceleration: an axis-wise move is never used for travel, only an axis-wise stop is.
    """
    values = wanted(config)
    await driver.batch([_FORMAT, *(_command(operand, value) for operand, value in values.items())])
    replies = await driver.batch([f"MG {operand}" for operand in values])
    for (operand, value), reply in zip(values.items(), replies, strict=True):
        try:
            found = parse_number(reply)
        except ValueError as error:
            raise UnexpectedReply(command=f"MG {operand}", reply=reply) from error
        if found != value:
            raise ParameterMismatch(register=operand[1:], found=reply, wanted=value)


def _command(operand: str, value: int) -> str:
    if operand in ("_CN0", "_TM"):
        return f"{operand[1:3]} {value}"
    return f"{operand[1:]}={value}"
