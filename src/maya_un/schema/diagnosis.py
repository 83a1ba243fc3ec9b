"""Log and findings, by which users find out what is wrong, as messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal, TypeAlias, get_args

from maya_un.schema.choices import LogLevel

LEVELS: tuple[LogLevel, ...] = get_args(LogLevel)
"""Log levels, in ascending order."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """An entry with `time` (ISO 8601, UTC, with milliseconds).

    `kind` is that of an event, or the part of the program that wrote a line of the log: http, events, defect. `code` is
    0 or that of an error; `run` and `seq` are the numbers of an event, 0 for other entries.
    """

    time: str
    level: str
    kind: str
    text: str
    code: int = 0
    run: int = 0
    seq: int = 0
    detail: Mapping[str, Any] = field(default_factory=dict[str, Any])


CheckName: TypeAlias = Literal[
    "configuration", "service", "version", "robot", "lease", "queue", "controller", "owner", "torque", "firmware",
    "handles", "limits", "program", "motors", "memory", "controller clock", "storage", "disk", "ports", "clock",
    "certificate", "software", "ROS", "supervisors",
]  # fmt: skip
"""Names of checks in the terminal and in JSON."""


class FindingOutcome(StrEnum):
    """The outcome of a check: good, a warning, or a failure; `skipped` was not checked."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class FoundByDoctor:
    """The result of a `check`: its `meaning` and its `remedy`, "" for none, in the language of the reader.

    `key` names the text and is the same in every language; `details` are the values in it.
    """

    check: CheckName
    outcome: FindingOutcome
    key: str
    meaning: str
    remedy: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The results of all checks, in the order in which they were made."""

    findings: tuple[FoundByDoctor, ...]
