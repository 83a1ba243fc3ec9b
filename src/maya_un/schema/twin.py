"""The faults of the twin, as messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import ConfigDict, Field

FaultValue = float | int | bool | str
"""The value of a parameter of a fault."""

LONGEST_FAULT = 1e6
"""Longest duration of a fault [s]; without a duration it stays."""


@dataclass(frozen=True, slots=True)
class FaultParameter:
    """A parameter of a fault: its default has its type, `unit` is "" for a plain number or a word.

    A number is from `minimum` to `maximum`, a word one of `choices`, if there are any; otherwise these are None and
    empty.
    """

    name: str
    default: FaultValue
    unit: str
    words: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A kind of fault with its meaning; one that does not last happens once and has no duration."""

    name: str
    words: str
    lasts: bool
    parameters: tuple[FaultParameter, ...]


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """A fault in effect, with the values of all its parameters; `seconds` is its remaining time, None if it stays.

    Its time is that of the twin's clock.
    """

    fault: str
    values: Mapping[str, FaultValue]
    seconds: float | None


@dataclass(frozen=True, slots=True)
class FaultsOfTwin:
    """The kinds of faults that the twin can have, and the `active` faults, oldest first."""

    kinds: tuple[FaultKind, ...]
    active: tuple[ActiveFault, ...]


@dataclass(frozen=True, slots=True)
class FaultRequest:
    """A fault to begin: `values` of its parameters by name, the others have their defaults.

    It ends after `seconds` of the twin's clock [s]; without them it stays until it is removed.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")
    values: dict[str, FaultValue] | None = None
    seconds: Annotated[float, Field(gt=0.0, le=LONGEST_FAULT, allow_inf_nan=False)] | None = None
