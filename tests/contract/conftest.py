"""Whom the contract is held against: the virtual controller, and a real one whose address is given.

`MAYA_CONTRACT_ADDRESS=HOST[:PORT]` adds a real box. Its motors stay where they are unless `MAYA_CONTRACT_MOVES=1`
allows axes A and B to turn by a few thousand counts.
"""

from __future__ import annotations

import os

from dmc41x3.cli.conform import TcpChannel
from dmc41x3.conformance import Demand

ADDRESS = os.environ.get("MAYA_CONTRACT_ADDRESS", "")
MOVES = os.environ.get("MAYA_CONTRACT_MOVES", "") == "1"
ALLOWED = {Demand.MOVES} if MOVES else set[Demand]()


def place() -> tuple[str, int]:
    """Return host and port of the box."""
    host, _, port = ADDRESS.partition(":")
    return host, int(port or 23)


def box() -> TcpChannel:
    """Open a connection to the box."""
    return TcpChannel(*place())
