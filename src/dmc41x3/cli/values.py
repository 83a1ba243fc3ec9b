"""Values on the command line."""

from __future__ import annotations

from dmc41x3.address import REAL, split
from dmc41x3.errors import InvalidValue

FASTEST = 1000.0
"""Largest factor of the twin's clock."""


def clock_factor(speed: float | None) -> float:
    """Return how many times as fast as the wall the twin's clock runs, 1 where nothing is said.

    Raises `InvalidValue` outside 0 < speed ≤ 1000.
    """
    if speed is None:
        return 1.0
    if not 0.0 < speed <= FASTEST:
        raise InvalidValue(key="--speed", value=speed, reason=f"it is above 0 and at most {FASTEST:g}")
    return speed


def host_and_port(text: str, key: str = "--address", words: str = REAL) -> tuple[str, int]:
    """Return host and port of HOST or HOST:PORT (Galil's where none is named).

    Raises `InvalidValue`, which names the `words` that would have been understood too.
    """
    try:
        return split(text)
    except ValueError as error:
        raise InvalidValue(key=key, value=repr(text), reason=f"where it is not {words}, {error}") from error
