"""What the controller keeps about its network: addresses and times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

Quad: TypeAlias = tuple[int, int, int, int]

RETRIES = 5
"""How often an unanswered TCP packet is sent again before the handle is closed (IA)."""


@dataclass(slots=True)
class Network:
    """Registers of IA, DH, MU and SM; `retry` is the time between two attempts [samples]."""

    address: Quad
    retry: int = 250
    dhcp: bool = True
    multicast: Quad = (239, 255, 19, 56)
    mask: Quad = (0, 0, 0, 0)


def number(quad: Quad) -> int:
    """Return four bytes as the signed number that operands show."""
    return int.from_bytes(bytes(quad), "big", signed=True)
