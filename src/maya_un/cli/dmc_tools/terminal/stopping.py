"""Stopping by the terminal's own link: the sequences on their paths, then whatever else moves.

A bare ST would also end the programs in the controller (DMC-41x3, command ST).
"""

from __future__ import annotations

from maya_un.galil.driver import Driver
from maya_un.galil.emergency import StopOutcome


async def stop(driver: Driver) -> StopOutcome:
    """Stop all motion and return what moved; the first bytes are on the wire before this waits. Raises as `send`."""
    for plane in "ST":
        driver.urgent(f"ST {plane}")
    axes = list(zip("ABCDEFGH", (await driver.record()).axes, strict=False))
    outcome = StopOutcome(
        coordinated="".join(letter for letter, axis in axes if axis.moving and axis.coordinated),
        independent="".join(letter for letter, axis in axes if axis.moving and not axis.coordinated),
    )
    if outcome.independent:
        await driver.send(f"ST {outcome.independent}")
    return outcome
