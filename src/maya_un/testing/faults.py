"""Context managers that inject faults into a virtual controller.

`with faults.latency(virtual, 0.05, jitter=0.01): ...` starts the fault and ends it with the block, also after an
exception. An earlier fault of the same kind is active again afterwards. `maya dmc fault` describes each fault.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from math import inf
from typing import Literal

from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.wire.faults import Value
from dmc41x3.twin.wire.injection import Injection
from dmc41x3.twin.wire.server import VirtualController

OVERCURRENT = 1 << 24
"""Amplifier status: overcurrent, axes A to D (byte 55 of the data record)."""


@contextmanager
def fault(virtual: VirtualController, name: str, **values: Value) -> Iterator[Injection]:
    """Inject a fault of any kind while the block runs; raises `UnknownName` and `InvalidValue`."""
    before = {standing.key: standing for standing in virtual.faults.active}
    injection = virtual.faults.inject(name, values, seconds=inf)
    try:
        yield injection
    finally:
        virtual.faults.end(injection)
        standing = before.get(injection.key)
        if standing is not None:
            _again(virtual, standing)


def _again(virtual: VirtualController, standing: Injection) -> None:
    """Inject an earlier fault again, for its remaining time."""
    left = inf if standing.until is None else standing.until - asyncio.get_running_loop().time()
    if left > 0.0:
        virtual.faults.inject(standing.fault.name, standing.values, seconds=left)


def latency(
    virtual: VirtualController, seconds: float = 0.05, *, jitter: float = 0.0
) -> AbstractContextManager[object]:
    """Delay replies by `seconds`, and by up to `jitter` [s] more."""
    return fault(virtual, "latency", seconds=seconds, jitter=jitter)


def drop(virtual: VirtualController, probability: float = 1.0) -> AbstractContextManager[object]:
    """Lose each reply, message or data record with `probability` (0 to 1)."""
    return fault(virtual, "drop", probability=probability)


def duplicate(virtual: VirtualController, probability: float = 1.0) -> AbstractContextManager[object]:
    """Send each reply, message or data record twice with `probability` (0 to 1)."""
    return fault(virtual, "duplicate", probability=probability)


def garbage(virtual: VirtualController, probability: float = 1.0, *, count: int = 8) -> AbstractContextManager[object]:
    """Put `count` random bytes before each reply, message or data record with `probability` (0 to 1)."""
    return fault(virtual, "garbage", probability=probability, bytes=count)


def refuse_commands(virtual: VirtualController, probability: float = 1.0) -> AbstractContextManager[object]:
    """Answer each command with `?`, and do not execute it, with `probability` (0 to 1)."""
    return fault(virtual, "refuse_commands", probability=probability)


def half_open(virtual: VirtualController, handles: str = LETTERS) -> AbstractContextManager[object]:
    """Make the present connections fall silent; handles are given by their letters."""
    return fault(virtual, "half_open", handles=handles)


def refuse_connections(virtual: VirtualController) -> AbstractContextManager[object]:
    """Refuse all connections."""
    return fault(virtual, "refuse_connections")


@contextmanager
def cut(virtual: VirtualController, handles: str = LETTERS) -> Iterator[None]:
    """Sever connections at the beginning of the block, and refuse new ones until its end."""
    with ExitStack() as stack:
        stack.enter_context(refuse_connections(virtual))
        stack.enter_context(fault(virtual, "cut", handles=handles))
        yield


def reset(virtual: VirtualController) -> AbstractContextManager[object]:
    """Reset the controller at the beginning of the block."""
    return fault(virtual, "reset")


def power_cycle(virtual: VirtualController) -> AbstractContextManager[object]:
    """Switch the controller off for the length of the block."""
    return fault(virtual, "power_cycle")


def stuck_limit(
    virtual: VirtualController,
    axis: str,
    side: Literal["forward", "reverse"] = "forward",
    *,
    active: bool = True,
) -> AbstractContextManager[object]:
    """Fix the reading of a limit switch, independent of the axis."""
    return fault(virtual, "stuck_limit", axis=axis, side=side, active=active)


def encoder_loss(virtual: VirtualController, axis: str) -> AbstractContextManager[object]:
    """Make the encoder of an axis stop counting."""
    return fault(virtual, "encoder_loss", axis=axis)


def abort_input(virtual: VirtualController) -> AbstractContextManager[object]:
    """Hold the abort input active."""
    return fault(virtual, "abort_input")


def amplifier_fault(virtual: VirtualController, status: int = OVERCURRENT) -> AbstractContextManager[object]:
    """Make the amplifiers report a fault, with the bits of the data record."""
    return fault(virtual, "amplifier_fault", status=status)
