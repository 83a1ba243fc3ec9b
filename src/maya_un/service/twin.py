"""Operations of the twin alone: faults on demand, for teaching and for tests of programs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from maya_un.errors import NotFound
from maya_un.schema.twin import FaultsOfTwin, FaultValue


class FaultInjector(Protocol):
    """Begins and ends the faults of a twin."""

    def view(self, language: str) -> FaultsOfTwin:
        """Return all kinds of faults, and the active faults."""
        ...

    def inject(self, name: str, values: Mapping[str, FaultValue], seconds: float | None) -> None:
        """Begin a fault, for `seconds` [s] or until it is cleared; raises `UnknownName` and `InvalidValue`."""
        ...

    def clear(self, name: str | None) -> None:
        """End all faults, or all of one name; raises `UnknownName`."""
        ...


class TwinService:
    """The operations of the twin; on a real machine, where there is no `injector`, each raises `NotFound`."""

    def __init__(self, injector: FaultInjector | None) -> None:
        self._injector = injector

    def faults(self, language: str = "en") -> FaultsOfTwin:
        """Return all kinds of faults with their meaning in a language, and the active faults."""
        return self._found().view(language)

    def inject(
        self, name: str, values: Mapping[str, FaultValue], seconds: float | None = None, language: str = "en"
    ) -> FaultsOfTwin:
        """Begin a fault and return as `faults`; an active fault of the same kind and place is replaced.

        It ends after `seconds` of the twin's clock [s]; without them it stays. Raises `UnknownName` and `InvalidValue`.
        """
        self._found().inject(name, values, seconds)
        return self.faults(language)

    def clear(self, name: str | None = None, language: str = "en") -> FaultsOfTwin:
        """End all faults, or all of one name, and return as `faults`; raises `UnknownName`."""
        self._found().clear(name)
        return self.faults(language)

    def _found(self) -> FaultInjector:
        if self._injector is None:
            raise NotFound(what="twin", number="on a real machine")
        return self._injector
