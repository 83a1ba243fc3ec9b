"""The parameters of a graph within one process: a tree of plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class BusParameters:
    """Values by name; a name that others begin with is a dict of them, as on ROS' parameter server."""

    def __init__(self) -> None:
        self._tree: dict[str, Any] = {}

    async def get(self, name: str, default: Any = None) -> Any:
        """Return the value at `name`, a dict for a name that others begin with."""
        here: Any = self._tree
        for part in _parts(name):
            if not isinstance(here, Mapping) or part not in here:
                return default
            here = here[part]
        return _copied(here)

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`; a dict takes the place of everything that begins with it."""
        parts = _parts(name)
        if not parts:
            self._tree = _copied(value)
            return
        here = self._tree
        for part in parts[:-1]:
            below = here.get(part)
            if not isinstance(below, dict):
                here[part] = below = {}
            here = below
        here[parts[-1]] = _copied(value)

    async def delete(self, name: str) -> None:
        """Forget `name` and all that begins with it; what is not there is forgotten already."""
        parts = _parts(name)
        above = await self._at(parts[:-1])
        if parts and above is not None:
            above.pop(parts[-1], None)
        elif not parts:
            self._tree = {}

    async def names(self) -> Sequence[str]:
        """Return the names of all values; one below which nothing is left has none, as on ROS' parameter server."""
        return list(_names("", self._tree))

    async def _at(self, parts: Sequence[str]) -> dict[str, Any] | None:
        here: Any = self._tree
        for part in parts:
            here = here.get(part) if isinstance(here, dict) else None
        return here if isinstance(here, dict) else None


def _parts(name: str) -> list[str]:
    return [part for part in name.split("/") if part]


def _names(above: str, tree: Mapping[str, Any]) -> Sequence[str]:
    found: list[str] = []
    for key, value in tree.items():
        name = f"{above}/{key}"
        found += _names(name, value) if isinstance(value, Mapping) else [name]
    return found


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _copied(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_copied(one) for one in value]
    return value
