"""What one check found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class FindingOutcome(StrEnum):
    """How it is: good, worth a look, or the reason why something does not work; `skipped` could not be looked at."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class Finding:
    """What a `check` found; its sentence stands in the words under `key`, with `details` filled in."""

    check: str
    outcome: FindingOutcome
    key: str
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])


def ok(check: str, key: str, **details: object) -> Finding:
    """Return that all is well."""
    return Finding(check, FindingOutcome.OK, key, details)


def warn(check: str, key: str, **details: object) -> Finding:
    """Return what is worth a look."""
    return Finding(check, FindingOutcome.WARN, key, details)


def fail(check: str, key: str, **details: object) -> Finding:
    """Return what keeps something from working."""
    return Finding(check, FindingOutcome.FAIL, key, details)


def skipped(check: str, key: str, **details: object) -> Finding:
    """Return what could not be looked at, or does not matter here."""
    return Finding(check, FindingOutcome.SKIPPED, key, details)
