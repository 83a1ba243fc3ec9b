"""Power-up, reset and burning: what a controller forgets and what it comes up with (RS, ^R^S, BN, BP, BV).

What is burned of the parameters: the registers of axes and planes (but for ZA and VV), whether motors are off, CN,
and the formats, ports and addresses. Outputs come up off. The reply to a burn comes at once, though the controller
takes up to seconds; records by themselves (DR) pause as long as it does.
"""

from __future__ import annotations

from contextlib import suppress

from dmc41x3.errors import FileUnwritable
from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin import registers
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.memory import Parameters
from dmc41x3.twin.network import SERIAL, Network, Quad
from dmc41x3.twin.registers import Register
from dmc41x3.twin.unit import Format, Unit

BURN_TIME = 2.0
"""How long a controller is busy with BN, BP or BV, at most [s]."""

_NOT_BURNED = frozenset({"ZA", "VV"})


def power_up(unit: Unit) -> None:
    """Come up with what is burned; a part of the memory found damaged sets error 14 and comes up as from the factory.

    Motors of axes that were never burned come up as the unit was told.
    """
    unit.memory.load()
    _restore(unit, factory=False)
    if unit.memory.errors:
        unit.error_code = int(ErrorCode.CHECKSUM)


def reset(unit: Unit, *, factory: bool = False) -> None:
    """Do what a power-up does at once (RS), or with what the factory set for this once (RS -1): all handles close."""
    unit.handles.reset()
    unit.reset()
    for activity in unit.activities:
        activity.reset()
    if factory:
        _restore(unit, factory=True)
    else:
        power_up(unit)


def master_reset(unit: Unit) -> None:
    """Erase everything burned and reset (^R^S)."""
    unit.memory.erase()
    reset(unit)


def burn_parameters(unit: Unit) -> None:
    """Keep the parameters over a reset (BN); raises `Rejection`."""
    unit.memory.contents.parameters = _parameters(unit)
    _store(unit)


def burn_program(unit: Unit) -> None:
    """Keep the program (BP); raises `Rejection`."""
    unit.memory.contents.program = unit.program.text()
    _store(unit)


def burn_variables(unit: Unit) -> None:
    """Keep variables and arrays (BV); raises `Rejection`."""
    unit.memory.contents.variables = dict(unit.variables)
    unit.memory.contents.arrays = unit.arrays.contents()
    _store(unit)


def _store(unit: Unit) -> None:
    unit.records.pause(unit.core.now + BURN_TIME)
    try:
        unit.memory.store()
    except (OSError, FileUnwritable):
        raise Rejection(ErrorCode.WRITE) from None


def _parameters(unit: Unit) -> Parameters:
    groups: Parameters = {"unit": _unit_parameters(unit)}
    for axis in unit.axes:
        groups[axis.letter] = {**_burned(axis.registers), "motor_off": not axis.on}
    for plane in unit.core.planes.values():
        groups[plane.letter] = _burned(plane.registers)
    return groups


def _burned(values: dict[str, float]) -> dict[str, float | str]:
    return {name: value for name, value in values.items() if name not in _NOT_BURNED}


def _unit_parameters(unit: Unit) -> dict[str, float | str]:
    network = unit.network
    return {
        **{f"CN{place}": value for place, value in enumerate(unit.core.cn)},
        "TM": unit.core.period,
        "PF": _format_text(unit.position_format),
        "VF": _format_text(unit.value_format),
        "LZ": unit.suppress_zeros,
        "EO": unit.echo,
        "CF": unit.outlet.port,
        "CW": unit.outlet.mark,
        "IK": unit.handles.blocking,
        "IA": ".".join(map(str, network.address)),
        "IA1": network.retry,
        "DH": network.dhcp,
        "MU": ".".join(map(str, network.multicast)),
        "SM": ".".join(map(str, network.mask)),
    }


def _format_text(form: Format) -> str:
    return f"{'$' * form.hexadecimal}{form.before}.{form.after}"


def _restore(unit: Unit, *, factory: bool) -> None:
    contents = unit.memory.contents
    burned = (None if factory else contents.parameters) or {}
    _restore_period(unit, burned.get("unit", {}).get("TM"))
    for axis in unit.axes:
        group = burned.get(axis.letter, {})
        _restore_registers(axis.registers, group, registers.AXIS, unit.core.period)
        unit.core.limit_torque(axis)
        unit.core.power(axis, not group.get("motor_off", unit.motors_off))
    for plane in unit.core.planes.values():
        _restore_registers(plane.registers, burned.get(plane.letter, {}), registers.PLANE, unit.core.period)
    _restore_unit(unit, burned.get("unit", {}))
    if not factory:
        unit.variables.update(contents.variables)
        unit.arrays.restore(contents.arrays)
        _start_program(unit)


def _start_program(unit: Unit) -> None:
    """Load the burned program and run its #AUTO on thread 0, or #AUTOERR where the memory was found damaged."""
    with suppress(Rejection):  # a file may hold anything
        unit.program.load(unit.memory.contents.program)
    line = unit.program.labels.get("AUTOERR" if unit.memory.errors else "AUTO")
    if line is not None:
        unit.threads.all[0].start(unit.program.start(line), line)


def _restore_period(unit: Unit, period: float | str | None) -> None:
    if isinstance(period, int):
        with suppress(Rejection):
            unit.core.set_period(int(registers.TM.rounded(period)))


def _restore_registers(
    values: dict[str, float], group: dict[str, float | str], table: dict[str, Register], period: int
) -> None:
    """Set registers to burned values; one that is out of range keeps what the factory set."""
    for name, value in group.items():
        register = table.get(name)
        if register is None or isinstance(value, str) or name in _NOT_BURNED:
            continue
        try:
            register.sampled(period).rounded(value)
        except Rejection:
            continue
        values[name] = value


def _restore_unit(unit: Unit, group: dict[str, float | str]) -> None:
    """Set what belongs to no axis; a value that no command could have set keeps what the factory set."""
    port = _text(group, "CF")
    if port and port in "ABCDEFGH" + SERIAL:
        unit.outlet.port = port
    unit.core.cn = [_one_of(group, f"CN{n}", (-1, 1) if n < 3 else (0, 1), now) for n, now in enumerate(unit.core.cn)]
    unit.position_format = _format(_text(group, "PF"), unit.position_format)
    unit.value_format = _format(_text(group, "VF"), unit.value_format)
    unit.suppress_zeros = _one_of(group, "LZ", (0, 1), unit.suppress_zeros)
    unit.echo = _one_of(group, "EO", (0, 1), unit.echo)
    unit.outlet.mark = _one_of(group, "CW", (1, 2), unit.outlet.mark)
    unit.handles.blocking = bool(_one_of(group, "IK", (0, 1), unit.handles.blocking))
    _restore_network(unit.network, group)


def _restore_network(network: Network, group: dict[str, float | str]) -> None:
    retry = group.get("IA1")
    if isinstance(retry, int) and retry > 0:
        network.retry = retry
    network.dhcp = bool(_one_of(group, "DH", (0, 1), network.dhcp))
    network.address = _quad(_text(group, "IA"), network.address)
    network.multicast = _quad(_text(group, "MU"), network.multicast)
    network.mask = _quad(_text(group, "SM"), network.mask)


def _text(group: dict[str, float | str], name: str) -> str:
    return str(group.get(name, ""))


def _one_of(group: dict[str, float | str], name: str, allowed: tuple[int, ...], default: int) -> int:
    value = group.get(name)
    return int(value) if isinstance(value, int | float) and value in allowed else default


def _format(text: str, default: Format) -> Format:
    before, _, after = text.removeprefix("$").partition(".")
    if not (before.isdecimal() and after.isdecimal() and int(before) <= 10 and int(after) <= 4):
        return default
    return Format(int(before), int(after), text.startswith("$"))


def _quad(text: str, default: Quad) -> Quad:
    parts = text.split(".")
    if len(parts) != 4 or not all(part.isdecimal() and int(part) < 256 for part in parts):
        return default
    a, b, c, d = (int(part) for part in parts)
    return a, b, c, d
