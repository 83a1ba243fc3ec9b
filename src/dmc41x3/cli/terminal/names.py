"""The names that live in a controller: labels of its program, variables, arrays."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected

_LABEL = re.compile(r"#\w+")
_VARIABLE = re.compile(r"^\s*([A-Za-z]\w*)\s*=", re.MULTILINE)
_ARRAY = re.compile(r"^\s*([A-Za-z]\w*)\s*\[", re.MULTILINE)
_ASSIGNED = re.compile(r"([A-Za-z]\w*)\s*=(?!\s*\??$)")


@dataclass(frozen=True, slots=True)
class CompletionNames:
    """Names to complete with; labels include their `#`. `axes` are the letters of the axes there are."""

    labels: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    axes: str = "ABC"

    def with_variable(self, name: str) -> CompletionNames:
        """Return the names with one more variable."""
        return CompletionNames(self.labels, _sorted([*self.variables, name]), self.arrays, self.axes)


async def ask(driver: Driver, axes: str) -> CompletionNames:
    """Return the names that the controller lists (LL, LV, LA); a list it refuses is empty. Raises on a lost link."""
    return CompletionNames(
        labels=_sorted(_LABEL.findall(await _list(driver, "LL"))),
        variables=_sorted(_VARIABLE.findall(await _list(driver, "LV"))),
        arrays=_sorted(_ARRAY.findall(await _list(driver, "LA"))),
        axes=axes,
    )


async def _list(driver: Driver, command: str) -> str:
    try:
        return await driver.send(command)
    except CommandRejected:
        return ""


def assigned(command: str) -> str | None:
    """Return the variable that a command makes or sets, None for any other command; `x=?` only asks."""
    found = _ASSIGNED.match(command)
    return found[1] if found is not None else None


def _sorted(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(set(names)))
