"""Addresses and clocks in user input."""

from __future__ import annotations

from dmc41x3.address import SIM, meant
from dmc41x3.cli import console
from dmc41x3.cli.console import controller_address
from dmc41x3.i18n import phrase
from maya_un.errors import SpeedOnRealMachine


def clock_factor(speed: float | None, address: str) -> float:
    """Return the speed of the twin's clock relative to real time, 1 by default.

    Raises `SpeedOnRealMachine` if `speed` is given for a real machine, and `InvalidValue` outside 0 < speed ≤ 1000.
    """
    if speed is not None and address != SIM:
        raise SpeedOnRealMachine(address=address)
    return console.clock_factor(speed)


def target_address(text: str, configured: str) -> str:
    """Return the meaning of an address: "sim", HOST[:PORT] or a serial port; for "real", the `configured` address.

    Raises `InvalidValue`.
    """
    if text != SIM:
        controller_address(meant(text, configured), words=phrase("sim or real"))
    return meant(text, configured)
