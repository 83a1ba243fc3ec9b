"""Base of every section of the configuration."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

Metres = Annotated[float, Field(gt=0.0, le=10.0)]
"""A length [m]; the upper bound catches millimetres."""


class Contradiction(ValueError):
    """A value that another one rules out: the `key` within its section, its `value`, and why."""

    def __init__(self, key: str, value: object, reason: str) -> None:
        super().__init__(reason)
        self.key = key
        self.value = value


class ConfigSection(BaseModel):
    """A part of the configuration: immutable, no unknown keys, no conversions, finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Flaw(NamedTuple):
    """Errors of keys: the dotted `key`, its `value`, and why."""

    key: str
    value: Any
    reason: str


def flaw(error: ValidationError, tags: tuple[str, ...] = ()) -> Flaw:
    """Return the first flaw that a validation found; `tags`, which name kinds of a section, are no keys."""
    first = error.errors(include_url=False)[0]
    place, value, reason = [part for part in first["loc"] if part not in tags], first["input"], first["msg"]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, Contradiction):
        place, value, reason = [*place, cause.key], cause.value, str(cause)
    elif first["type"] == "extra_forbidden":
        reason = "there is no such key"
    elif first["type"] == "missing":
        reason = "it is missing"
    elif first["type"] in _UNKNOWN_KIND:
        place, value, reason = [*place, "kind"], first.get("ctx", {}).get("tag"), f"it is one of {', '.join(tags)}"
    return Flaw(".".join(str(part) for part in place), value, reason.removeprefix("Value error, "))


_UNKNOWN_KIND = {"union_tag_invalid", "union_tag_not_found"}
