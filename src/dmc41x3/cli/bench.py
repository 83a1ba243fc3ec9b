"""The twin of `dmc`: a controller whose motors stand on a bench."""

from __future__ import annotations

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.plant import ServoBench
from dmc41x3.twin.wire.server import VirtualController


def bench(axes: int, memory: Memory | None = None, firmware: str | None = None, seed: int = 0) -> VirtualController:
    """Return a controller of `axes` servo motors on a bench, in the running loop; `seed` draws its faults."""
    return VirtualController(VirtualDmc(ServoBench(axes), axes=axes, memory=memory, firmware=firmware), seed=seed)
