"""Stopping: the sequences on their paths, then whatever else moves; by the terminal's link or past it.

A bare ST would also end the programs in the controller (DMC-41x3, command ST).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from dmc41x3.address import SIM, split
from dmc41x3.driver import Driver
from dmc41x3.language.hardware import LETTERS
from dmc41x3.wire import emergency
from dmc41x3.wire.emergency import StopOutcome

_PATIENCE = 2.0
"""Longest wait for each answer of a controller told directly [s]."""


async def stop(driver: Driver) -> StopOutcome:
    """Stop all motion and return what moved; the first bytes are on the wire before this waits. Raises as `send`."""
    for plane in "ST":
        driver.urgent(f"ST {plane}")
    axes = list(zip(LETTERS, (await driver.record()).axes, strict=False))
    outcome = StopOutcome(
        coordinated="".join(letter for letter, axis in axes if axis.moving and axis.coordinated),
        independent="".join(letter for letter, axis in axes if axis.moving and not axis.coordinated),
    )
    if outcome.independent:
        await driver.send(f"ST {outcome.independent}")
    return outcome


def stop_directly(place: str) -> Callable[[], StopOutcome] | None:
    """Return what stops the controller at an address by a handle of its own; None for a twin, which has no address.

    It blocks; see `emergency.stop`.
    """
    return None if place == SIM else partial(emergency.stop, *split(place), _PATIENCE)
