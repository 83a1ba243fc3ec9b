"""The result of one check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal, TypeAlias

CheckName: TypeAlias = Literal[
    "configuration", "service", "version", "robot", "lease", "queue", "controller", "owner", "torque", "firmware",
    "handles", "limits", "program", "motors", "memory", "controller clock", "storage", "disk", "ports", "clock",
    "certificate", "ROS", "supervisors",
]  # fmt: skip
"""Checks, by the names that the terminal and JSON show."""


class FindingOutcome(StrEnum):
    """How it is: good, worth a look, or the reason why something does not work; `skipped` could not be looked at."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of a `check`; its sentence is the text under `key`, with `details` filled in."""

    check: CheckName
    outcome: FindingOutcome
    key: str
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])


def ok(check: CheckName, key: str, **details: object) -> Finding:
    """Return that all is well."""
    return Finding(check, FindingOutcome.OK, key, details)


def warn(check: CheckName, key: str, **details: object) -> Finding:
    """Return what is worth a look."""
    return Finding(check, FindingOutcome.WARN, key, details)


def fail(check: CheckName, key: str, **details: object) -> Finding:
    """Return what keeps something from working."""
    return Finding(check, FindingOutcome.FAIL, key, details)


def skipped(check: CheckName, key: str, **details: object) -> Finding:
    """Return what could not be looked at, or does not matter here."""
    return Finding(check, FindingOutcome.SKIPPED, key, details)
