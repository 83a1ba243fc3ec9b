"""The result of one check."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from maya_un.schema.diagnosis import CheckName, FindingOutcome


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


Look = tuple[CheckName, Callable[[], Iterable[Finding]]]
"""A check, and the function that carries it out."""


def guarded(looks: Iterable[Look], note: Callable[[Exception], object]) -> Iterator[Finding]:
    """Carry out checks in turn; one that fails unexpectedly is a finding itself, and its defect is passed to `note`."""
    for check, look in looks:
        try:
            yield from look()
        except Exception as defect:  # noqa: BLE001 - a defect in one check must not prevent the others
            note(defect)
            yield fail(check, "check_failed", reason=f"{type(defect).__name__}: {defect}")
