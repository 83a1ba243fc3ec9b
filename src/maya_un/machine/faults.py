"""The faults of a twin as messages, from the table of its controller."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from dmc41x3.i18n import translate
from dmc41x3.twin.wire.faults import TABLE, Fault, Parameter
from dmc41x3.twin.wire.injection import Faults, described
from maya_un.schema.twin import ActiveFault, FaultKind, FaultParameter, FaultsOfTwin, FaultValue


def fault_kind(fault: Fault, language: str) -> FaultKind:
    """Return a kind of fault as a message."""
    parameters = tuple(_parameter(parameter, language) for parameter in fault.parameters)
    return FaultKind(fault.name, translate(fault.words, language), fault.end is not None, parameters)


def _parameter(parameter: Parameter, language: str) -> FaultParameter:
    number = not isinstance(parameter.default, bool | str)
    low, high = (parameter.minimum, parameter.maximum) if number else (None, None)
    words = translate(parameter.words, language)
    return FaultParameter(parameter.name, parameter.default, parameter.unit, words, low, high, parameter.choices)


class TwinFaultInjector:
    """Begins and ends the faults of one virtual controller, in its loop."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults

    def view(self, language: str) -> FaultsOfTwin:
        """Return all kinds of faults, and the active faults."""
        now = asyncio.get_running_loop().time()
        active = tuple(ActiveFault(**described(injection, now)) for injection in self._faults.active)
        return FaultsOfTwin(tuple(fault_kind(fault, language) for fault in TABLE), active)

    def inject(self, name: str, values: Mapping[str, FaultValue], seconds: float | None) -> None:
        """Begin a fault, for `seconds` [s] or until it is cleared; raises `UnknownName` and `InvalidValue`."""
        self._faults.inject(name, values, seconds=seconds)

    def clear(self, name: str | None) -> None:
        """End all faults, or all of one name; raises `UnknownName`."""
        self._faults.clear(name)
