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
"""Names of checks in the terminal and in JSON."""


class FindingOutcome(StrEnum):
    """The outcome of a check: good, a warning, or a failure; `skipped` was not checked."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of a `check`; its text is that under `key`, with `details` inserted."""

    check: CheckName
    outcome: FindingOutcome
    key: str
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])


def ok(check: CheckName, key: str, **details: object) -> Finding:
    """Return a good result."""
    return Finding(check, FindingOutcome.OK, key, details)


def warn(check: CheckName, key: str, **details: object) -> Finding:
    """Return a warning."""
    return Finding(check, FindingOutcome.WARN, key, details)


def fail(check: CheckName, key: str, **details: object) -> Finding:
    """Return a failure."""
    return Finding(check, FindingOutcome.FAIL, key, details)


def skipped(check: CheckName, key: str, **details: object) -> Finding:
    """Return the result of a check that is impossible or irrelevant here."""
    return Finding(check, FindingOutcome.SKIPPED, key, details)
