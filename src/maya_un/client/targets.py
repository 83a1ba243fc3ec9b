"""Places, joints and states in the notation of a client's users."""

from __future__ import annotations

from collections.abc import Sequence

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue

Spot = str | Sequence[float]
"""A place: a name (a part, a place, a cell like "tray[1,2]", a taught pose), or x, y and perhaps z [m]."""


def spot(first: Spot | float, second: float | None, third: float | None) -> str | list[float]:
    """Return a place given as a name, as separate numbers or as a sequence of numbers; raises `InvalidValue`."""
    rest = [number for number in (second, third) if number is not None]
    if not isinstance(first, int | float):
        if rest:
            raise InvalidValue(key="target", value=repr((first, *rest)), reason="it must be a name, or numbers")
        return first if isinstance(first, str) else [float(number) for number in first]
    return [float(first), *rest]


def plain(spot: Spot) -> str | list[float]:
    """Return a place as JSON data."""
    return spot if isinstance(spot, str) else list(spot)


def joints(goal: Spot) -> str | dict[str, float]:
    """Return a taught pose, or joints a, b, c (rad, m, m), in the format of a job step."""
    return goal if isinstance(goal, str) else dict(zip("abc", goal, strict=True))


def state_of(state: str, on: str, off: str) -> bool:
    """Return whether a state is `on`; raises `InvalidValue` if it is neither that nor `off`."""
    if state not in {on, off}:
        raise InvalidValue(
            key="state", value=repr(state), reason=phrase("it must be '{on}' or '{off}'", on=on, off=off)
        )
    return state == on
