"""The base of all sections of the configuration: units, refusals, and the flaws of a validation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue
from maya_un.quantities import angle_in, length_in
from maya_un.validation import reason_of


def _in_si(value: object, read: Callable[[object, str], float]) -> object:
    """Return a number or a text with a unit in SI, and anything else as it is, for pydantic to refuse."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return value
    try:
        return read(value, "it")
    except InvalidValue as error:
        raise ValueError(str(error.details["reason"])) from error


def _length(value: object) -> object:
    return _in_si(value, length_in)


def _angle(value: object) -> object:
    return _in_si(value, angle_in)


LENGTH = BeforeValidator(_length)
"""Reads a number [m] or a text with a unit."""

ANGLE = BeforeValidator(_angle)
"""Reads a number [rad] or a text with a unit."""

Metres = Annotated[float, Field(gt=0.0, le=10.0), LENGTH]
"""A length: a number [m] or a text like "500 mm"."""


class Contradiction(ValueError):
    """A value that contradicts another one: the `key` within its section, its `value`, and the reason."""

    def __init__(self, key: str, value: object, reason: str) -> None:
        super().__init__(reason)
        self.key = key
        self.value = value


class ConfigSection(BaseModel):
    """A part of the configuration: immutable, no unknown keys, no conversions, finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Flaw(NamedTuple):
    """An error of a validation: the dotted `key`, its `value`, and the reason."""

    key: str
    value: Any
    reason: str


def flaw(error: ValidationError, tags: tuple[str, ...] = ()) -> Flaw:
    """Return the first flaw of a validation; `tags`, which name kinds of a section, are not part of the key."""
    return _flaw(error.errors(include_url=False)[0], tags)


def flaws(error: ValidationError, tags: tuple[str, ...] = ()) -> list[Flaw]:
    """Return all flaws of a validation, as `flaw` does."""
    return [_flaw(one, tags) for one in error.errors(include_url=False)]


def _flaw(first: ErrorDetails, tags: tuple[str, ...]) -> Flaw:
    place, value, context = [part for part in first["loc"] if part not in tags], first["input"], first.get("ctx", {})
    cause = context.get("error")
    if isinstance(cause, Contradiction):
        place, value = [*place, cause.key], cause.value
    if first["type"] in _UNKNOWN_KIND:
        place, value = [*place, "kind"], context.get("tag")
        reason = phrase("it must be one of {choices}", choices=", ".join(tags))
    else:
        reason = reason_of(first)
    return Flaw(".".join(str(part) for part in place), value, reason)


_UNKNOWN_KIND = {"union_tag_invalid", "union_tag_not_found"}
