"""What a unit is told about things around it that this one does not have: serial ports, Modbus, analog wiring, events.

It is kept and told again, like any setting. The lock of the program is here as well.
"""

from __future__ import annotations

from dataclasses import dataclass, field

ANALOG_INPUTS = 8
PLUS_MINUS_TEN = 2
"""AQ: an analog input reads -10 to 10 V."""

LOCKED_COMMANDS = frozenset({"DL", "ED", "LS", "TR", "UL"})
"""Commands that a locked program refuses."""


@dataclass(slots=True)
class Peripherals:
    """Settings: AQ, MW, ME, US, CI and CC, the masks and handle of EI, and the lock of the program."""

    analog_ranges: list[int] = field(default_factory=lambda: [PLUS_MINUS_TEN] * ANALOG_INPUTS)
    modbus_waits: int = 1
    modbus_writes: int = 0
    ports_swapped: int = 0
    communication_interrupt: int = 0
    event_settings: list[int] = field(default_factory=lambda: [0, 0, -1])
    password: str = ""
    locked: bool = False
